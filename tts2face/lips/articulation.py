"""Visible articulation on a face: rounding, spreading and opening by phone class, the tongue, and lip contacts.

The steps follow retargeting and change the shape weights where the phones of the clip demand it. They use the face's
own geometry, so that they are the same for every talker and language.

Tracks of visible articulation: targets of phones in time, with transitions between them.

Last steps of articulation: limited speed of the mouth, and lips that meet in bilabials and pauses.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from lexicon.articulation import TARGET_NAMES, VisibleTarget, visible_targets
from lexicon.sequence import SILENCE, PhoneSequence
from tts2face.face.deformation import landmark_motion, landmark_positions, scatter_landmarks
from tts2face.face.mouth import MIDDLE_PAIR, LipConstraints, build_lip_constraints
from tts2face.lips.teeth_and_tongue import IncisorContact, Tongue, build_incisor_contact, build_tongue, incisor_edge
from tts2face.models.face import Face
from tts2face.models.face_schema import WIDE_OPEN
from tts2face.models.landmarks import (
    MOUTH_CORNER_LEFT,
    MOUTH_CORNER_RIGHT,
    OUTER_LIP_LOWER,
    OUTER_LIP_UPPER,
    inner_lip_gaps,
)
from tts2face.numeric.arrays import ordered_product, smooth_gaussian, smoothstep
from tts2face.source import CLEAR, NATURAL
from tts2face.types import Trajectory

FloatArray = NDArray[np.float64]

CLOCK_HZ = 200.0  # rate at which tracks are computed; they are interpolated at the frames
HOLD_SHARE = 0.5  # share of a phone, or of the half of a diphthong, in which its target is held
MAX_TRANSITION_S = 0.16  # lips round at most this long before a rounded phone is held (Perkell and Matthies 1992)
SMOOTHING_S = 0.012  # standard deviation of a Gaussian; short phones of fast speech fall short of their targets
SMOOTHING_REACH = int(4 * SMOOTHING_S * CLOCK_HZ)
# Transition to and from a contact of the lip, which may begin while a neighbouring phone is held, and of the tongue.
CONTACT_EASE_S, TONGUE_EASE_S = 0.1, 0.07
LIP_CONTACTS = ("lip_contact", "incisor_contact")
EASES_S = {"tongue_out": TONGUE_EASE_S, "tongue_up": TONGUE_EASE_S}
MIN_CLOSURE_S = 0.04  # bilabials are closed at least this long: a frame lies within at 25 frames/s
# Lips stay as they are in shorter pauses, and meet in longer ones: those of which most recorded ones have a frame with
# closed lips (.17 to .4 s: 45 %, longer: 72 %; docs/decisions/190-pauses.md).
SHORT_PAUSE_S, LONG_PAUSE_S = 0.3, 0.4
CLOSING_S, PARTING_S = 0.12, 0.40  # longest closing after speech, and parting before it, in which speakers breathe in
PARTING_SHARE = 0.4  # of a short pause


def articulation_tracks(phones: PhoneSequence, times: FloatArray) -> Mapping[str, FloatArray]:
    """Tracks (T,) of each field of `lexicon.articulation.VisibleTarget` at T times in seconds, from 0 to 1.

    Notes
    -----
    The target of a phone is held in its middle; phones without a target of their own belong to the transition between
    their neighbours (look-ahead model of coarticulation, Henke 1966), which is limited to `MAX_TRANSITION_S`.
    """
    halves = _halves(phones)
    clock = np.arange(int(np.ceil(max(phones.end, times[-1], 0.0) * CLOCK_HZ)) + 2) / CLOCK_HZ
    tracks = {}
    for name in TARGET_NAMES:
        keys = [(start, end, getattr(target, name)) for start, end, target in halves]
        if name in LIP_CONTACTS:
            tracks[name] = _contact_track([(start, end) for start, end, value in keys if value], times)
            continue
        raw = _keyframe_track([key for key in keys if key[2] is not None], clock, EASES_S.get(name, MAX_TRANSITION_S))
        tracks[name] = np.interp(times, clock, smooth_gaussian(raw, SMOOTHING_S * CLOCK_HZ, SMOOTHING_REACH))
    return tracks


def seconds_from_closure(phones: PhoneSequence, times: FloatArray) -> FloatArray:
    """Time (T,) in seconds to the nearest closed span of a bilabial, 0 within it; infinite without bilabials.

    Each is closed in its middle, for at least `MIN_CLOSURE_S` and one frame.
    """
    frame_s = float(times[1] - times[0]) if len(times) > 1 else 0.0
    nearest = np.full(len(times), np.inf)
    for label, start, end in zip(phones.phones, phones.edges[:-1], phones.edges[1:], strict=True):
        if visible_targets(label)[0].lip_contact > 0:
            held_s = max(HOLD_SHARE * (end - start), MIN_CLOSURE_S, frame_s)
            nearest = np.minimum(nearest, np.maximum(np.abs(times - (start + end) / 2) - held_s / 2, 0.0))
    return nearest


def pause_closure(phones: PhoneSequence, times: FloatArray) -> FloatArray:
    """Closure (T,) of the lips in pauses: 1 where they meet, 0 in speech and in pauses below `SHORT_PAUSE_S`.

    Silence before the first phone and after the last counts as long.
    """
    closure = np.zeros(len(times))
    labels, edges = phones.phones, phones.edges
    first = 0
    while first < len(labels):
        last = first
        while last + 1 < len(labels) and labels[last + 1] == labels[first] == SILENCE:
            last += 1
        if labels[first] == SILENCE:
            start = -np.inf if first == 0 else float(edges[first])
            end = np.inf if last + 1 == len(labels) else float(edges[last + 1])
            size = smoothstep(np.array([end - start]), SHORT_PAUSE_S, LONG_PAUSE_S)[0]
            parting = min(PARTING_S, PARTING_SHARE * (end - start))
            closed = smoothstep((times - start) / CLOSING_S) * smoothstep((end - times) / parting)
            closure = np.maximum(closure, size * closed)
        first = last + 1
    return closure


def _halves(phones: PhoneSequence) -> list[tuple[float, float, VisibleTarget]]:
    """Held span and target of each phone, two for a phone with two halves, one for a pause."""
    found = []
    for label, start, end in zip(phones.phones, phones.edges[:-1], phones.edges[1:], strict=True):
        first, last = visible_targets(label)
        parts = [(first, start, end)] if first == last else [(first, start, (start + end) / 2)]
        if first != last:
            parts.append((last, (start + end) / 2, end))
        for target, begin, finish in parts:
            margin = 0.0 if label == SILENCE else (1.0 - HOLD_SHARE) / 2 * (finish - begin)
            found.append((float(begin + margin), float(finish - margin), target))
    return found


def _contact_track(held: list[tuple[float, float]], times: FloatArray) -> FloatArray:
    """Contact (T,): 1 in held spans, with transitions of `CONTACT_EASE_S` on both sides."""
    track = np.zeros(len(times))
    for start, end in held:
        beyond = np.maximum(np.maximum(start - times, times - end), 0.0)
        track = np.maximum(track, smoothstep(beyond, CONTACT_EASE_S, 0.0))
    return track


def _keyframe_track(keys: list[tuple[float, float, float]], clock: FloatArray, longest: float) -> FloatArray:
    """Values at the clock: each held within its span, with cosine-like transitions of at most `longest` seconds.

    A longer transition rests at the smaller of its two values.
    """
    track = np.zeros(len(clock))
    for number, (start, end, value) in enumerate(keys):
        track[(clock >= start) & (clock <= end)] = value
        if number == 0:
            continue
        _, before, previous = keys[number - 1]
        between = (clock > before) & (clock < start)
        low = min(previous, value)
        falling = previous + (low - previous) * smoothstep(clock[between] - before, 0.0, min(longest, start - before))
        rising = low + (value - low) * smoothstep(clock[between] - start, -min(longest, start - before), 0.0)
        track[between] = np.maximum(falling, rising)
    return track


# Largest change of a shape's weight per second, .3 per 1/60 s; closing the lips afterwards adds a little. The fastest
# score of the mouth in 14 recordings of GRID s1 (mouthPucker) changes by .34 per 1/60 s (99.9th percentile), that of
# the Live Link capture (mouthFunnel) by .25.
LARGEST_SPEED_PER_S = 18.0
# Speed at which the lips of a mouth of 50 mm open or close (99.9th percentile of GRID s1: 265 and 310 mm/s), and the
# time in which they reach half of it.
LIP_SPEED_MM_PER_S, LIP_ONSET_S = 300.0, 0.01
FIRM_POWER = 6  # of the smooth minimum of a gap and its bound: a bound of twice the gap lowers it by .3 %
LEAST_CHANGE_MM = 1e-4  # of a gap; frames that would change less are unchanged


def limit_speed(values: FloatArray, fps: float) -> FloatArray:
    """Values (T, K) whose changes from frame to frame are limited; values that change slowly enough are unchanged.

    Notes
    -----
    The mean of the least function above the values, and of the greatest below them, whose slopes are within the limit.
    """
    largest = LARGEST_SPEED_PER_S / fps
    above, below = values.copy(), values.copy()
    for order in (range(1, len(values)), range(len(values) - 2, -1, -1)):
        back = -1 if order.step > 0 else 1
        for t in order:
            above[t] = np.maximum(above[t], above[t + back] - largest)
            below[t] = np.minimum(below[t], below[t + back] + largest)
    return (above + below) / 2


def largest_gaps(seconds: FloatArray, mouth_share: float) -> FloatArray:
    """Largest gaps (T,), mm, of lips that touch in `seconds` (T,), on a mouth of a share of the default head's."""
    far = np.minimum(seconds, 1e3)
    return mouth_share * LIP_SPEED_MM_PER_S * far * far / (far + LIP_ONSET_S)


