"""Gestures on any face: expressions, brows, lids, cheeks, gaze and head laid over its speech.

Ju and Lee 2008, section 5: ``F(t) = R(t) (N + sum_i c_i B_i + sum_l d_l P_l + sum_j D_j) + T(t)``. Weights c of the
basis expressions are shared between faces; D_j move landmarks, scaled to the face and spread around them (5.2).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import InputError
from tts2face.face.expressions import GAZE_SHAPES, add_expression_shapes, expression_weights
from tts2face.face.eyelids import EyelidModel, build_eyelid_model
from tts2face.face.landmark_fit import N_SKIN, axis_scales, landmark_positions, procrustes_rotation, scatter_landmarks
from tts2face.face.lip_constraints import LipConstraints, build_lip_constraints
from tts2face.face.mouth_model import SPEECH_SHAPE_PREFIXES
from tts2face.face.shape_transfer import SCALE_LIMITS, append_shapes, spread_landmark_motion
from tts2face.models.face import Face
from tts2face.models.landmarks import INNER_LIP_LOWER, INNER_LIP_UPPER, OUTER_LIP_LOWER, OUTER_LIP_UPPER
from tts2face.models.palette import FEATURES, FIXED_CHANNELS, REGION_FEATURES, FaceRegion, Palette
from tts2face.numeric import ordered_product
from tts2face.types import HEAD_CHANNELS, Trajectory

# Weights of an expression from which the mouth begins to answer, and answers in full: a neutral speaker reads as up to
# .1 sad or angry (99th percentile of 40 minutes), and the mouth's part of that is in the recorded lips already.
MOUTH_RESPONSE_RANGE = (0.05, 0.2)
SPEECH_GAINS = ("jaw", "lips")
GAIN_NAMES = (*FEATURES, *SPEECH_GAINS)  # whose motion may be multiplied
MAX_MODE_MM = 10.0  # of a landmark by one mode: brows rise 10 mm at most
# What stays still while a region moves: the rims of the lids, and the lips. Lids and lips have features of their own.
LID_LANDMARKS = (
    33, 246, 161, 160, 159, 158, 157, 173, 133, 155, 154, 153, 145, 144, 163, 7,
    263, 466, 388, 387, 386, 385, 384, 398, 362, 382, 381, 380, 374, 373, 390, 249,
)  # fmt: skip
LIP_LANDMARKS = (*OUTER_LIP_UPPER, *OUTER_LIP_LOWER, *INNER_LIP_UPPER, *INNER_LIP_LOWER)
# Added to a region when its size is fitted: corners of the eyes, root and base of the nose.
FIT_LANDMARKS = (33, 133, 362, 263, 168, 6, 2)
DEFAULT_GAZE_TURN = 0.4  # rad per weight of a gaze shape on a face whose eyes are part of its shapes

Float32Array = NDArray[np.float32]
FloatArray = NDArray[np.float64]
NO_GAINS: Mapping[str, float] = MappingProxyType({})


@dataclass(frozen=True, slots=True, eq=False)
class FaceMotion:
    """A face that speaks and moves: weights (T, K) of the shapes of `GestureFace.face`, and its head (T, 6)."""

    motion: Trajectory
    head: Trajectory


@dataclass(frozen=True, slots=True, eq=False)
class GestureFace:
    """A face made ready for gestures; `gesture_face` makes it.

    Parameters
    ----------
    face
        The given face, with further shapes behind its own; draw this one.
    n_own
        Number of shapes of the given face.
    expressions : (5, K)
        Weights of the shapes in each of `tts2face.models.palette.EXPRESSIONS`.
    regions
        Numbers of the shapes of each region's modes.
    gaze : (4, K)
        Weight per radian of looking down, up, to the own left and to the right.
    mouth, lids
        What lips and lids do.
    """

    face: Face
    n_speech_shapes: int
    expressions: FloatArray
    regions: Mapping[str, slice]
    gaze: FloatArray
    mouth: LipConstraints
    lids: EyelidModel

    def perform(
        self, speech: Trajectory, gestures: Mapping[str, Float32Array], gains: Mapping[str, float] = NO_GAINS
    ) -> FaceMotion:
        """Speech with gestures.

        Parameters
        ----------
        speech : (T, n_own)
            Weights of the shapes of the given face, as `tts2face.retargeting.to_face.Retargeter` makes them.
        gestures
            (T, k) values of features of the palette, in its units; nothing moves where one is absent.
        gains
            Factors by which the motion of features is multiplied, and of ``jaw`` and ``lips`` the speech's; closed
            lips stay closed.

        Raises
        ------
        InputError
            The speech is not in the given face's shapes, a feature or gain does not exist, is not finite, or does
            not fit the speech's frames.
        """
        self._check(speech, gestures, gains)
        spoken = np.zeros((len(speech), len(self.face.shape_names)))
        spoken[:, : self.n_speech_shapes] = speech.values
        felt = {name: gains.get(name, 1.0) * values.astype(np.float64) for name, values in gestures.items()}
        spoken = self._scale_speech(spoken, gains)
        added = self._gesture_weights(spoken, felt)
        shares = felt.get("blink", np.zeros((len(speech), 2)))
        added = self.lids.close(spoken + added, shares) - spoken
        weights = self.mouth.held(spoken, added)
        for (
            name,
            columns,
        ) in self.regions.items():  # they leave lids and lips alone, and lids and lips know nothing of them
            if name in felt:
                weights[:, columns] = np.clip(felt[name], *self.face.limits[columns].T.astype(np.float64))
        head = felt.get("head", np.zeros((len(speech), len(HEAD_CHANNELS))))
        return FaceMotion(
            Trajectory(self.face.shape_names, weights, speech.fps), Trajectory(HEAD_CHANNELS, head, speech.fps)
        )

    def _scale_speech(self, spoken: FloatArray, gains: Mapping[str, float]) -> FloatArray:
        """Speech with its jaw and lips multiplied."""
        jaw, lips = (
            np.where([shape.startswith(prefix) for shape in self.face.shape_names], gains.get(name, 1.0), 1.0)
            for name, prefix in zip(SPEECH_GAINS, SPEECH_SHAPE_PREFIXES, strict=True)
        )
        return self.mouth.amplify(spoken, jaw, lips)

    def _gesture_weights(self, spoken: FloatArray, felt: Mapping[str, FloatArray]) -> FloatArray:
        """(T, K) what expression and gaze add to speech; apart from the mouth within the shapes' limits."""
        added = np.zeros_like(spoken)
        if "expression" in felt:
            added += ordered_product(felt["expression"], self.expressions)
            lips = self.mouth.moving
            added[:, lips] = ordered_product(mouth_response(felt["expression"]), self.expressions[:, lips])
            added = self.mouth.attenuate_on_rounded_lips(spoken, added)
        if "gaze" in felt:
            down, left = felt["gaze"].T
            turned = np.stack([np.maximum(down, 0), np.maximum(-down, 0), np.maximum(left, 0), np.maximum(-left, 0)])
            added += ordered_product(turned.T, self.gaze)
        others = np.setdiff1d(np.arange(spoken.shape[1]), self.mouth.moving)
        low, high = self.face.limits[others].T.astype(np.float64)
        added[:, others] = np.clip(spoken[:, others] + added[:, others], low, high) - spoken[:, others]
        return added

    def _check(self, speech: Trajectory, gestures: Mapping[str, Float32Array], gains: Mapping[str, float]) -> None:
        if speech.channels != self.face.shape_names[: self.n_speech_shapes]:
            raise InputError("the speech is not in the shapes of this face; retarget it to the face first")
        widths = {name: columns.stop - columns.start for name, columns in self.regions.items()}
        check_gestures(gestures, gains, len(speech), widths)


