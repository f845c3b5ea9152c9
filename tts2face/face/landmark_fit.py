"""Landmark positions and motion of a face, and alignment of two sets of landmarks."""

import numpy as np
from numpy.typing import NDArray

from tts2face.models.face import Face
from tts2face.models.landmarks import N_LANDMARKS
from tts2face.numeric import nearest_rotation

FloatArray = NDArray[np.float64]

DIGITS = 9  # decimals kept: the last bits of LAPACK's results depend on its threads


def landmark_positions(face: Face) -> FloatArray:
    """Landmarks (L, 3) of a face at rest, mm, in the order of `Face.landmarks`."""
    mixed = face.landmark_weights.astype(np.float64)[..., None]
    places: FloatArray = (face.vertices[face.landmark_vertices] * mixed).sum(axis=1)
    return places


def landmark_motion(face: Face, shapes: NDArray[np.integer]) -> FloatArray:
    """Landmark motion (L, 3, k) per weight of the shapes with indices `shapes` (k,), mm."""
    mixed = face.landmark_weights.astype(np.float64)[..., None]
    moved = face.shapes[np.asarray(shapes)[:, None, None], face.landmark_vertices]
    return np.ascontiguousarray(np.moveaxis((moved * mixed).sum(axis=2), 0, -1))


def scatter_landmarks(face: Face, values: FloatArray) -> FloatArray:
    """Values (L, ...) of a face's landmarks in an array (478, ...) by landmark index; NaN for missing landmarks."""
    spread: FloatArray = np.full((N_LANDMARKS, *values.shape[1:]), np.nan)
    spread[face.landmarks] = values
    return spread


def procrustes_rotation(source: FloatArray, target: FloatArray) -> FloatArray:
    """Rotation (3, 3) of points (N, 3) that fits the target best, up to translation and scale (Procrustes)."""
    inertia = np.einsum("nc,nd->cd", source - source.mean(axis=0), target - target.mean(axis=0))
    turn: FloatArray = np.round(nearest_rotation(inertia).T, DIGITS)
    return turn


def axis_scales(source: FloatArray, target: FloatArray, bounds: tuple[float, float]) -> FloatArray:
    """Factors s (3,) of the least-squares fit ``target = s * source + shift`` per axis, clipped to `bounds`."""
    clipped: FloatArray = np.clip(axis_ratios(source, target), *bounds).round(DIGITS)
    return clipped


def axis_ratios(source: NDArray[np.floating], target: NDArray[np.floating]) -> FloatArray:
    """Factors s (3,) of the least-squares fit ``target = s * source + shift`` per axis."""
    here, there = (np.asarray(points, np.float64) for points in (source, target))
    here, there = here - here.mean(axis=0), there - there.mean(axis=0)
    ratios: FloatArray = (here * there).sum(axis=0) / np.maximum((here**2).sum(axis=0), 1e-12)
    return ratios
