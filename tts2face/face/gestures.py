"""Gesture transfer to a mesh face: expressions, brows, lids, cheeks, gaze and head, added to speech.

Ju and Lee 2008, section 5: ``F(t) = R(t) (N + sum_i c_i B_i + sum_l d_l P_l + sum_j D_j) + T(t)``. Weights c of the
basis expressions are shared between faces; D_j move landmarks, scaled to the face and spread around them (5.2).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from types import MappingProxyType
from zlib import crc32

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import InputError
from tts2face.face.expressions import GAZE_SHAPES, add_expression_shapes
from tts2face.face.eyelids import EyelidModel, build_eyelid_model
from tts2face.face.landmarks import axis_scales, landmark_positions, procrustes_rotation, scatter_landmarks
from tts2face.face.lip_constraints import MIDDLE_PAIR, SPEECH_SHAPE_PREFIXES, LipConstraints, build_lip_constraints
from tts2face.face.mood_targets import mood_weights, with_corner_shape
from tts2face.face.shape_transfer import SCALE_LIMITS, append_shapes, spread_landmark_motion
from tts2face.face.stand_in import stand_in, with_channels_of
from tts2face.models.face import Face
from tts2face.models.landmarks import LID_RINGS, LIP_LANDMARKS, N_MESH_LANDMARKS
from tts2face.models.palette import EYE_CHANNELS, FEATURES, FIXED_CHANNELS, REGION_FEATURES, FaceRegion, Palette
from tts2face.numeric.arrays import Float32Array, FloatArray, ordered_product
from tts2face.processes.shared import shared
from tts2face.types import HEAD_CHANNELS, Trajectory

# Expression weights at which the mouth begins to respond and responds in full: a neutral speaker scores up to 0.1 sad
# or angry (99th percentile of 40 minutes), and the recorded lips already contain the mouth's part of it.
MOUTH_RESPONSE_RANGE = (0.05, 0.2)
SPEECH_GAINS = ("jaw", "lips")
GAIN_NAMES = (*FEATURES, *SPEECH_GAINS)  # whose motion has a gain
MAX_MODE_MM = 10.0  # largest displacement of a landmark by one mode: brows rise up to 10 mm
# Landmarks that stay still while a region moves: rims of the lids, and lips, which have features of their own.
LID_LANDMARKS = (*LID_RINGS[0], *LID_RINGS[1])
# Landmarks added to a region for the fit of its size: corners of the eyes, root and base of the nose.
FIT_LANDMARKS = (33, 133, 362, 263, 168, 6, 2)
SMILES = ("mouthSmile", "cheekSquint")  # shapes whose sides differ a little in a person's smile
SMILE_UNEVENNESS = (0.03, 0.08)  # sides of smiles differ by 6 to 16 %: posed symmetry is seen as a mask
DEFAULT_GAZE_TURN = 0.4  # rad per weight of a gaze shape on a face whose eyes are part of its shapes

JAW_SHAPE, SQUINT_SHAPES = "jawOpen", ("cheekSquintLeft", "cheekSquintRight")
LEAST_OPENING_MM = 1.0  # of the lips by a shape at weight 1; less is none of a jaw
# Channels that only gestures with names have: mm by which the lips part, and weights of the squints of both cheeks.
MOUTH_CHANNELS: Mapping[str, tuple[str, ...]] = MappingProxyType({"mouth": ("gap",), "squint": EYE_CHANNELS})

NO_GAINS: Mapping[str, float] = MappingProxyType({})


@dataclass(frozen=True, slots=True, eq=False)
class FaceMotion:
    """Shape weights (T, K) of `GestureFace.face` and head pose (T, 6) of speech with gestures."""

    motion: Trajectory
    head: Trajectory


@dataclass(frozen=True, slots=True, eq=False, weakref_slot=True)
class GestureFace:
    """Face prepared for the gestures of a palette; built by `gesture_face`.

    Parameters
    ----------
    face
        The given face with gesture shapes appended.
    n_speech_shapes
        Number of shapes of the given face.
    expressions : (5, K)
        Shape weights of each of `tts2face.models.palette.EXPRESSIONS`.
    regions
        Range of the shapes of each region's modes.
    gaze : (4, K)
        Weights per radian of gaze down, up, to the face's own left and to its right.
    mouth, lids
        Constraints of lips and lids.
    """

    face: Face
    n_speech_shapes: int
    expressions: FloatArray
    regions: Mapping[str, slice]
    gaze: FloatArray
    mouth: LipConstraints
    lids: EyelidModel

    def perform(
        self,
        speech: Trajectory,
        gestures: Mapping[str, Float32Array],
        gains: Mapping[str, float] = NO_GAINS,
        unevenness: float = 0.0,
    ) -> FaceMotion:
        """Shape weights and head pose of speech with gestures.

        Parameters
        ----------
        speech : (T, n_speech_shapes)
            Weights of the shapes of the given face, as `tts2face.lips.retargeting.Retargeter` returns them.
        gestures
            (T, k) values of each feature of the palette, in its units, and of `MOUTH_CHANNELS`; missing ones are at
            rest.
        gains
            Factors on the motion of features, and on the speech motion of ``jaw`` and ``lips``; closed lips stay
            closed.
        unevenness
            Share by which the left side of a smile is larger than the mean of both, as of `smile_unevenness`.

        Raises
        ------
        InputError
            The speech is not in the given face's shapes, or a feature or gain does not exist, is not finite, or
            differs from the speech in its number of frames.
        """
        self._check(speech, gestures, gains)
        spoken = np.zeros((len(speech), len(self.face.shape_names)))
        spoken[:, : self.n_speech_shapes] = speech.values
        features = {name: gains.get(name, 1.0) * values.astype(np.float64) for name, values in gestures.items()}
        spoken = self._open_mouth(self._scale_speech(spoken, gains), features)
        added = self._gesture_weights(spoken, features, self._uneven_expressions(unevenness))
        shares = features.get("blink", np.zeros((len(speech), 2)))
        added = self.lids.close(spoken + added, shares) - spoken
        weights = self.mouth.combine(spoken, added)
        for name, columns in self.regions.items():  # region shapes do not move lids or lips
            if name in features:
                weights[:, columns] = np.clip(features[name], *self.face.limits[columns].T.astype(np.float64))
        head = features.get("head", np.zeros((len(speech), len(HEAD_CHANNELS))))
        return FaceMotion(
            Trajectory(self.face.shape_names, weights, speech.fps), Trajectory(HEAD_CHANNELS, head, speech.fps)
        )

    def _scale_speech(self, speech: FloatArray, gains: Mapping[str, float]) -> FloatArray:
        """Speech weights (T, K) with the gains of jaw and lips applied."""
        jaw, lips = (
            np.where([shape.startswith(prefix) for shape in self.face.shape_names], gains.get(name, 1.0), 1.0)
            for name, prefix in zip(SPEECH_GAINS, SPEECH_SHAPE_PREFIXES, strict=True)
        )
        return self.mouth.amplify(speech, jaw, lips)

    def _open_mouth(self, speech: FloatArray, features: Mapping[str, FloatArray]) -> FloatArray:
        """Speech weights (T, K) with a jaw that opens the lips by the mm of ``mouth``, within its limit.

        A face without `JAW_SHAPE` opens them by the one of its own shapes that does so most, as of the vowel aa.
        """
        if "mouth" not in features:
            return speech
        own = self.face.shape_names[: self.n_speech_shapes]
        gaps = self.mouth.gaps[MIDDLE_PAIR]
        column = own.index(JAW_SHAPE) if JAW_SHAPE in own else int(gaps[: len(own)].argmax())
        opened = float(gaps[column])
        if opened < LEAST_OPENING_MM:
            return speech
        parted = speech.copy()
        highest = np.maximum(float(self.face.limits[column, 1]), speech[:, column])
        parted[:, column] = np.minimum(speech[:, column] + features["mouth"][:, 0] / opened, highest)
        return parted

    def _uneven_expressions(self, unevenness: float) -> FloatArray:
        """Shape weights (5, K) of the expressions, of which smiles differ between the sides."""
        sides = [name.endswith("Left") - name.endswith("Right") for name in self.face.shape_names]
        smiles = np.where([name.startswith(SMILES) for name in self.face.shape_names], sides, 0)
        uneven: FloatArray = self.expressions * (1.0 + unevenness * smiles)
        return uneven

    def _gesture_weights(
        self, speech: FloatArray, features: Mapping[str, FloatArray], expressions: FloatArray
    ) -> FloatArray:
        """Weights (T, K) that expression and gaze add to speech; clipped to the limits, except for the mouth's."""
        added = np.zeros_like(speech)
        if "expression" in features:
            added += ordered_product(features["expression"], expressions)
            lips = self.mouth.moving
            added[:, lips] = ordered_product(mouth_response(features["expression"]), expressions[:, lips])
            added = self.mouth.attenuate_on_rounded_lips(speech, self.mouth.attenuate_on_moved_lips(speech, added))
        if "gaze" in features:
            down, left = features["gaze"].T
            # shapes of gaze have one direction each: down, up, left, right
            turned = np.stack([np.maximum(down, 0), np.maximum(-down, 0), np.maximum(left, 0), np.maximum(-left, 0)])
            added += ordered_product(turned.T, self.gaze)
        for side, name in enumerate(SQUINT_SHAPES if "squint" in features else ()):
            added[:, self.face.shape_names.index(name)] += features["squint"][:, side]
        others = np.setdiff1d(np.arange(speech.shape[1]), self.mouth.moving)
        low, high = self.face.limits[others].T.astype(np.float64)
        added[:, others] = np.clip(speech[:, others] + added[:, others], low, high) - speech[:, others]
        return added

    def _check(self, speech: Trajectory, gestures: Mapping[str, Float32Array], gains: Mapping[str, float]) -> None:
        if speech.channels != self.face.shape_names[: self.n_speech_shapes]:
            raise InputError("the speech is not in the shapes of this face; retarget it to the face first")
        widths = {name: columns.stop - columns.start for name, columns in self.regions.items()}
        check_gestures(gestures, gains, len(speech), widths)


