"""Catmull-Clark subdivision of a quad mesh as a matrix, which also applies to shapes and texture coordinates.

The control cage of one identity: MakeHuman's vertices and face units in millimetres about the eyes.

Smooth random fields over points in space, for colours without seams.

The texture layout: MakeHuman's, with the head enlarged so that eyes, nose and mouth get most pixels.

Pieces of a head, and their assembly into a `Face`.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.ndimage import map_coordinates

from corpus_tools.dense.texels import ISLANDS_TOP
from corpus_tools.shipped.head.source import SourceMesh
from tts2face.models.face import Eye, Face, FacePart, Texture
from tts2face.numeric.arrays import nearest_rotation, unit_vectors


def catmull_clark(n_vertices: int, quads: NDArray[np.integer]) -> tuple[sparse.csr_array, NDArray[np.int64]]:
    """One step: new points = matrix @ points.

    Parameters
    ----------
    quads : (F, 4)
        Every vertex belongs to at least one.

    Returns
    -------
    matrix : (V + E + F, V)
        Rows: old vertices, then edges, then faces; each sums to 1.
    quads : (4 F, 4)
        Quad ``4 f + k`` holds corner k of face f as its first corner.

    Notes
    -----
    On the border a vertex and its edges follow the cubic B-spline of the border alone. Source: Catmull and Clark 1978.
    """
    n_faces = len(quads)
    edges, edge_of = _edges(quads)
    n_edges = len(edges)
    face_of = np.repeat(np.arange(n_faces), 4)
    face_points = _averages(face_of, quads.ravel(), (n_faces, n_vertices))
    midpoints = _averages(np.repeat(np.arange(n_edges), 2), edges.ravel(), (n_edges, n_vertices))
    beside = _averages(edge_of, face_of, (n_edges, n_faces)) @ face_points
    is_inner = np.bincount(edge_of, minlength=n_edges) == 2
    edge_points = _scale_rows(np.where(is_inner, 0.5, 1.0), midpoints) + _scale_rows(
        np.where(is_inner, 0.5, 0.0), beside
    )
    rim = edges[~is_inner]
    on_rim = np.zeros(n_vertices, bool)
    on_rim[rim] = True
    valence = np.bincount(edges.ravel(), minlength=n_vertices).astype(float)
    same = sparse.eye_array(n_vertices, format="csr")
    faces_around = _averages(quads.ravel(), face_of, (n_vertices, n_faces)) @ face_points
    edges_around = _averages(edges.ravel(), np.repeat(np.arange(n_edges), 2), (n_vertices, n_edges)) @ midpoints
    inner = _scale_rows(~on_rim / valence, faces_around + 2.0 * edges_around) + _scale_rows(
        ~on_rim * (1 - 3 / valence), same
    )
    along = sparse.csr_array((np.full(2 * len(rim), 0.125), (rim.ravel(), rim[:, ::-1].ravel())), shape=same.shape)
    matrix = sparse.vstack([inner + _scale_rows(0.75 * on_rim, same) + along, edge_points, face_points], format="csr")
    edge_at = n_vertices + edge_of.reshape(-1, 4)  # of side k, from corner k to k + 1
    centre = n_vertices + n_edges + np.arange(n_faces)
    new = [np.stack([quads[:, k], edge_at[:, k], centre, edge_at[:, k - 1]], axis=1) for k in range(4)]
    return matrix, np.stack(new, axis=1).reshape(-1, 4).astype(np.int64)


def triangulate(quads: NDArray[np.integer]) -> NDArray[np.int64]:
    """(2 F, 3) triangles of (F, 4) quads, with the same winding."""
    return np.stack([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]], axis=1).reshape(-1, 3).astype(np.int64)


def grid_triangles(n_rows: int, n_columns: int, *, is_closed: bool = False) -> NDArray[np.int64]:
    """(F, 3) triangles of a surface stored row by row; a closed one joins its last column to its first."""
    steps = n_columns if is_closed else n_columns - 1
    row, column = (grid.ravel() for grid in np.meshgrid(np.arange(n_rows - 1), np.arange(steps), indexing="ij"))
    here, beside = row * n_columns + column, row * n_columns + (column + 1) % n_columns
    return np.concatenate(
        [
            np.stack([here, beside, beside + n_columns], axis=1),
            np.stack([here, beside + n_columns, here + n_columns], axis=1),
        ]
    ).astype(np.int64)


def _edges(quads: NDArray[np.integer]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Edges (E, 2) and the edge of each side of each quad (4 F,)."""
    sides = np.stack([quads, np.roll(quads, -1, axis=1)], axis=-1).reshape(-1, 2)
    edges, edge_of = np.unique(np.sort(sides, axis=1), axis=0, return_inverse=True)
    return edges.astype(np.int64), edge_of.ravel()


