"""Gestures of a talker's own face on its video: landmark motion, and the texture change of the lids.

Lids move and change their texture as in the recorded blinks of the talker. Gaze and head pose are those of the video.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tts2face.face.expressions import expression_landmarks
from tts2face.face.gestures import LID_LANDMARKS, NO_GAINS, check_gestures, fit_modes
from tts2face.face.landmarks import axis_scales, landmark_positions, procrustes_rotation, scatter_landmarks
from tts2face.face.shape_transfer import SCALE_LIMITS, SUPPORT, default_head
from tts2face.models.appearance import Appearance
from tts2face.models.landmarks import (
    EYE_OUTER_LEFT,
    EYE_OUTER_RIGHT,
    EYELID_LANDMARKS,
    LID_RINGS,
    LIP_LANDMARKS,
    eyelid_numbers,
    lid_aperture,
)
from tts2face.models.palette import EXPRESSIONS, REGION_FEATURES, Palette
from tts2face.models.talker import ShapeModel, Talker, require_appearance
from tts2face.numeric.arrays import Float32Array, FloatArray, ordered_product, smoothstep
from tts2face.numeric.local_splines import fit_local_interpolant
from tts2face.types import Trajectory

LID_CHANNEL = "lids"
OPEN_QUANTILE, CLOSED_QUANTILE = 0.7, 0.005  # quantiles of the lid opening over all frames: open eyes and blinks
MIN_BLINK_CLOSURE = 0.5  # least closure in recorded blinks; talkers without blinks get no lid motion
MIN_LID_CLOSURE = -0.3  # closure of lids opened wide
# share of the mean curvature
GESTURE_RIDGE = 1e-5
LID_INNER_RADIUS, LID_OUTER_RADIUS = 0.7, 1.1  # relative to the eye width: lid texture changes in full, and ends
EXPRESSION_SHARE = 0.6  # of an expression that is applied: its folds and teeth do not occur in recorded speech


@dataclass(frozen=True, slots=True, eq=False)
class OwnFaceGestures:
    """Gesture model of a talker's own face; N points of its mesh.

    Parameters
    ----------
    channels
        Gesture channels, which follow those of speech and appearance: expressions, modes of brows and cheeks, and
        the lid closure.
    regions
        Number of modes of each region.
    modes : (G, N, 3)
        Motion of the points for each channel but the last, mm.
    lids, lid_appearance : (2, N, 3), (2, A)
        Coefficients of s and s squared of point motion, mm, and of face texture parameters, for lid closure s.
    lid_pixels : (P,)
        Weight of each face texture pixel: 1 where lids change the picture, 0 where they do not.
    plate_lid_closure : (T,)
        Lid closure on each frame of the plate; negative when wider than usual.
    """

    channels: tuple[str, ...]
    regions: Mapping[str, int]
    modes: Float32Array
    lids: Float32Array
    lid_appearance: Float32Array
    lid_pixels: Float32Array
    plate_lid_closure: Float32Array

    def motion(
        self, own: Trajectory, gestures: Mapping[str, Float32Array], gains: Mapping[str, float] = NO_GAINS
    ) -> Trajectory:
        """Speech and appearance (T, S + A) with gesture channels appended (T, S + A + G).

        Parameters
        ----------
        gestures
            (T, k) values of each feature of the palette; gaze and head have no effect, and both eyes blink together.
        gains
            Factors on the motion of features; ``jaw`` and ``lips`` have no effect.

        Raises
        ------
        InputError
            As `tts2face.face.gestures.check_gestures`.
        """
        check_gestures(gestures, gains, len(own), self.regions)
        values = np.zeros((len(own), len(self.channels)))
        widths = {"expression": len(EXPRESSIONS), **self.regions}
        first = 0
        for name, width in widths.items():
            if name in gestures:
                values[:, first : first + width] = gains.get(name, 1.0) * gestures[name]
            first += width
        values[:, : len(EXPRESSIONS)] *= EXPRESSION_SHARE
        if "blink" in gestures:
            values[:, -1] = np.clip(gains.get("blink", 1.0) * gestures["blink"].mean(axis=1), 0.0, 1.0)
        return Trajectory(own.channels + self.channels, np.concatenate([own.values, values], axis=1), own.fps)

    def displacements(self, gestures: NDArray[np.floating], number: int) -> tuple[Float32Array, Float32Array]:
        """Point motion (N, 3), mm, and change of the face texture parameters (A,) on a frame of the plate.

        `gestures` (G,) are the gesture channels of one frame, `number` is the index of the plate's frame.
        """
        before = float(self.plate_lid_closure[number])
        after = before + float(gestures[-1]) * (1.0 - before)
        powers = np.array([after - before, after**2 - before**2], np.float32)
        points = np.tensordot(gestures[:-1].astype(np.float32), self.modes, axes=1)
        return points + np.tensordot(powers, self.lids, axes=1), powers @ self.lid_appearance


def build_own_face_gestures(talker: Talker, palette: Palette) -> OwnFaceGestures:
    """Gesture model of a talker's own face for the gestures of a palette.

    Raises
    ------
    InputError
        The talker has no appearance model.
    """
    appearance, model = require_appearance(talker), talker.model
    rest = (model.mean + np.einsum("m,mld->ld", model.rest, model.basis)).astype(np.float64)
    n_mesh = len(appearance.face.reference)
    expressions = _expression_modes(rest)
    regions = [_region_modes(rest, palette, name) for name in REGION_FEATURES]
    lids, lid_appearance, plate_closure = _lid_model(talker, appearance)
    return OwnFaceGestures(
        channels=(*EXPRESSIONS, *(c for name in REGION_FEATURES for c in palette.channels(name)), LID_CHANNEL),
        regions={name: len(palette.regions[name].modes) for name in REGION_FEATURES},
        modes=np.concatenate([expressions, *regions])[:, :n_mesh].astype(np.float32),
        lids=lids[:, :n_mesh].astype(np.float32),
        lid_appearance=lid_appearance.astype(np.float32),
        lid_pixels=_lid_pixel_weights(appearance),
        plate_lid_closure=plate_closure.astype(np.float32),
    )


def _expression_modes(rest: FloatArray) -> FloatArray:
    """Basis expressions (5, 478, 3) of the default head at the scale of a talker with landmarks `rest` (478, 3)."""
    head = default_head()
    places = scatter_landmarks(head, landmark_positions(head))
    turn = procrustes_rotation(places, rest)
    return ordered_product(expression_landmarks(head), turn.T) * axis_scales(
        ordered_product(places, turn.T), rest, SCALE_LIMITS
    )


def _region_modes(rest: FloatArray, palette: Palette, name: str) -> FloatArray:
    """Modes (k, 478, 3) of a region on all landmarks; rims of the lids and lips do not move."""
    region = palette.regions[name]
    modes = fit_modes(rest, palette.neutral.astype(np.float64), region)
    still = [number for number in sorted({*LID_LANDMARKS, *LIP_LANDMARKS}) if number not in region.landmarks]
    constrained = np.concatenate([modes, np.zeros((len(modes), len(still), 3))], axis=1)
    size = float(np.linalg.norm(rest[EYE_OUTER_LEFT] - rest[EYE_OUTER_RIGHT]))
    flat = constrained.transpose(1, 0, 2).reshape(-1, 3 * len(modes))
    field = fit_local_interpolant(rest[[*region.landmarks, *still]], flat, SUPPORT * size)
    return field(rest).reshape(len(rest), -1, 3).transpose(1, 0, 2)


def _lid_model(talker: Talker, appearance: Appearance) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Motion (2, 478, 3) and texture parameters (2, A) of lids by closure and its square; plate closure (T,)."""
    model, n_face = talker.model, appearance.face.n_modes
    recorded = [utterance for utterance in talker.utterances if utterance.appearance_parameters is not None]
    shapes = np.concatenate([utterance.shape for utterance in recorded])
    texture = np.concatenate(
        [
            utterance.appearance_parameters[:, :n_face]
            for utterance in recorded
            if utterance.appearance_parameters is not None
        ]
    )
    openings = _mean_eye_openings(model, shapes)
    opened, shut = np.quantile(openings, [OPEN_QUANTILE, CLOSED_QUANTILE])
    still, plate = model.basis[model.n_speech :].astype(np.float64), _mean_eye_openings(model, appearance.plate.shape)
    # nobody blinks in the recordings: there is no lid to learn
    if shut > (1.0 - MIN_BLINK_CLOSURE) * opened:
        return np.zeros((2, len(model.mean), 3)), np.zeros((2, n_face)), np.zeros(len(plate))
    shares, on_plate = (
        np.clip((opened - values) / (opened - shut), MIN_LID_CLOSURE, 1.0) for values in (openings, plate)
    )
    terms = np.stack([np.ones_like(shares), shares, shares**2], axis=1)
    normal = ordered_product(terms.T, terms) + GESTURE_RIDGE * len(terms) * np.diag([0.0, 1.0, 1.0])
    motion, change = (
        np.linalg.solve(normal, ordered_product(terms.T, values.astype(np.float64)))[1:]
        for values in (shapes[:, model.n_speech :], texture)
    )
    return ordered_product(motion, still.reshape(len(still), -1)).reshape(2, -1, 3), change.astype(np.float64), on_plate


