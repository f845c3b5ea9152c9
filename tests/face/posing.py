"""Vertices of a posed face in plain numpy."""

import numpy as np
from numpy.typing import NDArray

from tts2face.face.deformation import rotation_matrix
from tts2face.models.face import Face


def posed_vertices(face: Face, weights: NDArray[np.floating]) -> NDArray[np.float32]:
    """Vertices (V, 3) of a face, mm, for shape weights (K,), with the head at rest.

    Plain numpy, to compare with the compiled `tts2face.face.deformation`.
    """
    weights = np.asarray(weights, np.float64)
    vertices = face.vertices + np.tensordot(weights, face.shapes, axes=1)
    for eye in face.eyes:
        turn = np.zeros(3)
        for name, per_weight in eye.turns.items():
            turn += weights[face.shape_names.index(name)] * per_weight
        span = slice(eye.first, eye.first + eye.count)
        vertices[span] = (vertices[span] - eye.centre) @ rotation_matrix(turn).T + eye.centre
    return vertices.astype(np.float32)
