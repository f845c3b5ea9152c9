"""Visible articulation on a face: rounding, spreading and opening by phone class, the tongue, and lip contacts.

The steps follow retargeting and change the shape weights where the phones of the clip demand it. They use the face's
own geometry, so that they are the same for every talker and language.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from lexicon.sequence import PhoneSequence
from tts2face.articulation import CLEAR, NATURAL
from tts2face.face.landmarks import landmark_motion, landmark_positions, scatter_landmarks
from tts2face.face.lip_constraints import MIDDLE_PAIR, LipConstraints, build_lip_constraints
from tts2face.lips.articulation_tracks import articulation_tracks, pause_closure, seconds_from_closure
from tts2face.lips.mouth_limits import close_lips, largest_gaps, limit_speed
from tts2face.lips.teeth_and_tongue import IncisorContact, Tongue, build_incisor_contact, build_tongue, incisor_edge
from tts2face.models.face import Face
from tts2face.models.landmarks import (
    MOUTH_CORNER_LEFT,
    MOUTH_CORNER_RIGHT,
    OUTER_LIP_LOWER,
    OUTER_LIP_UPPER,
    inner_lip_gaps,
)
from tts2face.numeric.arrays import FloatArray, ordered_product, smoothstep
from tts2face.types import Trajectory

DEFAULT_ARTICULATION = CLEAR  # of a mesh: rounding is not seen otherwise (docs/decisions/102-articulation.md)
# Targets of clear articulation on a mouth of `HEAD_MOUTH_MM`; sizes on other faces are in proportion to the mouth.
HEAD_MOUTH_MM = 50.0
ROUND_WIDTH_SHARE, SPREAD_WIDTH_SHARE = 0.165, 0.08  # of the width at rest, by which a mouth is narrower or wider
PROTRUSION_MM = 3.7  # of the lips' outer edges in rounding, forward
OPENING_GAIN = 0.22  # growth of the gap of an open vowel, by the jaw
MIN_GAP_SHARE = 0.6  # of a gap that rounding leaves open
FOLLOW_GAPS_MM = (0.2, 2.5)  # gap of the lips up to which they keep it, and from which they follow in full
LARGEST_ADDED_WEIGHT = 1.2
LARGEST_REST_GAP_SHARE = 0.02  # of the mouth's width: a gap at rest that contacts close; landmarks may be further apart
# Shapes of contacts that the character's maker has drawn, for a mouth that lacks those that roll or press the lips: as
# sums of others, /f/ was a grin and /b/ a frown. Share that they have of the mouth in contact, and their weight.
OWN_CONTACTS = {"incisor_contact": "mouthViseme_ff", "lip_contact": "mouthViseme_pp"}
OWN_CONTACT_SHARE, OWN_CONTACT_WEIGHT = 0.85, 0.8
N_CLOSURE_ROUNDS = 3  # of limiting the speed and closing the lips, which disturb each other a little
LEAST_MOTION_MM = 0.5  # per weight of a shape: shapes that move less, as on a face without them, are not used
ROUND_SHAPES = {"mouthPucker": 1.0}
FLARED_SHAPES = {"mouthPucker": 0.85, "mouthFunnel": 0.3}
SPREAD_SHAPES = {"mouthStretchLeft": 0.5, "mouthStretchRight": 0.5, "mouthSmileLeft": 0.5, "mouthSmileRight": 0.5}
# Visemes of a face that lacks these shapes, the first that it has.
INSTEAD = {
    "mouthPucker": ("mouthViseme_ou", "mouthViseme_oh"),
    "mouthFunnel": ("mouthViseme_ch", "mouthViseme_oh"),
    "mouthStretchLeft": ("mouthViseme_ih", "mouthViseme_ee"),
    "mouthStretchRight": ("mouthViseme_ih", "mouthViseme_ee"),
}
LOWERED_SHAPES = {"mouthLowerDownLeft": 1.0, "mouthLowerDownRight": 1.0}
# Drop of the jaw and gap of the lips at which the tip of the tongue is seen between the teeth; largest weight for it.
DENTAL_DROP_MM = 5.5
DENTAL_GAP_MM = 8.0
LARGEST_LOWERED = 0.8
OUTER_UPPER_MID, OUTER_LOWER_MID = OUTER_LIP_UPPER[5], OUTER_LIP_LOWER[5]


@dataclass(frozen=True, slots=True, eq=False)
class Articulator:
    """Steps of visible articulation for a face; built by `build_articulator`.

    Parameters
    ----------
    mouth, contact
        Lip gaps, mouth width and cost of a change; in contacts, changes of the weights cost as well.
    protrusion : (K,)
        Forward motion of the lips' outer edges per weight, mm.
    rest_width, rest_gaps : (), (P,)
        Width of the mouth at rest, and gaps of the lips at rest that contacts close as well, mm.
    directions
        Weights (K,) that make the mouth ``round``, ``flared``, ``spread`` or ``open``, or lower the lip (``lowered``);
        zero without such shapes.
    tongue
        Shapes of the tongue.
    incisors
        Contact of the lower lip with the upper incisors.
    own_contacts
        By track of contact, the number of the character's own shape of it: its viseme of /f v/ or of /p b m/.
    """

    mouth: LipConstraints
    contact: LipConstraints
    protrusion: FloatArray
    rest_width: float
    rest_gaps: FloatArray
    directions: Mapping[str, FloatArray]
    tongue: Tongue
    incisors: IncisorContact
    own_contacts: Mapping[str, int]

    def articulate(self, weights: Trajectory, phones: PhoneSequence, factor: float) -> Trajectory:
        """Shape weights (T, K) with the visible articulation of phones.

        Parameters
        ----------
        weights
            Retargeted speech.
        factor
            Of rounding, spreading and opening, `NATURAL` for the talker's own.
        """
        times = weights.times
        tracks = articulation_tracks(phones, times)
        values = weights.values.astype(np.float64)
        if factor > NATURAL:
            values = self._add_by_class(values, tracks, (factor - NATURAL) / (CLEAR - NATURAL))
        elif factor < NATURAL:
            values = self._reduce_by_class(values, tracks, 1.0 - factor)
        for track, shape in self.own_contacts.items():
            values = self._towards(values, shape, OWN_CONTACT_SHARE * tracks[track])
        if "incisor_contact" not in self.own_contacts:
            values = self.incisors.enforce(values, tracks["incisor_contact"] * (1.0 - tracks["lip_contact"] ** 2))
        bounds = largest_gaps(seconds_from_closure(phones, times), self.rest_width / HEAD_MOUTH_MM)
        pauses = pause_closure(phones, times)
        for _ in range(N_CLOSURE_ROUNDS):
            values = limit_speed(values, weights.fps)
            values = close_lips(self.contact, values, self.rest_gaps, bounds, pauses)
        gap = ordered_product(values, self.mouth.gaps[MIDDLE_PAIR])
        values = self.tongue.move(values, gap, tracks)
        tongue = np.setdiff1d(np.arange(values.shape[1]), self.mouth.moving)
        values[:, tongue] = limit_speed(values[:, tongue], weights.fps)
        return replace(weights, values=values.astype(np.float32))

    def _add_by_class(self, speech: FloatArray, tracks: Mapping[str, FloatArray], strength: float) -> FloatArray:
        """Speech (T, K) with rounding, spreading and opening added, up to the targets of the phone classes."""
        added = strength * (self._rounding(speech, tracks) + self._spreading(speech, tracks["spreading"]))
        dental = tracks["tongue_out"] * (1.0 - tracks["lip_contact"])
        added += min(strength, 1.0) * self._parting(speech, dental)
        return self._combine(speech, added, tracks["opening"] * OPENING_GAIN * strength, dental)

    def _towards(self, speech: FloatArray, shape: int, share: FloatArray) -> FloatArray:
        """Speech (T, K) whose mouth is by shares (T,) that of one shape at `OWN_CONTACT_WEIGHT`."""
        pose = np.zeros(speech.shape[1])
        pose[shape] = OWN_CONTACT_WEIGHT
        lips, values = self.mouth.moving, speech.copy()
        values[:, lips] += share[:, None] * (pose[lips] - speech[:, lips])
        return values

    def _rounding(self, speech: FloatArray, tracks: Mapping[str, FloatArray]) -> FloatArray:
        """Weights (T, K) that narrow and protrude the lips by what speech lacks to a round mouth."""
        flare = tracks["flare"][:, None]
        rounded = (1.0 - flare) * self.directions["round"] + flare * self.directions["flared"]
        narrowing = np.maximum(-ordered_product(rounded, self.mouth.width), LEAST_MOTION_MM)
        forward = np.maximum(ordered_product(rounded, self.protrusion), LEAST_MOTION_MM)
        excess_width = ordered_product(speech, self.mouth.width) + ROUND_WIDTH_SHARE * self.rest_width
        missing_depth = PROTRUSION_MM * self.rest_width / HEAD_MOUTH_MM - ordered_product(speech, self.protrusion)
        weight = np.clip(np.maximum(excess_width / narrowing, missing_depth / forward), 0.0, LARGEST_ADDED_WEIGHT)
        return np.asarray((tracks["rounding"] * weight)[:, None] * rounded, np.float64)

    def _spreading(self, speech: FloatArray, share: FloatArray) -> FloatArray:
        """Weights (T, K) that widen the mouth by what speech lacks to a spread mouth, times shares (T,)."""
        spread = self.directions["spread"]
        widening = max(float(ordered_product(spread, self.mouth.width)), LEAST_MOTION_MM)
        missing = SPREAD_WIDTH_SHARE * self.rest_width - ordered_product(speech, self.mouth.width)
        return (share * np.clip(missing / widening, 0.0, 1.0))[:, None] * spread

    def _parting(self, speech: FloatArray, share: FloatArray) -> FloatArray:
        """Weights (T, K) that part teeth and lips for the tip of the tongue, times shares (T,)."""
        size = self.rest_width / HEAD_MOUTH_MM
        jaw = self.directions["open"]
        lip = self.directions["lowered"]
        dropped = ordered_product(speech, jaw) * self._gap_by_jaw()
        # only what is missing
        drop = np.clip(DENTAL_DROP_MM * size - dropped, 0.0, DENTAL_DROP_MM * size)
        gap = ordered_product(speech, self.mouth.gaps[MIDDLE_PAIR]) + drop
        by_lip = max(float(ordered_product(lip, self.mouth.gaps[MIDDLE_PAIR])), LEAST_MOTION_MM)
        lowered = np.clip((DENTAL_GAP_MM * size - gap) / by_lip, 0.0, LARGEST_LOWERED)
        weights: FloatArray = (share * drop / self._gap_by_jaw())[:, None] * jaw + (share * lowered)[:, None] * lip
        return weights

    def _gap_by_jaw(self) -> float:
        """Gap of the lips per weight of the jaw, mm."""
        return max(float(ordered_product(self.directions["open"], self.mouth.gaps[MIDDLE_PAIR])), LEAST_MOTION_MM)

    def _combine(self, speech: FloatArray, added: FloatArray, opening: FloatArray, free: FloatArray) -> FloatArray:
        """Speech (T, K) with added weights (T, K), and gaps that grow by shares (T,) through the jaw.

        Open lips follow in full, and the jaw keeps a share of their gap; touching lips keep their gaps except by
        shares `free` (T,).
        """
        gaps = ordered_product(speech, self.mouth.gaps.T)
        # lips that overlap a little are closed
        gap = np.maximum(gaps[:, MIDDLE_PAIR], 0.0)
        narrowed = gap + ordered_product(added, self.mouth.gaps[MIDDLE_PAIR])
        missing = np.maximum(MIN_GAP_SHARE * gap - narrowed, 0.0) + opening * gap
        lips, (low, high) = self.mouth.moving, self.mouth.limits.T
        opened = speech + added + (missing / self._gap_by_jaw())[:, None] * self.directions["open"]
        opened[:, lips] = np.clip(opened[:, lips], low, high)
        follow = smoothstep(gap * HEAD_MOUTH_MM / self.rest_width, *FOLLOW_GAPS_MM)
        follow = np.maximum(follow, free)[:, None]
        closed = self.mouth.solve(speech, added, gaps, (follow[:, 0] < 1) & added.any(axis=1))
        return follow * opened + (1.0 - follow) * closed

    def _reduce_by_class(self, speech: FloatArray, tracks: Mapping[str, FloatArray], share: float) -> FloatArray:
        """Speech (T, K) whose motion from rest is smaller by `share` where a class is in full; gaps shrink alike."""
        of_class = share * np.maximum.reduce([tracks[name] for name in ("rounding", "spreading", "opening")])
        added = np.zeros_like(speech)
        added[:, self.mouth.moving] = -of_class[:, None] * speech[:, self.mouth.moving]
        gaps = ordered_product(speech, self.mouth.gaps.T)
        return self.mouth.solve(speech, added, gaps - of_class[:, None] * np.maximum(gaps, 0.0))


def build_articulator(face: Face) -> Articulator:
    """Articulator of a face.

    Raises
    ------
    DataError
        The face lacks landmarks of the lips, or has no shape that speech moves.
    """
    mouth = build_lip_constraints(face)
    contact = mouth.with_change_cost()
    places = scatter_landmarks(face, landmark_positions(face))
    motion = scatter_landmarks(face, landmark_motion(face, np.arange(len(face.shape_names))))
    rest_width = float(np.linalg.norm(places[MOUTH_CORNER_LEFT] - places[MOUTH_CORNER_RIGHT]))
    edge = incisor_edge(face, places, rest_width)
    tables = {"round": ROUND_SHAPES, "flared": FLARED_SHAPES, "spread": SPREAD_SHAPES, "lowered": LOWERED_SHAPES}
    own = {track: face.shape_names.index(name) for track, name in OWN_CONTACTS.items() if name in face.shape_names}
    tables["open"] = {face.opened_by: 1.0}
    if not {*ROUND_SHAPES, *FLARED_SHAPES} <= {*face.shape_names}:
        tables["flared"] = ROUND_SHAPES
    return Articulator(
        mouth=mouth,
        contact=contact,
        protrusion=(motion[OUTER_UPPER_MID, 2] + motion[OUTER_LOWER_MID, 2]) / 2,
        rest_width=rest_width,
        rest_gaps=np.clip(inner_lip_gaps(places), 0.0, LARGEST_REST_GAP_SHARE * rest_width),
        directions={kind: _direction(table, face.shape_names) for kind, table in tables.items()},
        own_contacts=own,
        tongue=build_tongue(face, edge, rest_width),
        incisors=build_incisor_contact(face.shape_names, contact, edge, places=places, motion=motion, width=rest_width),
    )


def _direction(table: Mapping[str, float], names: tuple[str, ...]) -> FloatArray:
    """Weights (K,) of shapes, or of the visemes that stand for those that the face lacks."""
    direction = np.zeros(len(names))
    for shape, weight in table.items():
        found = next((name for name in (shape, *INSTEAD.get(shape, ())) if name in names), None)
        if found is not None:
            direction[names.index(found)] += weight
    return direction
