"""Surface of a face in the arrays that the kernels take: triangles, colours and materials."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tts2face.face.deformation import FaceRig, build_rig
from tts2face.models.face import Face, FacePart, Texture
from tts2face.picture.cards import Strands, find_strands
from tts2face.picture.kernels.eyes import EyeGeometry, eye_geometry
from tts2face.picture.kernels.raster import FIRST, HOLES, LATER, NOT_DRAWN, TRANSLUCENT
from tts2face.picture.kernels.tones import TONE_TABLES, linear_light
from tts2face.picture.materials import NO_SKIN, STRANDS, Skin, find_skin, material_table, vertex_wrap
from tts2face.picture.textures import pack_textures
from tts2face.processes.shared import shared


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
    line = mixed.reshape(-1)
    # arbitrary fixed weights that separate vertices with different motion
    weights = np.repeat(np.cos(np.arange(1, len(rig.starts))), rig.starts[1:] - rig.starts[:-1])
    for weight, (first, end, own) in zip(weights.tolist(), rig.runs.tolist(), strict=True):
        line[first:end] += weight * rig.deltas[own : own + end - first]
    alike = np.zeros(len(mixed)) if kind is None else kind
    key = np.column_stack([face.vertices, mixed, alike])
    # micrometres: vertices of a seam differ by rounding
    return _group_rows(np.rint(key * 1000).astype(np.int64))


def _group_rows(rows: NDArray[np.int64]) -> NDArray[np.int64]:
    """(n,) number of the group of equal rows (n, k) to which each row belongs; `numpy.unique` of rows is far slower."""
    order = np.lexsort(rows.T[::-1])
    differs = (np.diff(rows[order], axis=0) != 0).any(axis=1)
    group = np.zeros(len(rows), np.int64)
    group[order[1:]] = np.cumsum(differs)
    return group