def _averages(rows: NDArray[np.integer], columns: NDArray[np.integer], shape: tuple[int, int]) -> sparse.csr_array:
    """Matrix whose rows average their columns."""
    counts = np.bincount(rows, minlength=shape[0])
    return sparse.csr_array((1.0 / counts[rows], (rows, columns)), shape=shape)


def _scale_rows(factors: NDArray[np.floating], matrix: sparse.csr_array) -> sparse.csr_array:
    scaled: sparse.csr_array = sparse.diags_array(factors.astype(float)) @ matrix
    return scaled


Floats = NDArray[np.float64]

SCALE = 107.6  # mm per unit of the source, a decimetre: the default identity gets 62 mm between the eyes
SIDES = ("l", "r")  # the person's own left has x > 0


@dataclass(frozen=True, slots=True, eq=False)
class Cage:
    """Vertices (N, 3) of one identity and displacements (N, 3) of its shapes by name; mm, origin between the eyes."""

    source: SourceMesh
    vertices: Floats
    units: Mapping[str, Floats]

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


def fit_sphere(points: Floats) -> tuple[Floats, float]:
    """Centre and radius of the least-squares sphere through points (algebraic distance)."""
    rows = np.column_stack([2.0 * points, np.ones(len(points))])
    solution = np.linalg.lstsq(rows, (points**2).sum(axis=1), rcond=None)[0]
    return solution[:3], float(np.sqrt(solution[3] + solution[:3] @ solution[:3]))


def fit_rotation(before: Floats, after: Floats) -> tuple[Floats, Floats]:
    """Least-squares rotation (3, 3) and translation (3,) from points to their new positions (Kabsch 1976)."""
    middle, there = before.mean(axis=0), after.mean(axis=0)
    rotation = nearest_rotation((before - middle).T @ (after - there)).T
    return rotation, there - rotation @ middle


SIZE = 32  # lattice points along each axis; the field is periodic


def value_noise(points: Floats, size_mm: float, generator: np.random.Generator) -> Floats:
    """(P,) value noise of about -1..1 with features of about `size_mm`, at points (P, 3) in mm."""
    lattice = generator.standard_normal((SIZE, SIZE, SIZE))
    field = map_coordinates(lattice, (points / size_mm).T % SIZE, order=1, mode="grid-wrap")
    return np.clip(field / 1.2, -2, 2)


def gaussian_bump(points: Floats, centre: tuple[float, ...], reach: tuple[float, ...]) -> Floats:
    """(P,) Gaussian with value 1 at the centre, symmetric in x."""
    mirrored = np.column_stack([np.abs(points[:, 0]), points[:, 1:]])[:, : len(centre)]
    falling: Floats = np.exp(-(((mirrored - np.array(centre)) / np.array(reach)) ** 2).sum(axis=1))
    return falling


SIDE = 1280  # pixels of the square texture
HEAD_BOTTOM = 0.80  # v at which the rows of the head end; the other islands begin at `ISLANDS_TOP`
# Where MakeHuman's layout has the head, and within it the face from brows to chin and from eye to eye.
HEAD_BOX = ((0.638, 0.997), (0.145, 0.822))
FACE = ((0.872, 0.055), (0.4835, 0.085))  # centre and half width along u and v
FACE_GAIN = 4.0
ISLANDS = {  # box in MakeHuman's layout -> box in this one, both (u low, u high, v low, v high)
    "mouth": ((0.75, 0.93, 0.0, 0.14), (0.005, 0.235, ISLANDS_TOP, 0.995)),
    "neck": ((0.15, 0.62, 0.80, 1.0), (0.245, 0.695, ISLANDS_TOP, 0.995)),
    "sockets": ((0.008, 0.155, 0.54, 0.64), (0.705, 0.995, ISLANDS_TOP, 0.995)),
}


def layout_coordinates(source_uv: Floats) -> Floats:
    """(N, 2) texture coordinates, v down, for MakeHuman's (N, 2), v up."""
    u, v = source_uv[:, 0], source_uv[:, 1]
    placed = np.column_stack([_stretch(u, HEAD_BOX[0], FACE[0]), HEAD_BOTTOM * (1 - _stretch(v, HEAD_BOX[1], FACE[1]))])
    for (low_u, high_u, low_v, high_v), (left, right, top, bottom) in ISLANDS.values():
        inside = (u > low_u) & (u < high_u) & (v > low_v) & (v < high_v)
        across = left + (u - low_u) / (high_u - low_u) * (right - left)
        down = bottom - (v - low_v) / (high_v - low_v) * (bottom - top)
        placed[inside] = np.column_stack([across, down])[inside]
    return placed


