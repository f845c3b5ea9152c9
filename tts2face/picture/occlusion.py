"""Occlusion: for each vertex of a face, the directions from which it is hidden, as bits.

`bake_occlusion` is the one place that computes it: builders of faces and the import of characters store the result in
the face's file, haircuts add theirs (`bake_hair`). For a face without it, it is computed once and kept in the user's
cache folder. Drawing needs no more than the bits: the shadow of a lamp in any direction is a sum over them.
"""

import math
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import InputError
from tts2face.models.face import Face
from tts2face.models.hair import Hair, attach_hair
from tts2face.numeric.kernels import kernel
from tts2face.picture.kernels.fragments import face_normals, vertex_normals
from tts2face.picture.kernels.picture import allocate_buffers, draw_samples, project_surface
from tts2face.picture.kernels.raster import GRID_SHIFT, HOLES, NOT_DRAWN, transform_to_camera
from tts2face.picture.kernels.tables import NORMAL
from tts2face.picture.surface import Surface, build_surface
from tts2face.storage.array_cache import computed_once

N_DIRECTIONS = 128  # docs/decisions/112-occlusion.md: more change the light by less than its smoothing
VIEW_SAMPLES = 192  # samples along a side of the views: 1.5 mm each on a head
LIFT_MM, SLACK_MM = 1.2, 1.2  # offset of a vertex along its normal, and depth tolerance of occlusion
VIEW_DISTANCE_MM = 20_000.0  # distance of the cameras: almost parallel light
OPEN_JAW_WEIGHT = 0.6  # of the shape that opens the mouth wide
MIN_CACHED_VERTICES = 5000  # smaller faces are traced as fast as a file is read
CACHE_KIND, CACHE_VERSION = "occlusion", 1

Bits = NDArray[np.uint8]


def bake_occlusion(face: Face, threads: int = 1, n_directions: int = N_DIRECTIONS) -> Face:
    """The face with `Face.occlusion` (P, V, n_directions / 8), computed from its mesh."""
    return replace(face, occlusion=_trace(face, build_surface(face), threads, n_directions))


def bake_hair(face: Face, hair: Hair, threads: int = 1) -> Hair:
    """The haircut with its own occlusion and with that of the face's skin under it; the face needs its own."""
    if face.occlusion is None:
        raise InputError("the face has no occlusion; give it to bake_occlusion first")
    plain = replace(face, occlusion=None)
    haired = attach_hair(plain, replace(hair, occlusion=None, skin_occlusion=None), "black")
    bits = _trace(haired, build_surface(haired), threads, 8 * face.occlusion.shape[2])
    n_face = len(face.vertices)
    return replace(hair, occlusion=bits[0, n_face:], skin_occlusion=bits[0, :n_face] & ~face.occlusion[0])


def occlusion_of(face: Face, surface: Surface, threads: int) -> Bits:
    """Occlusion (P, V, D / 8) of a face: its own, else from the cache folder, else computed and kept there."""
    if face.occlusion is not None:
        return face.occlusion
    if len(face.vertices) < MIN_CACHED_VERTICES:
        return _trace(face, surface, threads, N_DIRECTIONS)
    shape = (face.n_lit_poses, len(face.vertices))
    return computed_once(
        CACHE_KIND,
        CACHE_VERSION,
        _geometry(face),
        lambda: {"bits": _trace(face, surface, threads, N_DIRECTIONS)},
        lambda kept: "bits" in kept and kept["bits"].dtype == np.uint8 and kept["bits"].shape[:2] == shape,
    )["bits"]


def _geometry(face: Face) -> list[NDArray[Any] | str]:
    """Vertices, triangles, opening shape of a face, and what of its parts is drawn."""
    jaw = [] if face.opening is None else [face.shapes[face.opening]]
    parts = repr([(part.count, part.opacity, part.cutout, part.kind) for part in face.parts])
    alphas = ["" if texture.alpha is None else texture.alpha for texture in face.textures]
    return [face.vertices, face.triangles, occlusion_poses(face), *jaw, parts, *alphas]


def occlusion_poses(face: Face) -> NDArray[np.float32]:
    """Shape weights (P, K) of the poses with an occlusion of their own: at rest, and with the mouth wide open."""
    poses = np.zeros((face.n_lit_poses, len(face.shape_names)), np.float32)
    if face.opening is not None:
        poses[1:, face.opening] = OPEN_JAW_WEIGHT
    return poses


