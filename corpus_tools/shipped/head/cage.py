"""The control cage of one identity: MakeHuman's vertices and face units in millimetres about the eyes."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from corpus_tools.shipped.head.source import SourceMesh
from tts2face.numeric.arrays import FloatArray, nearest_rotation

SCALE = 107.6  # mm per unit of the source, a decimetre: the default identity gets 62 mm between the eyes
SIDES = ("l", "r")  # the person's own left has x > 0


@dataclass(frozen=True, slots=True, eq=False)
class Cage:
    """Vertices (N, 3) of one identity and displacements (N, 3) of its shapes by name; mm, origin between the eyes."""

    source: SourceMesh
    vertices: FloatArray
    units: Mapping[str, FloatArray]

    def group(self, name: str) -> NDArray[np.int64]:
        """Vertex indices of a group of the source mesh."""
        return np.unique(self.source.groups[name].corners)


def build_cage(source: SourceMesh, targets: Mapping[str, float]) -> Cage:
    """The control cage of the source mesh with weighted targets."""
    vertices = source.vertices.copy()
    for name, weight in targets.items():
        vertices += weight * source.target(name)
    vertices *= SCALE
    eyes = [fit_sphere(vertices[np.unique(source.groups[f"helper-{side}-eye"].corners)])[0] for side in SIDES]
    units = {name: SCALE * moved for name, moved in source.face_units().items()}
    return Cage(source, vertices - np.mean(eyes, axis=0), units)


def fit_sphere(points: FloatArray) -> tuple[FloatArray, float]:
    """Centre and radius of the least-squares sphere through points (algebraic distance)."""
    rows = np.column_stack([2.0 * points, np.ones(len(points))])
    solution = np.linalg.lstsq(rows, (points**2).sum(axis=1), rcond=None)[0]
    return solution[:3], float(np.sqrt(solution[3] + solution[:3] @ solution[:3]))


def fit_rotation(before: FloatArray, after: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Least-squares rotation (3, 3) and translation (3,) from points to their new positions (Kabsch 1976)."""
    middle, there = before.mean(axis=0), after.mean(axis=0)
    rotation = nearest_rotation((before - middle).T @ (after - there)).T
    return rotation, there - rotation @ middle
