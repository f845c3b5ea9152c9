"""The skin: MakeHuman's head after one step of subdivision."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from corpus_tools.shipped.head.cage import Cage
from corpus_tools.shipped.head.subdivision import catmull_clark
from tts2face.numeric.arrays import FloatArray

LOWEST, WIDEST = 4.1, 3.2  # of the bust, in units of the source
NECK_Y, NECK_SLOPE = 5.80, -0.272  # the head ends below this plane, under the shirt's collar
HEAD_WIDEST = 1.2  # half the width of head and neck; arms are further out
SHOULDER_Y = 6.35  # the bust ends above this
SOCKET_U, SOCKET_Z = 0.2, 1.30  # MakeHuman's islands of the sockets; parts further back are behind the eyeballs


@dataclass(frozen=True, slots=True, eq=False)
class HeadSkin:
    """The subdivided head.

    Parameters
    ----------
    vertices : (N, 3)
        mm; split along texture seams.
    shapes
        Displacement (N, 3) by name.
    quads : (F, 4)
    source_uv : (N, 2)
        Texture coordinates in MakeHuman's own layout, v up.
    base : (N, 3)
        Position of each vertex on the source's base mesh, the same for every identity.
    corrections
        Displacements (N, 3) added to shapes, by name; lashes follow them.
    """

    vertices: FloatArray
    shapes: Mapping[str, FloatArray]
    quads: NDArray[np.int64]
    source_uv: FloatArray
    base: FloatArray
    corrections: Mapping[str, FloatArray] = field(default_factory=dict)


def build_skin(cage: Cage) -> HeadSkin:
    """Head and neck of a cage after one Catmull-Clark step."""
    body = cage.source.groups["body"]
    places, where = cage.source.vertices[body.corners], cage.source.uv[body.uv_corners]
    kept: NDArray[np.bool_] = np.any(places[:, :, 1] - NECK_SLOPE * places[:, :, 2] > NECK_Y, axis=1)
    kept &= np.all((np.abs(places[:, :, 0]) < HEAD_WIDEST) & (places[:, :, 1] > LOWEST), axis=1)
    kept &= ~np.all((where[:, :, 0] < SOCKET_U) & (places[:, :, 2] < SOCKET_Z), axis=1)
    return _subdivide(cage, kept)


def build_shoulders(cage: Cage) -> HeadSkin:
    """Neck and shoulders of a cage, under the shirt."""
    places = cage.source.vertices[cage.source.groups["body"].corners]
    inside = (places[:, :, 1] > LOWEST) & (places[:, :, 1] < SHOULDER_Y) & (np.abs(places[:, :, 0]) < WIDEST)
    kept: NDArray[np.bool_] = np.all(inside, axis=1)
    return _subdivide(cage, kept)


def _subdivide(cage: Cage, kept: NDArray[np.bool_]) -> HeadSkin:
    body = cage.source.groups["body"]
    used, quads = np.unique(body.corners[kept], return_inverse=True)
    matrix, fine = catmull_clark(len(used), quads.reshape(-1, 4))
    fine_uv = _subdivide_coordinates(cage.source.uv[body.uv_corners[kept]])
    keys = np.column_stack([fine.ravel(), np.rint(fine_uv.reshape(-1, 2) * 1e6).astype(np.int64)])
    _, first, corner = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    rows = fine.ravel()[first]
    split = matrix[rows]
    return HeadSkin(
        vertices=split @ cage.vertices[used],
        shapes={name: split @ moved[used] for name, moved in cage.units.items()},
        quads=corner.reshape(-1, 4).astype(np.int64),
        source_uv=fine_uv.reshape(-1, 2)[first],
        base=split @ cage.source.vertices[used],
    )


def _subdivide_coordinates(corners: FloatArray) -> FloatArray:
    """(4 F, 4, 2) texture coordinates of quads split in four as in `catmull_clark`."""
    after = (corners + np.roll(corners, -1, axis=1)) / 2
    centre = corners.mean(axis=1)
    new = [np.stack([corners[:, k], after[:, k], centre, after[:, k - 1]], axis=1) for k in range(4)]
    return np.stack(new, axis=1).reshape(-1, 4, 2)


def vertex_normals(vertices: FloatArray, quads: NDArray[np.int64], base: FloatArray) -> FloatArray:
    """(N, 3) unit normals; vertices on a seam share one."""
    diagonals = vertices[quads[:, 2]] - vertices[quads[:, 0]], vertices[quads[:, 3]] - vertices[quads[:, 1]]
    faces = np.cross(*diagonals)
    _, weld = np.unique(np.rint(base * 1e6).astype(np.int64), axis=0, return_inverse=True)
    weld = weld.ravel()
    total = np.zeros((int(weld.max()) + 1, 3))
    for corner in quads.T:
        np.add.at(total, weld[corner], faces)
    unit: FloatArray = (total / np.maximum(np.linalg.norm(total, axis=1, keepdims=True), 1e-12))[weld]
    return unit