def smile_unevenness(name: str, seed: int) -> float:
    """Share by which the left side of a face's smile exceeds the mean of both: of `SMILE_UNEVENNESS`, either sign."""
    random = np.random.default_rng([crc32(name.encode()), seed])
    return float(random.uniform(*SMILE_UNEVENNESS) * random.choice((-1.0, 1.0)))


def mouth_response(expression: FloatArray) -> FloatArray:
    """Expression weights (T, 5) for the mouth: attenuated below `MOUTH_RESPONSE_RANGE`, where speech contains them."""
    low, high = MOUTH_RESPONSE_RANGE
    share = np.clip((np.abs(expression) - low) / (high - low), 0.0, 1.0)
    return np.asarray(
        expression * share * share * (3.0 - 2.0 * share)
    )  # not `smoothstep`: this order rounds differently


def check_gestures(
    gestures: Mapping[str, Float32Array], gains: Mapping[str, float], n_frames: int, regions: Mapping[str, int]
) -> None:
    """Check gestures and gains against the frames and the palette; `regions` holds the number of modes per region."""
    widths = {name: len(channels) for name, channels in {**FIXED_CHANNELS, **MOUTH_CHANNELS}.items()}
    widths |= regions
    for name, values in gestures.items():
        if name not in widths:
            raise InputError(f"there is no feature {name!r}; give {', '.join(FEATURES)}")
        expected = (n_frames, widths[name])
        if values.shape != expected or not np.isfinite(values).all():
            raise InputError(f"{name} must be finite values {expected}, not {values.shape}")
    for name, gain in gains.items():
        if name not in GAIN_NAMES:
            raise InputError(f"there is no gain for {name!r}; give {', '.join(GAIN_NAMES)}")
        if not (np.isfinite(gain) and gain >= 0):
            raise InputError(f"the gain of {name} must be 0 or more, not {gain}")


