"""Where the landmarks of a face lie, how its shapes move them, and how faces lie to each other."""

import numpy as np
from numpy.typing import NDArray

from tts2face.models.face import Face
from tts2face.models.landmarks import N_LANDMARKS

FloatArray = NDArray[np.float64]

N_SKIN = 468  # landmarks from here on lie on the irises
DIGITS = 9  # the last bits of LAPACK's results depend on its threads


def landmark_positions(face: Face) -> FloatArray:
    """(L, 3) landmarks of a face at rest, mm, in the order of `Face.landmarks`."""
    mixed = face.landmark_weights.astype(np.float64)[..., None]
    places: FloatArray = (face.vertices[face.landmark_vertices] * mixed).sum(axis=1)
    return places


def landmark_motion(face: Face, shapes: NDArray[np.integer]) -> FloatArray:
    """(L, 3, k) motion of the landmarks per weight of the numbered shapes, mm."""
    mixed = face.landmark_weights.astype(np.float64)[..., None]
    return np.stack([(face.shapes[k][face.landmark_vertices] * mixed).sum(axis=1) for k in shapes], axis=-1)


def scatter_landmarks(face: Face, values: FloatArray) -> FloatArray:
    """(478, ...) values (L, ...) of a face's landmarks by their numbers; NaN where the face lacks one."""
    spread: FloatArray = np.full((N_LANDMARKS, *values.shape[1:]), np.nan)
    spread[face.landmarks] = values
    return spread


def procrustes_rotation(source: FloatArray, target: FloatArray) -> FloatArray:
    """(3, 3) rotation that brings places (N, 3) nearest to others, up to shift and size (orthogonal Procrustes)."""
    inertia = np.einsum("nc,nd->cd", source - source.mean(axis=0), target - target.mean(axis=0))
    left, _, right = np.linalg.svd(inertia)
    mirror = np.diag([1.0, 1.0, np.sign(np.linalg.det(left @ right))])
    turn: FloatArray = np.round((left @ mirror @ right).T, DIGITS)
    return turn


def axis_scales(source: FloatArray, target: FloatArray, bounds: tuple[float, float]) -> FloatArray:
    """(3,) factors s of the least-squares fit ``target = s * source + shift``, axis by axis, held within bounds."""
    from_middle, to_middle = source - source.mean(axis=0), target - target.mean(axis=0)
    scales = (from_middle * to_middle).sum(axis=0) / np.maximum((from_middle**2).sum(axis=0), 1e-12)
    held: FloatArray = np.round(np.clip(scales, *bounds), DIGITS)
    return held
