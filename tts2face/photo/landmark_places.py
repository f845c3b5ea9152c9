"""Landmarks of a photographed face on its vertices."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from tts2face.models.landmarks import INNER_LIP_LOWER, INNER_LIP_UPPER, N_LANDMARKS
from tts2face.photo.eye_pictures import IRISES, EyePatch
from tts2face.photo.lid_lines import LID_MARGINS, N_LID
from tts2face.photo.lip_line import N_POINTS
from tts2face.photo.photo_mesh import PhotoMesh

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


def place_landmarks(
    mesh: PhotoMesh, landmarks: Floats, eyes: Sequence[tuple[EyePatch, Ints]]
) -> tuple[NDArray[np.int32], NDArray[np.float32]]:
    """Three vertices (478, 3) and their weights for each landmark (478, 2 or more), pixels.

    Eyes are given with the numbers of their vertices.
    """
    corners, weights = np.zeros((N_LANDMARKS, 3), np.int32), np.tile(np.array([1, 0, 0], np.float32), (N_LANDMARKS, 1))
    own = _vertices(mesh)
    for number in range(N_LANDMARKS):
        place = landmarks[number, :2]
        eye = next((eye for eye, iris in enumerate(IRISES) if number in iris), None)
        if number in own:
            corners[number] = own[number]
        elif eye is None:
            corners[number], weights[number] = _triangle_around(place, mesh.places, mesh.triangles)
        else:
            patch, vertices = eyes[eye]
            at, weights[number] = _triangle_around(place, patch.places, patch.triangles)
            corners[number] = vertices[at]
    return corners, weights


def _vertices(mesh: PhotoMesh) -> Mapping[int, int]:
    """Vertices that are landmarks: their own, and those of lips and lids on the lines through them."""
    lines: list[tuple[Ints, Sequence[int], int]] = [
        (mesh.upper_lip, INNER_LIP_UPPER, (N_POINTS - 1) // (len(INNER_LIP_UPPER) - 1)),
        (mesh.lower_lip, INNER_LIP_LOWER, (N_POINTS - 1) // (len(INNER_LIP_LOWER) - 1)),
    ]
    for upper, lower, lids in zip(mesh.upper_lids, mesh.lower_lids, LID_MARGINS, strict=True):
        lines += [
            (line, numbers, (N_LID - 1) // (len(numbers) - 1))
            for line, numbers in zip((upper, lower), lids, strict=True)
        ]
    on_lines = {int(number): int(line[k * step]) for line, numbers, step in lines for k, number in enumerate(numbers)}
    return mesh.vertex_of | on_lines


def _triangle_around(place: Floats, places: Floats, triangles: Ints) -> tuple[Ints, Floats]:
    """Corners (3,) of the triangle around a place (2,), or nearest to it, and the weights of the place in it."""
    a, b, c = (places[triangles[:, k]] for k in range(3))
    first, second, off = b - a, c - a, place - a
    area = first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]
    area = np.where(np.abs(area) < 1e-12, 1e-12, area)
    along = (off[:, 0] * second[:, 1] - off[:, 1] * second[:, 0]) / area
    across = (first[:, 0] * off[:, 1] - first[:, 1] * off[:, 0]) / area
    weights = np.stack([1 - along - across, along, across], axis=1)
    best = int(weights.min(axis=1).argmax())
    inside = np.clip(weights[best], 0, None)
    return triangles[best], inside / inside.sum()