@shared
def gesture_face(face: Face, palette: Palette) -> GestureFace:
    """Face prepared for the gestures of a palette.

    ARKit shapes that the face lacks are transferred from the default head by the landmarks; each mode of the palette's
    regions becomes a shape such as ``brows0``. A face without landmarks of lips has a stand-in (`stand_in`).

    Raises
    ------
    DataError
        The face lacks landmarks of the eyes or lips, or has no shape that speech moves.
    """
    own, face = face, stand_in(face)
    build_lip_constraints(face)  # raises for a face without lips before the transfer
    extended_face = with_corner_shape(add_expression_shapes(face))
    neutral = palette.neutral.astype(np.float64)
    shapes = [region_shapes(extended_face, neutral, palette.regions[name]) for name in REGION_FEATURES]
    firsts = np.cumsum([len(extended_face.shape_names), *(len(moved) for moved in shapes)]).tolist()
    regions = {name: slice(*ends) for name, ends in zip(REGION_FEATURES, pairwise(firsts), strict=True)}
    sizes = np.concatenate(
        [np.linalg.norm(palette.regions[name].modes, axis=2).max(axis=1) for name in REGION_FEATURES]
    )
    largest_weights = MAX_MODE_MM / np.maximum(sizes.astype(np.float64), 1e-6)
    names = [channel for name in REGION_FEATURES for channel in palette.channels(name)]
    limits = np.column_stack([-largest_weights, largest_weights])
    extended_face = append_shapes(extended_face, names, np.concatenate(shapes), limits)
    mouth = build_lip_constraints(extended_face)
    return GestureFace(
        face=extended_face if own is face else with_channels_of(own, extended_face),
        n_speech_shapes=len(face.shape_names),
        expressions=mood_weights(extended_face, mouth.with_smile_cost()),
        regions=regions,
        gaze=gaze_weights(extended_face),
        mouth=mouth.with_gesture_cost(),
        lids=build_eyelid_model(extended_face),
    )


