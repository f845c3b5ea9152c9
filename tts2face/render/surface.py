"""Surface of a face in the arrays that the kernels take: triangles, colours and materials."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tts2face.colour import decode_srgb, encode_srgb
from tts2face.face.deformation import FaceRig, build_rig
from tts2face.models.face import Face, Texture

OPEN_SHARE = 0.05  # parts with a larger share of boundary edges are open sheets, lit from both sides


@dataclass(frozen=True, slots=True, eq=False)
class Surface:
    """Constant arrays for drawing a face.

    ``triangles`` (F, 3); ``colours`` (V, 3) linear light; ``uv`` (V, 2), ``texture`` (H, W, 3) sRGB; ``part_of`` and
    ``translucent`` (F,); ``cut_out`` (F,) marks triangles that are drawn where ``alpha`` (H, W), the coverage of the
    texture, is; ``materials`` (P, 6) as `tts2face.render.fragments` names its columns; the triangles
    around vertex v are ``members[starts[v]:starts[v + 1]]``, those of vertices at the same place and of the same
    part included, so that a seam of the texture does not show.
    """

    rig: FaceRig
    triangles: NDArray[np.int32]
    colours: NDArray[np.float32]
    uv: NDArray[np.float32]
    texture: NDArray[np.uint8]
    part_of: NDArray[np.int32]
    translucent: NDArray[np.int8]
    cut_out: NDArray[np.bool_]
    alpha: NDArray[np.uint8]
    materials: NDArray[np.float32]
    starts: NDArray[np.int64]
    members: NDArray[np.int32]


def build_surface(face: Face) -> Surface:
    """Surface of a face."""
    parts, (uv, texture) = face.parts, pack_textures(face)
    counts = [part.count for part in parts]
    part_of = np.repeat(np.arange(len(parts), dtype=np.int32), counts)
    translucent = np.repeat([part.opacity < 1 for part in parts], counts)
    triangles = np.array(face.triangles, np.int32)
    starts, members = _triangles_by_vertex(face, triangles, part_of)
    return Surface(
        rig=build_rig(face),
        triangles=triangles,
        colours=linear_light(face.colours),
        uv=uv,
        texture=np.array(texture.pixels),
        part_of=part_of,
        translucent=translucent.astype(np.int8),
        cut_out=np.repeat([part.cutout and texture.alpha is not None for part in parts], counts),
        alpha=np.zeros((1, 1), np.uint8) if texture.alpha is None else np.array(texture.alpha),
        materials=_materials(face, triangles, part_of),
        starts=starts,
        members=members,
    )


def pack_textures(face: Face) -> tuple[NDArray[np.float32], Texture]:
    """Texture coordinates (V, 2) in one texture that holds all of a face's, one below the other, and that texture."""
    if face.uv is None or not face.textures:
        return np.zeros((1, 2), np.float32), Texture(np.zeros((1, 1, 3), np.uint8))
    if len(face.textures) == 1:
        return np.array(face.uv, np.float32), face.textures[0]
    heights = [texture.pixels.shape[0] for texture in face.textures]
    width, tops = max(texture.pixels.shape[1] for texture in face.textures), np.cumsum([0, *heights])
    pixels, alpha = np.zeros((tops[-1], width, 3), np.uint8), np.full((tops[-1], width), 255, np.uint8)
    uv = np.array(face.uv, np.float32)
    for number, (texture, top) in enumerate(zip(face.textures, tops, strict=False)):
        height, across = texture.pixels.shape[:2]
        pixels[top : top + height, :across] = texture.pixels
        if texture.alpha is not None:
            alpha[top : top + height, :across] = texture.alpha
        spans = [face.triangles[part.first : part.first + part.count] for part in face.parts if part.texture == number]
        used = np.unique(np.concatenate([np.zeros((0, 3), np.int32), *spans]))
        inside = np.clip(face.uv[used], [0.5 / across, 0.5 / height], [1 - 0.5 / across, 1 - 0.5 / height])
        uv[used] = (inside * [across, height] + [0, top]) / [width, tops[-1]]
    return uv, Texture(pixels, alpha if any(texture.alpha is not None for texture in face.textures) else None)


def linear_light(srgb: NDArray[np.uint8]) -> NDArray[np.float32]:
    """Linear light in [0, 1] of 8-bit sRGB values (IEC 61966-2-1)."""
    return linear_table()[srgb]


def linear_table() -> NDArray[np.float32]:
    """Linear light (256,) of each 8-bit sRGB value."""
    return decode_srgb(np.arange(256) / 255.0).astype(np.float32)


def encoding_table(n_steps: int) -> NDArray[np.uint8]:
    """8-bit sRGB values (n_steps,) of linear light from 0 to 1 in equal steps."""
    return encode_srgb(np.linspace(0.0, 1.0, n_steps))


def _materials(face: Face, triangles: NDArray[np.int32], part_of: NDArray[np.int32]) -> NDArray[np.float32]:
    rows = []
    for number, part in enumerate(face.parts):
        sheet = _free_edge_share(triangles[part_of == number]) > OPEN_SHARE
        rows.append((part.specular, part.shininess, part.wrap, part.opacity, part.is_textured, sheet))
    return np.array(rows, np.float32).reshape(-1, 6)


def _free_edge_share(triangles: NDArray[np.int32]) -> float:
    if not len(triangles):
        return 0.0
    edges = np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    _, uses = np.unique(edges, axis=0, return_counts=True)
    return float((uses == 1).mean())


def _triangles_by_vertex(face: Face, triangles: NDArray[np.int32], part_of: NDArray[np.int32]) -> tuple[Any, Any]:
    """Starts and indices of the triangles around each vertex; coincident vertices that move alike are welded."""
    n_vertices = len(face.vertices)
    vertex_part = np.full(n_vertices, -1)
    vertex_part[triangles.ravel()] = np.repeat(part_of, 3)
    mix = np.cos(
        np.arange(1, len(face.shapes) + 1)
    )  # arbitrary fixed weights that separate vertices with different motion
    key = np.column_stack([face.vertices, np.tensordot(mix, face.shapes, axes=1), vertex_part])
    _, weld = np.unique(np.rint(key * 1000).astype(np.int64), axis=0, return_inverse=True)
    corner = weld.ravel()[triangles.ravel()]
    order = np.argsort(corner, kind="stable")
    counts = np.bincount(corner, minlength=int(weld.max(initial=-1)) + 1)
    begins = np.concatenate([[0], np.cumsum(counts)])
    around = (order // 3).astype(np.int32)
    sizes = counts[weld.ravel()]
    starts = np.concatenate([[0], np.cumsum(sizes)]).astype(np.int64)
    picks = np.repeat(begins[weld.ravel()] - starts[:-1], sizes) + np.arange(starts[-1])
    return starts, around[picks]
