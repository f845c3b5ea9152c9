"""Surface of a face in the arrays that the kernels take: triangles, colours and materials.

Materials of the parts of a face, and the scattering of light in its skin.

Cards of hair, lashes and brows in the arrays that the kernels take.
"""

from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tts2face.face.deformation import FaceRig, build_rig
from tts2face.models.face import Face, FacePart, Texture
from tts2face.numeric.arrays import unit_vectors
from tts2face.picture.kernels.eyes import EyeGeometry, eye_geometry
from tts2face.picture.kernels.raster import FIRST, HOLES, LATER, NOT_DRAWN, TRANSLUCENT
from tts2face.picture.kernels.shade import N_SCATTER_PASSES, SCATTER_MM
from tts2face.picture.kernels.tables import (
    DARK_GLOSS,
    EYE,
    GLOSS,
    N_MATERIAL_COLUMNS,
    OPACITY,
    OPEN_SURFACE,
    ROUGHNESS,
    SECOND_LOBE,
    TEXTURE,
    TONE_TABLES,
    WRAP,
    linear_light,
)
from tts2face.picture.textures import pack_textures
from tts2face.processes.shared import shared

SKIN, EYE_KIND, STRANDS = "skin", "eye", "strands"  # kinds of parts
OPEN_SHARE = 0.05  # parts with a larger share of boundary edges are open sheets, lit from both sides
SKIN_ROUGHNESS = 0.0448  # squared width of the wide lobe of skin: a roughness of 0.46
SKIN_GLOSS = 0.5  # wide lobe of skin, as a share of the part's specular
SKIN_SECOND_LOBE = 0.42  # narrow lobe of skin, relative to the wide one
DARK_SKIN_GLOSS = 0.75  # share of the gloss that the darkest skin lacks
SKIN_WRAP = 0.6  # of skin, as a share of the part's wrap: light scatters to the vertices around, too


@dataclass(frozen=True, slots=True, eq=False)
class Skin:
    """Vertices of skin ``vertices`` (S,), their ``share`` (S, 3) for `scatter_light`, and the skin's triangles."""

    vertices: NDArray[np.int32]
    share: NDArray[np.float32]
    triangles: NDArray[np.int32]


NO_SKIN = Skin(np.zeros(0, np.int32), np.zeros((0, 3), np.float32), np.zeros(0, np.int32))


def material_table(face: Face, triangles: NDArray[np.int32], part_of: NDArray[np.int32]) -> NDArray[np.float32]:
    """Materials (P, 9) of the parts, with the columns of `tts2face.picture.kernels.tables`."""
    rows = np.zeros((len(face.parts), N_MATERIAL_COLUMNS), np.float32)
    for number, (part, row) in enumerate(zip(face.parts, rows, strict=True)):
        row[GLOSS], row[ROUGHNESS] = part.specular, 2 / (part.shininess + 2)  # as wide as a Blinn-Phong highlight
        row[OPACITY], row[WRAP] = part.opacity, part.wrap
        row[TEXTURE] = part.texture if face.uv is not None else -1
        row[OPEN_SURFACE] = _free_edge_share(triangles[part_of == number]) > OPEN_SHARE
        if part.kind == SKIN:
            row[GLOSS], row[ROUGHNESS] = SKIN_GLOSS * part.specular, SKIN_ROUGHNESS
            row[SECOND_LOBE], row[DARK_GLOSS], row[WRAP] = SKIN_SECOND_LOBE, DARK_SKIN_GLOSS, SKIN_WRAP * part.wrap
        row[EYE] = part.kind == EYE_KIND
    return rows


def vertex_wrap(
    face: Face, triangles: NDArray[np.int32], part_of: NDArray[np.int32], materials: NDArray[np.float32]
) -> NDArray[np.float32]:
    """Wrap (V,) of diffuse light; negative on open sheets, which are lit from the side that the camera sees."""
    wrap = np.zeros(len(face.vertices), np.float32)
    of_part = np.where(materials[:, OPEN_SURFACE] > 0, -1 - materials[:, WRAP], materials[:, WRAP])
    wrap[triangles.ravel()] = np.repeat(of_part[part_of], 3)
    return wrap