def region_shapes(face: Face, neutral: FloatArray, region: FaceRegion) -> Float32Array:
    """Shapes (k, V, 3) of a region's modes on a face, mm per mm.

    Notes
    -----
    The modes are rotated by the Procrustes fit of the face to `neutral` (478, 3), scaled by a fit of each axis on the
    region, eye corners and nose, and interpolated over the skin by compact cubic B-splines.
    """
    places = scatter_landmarks(face, landmark_positions(face))
    own = {*region.landmarks.tolist()}
    still = [number for number in (*LID_LANDMARKS, *LIP_LANDMARKS) if number not in own]
    return spread_landmark_motion(face, region.landmarks, fit_modes(places, neutral, region), still)


def fit_modes(places: FloatArray, neutral: FloatArray, region: FaceRegion) -> FloatArray:
    """Modes (k, L, 3) of a region, rotated and scaled to the landmarks `places` (478, 3), some of which may be NaN."""
    known: NDArray[np.bool_] = np.isfinite(places[:, 0])
    skin = np.flatnonzero(known[:N_MESH_LANDMARKS])
    turn = procrustes_rotation(neutral[skin], places[skin])
    fitted = np.array([number for number in (*region.landmarks, *FIT_LANDMARKS) if known[number]])
    sizes = axis_scales(ordered_product(neutral[fitted], turn.T), places[fitted], SCALE_LIMITS)
    return ordered_product(region.modes.astype(np.float64), turn.T) * sizes


def gaze_weights(face: Face) -> FloatArray:
    """Weights (4, K) of the gaze shapes per radian of gaze down, up, to the face's own left and to its right.

    Shapes that rotate eyeballs have known angles; shapes that move the eyes as part of the skin are assumed to rotate
    them by `DEFAULT_GAZE_TURN` at weight 1.
    """
    directions = np.array([[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]])  # about x and y
    weights = np.zeros((4, len(face.shape_names)))
    turns = {name: turn for eye in face.eyes for name, turn in eye.turns.items()}
    for name in GAZE_SHAPES:
        turn = np.asarray(turns.get(name, DEFAULT_GAZE_TURN * _default_gaze_axis(name)), np.float64)[:2]
        main = int(np.abs(turn).argmax())
        along = directions[:, main] * turn[main]
        weights[:, face.shape_names.index(name)] = np.where(along > 0, 1.0 / np.maximum(along, 1e-6), 0.0)
    return weights


def _default_gaze_axis(name: str) -> FloatArray:
    """Signed rotation axis (3,) of a gaze shape, derived from its name."""
    if "Up" in name or "Down" in name:
        return np.array([1.0 if "Down" in name else -1.0, 0.0, 0.0])
    to_left = ("Out" in name) == name.endswith("Left")
    return np.array([0.0, 1.0 if to_left else -1.0, 0.0])
