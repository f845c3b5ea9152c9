"""Landmarks of a face moved by weights of its shapes."""

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError
from tts2face.face.landmark_fit import landmark_motion, landmark_positions, scatter_landmarks
from tts2face.models.face import Face
from tts2face.models.landmarks import N_LANDMARKS
from tts2face.types import Trajectory

Floats = NDArray[np.float64]


def rest_landmarks(face: Face) -> Floats:
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
    _turn_eyes(face, weights, found)
    return found.astype(np.float32)


def _turn_eyes(face: Face, weights: Floats, landmarks: Floats) -> None:
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