def find_skin(face: Face, triangles: NDArray[np.int32], part_of: NDArray[np.int32]) -> Skin:
    """Skin, whose light scatters over the distances of `SCATTER_MM` on the face at rest."""
    of_skin = np.flatnonzero(np.array([part.kind == SKIN for part in face.parts], bool)[part_of]).astype(np.int32)
    used = np.unique(triangles[of_skin]).astype(np.int32)
    if not len(used):
        return NO_SKIN
    corners = face.vertices[triangles].astype(np.float64)
    edges = ((corners - np.roll(corners, 1, axis=1)) ** 2).sum(axis=2)  # of corner k to its predecessor
    sums = np.zeros((len(face.vertices), 2))
    for k in range(3):
        np.add.at(sums[:, 0], triangles[:, k], edges[:, k] + edges[:, (k + 1) % 3])
        np.add.at(sums[:, 1], triangles[:, k], 2.0)
    squared = np.maximum(sums[used, 0] / np.maximum(sums[used, 1], 1.0), 1e-6)
    share = 2 * np.square(SCATTER_MM)[None, :] / (N_SCATTER_PASSES * squared[:, None])
    return Skin(used, np.minimum(share, 1.0).astype(np.float32), of_skin)


def _free_edge_share(triangles: NDArray[np.int32]) -> float:
    if not len(triangles):
        return 0.0
    edges = np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1).astype(np.int64)
    _, uses = np.unique((edges[:, 0] << 32) | edges[:, 1], return_counts=True)
    return float((uses == 1).mean())


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


@dataclass(frozen=True, slots=True, eq=False, weakref_slot=True)
class Surface:
    """Constant arrays for drawing a face.

    ``triangles`` (F, 3); ``colours`` (V, 3) linear light; ``uv`` (V, 2); ``textures`` their pixels and coverage,
    ``texels`` and ``levels`` as `tts2face.picture.textures` packs them; ``part_of`` and ``texture_of`` (F,); ``phase``
    (F, 2) of the front and the back of triangles as `tts2face.picture.kernels.raster` names them; ``materials`` (P, 9)
    as `tts2face.picture.kernels.tables` names its columns; ``wrap`` (V,); the triangles around vertex v are
    ``members[starts[v]:starts[v + 1]]``, those of vertices at the same place and of the same part included, so that a
    seam of the texture does not show.
    """

    rig: FaceRig
    triangles: NDArray[np.int32]
    colours: NDArray[np.float32]
    uv: NDArray[np.float32]
    textures: tuple[Texture, ...]
    texels: NDArray[np.uint8]
    levels: NDArray[np.int64]
    part_of: NDArray[np.int32]
    texture_of: NDArray[np.int32]
    phase: NDArray[np.int8]
    materials: NDArray[np.float32]
    wrap: NDArray[np.float32]
    starts: NDArray[np.int64]
    members: NDArray[np.int32]
    skin: Skin
    strands: Strands
    eyes: EyeGeometry