def _mean_eye_openings(model: ShapeModel, shapes: Float32Array) -> FloatArray:
    """Mean opening (T,) of both eyes, relative to their width."""
    numbers = {side: eyelid_numbers(side) for side in EYELID_LANDMARKS}  # all landmarks of an hour: 1 GB
    eyes = (replace(model, mean=model.mean[rows], basis=model.basis[:, rows]) for rows in numbers.values())
    left, right = (lid_aperture(eye.shapes(shapes)) for eye in eyes)
    return (left + right) / 2


def _lid_pixel_weights(appearance: Appearance) -> Float32Array:
    """Weights (P,) of the face texture pixels that lids change, fading outwards."""
    width = appearance.face.size[0]
    places = np.stack([appearance.face.pixels % width, appearance.face.pixels // width], axis=1)
    share = np.zeros(len(places))
    for rim in LID_RINGS:
        around = appearance.face.reference[list(rim)]
        size = float(around[:, 0].max() - around[:, 0].min())
        distance = np.linalg.norm(places - around.mean(axis=0), axis=1) / size
        share = np.maximum(
            share, np.clip((LID_OUTER_RADIUS - distance) / (LID_OUTER_RADIUS - LID_INNER_RADIUS), 0.0, 1.0)
        )
    smooth: Float32Array = smoothstep(share).astype(np.float32)
    return smooth
