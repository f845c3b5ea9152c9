"""Estimation of the head pose by weighted rigid alignment, and its removal from landmarks.

Pixels are scaled to millimetres of the canonical face (outer eye corners 88.9 mm apart) under orthographic projection.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError, InputError
from tts2face.models.landmarks import N_LANDMARKS

# Points that hardly move relative to the skull: right landmark, its left counterpart (itself on the midline), position
# of the right one on the canonical face in mm (x to the person's left, y up, z out), weight. Source: MediaPipe's face
# geometry (canonical face and its 33 alignment weights, Apache-2.0) without the points 136 and 365, which move with the
# jaw: with them the estimated scale changes when the mouth opens (docs/decisions/010-landmarks-two-passes.md).
RIGID_POINTS = (
    (4, 4, 0, -4.632, 75.866, 0.07091),
    (6, 6, 0, 24.733, 57.886, 0.0321),
    (10, 10, 0, 82.618, 44.815, 0.00845),
    (33, 263, -44.459, 26.64, 31.734, 0.05872),
    (54, 284, -62.793, 66.154, 14.259, 0.00767),
    (67, 297, -35.24, 80.06, 37.292, 0.00908),
    (117, 346, -52.587, 9.458, 29.743, 0.00979),
    (119, 348, -33.007, 8.616, 38.728, 0.01457),
    (121, 350, -18.207, 14.68, 42.241, 0.01859),
    (127, 356, -77.431, 23.65, -20.052, 0.0052),
    (129, 358, -17.858, -9.783, 48.505, 0.12063),
    (132, 361, -72.709, -28.909, -22.525, 0.00556),
    (133, 362, -18.564, 25.852, 37.579, 0.05329),
    (143, 372, -64.076, 22.36, 15.608, 0.01482),
    (147, 376, -62.349, -19.444, 16.635, 0.01426),
    (198, 420, -12.468, 2.303, 56.81, 0.02546),
    (205, 425, -38.329, -15.373, 41.377, 0.04725),
)  # fmt: skip
PIVOT = (0.0, -30.0, -50.0)  # mm on the canonical face: between the ears, about where skull meets neck
SCALE_SMOOTHING_S = 1.0  # standard deviation; slower than the jaw, faster than movements towards the camera
CAMERA_DISTANCE_MM = 1000.0  # assumed, to convert a change of scale to a movement in depth


@dataclass(frozen=True, slots=True, eq=False)
class PoseFreeLandmarks:
    """Landmarks without head pose, and the pose.

    Parameters
    ----------
    landmarks : (T, 478, 3)
        Millimetres on the canonical face; axes as in `tts2face.models.landmarks`; NaN for frames without a face.
    rotations : (T, 3, 3)
        Rotations from canonical axes to camera axes (x to the left of a person facing the camera, y up, z towards it).
    translations : (T, 3)
        Position of `PIVOT` in mm; x and y relative to the top left corner of the picture, z relative to the median
        distance of the recording.
    """

    landmarks: NDArray[np.float32]
    rotations: NDArray[np.float64]
    translations: NDArray[np.float64]


def remove_pose(points: NDArray[np.floating], fps: float) -> PoseFreeLandmarks:
    """Estimate the head pose of tracked landmarks and remove it.

    Parameters
    ----------
    points : (T, 478, 3)
        Pixels as in `tts2face.video.tracking.Tracking`; NaN for frames without a face.

    Raises
    ------
    InputError
        `points` has another shape or `fps` is not above 0.
    DataError
        There is no frame with a face.

    Notes
    -----
    Rotation: weighted Kabsch on `RIGID_POINTS` for each frame. Scale: least squares for each frame; its logarithm is
    smoothed with zero phase over `SCALE_SMOOTHING_S`, since the size of a face changes only with its distance.
    """
    if points.ndim != 3 or points.shape[1:] != (N_LANDMARKS, 3):
        raise InputError(f"head pose needs points of shape (T, {N_LANDMARKS}, 3), not {points.shape}")
    if not fps > 0:
        raise InputError(f"frames per second must be above 0, not {fps}")
    present = np.isfinite(points).all(axis=(1, 2))
    if not present.any():
        raise DataError("no frame shows a face; check that the camera sees it")
    indices, canonical, weights = rigid_points()
    seen = points[present].astype(np.float64) * (1.0, -1.0, -1.0)
    turns, scales = similarity_transforms(seen[:, indices], canonical, weights)
    scales = _smooth_scales(scales, present, fps)
    centres = np.einsum("n,tni->ti", weights, seen[:, indices])
    anchor = weights @ canonical
    local = np.einsum("tij,tnj->tni", turns, seen - centres[:, None]) * scales[:, None, None] + anchor
    rotations = np.swapaxes(turns, 1, 2)
    shifts = centres * scales[:, None] + rotations @ (np.array(PIVOT) - anchor)
    shifts[:, 2] = CAMERA_DISTANCE_MM * (1.0 - scales / np.median(scales))
    return PoseFreeLandmarks(
        _scatter_rows(local, present).astype(np.float32),
        _scatter_rows(rotations, present),
        _scatter_rows(shifts, present),
    )


def rigid_points() -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]:
    """(N,) landmark indices, (N, 3) positions in mm and (N,) weights with sum 1."""
    right = [(index, (x, y, z), weight) for index, _, x, y, z, weight in RIGID_POINTS]
    left = [(mirrored, (-x, y, z), weight) for index, mirrored, x, y, z, weight in RIGID_POINTS if mirrored != index]
    indices, places, weights = zip(*right, *left, strict=True)
    return np.array(indices), np.array(places), np.array(weights) / sum(weights)


def similarity_transforms(
    source: NDArray[np.float64], target: NDArray[np.float64], weights: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """(T, 3, 3) rotations and (T,) scales that best map (T, N, 3) points to (N, 3) ones, for weights (N,) with sum 1.

    Source: Kabsch 1976; scale after Umeyama 1991, eq. 42.
    """
    source_centred = source - np.einsum("n,tni->ti", weights, source)[:, None]
    target_centred = target - weights @ target
    covariance = np.einsum("n,tni,nj->tij", weights, source_centred, target_centred)
    left, strengths, right = np.linalg.svd(covariance)
    signs = np.ones_like(strengths)
    signs[:, 2] = np.sign(np.linalg.det(left @ right))  # a reflection is no rotation
    rotations = np.einsum("tji,tj,tkj->tik", right, signs, left)
    scales = (strengths * signs).sum(axis=1) / np.einsum("n,tni->t", weights, source_centred**2)
    return rotations, scales


def head_angles(rotations: NDArray[np.floating]) -> NDArray[np.float64]:
    """(T, 3) pitch, yaw, roll in radians of (T, 3, 3) rotations: roll about z first, then pitch about x, then yaw."""
    # rounding may exceed 1
    pitch = -np.arcsin(np.clip(rotations[:, 1, 2], -1.0, 1.0))
    yaw = np.arctan2(rotations[:, 0, 2], rotations[:, 2, 2])
    roll = np.arctan2(rotations[:, 1, 0], rotations[:, 1, 1])
    return np.column_stack([pitch, yaw, roll])


def _smooth_scales(scales: NDArray[np.float64], present: NDArray[np.bool_], fps: float) -> NDArray[np.float64]:
    """Scales of the frames with a face, smoothed over all frames."""
    from scipy.ndimage import gaussian_filter1d

    frames = np.flatnonzero(present)
    filled = np.interp(np.arange(len(present)), frames, np.log(scales))
    smooth: NDArray[np.float64] = gaussian_filter1d(filled, SCALE_SMOOTHING_S * fps, mode="nearest")
    return np.exp(smooth[frames])


def _scatter_rows(values: NDArray[np.float64], present: NDArray[np.bool_]) -> NDArray[np.float64]:
    """(T, ...) array with the given rows for the frames with a face and NaN for all others."""
    rows = np.full((len(present), *values.shape[1:]), np.nan)
    rows[present] = values
    return rows
