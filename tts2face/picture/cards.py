"""Cards of hair, lashes and brows in the arrays that the kernels take."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tts2face.models.face import Face
from tts2face.numeric.arrays import unit_vectors
from tts2face.picture.kernels.tones import linear_light

SKULL_CENTRE_MM = np.array([0.0, 20.0, -75.0])  # middle of the skull, from midway between the eyes
STRAND_GLOSS = 0.25  # specular of a part of strands at which its highlights are those of hair


@dataclass(frozen=True, slots=True, eq=False)
class Strands:
    """Hair, lashes and brows.

    ``vertices`` (S,) of the face; ``triangles`` (F, 3) as rows of them; ``neighbours`` (F, 3)
    the triangle across the edge opposite to each corner, -1 at borders; ``texture`` and ``gloss`` (F,); ``tangents``
    and ``uv`` (S, 3), (S, 2); ``outward`` (S, 3) from the middle of the skull; ``mean_light`` (T,) of the textures.
    """

    vertices: NDArray[np.int32]
    triangles: NDArray[np.int32]
    neighbours: NDArray[np.int32]
    texture: NDArray[np.int32]
    gloss: NDArray[np.float32]
    tangents: NDArray[np.float32]
    uv: NDArray[np.float32]
    outward: NDArray[np.float32]
    mean_light: NDArray[np.float32]


def find_strands(
    face: Face, triangles: NDArray[np.int32], is_strand: NDArray[np.bool_], packed: tuple[Any, Any]
) -> Strands:
    """Strands of a face; `packed` holds texels and levels of `tts2face.picture.textures.pack_textures`."""
    used, places = np.unique(triangles[is_strand], return_inverse=True)
    counts = [part.count for part in face.parts]
    texture = np.repeat([max(part.texture, 0) for part in face.parts], counts)[is_strand]
    gloss = np.repeat([min(part.specular / STRAND_GLOSS, 1.5) for part in face.parts], counts)[is_strand]
    rows: NDArray[np.int32] = places.reshape(-1, 3).astype(np.int32)
    points = face.vertices[used].astype(np.float64)
    uv = face.uv[used] if face.uv is not None and len(used) else np.zeros((len(used), 2), np.float32)
    along = card_tangents(points, rows, uv)
    if face.tangents is not None:
        given = face.tangents[used].astype(np.float64)
        along = np.where(np.any(given != 0, axis=1, keepdims=True), given, along)
    outward = points - SKULL_CENTRE_MM
    texels, levels = packed
    means = np.ones(len(levels), np.float32)
    for number in np.unique(texture):
        start, width, height = levels[number, 0]
        # every seventh texel: a mean needs no more
        seen = texels[start : start + width * height : 7]
        light = linear_light(seen[:, :3]).mean(axis=1)
        means[number] = max(float(np.average(light, weights=seen[:, 3] + 1e-3)), 1e-4)
    return Strands(
        vertices=used.astype(np.int32),
        triangles=rows,
        neighbours=card_neighbours(points, rows),
        texture=texture.astype(np.int32),
        gloss=gloss.astype(np.float32),
        tangents=unit_vectors(along).astype(np.float32),
        uv=np.array(uv, np.float32),
        outward=unit_vectors(outward).astype(np.float32),
        mean_light=means,
    )


def card_neighbours(points: NDArray[np.floating], triangles: NDArray[np.int32]) -> NDArray[np.int32]:
    """Triangle across the edge opposite to each corner (F, 3); -1 at borders. Coincident points are welded."""
    if not len(triangles):
        return np.zeros((0, 3), np.int32)
    keys = np.rint(points * 100).astype(np.int64) + (1 << 20)
    _, weld = np.unique((keys[:, 0] << 42) | (keys[:, 1] << 21) | keys[:, 2], return_inverse=True)
    edges = np.sort(weld.ravel()[triangles][:, [[1, 2], [2, 0], [0, 1]]].reshape(-1, 2), axis=1)
    codes = edges[:, 0] * len(points) + edges[:, 1]
    order = np.argsort(codes, kind="stable")
    pairs = np.flatnonzero(codes[order[1:]] == codes[order[:-1]])
    across = np.full(len(codes), -1, np.int32)
    across[order[pairs]], across[order[pairs + 1]] = order[pairs + 1] // 3, order[pairs] // 3
    return across.reshape(-1, 3)


def card_tangents(points: NDArray[np.floating], triangles: NDArray[np.int32], uv: Any) -> NDArray[np.float64]:
    """Direction (V, 3) of the texture's v axis at the vertices of cards, the direction of their strands."""
    tangents = np.zeros((len(points), 3))
    if not len(triangles):
        return tangents
    first, second = (points[triangles[:, k]] - points[triangles[:, 0]] for k in (1, 2))
    du, dv = ((uv[triangles[:, 1:], axis] - uv[triangles[:, :1], axis]).astype(np.float64) for axis in (0, 1))
    along = (du[:, :1] * second - du[:, 1:] * first) * np.sign(du[:, :1] * dv[:, 1:] - du[:, 1:] * dv[:, :1])
    for k in range(3):
        np.add.at(tangents, triangles[:, k], along)
    return tangents