def _stretch(values: Floats, box: tuple[float, float], face: tuple[float, float]) -> Floats:
    """A box mapped monotonically to 0..1, with a higher density about the face's centre."""
    grid = np.linspace(box[0], box[1], 2001)
    density = 1.0 + FACE_GAIN * np.exp(-(((grid - face[0]) / face[1]) ** 4))
    share = np.concatenate([[0], np.cumsum((density[1:] + density[:-1]) / 2)])
    placed: Floats = np.interp(values, grid, share / share[-1])
    return placed


@dataclass(frozen=True, slots=True, eq=False)
class MaterialSpan:
    """Triangles (F, 3) of one material within a piece; `material` holds the keyword arguments of `FacePart`."""

    name: str
    triangles: NDArray[np.int64]
    material: Mapping[str, Any]


@dataclass(frozen=True, slots=True, eq=False)
class HeadPart:
    """Vertices (N, 3) in mm, colours (N, 3) in 0..1, shapes by name (N, 3), texture coordinates (N, 2) or None.

    ``tangents`` (N, 3) are unit vectors along strands, or None.
    """

    vertices: Floats
    spans: tuple[MaterialSpan, ...]
    colours: Floats
    shapes: Mapping[str, Floats] = field(default_factory=dict)
    uv: Floats | None = None
    tangents: Floats | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Eyeball:
    """An eyeball: centre (3,), radius in mm, and its turns by gaze shape, rotation vectors (3,) in radians.

    ``iris`` and ``pupil`` are half angles seen from the centre, radians; ``bulge`` is the cornea's height in radii.
    """

    centre: Floats
    radius: float
    turns: Mapping[str, Floats]
    iris: float
    pupil: float
    bulge: float


@dataclass(frozen=True, slots=True, eq=False)
class HeadPieces:
    """The pieces of a head; pieces `eye_pieces` are the eyeballs `balls`."""

    pieces: tuple[HeadPart, ...]
    eye_pieces: tuple[int, ...]
    balls: tuple[Eyeball, ...]
    pivot: Floats


def stack_vertices(built: HeadPieces) -> Floats:
    """(V, 3) vertices of all pieces in order."""
    return np.concatenate([piece.vertices for piece in built.pieces])


def assemble_face(
    built: HeadPieces, shape_names: Sequence[str], textures: tuple[Texture, ...], metadata: Mapping[str, Any]
) -> Face:
    """The face of the pieces, without landmarks."""
    firsts = np.cumsum([0, *(len(piece.vertices) for piece in built.pieces)])
    triangles, parts = _parts(built, firsts)
    shapes = np.zeros((len(shape_names), int(firsts[-1]), 3), np.float32)
    uv, tangents = np.zeros((int(firsts[-1]), 2), np.float32), np.zeros((int(firsts[-1]), 3), np.float32)
    for first, piece in zip(firsts, built.pieces, strict=False):
        here = slice(first, first + len(piece.vertices))
        for name, moved in piece.shapes.items():
            shapes[shape_names.index(name), here] = moved
        if piece.uv is not None:
            uv[here] = piece.uv
        if piece.tangents is not None:
            tangents[here] = unit_vectors(piece.tangents)
    colours = np.concatenate([piece.colours for piece in built.pieces])
    return Face(
        vertices=stack_vertices(built).astype(np.float32),
        triangles=triangles,
        parts=tuple(parts),
        shape_names=tuple(shape_names),
        shapes=shapes,
        limits=np.tile(np.array([0.0, 1.0], np.float32), (len(shape_names), 1)),
        eyes=tuple(_eyes(built, firsts)),
        colours=np.rint(np.clip(colours, 0, 1) * 255).astype(np.uint8),
        uv=uv,
        textures=textures,
        tangents=tangents,
        landmarks=np.zeros(0, np.int32),
        landmark_vertices=np.zeros((0, 3), np.int32),
        landmark_weights=np.zeros((0, 3), np.float32),
        pivot=built.pivot.astype(np.float32),
        metadata=dict(metadata),
    )


def _parts(built: HeadPieces, firsts: NDArray[np.integer]) -> tuple[NDArray[np.int32], list[FacePart]]:
    triangles, parts, begin = [], [], 0
    for first, piece in zip(firsts, built.pieces, strict=False):
        for span in piece.spans:
            triangles.append(span.triangles + first)
            parts.append(FacePart(span.name, begin, len(span.triangles), **span.material))
            begin += len(span.triangles)
    return np.concatenate(triangles).astype(np.int32), parts


def _eyes(built: HeadPieces, firsts: NDArray[np.integer]) -> list[Eye]:
    eyes = []
    for at, ball in zip(built.eye_pieces, built.balls, strict=True):
        turns = {name: turn.astype(np.float32) for name, turn in ball.turns.items()}
        count = len(built.pieces[at].vertices)
        eyes.append(Eye(int(firsts[at]), count, ball.centre.astype(np.float32), turns))
    return eyes