def mouth_response(expression: FloatArray) -> FloatArray:
    """Weights of expressions (T, 5) as the mouth answers them, whose motion in a neutral face is speech already."""
    low, high = MOUTH_RESPONSE_RANGE
    share = np.clip((np.abs(expression) - low) / (high - low), 0.0, 1.0)
    return np.asarray(expression * share * share * (3.0 - 2.0 * share))


def check_gestures(
    gestures: Mapping[str, Float32Array], gains: Mapping[str, float], n_frames: int, regions: Mapping[str, int]
) -> None:
    """Refuse gestures that are none, or do not fit the frames or the palette; `regions` are numbers of modes.

    Raises
    ------
    InputError
        A feature or gain does not exist, is not finite, or has other sizes.
    """
    widths = {name: len(channels) for name, channels in FIXED_CHANNELS.items()} | dict(regions)
    for name, values in gestures.items():
        if name not in widths:
            raise InputError(f"there is no feature {name!r}; give {', '.join(FEATURES)}")
        wanted = (n_frames, widths[name])
        if values.shape != wanted or not np.isfinite(values).all():
            raise InputError(f"{name} must be finite values {wanted}, not {values.shape}")
    for name, gain in gains.items():
        if name not in GAIN_NAMES:
            raise InputError(f"there is no gain for {name!r}; give {', '.join(GAIN_NAMES)}")
        if not (np.isfinite(gain) and gain >= 0):
            raise InputError(f"the gain of {name} must be 0 or more, not {gain}")