def close_lips(
    mouth: LipConstraints, speech: FloatArray, rest_gaps: FloatArray, bounds: FloatArray, closure: FloatArray
) -> FloatArray:
    """Speech (T, K) whose lip gaps are within bounds (T,), mm, and smaller by shares `closure` (T,).

    All gaps of a frame shrink by the same share. Overlapping lips, whose gap is negative, stay as they are.

    Parameters
    ----------
    rest_gaps : (P,)
        Gaps of the face at rest that are to be closed, mm.
    """
    displaced = ordered_product(speech, mouth.gaps.T)
    gaps = np.maximum(displaced + rest_gaps, 0.0)
    widest = gaps.max(axis=1)
    ratio = np.divide(widest, bounds, out=np.full(len(widest), np.inf), where=bounds > 0)
    kept = (1.0 - closure) * (1.0 + ratio**FIRM_POWER) ** (-1.0 / FIRM_POWER)
    changed = (1.0 - kept) * widest > LEAST_CHANGE_MM
    targets = displaced - (1.0 - kept)[:, None] * gaps
    return mouth.solve(speech, np.zeros_like(speech), targets, changed)


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
N_CLOSURE_ROUNDS = 3  # of limiting the speed and closing the lips, which disturb each other a little
LEAST_MOTION_MM = 0.5  # per weight of a shape: shapes that move less, as on a face without them, are not used
ROUND_SHAPES = {"mouthPucker": 1.0}
FLARED_SHAPES = {"mouthPucker": 0.85, "mouthFunnel": 0.3}
SPREAD_SHAPES = {"mouthStretchLeft": 0.5, "mouthStretchRight": 0.5, "mouthSmileLeft": 0.5, "mouthSmileRight": 0.5}
LOWERED_SHAPES = {"mouthLowerDownLeft": 1.0, "mouthLowerDownRight": 1.0}
# Drop of the jaw and gap of the lips at which the tip of the tongue is seen between the teeth; largest weight for it.
DENTAL_DROP_MM, DENTAL_GAP_MM, LARGEST_LOWERED = 5.5, 8.0, 0.8
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
    """

    mouth: LipConstraints
    contact: LipConstraints
    protrusion: FloatArray
    rest_width: float
    rest_gaps: FloatArray
    directions: Mapping[str, FloatArray]
    tongue: Tongue
    incisors: IncisorContact

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
        size, jaw, lip = self.rest_width / HEAD_MOUTH_MM, self.directions["open"], self.directions["lowered"]
        dropped = ordered_product(speech, jaw) * self._gap_by_jaw()
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
    tables["open"] = {WIDE_OPEN: 1.0}
    if not {*ROUND_SHAPES, *FLARED_SHAPES} <= {*face.shape_names}:
        tables["flared"] = ROUND_SHAPES
    return Articulator(
        mouth=mouth,
        contact=contact,
        protrusion=(motion[OUTER_UPPER_MID, 2] + motion[OUTER_LOWER_MID, 2]) / 2,
        rest_width=rest_width,
        rest_gaps=np.clip(inner_lip_gaps(places), 0.0, LARGEST_REST_GAP_SHARE * rest_width),
        directions={
            kind: np.array([table.get(name, 0.0) for name in face.shape_names]) for kind, table in tables.items()
        },
        tongue=build_tongue(face, edge, rest_width),
        incisors=build_incisor_contact(face.shape_names, contact, edge, places=places, motion=motion, width=rest_width),
    )