@shared
def build_surface(face: Face, *, scatters: bool = True) -> Surface:
    """Surface of a face; `scatters` is whether light spreads under its skin."""
    parts = face.parts
    counts = [part.count for part in parts]
    part_of = np.repeat(np.arange(len(parts), dtype=np.int32), counts)
    is_strand = np.repeat([part.kind == STRANDS for part in parts], counts).astype(bool)
    every = np.array(face.triangles, np.int32)
    rig = build_rig(face)
    starts, members = triangles_by_vertex(face, every, part_of, rig)
    textures = tuple(face.textures)
    texels, levels = pack_textures(textures, TONE_TABLES)
    materials = material_table(face, every, part_of)
    return Surface(
        rig=rig,
        triangles=every,
        colours=linear_light(face.colours),
        uv=np.array(face.uv, np.float32) if face.uv is not None else np.zeros((1, 2), np.float32),
        textures=textures,
        texels=texels,
        levels=levels,
        part_of=part_of,
        texture_of=np.repeat([max(part.texture, 0) for part in parts], counts).astype(np.int32),
        phase=_phases(face, part_of),
        materials=materials,
        wrap=vertex_wrap(face, every, part_of, materials),
        starts=starts,
        members=members,
        skin=find_skin(face, every, part_of) if scatters else NO_SKIN,
        strands=find_strands(face, every, is_strand, (texels, levels)),
        eyes=eye_geometry(face, rig),
    )


def _is_cut_out(face: Face, part: FacePart) -> bool:
    return part.cutout and part.texture >= 0 and face.textures[part.texture].alpha is not None


def _phases(face: Face, part_of: NDArray[np.int32]) -> NDArray[np.int8]:
    """Phase (F, 2) of the front and back of each triangle; the largest opaque part is drawn first."""
    sizes = [-1 if part.opacity < 1 or _is_cut_out(face, part) else part.count for part in face.parts]
    phases = np.full(len(face.parts), LATER, np.int8)
    if sizes:
        phases[int(np.argmax(sizes))] = FIRST
    for number, part in enumerate(face.parts):
        if part.kind == STRANDS:
            phases[number] = NOT_DRAWN
        elif _is_cut_out(face, part):
            phases[number] = HOLES
        elif part.opacity < 1:
            phases[number] = TRANSLUCENT
    backs = np.where(phases == FIRST, LATER, phases).astype(np.int8)
    return np.stack([phases, backs], axis=1)[part_of]


def triangles_by_vertex(
    face: Face, triangles: NDArray[np.int32], part_of: NDArray[np.int32], rig: FaceRig
) -> tuple[Any, Any]:
    """Starts and indices of the triangles around each vertex; coincident vertices that move alike are welded."""
    vertex_part = np.full(len(face.vertices), -1)
    vertex_part[triangles.ravel()] = np.repeat(part_of, 3)
    weld = weld_groups(face, rig, vertex_part)
    corner = weld[triangles.ravel()]
    order = np.argsort(corner, kind="stable")
    counts = np.bincount(corner, minlength=int(weld.max(initial=-1)) + 1)
    firsts = np.concatenate([[0], np.cumsum(counts)])
    around = (order // 3).astype(np.int32)
    sizes = counts[weld]
    starts = np.concatenate([[0], np.cumsum(sizes)]).astype(np.int64)
    picks = np.repeat(firsts[weld] - starts[:-1], sizes) + np.arange(starts[-1])
    return starts, around[picks]


def weld_groups(face: Face, rig: FaceRig, kind: NDArray[np.int64] | None = None) -> NDArray[np.int64]:
    """(V,) group of each vertex with those at its place that move alike, and are of the same kind (V,)."""
    mixed = np.zeros((len(face.vertices), 3))
    for number, (first, end) in enumerate(pairwise(rig.starts.tolist()), start=1):
        weight = np.cos(number)  # arbitrary fixed weights that separate vertices with different motion
        mixed[rig.indices[first:end]] += weight * rig.deltas[first:end]
    alike = np.zeros(len(mixed)) if kind is None else kind
    key = np.column_stack([face.vertices, mixed, alike])
    return _group_rows(np.rint(key * 1000).astype(np.int64))


def _group_rows(rows: NDArray[np.int64]) -> NDArray[np.int64]:
    """(n,) number of the group of equal rows (n, k) to which each row belongs; `numpy.unique` of rows is far slower."""
    order = np.lexsort(rows.T[::-1])
    differs = (np.diff(rows[order], axis=0) != 0).any(axis=1)
    group = np.zeros(len(rows), np.int64)
    group[order[1:]] = np.cumsum(differs)
    return group
