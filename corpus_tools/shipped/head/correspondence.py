"""Correspondence of landmarks: a table of positions on MakeHuman's skin, the same for every identity.

The table is computed by `corpus_tools.shipped.head.locate`; building a head needs no other data about landmarks.
"""

import csv
from dataclasses import replace
from pathlib import Path

import numpy as np

from lexicon.errors import DataError
from tts2face.models.face import Eye, Face
from tts2face.numeric.arrays import FloatArray, IntArray

TABLE = Path(__file__).with_name("correspondence.csv")
FAR = 0.05  # units of the source; a position further from the skin than this belongs to another mesh
# Centre, then the rim of the iris towards the person's left, the top, the right and the bottom; right eye, left eye.
IRISES = (range(468, 473), range(473, 478))
IRIS_SIDES = np.array([(0, 0), (1, 0), (0, 1), (-1, 0), (0, -1)], np.float64)


def read_places(path: Path = TABLE) -> dict[int, FloatArray]:
    """Position (3,) of each landmark on the skin of the source's base mesh, in its units."""
    try:
        with path.open(encoding="utf-8", newline="") as file:
            rows = list(csv.DictReader(file))
        return {int(row["landmark"]): np.array([float(row[axis]) for axis in "xyz"]) for row in rows}
    except (OSError, KeyError, TypeError, ValueError) as broken:
        raise DataError(
            f"{path} is not a table of landmark,x,y,z; build it again with corpus_tools.shipped.head.locate"
        ) from broken


def write_places(places: dict[int, FloatArray], path: Path = TABLE) -> None:
    """Write the table; six decimals are a tenth of a micrometre."""
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["landmark", "x", "y", "z"])
        writer.writerows([number, *(f"{value:.6f}" for value in place)] for number, place in sorted(places.items()))


def add_landmarks(face: Face, base: FloatArray) -> Face:
    """A face with landmarks: those of the table on the skin, those of the irises on the eyeballs.

    Parameters
    ----------
    face
        Its first vertices are the skin's.
    base : (N, 3)
        Where each vertex of the skin lies on the source's base mesh.
    """
    table = read_places()
    skin = face.triangles[(face.triangles < len(base)).all(axis=1)].astype(np.int64)
    wanted = np.array(list(table.values()))
    triangle, weights, distance = nearest_surface_points(wanted, base, skin)
    if distance.max() > FAR:
        farthest = list(table)[int(distance.argmax())]
        raise DataError(
            f"landmark {farthest} lies {distance.max():.3f} units off the skin; build the table for this mesh"
        )
    numbers, corners, shares = [np.array(list(table))], [skin[triangle]], [weights]
    for eye, iris in zip(sorted(face.eyes, key=lambda eye: float(eye.centre[0])), IRISES, strict=True):
        rows = iris_vertices(face, eye)
        numbers.append(np.array(iris))
        corners.append(np.repeat(rows[:, None], 3, axis=1))
        shares.append(np.tile([1.0, 0.0, 0.0], (len(rows), 1)))
    return replace(
        face,
        landmarks=np.concatenate(numbers).astype(np.int32),
        landmark_vertices=np.concatenate(corners).astype(np.int32),
        landmark_weights=np.concatenate(shares).astype(np.float32),
    )


def iris_vertices(face: Face, eye: Eye) -> IntArray:
    """Vertices (5,) of an eyeball nearest to the middle of its iris and to the four sides of its rim."""
    iris = [face.triangles[part.first : part.first + part.count] for part in face.parts if part.name.startswith("iris")]
    inside = np.unique(np.concatenate(iris)).astype(np.int64)
    inside = inside[(inside >= eye.first) & (inside < eye.first + eye.count)]
    flat = face.vertices[inside, :2] - eye.centre[:2]
    aims = float(np.hypot(*flat.T).max()) * IRIS_SIDES
    nearest = np.linalg.norm(flat[None] - aims[:, None], axis=2).argmin(axis=1)
    return np.asarray(inside[nearest], np.int64)


def nearest_surface_points(
    points: FloatArray, vertices: FloatArray, triangles: IntArray
) -> tuple[IntArray, FloatArray, FloatArray]:
    """Triangle (P,), barycentric weights (P, 3) and distance (P,) of the surface point nearest to each point.

    Source: Ericson 2005, Real-Time Collision Detection, section 5.1.5 (closest point on a triangle).
    """
    found = [_nearest_point(point, vertices[triangles]) for point in points]
    numbers = np.array([number for number, _ in found], np.int64)
    weights = np.array([weight for _, weight in found])
    there = np.einsum("pk,pkd->pd", weights, vertices[triangles[numbers]])
    return numbers, weights, np.linalg.norm(there - points, axis=1)


def _nearest_point(point: FloatArray, corners: FloatArray) -> tuple[int, FloatArray]:
    """Index of the nearest of the triangles (F, 3, 3), and the barycentric weights (3,) of its nearest point."""
    first, second, third = corners[:, 0], corners[:, 1], corners[:, 2]
    edges = [(0, 1, first, second), (1, 2, second, third), (2, 0, third, first)]
    inner = _plane_weights(point, corners)
    is_inside = (inner >= 0).all(axis=1)
    candidates = [np.where(is_inside.reshape(-1, 1), inner, np.nan)]
    for a, b, start, end in edges:
        along = end - start
        length = np.maximum((along**2).sum(axis=1), 1e-30)
        share = np.clip(((point - start) * along).sum(axis=1) / length, 0.0, 1.0)
        weights = np.zeros((len(corners), 3))
        weights[:, a], weights[:, b] = 1.0 - share, share
        candidates.append(weights)
    weights = np.stack(candidates)
    gaps = np.linalg.norm(np.einsum("cfk,fkd->cfd", weights, corners) - point, axis=2)
    kind, number = np.unravel_index(np.nanargmin(gaps), gaps.shape)
    return int(number), weights[kind, number]


def _plane_weights(point: FloatArray, corners: FloatArray) -> FloatArray:
    """(F, 3) barycentric weights of a point's orthogonal projection onto each triangle's plane."""
    u, v, there = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0], point - corners[:, 0]
    d11, d12, d22 = (u * u).sum(axis=1), (u * v).sum(axis=1), (v * v).sum(axis=1)
    d1, d2 = (there * u).sum(axis=1), (there * v).sum(axis=1)
    area = np.maximum(d11 * d22 - d12 * d12, 1e-30)
    second, third = (d22 * d1 - d12 * d2) / area, (d11 * d2 - d12 * d1) / area
    return np.stack([1.0 - second - third, second, third], axis=1)
