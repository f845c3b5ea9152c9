"""Landmarks of a face: their positions, their motion by weights of its shapes, and the fit of one set to another."""

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError
from tts2face.models.face import Face
from tts2face.models.landmarks import N_LANDMARKS
from tts2face.numeric.arrays import FloatArray, nearest_rotation
from tts2face.processes.shared import shared
from tts2face.types import Trajectory

DIGITS = 9  # decimals kept: the last bits of LAPACK's results depend on its threads


def landmark_positions(face: Face) -> FloatArray:
    """Landmarks (L, 3) of a face at rest, mm, in the order of `Face.landmarks`."""
    mixed = face.landmark_weights.astype(np.float64)[..., None]
    places: FloatArray = (face.vertices[face.landmark_vertices] * mixed).sum(axis=1)
    return places


def landmark_motion(face: Face, shapes: NDArray[np.integer]) -> FloatArray:
    """Landmark motion (L, 3, k) per weight of the shapes with indices `shapes` (k,), mm."""
    return np.ascontiguousarray(np.moveaxis(_landmark_moves(face)[np.asarray(shapes)], 0, -1))


@shared
def _landmark_moves(face: Face) -> FloatArray:
    """Landmark motion (K, L, 3) per weight of all shapes, mm; a face that is prepared needs it eight times."""
    mixed = face.landmark_weights.astype(np.float64)[..., None]
    moves: FloatArray = (face.shapes[:, face.landmark_vertices] * mixed).sum(axis=2)
    moves.setflags(write=False)
    return moves


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


def rest_landmarks(face: Face) -> FloatArray:
    """(478, 3) landmarks of a face at rest, mm.

    Raises
    ------
    DataError
        The face has not all of them.
    """
    if sorted(face.landmarks.tolist()) != list(range(N_LANDMARKS)):
        raise DataError(f"the face has {len(face.landmarks)} of {N_LANDMARKS} landmarks; build it with all of them")
    return scatter_landmarks(face, landmark_positions(face))


def moved_landmarks(face: Face, motion: Trajectory) -> NDArray[np.float32]:
    """(T, 478, 3) landmarks of a face, mm, for weights (T, K) of its first K shapes; its eyes turn.

    Raises
    ------
    DataError
        The face has not all landmarks, or the weights are not of its shapes.
    """
    n = len(motion.channels)
    if motion.channels != face.shape_names[:n]:
        raise DataError("the weights are not for the shapes of this face; retarget them to it first")
    weights = motion.values.astype(np.float64)
    moves = scatter_landmarks(face, landmark_motion(face, np.arange(n)))
    found = rest_landmarks(face) + np.tensordot(weights, moves, axes=(1, 2))
    _turn_eye_landmarks(face, weights, found)
    return found.astype(np.float32)


def _turn_eye_landmarks(face: Face, weights: FloatArray, landmarks: FloatArray) -> None:
    """Turn those landmarks (T, 478, 3) that lie on eyeballs."""
    from scipy.spatial.transform import Rotation

    for eye in face.eyes:
        on_it = ((face.landmark_vertices >= eye.first) & (face.landmark_vertices < eye.first + eye.count)).all(axis=1)
        known = [name for name in eye.turns if name in face.shape_names[: weights.shape[1]]]
        if not on_it.any() or not known:
            continue
        columns = [face.shape_names.index(name) for name in known]
        turns = weights[:, columns] @ np.array([eye.turns[name] for name in known], np.float64)
        rows = face.landmarks[on_it]
        about = Rotation.from_rotvec(turns).as_matrix()
        landmarks[:, rows] = np.einsum("tij,tlj->tli", about, landmarks[:, rows] - eye.centre) + eye.centre