def gesture_face(face: Face, palette: Palette) -> GestureFace:
    """Prepare a face for the gestures of a palette.

    ARKit shapes that the face lacks are carried from the default head by the landmarks; each mode of the palette's
    regions becomes a shape such as ``brows0``.

    Raises
    ------
    DataError
        The face lacks landmarks of the eyes or lips, or a shape that speech could move.
    """
    build_lip_constraints(face)  # refuses a face without lips before anything is carried to it
    whole = add_expression_shapes(face)
    regions: dict[str, slice] = {}
    for name in REGION_FEATURES:
        shapes = region_shapes(whole, palette.neutral.astype(np.float64), palette.regions[name])
        first = len(whole.shape_names)
        regions[name] = slice(first, first + len(shapes))
        size = np.linalg.norm(palette.regions[name].modes, axis=2).max(axis=1)
        most = MAX_MODE_MM / np.maximum(size.astype(np.float64), 1e-6)
        whole = append_shapes(whole, palette.channels(name), shapes, np.column_stack([-most, most]))
    mouth = build_lip_constraints(whole)
    return GestureFace(
        face=whole,
        n_speech_shapes=len(face.shape_names),
        expressions=expression_weights(whole, mouth),
        regions=regions,
        gaze=gaze_weights(whole),
        mouth=mouth,
        lids=build_eyelid_model(whole),
    )


def region_shapes(face: Face, neutral: FloatArray, region: FaceRegion) -> Float32Array:
    """(k, V, 3) shapes of a region's modes on a face, mm per mm.

    Notes
    -----
    The modes are turned as the face lies to `neutral` (478, 3), scaled by an affine fit of each axis on the region and
    its frame of eye corners and nose, and spread by compact cubic B-splines.
    """
    places = scatter_landmarks(face, landmark_positions(face))
    own = {*region.landmarks.tolist()}
    still = [number for number in (*LID_LANDMARKS, *LIP_LANDMARKS) if number not in own]
    return spread_landmark_motion(face, region.landmarks, fit_modes(places, neutral, region), still)


def fit_modes(places: FloatArray, neutral: FloatArray, region: FaceRegion) -> FloatArray:
    """(k, L, 3) a region's modes in the size of landmarks (478, 3), of which some may be NaN."""
    seen: NDArray[np.bool_] = np.isfinite(places[:, 0])
    skin = np.flatnonzero(seen[:N_SKIN])
    turn = procrustes_rotation(neutral[skin], places[skin])
    fitted = np.array([number for number in (*region.landmarks, *FIT_LANDMARKS) if seen[number]])
    sizes = axis_scales(ordered_product(neutral[fitted], turn.T), places[fitted], SCALE_LIMITS)
    return ordered_product(region.modes.astype(np.float64), turn.T) * sizes


def gaze_weights(face: Face) -> FloatArray:
    """(4, K) weight of each gaze shape per radian of looking down, up, to the face's own left, and right.

    Eyes that turn take their own angles; shapes that move eyes as part of the skin are taken to turn them by
    `DEFAULT_GAZE_TURN`.
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
    """Rotation axis (3,) of a gaze shape by its name."""
    if "Up" in name or "Down" in name:
        return np.array([1.0 if "Down" in name else -1.0, 0.0, 0.0])
    to_left = ("Out" in name) == name.endswith("Left")
    return np.array([0.0, 1.0 if to_left else -1.0, 0.0])