def sphere_directions(n: int) -> NDArray[np.float64]:
    """Unit vectors (n, 3) distributed evenly over the sphere (Fibonacci lattice; Gonzalez 2010)."""
    height = 1 - (2 * np.arange(n) + 1) / n
    around = np.arange(n) * math.pi * (3 - math.sqrt(5))
    level = np.sqrt(1 - height**2)
    return np.column_stack([level * np.cos(around), height, level * np.sin(around)])


def pose_normals(surface: Surface, pose: NDArray[np.float32]) -> NDArray[np.float32]:
    """Unit normals (V, 3) of a surface with shape weights (K,)."""
    return _normals(surface, surface.rig.pose(pose))


def _normals(surface: Surface, points: NDArray[np.float32]) -> NDArray[np.float32]:
    table = np.zeros((len(points), NORMAL + 3), np.float32)
    table[:, :3] = points
    flat = np.zeros((len(surface.triangles), 3), np.float32)
    face_normals(table, surface.triangles, flat)
    vertex_normals(flat, surface.starts, surface.members, table)
    return table[:, NORMAL:]


def _trace(face: Face, surface: Surface, threads: int, n_directions: int) -> Bits:
    """Bits (P, V, n_directions / 8): 1 where a vertex is hidden from a direction that it faces."""
    # Cards of hair shadow as parts with holes do.
    solid = replace(surface, phase=np.where(surface.phase == NOT_DRAWN, np.int8(HOLES), surface.phase))
    directions = sphere_directions(n_directions)
    packed = []
    for pose in occlusion_poses(face):
        points = surface.rig.pose(pose)
        normals = _normals(surface, points)
        hidden = _visibility(solid, points, normals, directions, threads) == 0
        hidden &= directions @ normals.T.astype(np.float64) > 0
        packed.append(np.packbits(hidden.T, axis=1))
    return np.stack(packed)


def _visibility(
    surface: Surface, points: Any, normals: Any, directions: NDArray[np.float64], threads: int
) -> NDArray[np.uint8]:
    """Visibility (D, V): 1 where a vertex is visible from a direction, else 0."""
    lifted = points + np.float32(LIFT_MM) * normals
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    radius = float(np.linalg.norm(points - middle, axis=1).max()) + LIFT_MM
    visible = np.zeros((len(directions), len(points)), np.uint8)

    def trace_views(numbers: range) -> None:
        buffers = allocate_buffers(surface, (VIEW_SAMPLES, VIEW_SAMPLES), 1)
        grid, camera = np.zeros_like(buffers.grid), np.zeros((len(points), 3), np.float32)
        for d in numbers:
            view, lens = _shadow_view(directions[d], middle, radius)
            members = project_surface(points, surface, (view, lens), buffers, (VIEW_SAMPLES, VIEW_SAMPLES))
            draw_samples(surface, lens, members, 0, buffers)
            transform_to_camera(lifted, view, lens, camera, grid)
            mark_visible(camera, grid, buffers.depth, np.float32(SLACK_MM), visible[d])

    with ThreadPoolExecutor(threads) as pool:
        list(pool.map(trace_views, [range(i, len(directions), threads) for i in range(threads)]))
    return visible


def _shadow_view(direction: NDArray[np.float64], middle: Any, radius: float) -> tuple[NDArray[np.float64], Any]:
    ahead = -direction
    # seen from straight above there is no upright direction
    right = np.cross(ahead, [0.0, 1.0, 0.0] if abs(direction[1]) < 0.99 else [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    turned = np.stack([right, np.cross(ahead, right), ahead])
    view = np.column_stack([turned, -turned @ (middle - VIEW_DISTANCE_MM * ahead)])
    return view, np.array(
        [(VIEW_SAMPLES / 2 - 1) * VIEW_DISTANCE_MM / radius, VIEW_SAMPLES / 2, VIEW_SAMPLES / 2, VIEW_DISTANCE_MM / 2]
    )


@kernel
def mark_visible(camera: Any, grid: Any, depth: Any, slack: Any, visible: Any) -> None:
    """Set `visible` (V,) to 1 for vertices that no surface occludes by more than `slack` mm."""
    for v in range(len(camera)):
        x = min(max(grid[v, 0] >> GRID_SHIFT, 0), depth.shape[2] - 1)
        y = min(max(grid[v, 1] >> GRID_SHIFT, 0), depth.shape[1] - 1)
        if depth[0, y, x] * (camera[v, 2] - slack) <= np.float32(1):
            visible[v] = 1
