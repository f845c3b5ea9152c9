"""Soft shadows: the share of sky light and of each lamp's light that reaches every vertex, computed once per scene.

The rasteriser draws the head from many directions; a vertex receives the light of the directions from which it is
visible. Shadows are fixed to the skin, an approximation that holds for large lamps and small head motion, and are
interpolated between the closed and the wide open mouth by the lip opening of the shape weights.
"""

import math
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tts2face.compilation import kernel
from tts2face.models.face import Face
from tts2face.models.landmarks import LOWER_LIP_INNER_MID, UPPER_LIP_INNER_MID
from tts2face.render.fragment_rows import NORMAL
from tts2face.render.fragments import face_normals, vertex_normals
from tts2face.render.picture_kernels import allocate_buffers, draw_samples, project_surface
from tts2face.render.raster import GRID_SHIFT, transform_to_camera
from tts2face.render.studio_light import LAMP_RADIUS_RAD
from tts2face.render.surface import Surface

VIEW_SAMPLES = 192  # samples along a side of the views: 1.5 mm each on a head
N_SKY, N_LAMP = 36, 7  # views for the sky and for each lamp
LIFT_MM, SLACK_MM = 1.2, 1.2  # offset of a vertex along its normal, and depth tolerance of occlusion
VIEW_DISTANCE_MM = 20_000.0  # distance of the cameras: almost parallel light
OPEN_JAW_WEIGHT = 0.6  # jawOpen weight of the wide open mouth
HIDDEN_EYE_LIGHT = 0.75  # least exposure of an eyeball, as a share of that of its lit parts: it turns
HIDDEN_TOOTH_LIGHT = 0.6  # likewise of teeth behind the lips of the open mouth: enamel scatters light
N_SMOOTHING_PASSES = 2  # smoothing passes over neighbours, against the noise of few views


@dataclass(frozen=True, slots=True, eq=False)
class Exposure:
    """Exposure of each vertex to the sky and to three lamps: ``rest`` (V, 4), plus ``gain`` (V, 4) with an open mouth.

    ``opening`` (K,) is the lip opening of each shape at weight 1, relative to the wide open mouth.
    """

    rest: NDArray[np.float32]
    gain: NDArray[np.float32]
    opening: NDArray[np.float32]

    def at(self, weights: NDArray[np.floating]) -> NDArray[np.float32]:
        """Exposure (V, 4) for shape weights (K,); it grows with the square root of the lip opening."""
        opened = min(max(float(np.dot(self.opening, weights)), 0.0), 1.0)
        return self.rest + np.float32(math.sqrt(opened)) * self.gain


def compute_exposure(face: Face, surface: Surface, lamps: NDArray[np.float64], threads: int) -> Exposure:
    """Exposure of a face to the sky and to lamps in the world directions `lamps` (3, 3)."""
    jaw = face.shape_names.index("jawOpen") if "jawOpen" in face.shape_names else -1
    poses = np.zeros((1 if jaw < 0 else 2, len(face.shape_names)), np.float32)
    if jaw >= 0:
        poses[1, jaw] = OPEN_JAW_WEIGHT
    exposures = [_rest_exposure(surface, surface.rig.pose(pose), lamps, threads) for pose in poses]
    for part in face.parts:
        if part.name.startswith("teeth"):
            teeth = np.unique(face.triangles[part.first : part.first + part.count])
            lit = HIDDEN_TOOTH_LIGHT * np.percentile(exposures[-1][teeth], 90, axis=0)
            exposures[-1][teeth] = np.maximum(exposures[-1][teeth], lit)
    return Exposure(exposures[0], exposures[-1] - exposures[0], lip_opening(face, jaw))


def lip_opening(face: Face, jaw: int) -> NDArray[np.float32]:
    """Lip opening (K,) of each shape at its middle, relative to that of the wide open jaw.

    `jaw` is the index of jawOpen, -1 without it. On a face without lip landmarks only the jaw opens the lips.
    """
    opening = np.zeros(len(face.shape_names), np.float32)
    if jaw >= 0:
        opening[jaw] = 1 / OPEN_JAW_WEIGHT
    rows = {int(number): row for row, number in enumerate(face.landmarks)}
    if jaw < 0 or not {UPPER_LIP_INNER_MID, LOWER_LIP_INNER_MID} <= rows.keys():
        return opening
    upper, lower = (
        np.einsum("kv,v->k", face.shapes[:, face.landmark_vertices[rows[lip]], 1], face.landmark_weights[rows[lip]])
        for lip in (UPPER_LIP_INNER_MID, LOWER_LIP_INNER_MID)
    )
    parted = upper - lower
    return (parted / (OPEN_JAW_WEIGHT * parted[jaw])).astype(np.float32) if parted[jaw] > 0 else opening


def sphere_directions(n: int) -> NDArray[np.float64]:
    """Unit vectors (n, 3) distributed evenly over the sphere (Fibonacci lattice; Gonzalez 2010)."""
    height = 1 - (2 * np.arange(n) + 1) / n
    around = np.arange(n) * math.pi * (3 - math.sqrt(5))
    level = np.sqrt(1 - height**2)
    return np.column_stack([level * np.cos(around), height, level * np.sin(around)])


def cone_directions(axis: NDArray[np.float64], n: int, radius: float) -> NDArray[np.float64]:
    """Unit vectors (n, 3) distributed evenly over a cone of half angle `radius` (rad) about an axis (3,)."""
    side = np.cross(axis, [0.0, 1.0, 0.0] if abs(axis[1]) < 0.9 else [1.0, 0.0, 0.0])
    side /= np.linalg.norm(side)
    other = np.cross(axis, side)
    out = math.tan(radius) * np.sqrt((np.arange(n) + 0.5) / n)[:, None]
    around = (np.arange(n) * math.pi * (3 - math.sqrt(5)))[:, None]
    spread = axis + out * (np.cos(around) * side + np.sin(around) * other)
    unit: NDArray[np.float64] = spread / np.linalg.norm(spread, axis=1, keepdims=True)
    return unit


def _rest_exposure(
    surface: Surface, points: NDArray[np.float32], lamps: NDArray[np.float64], threads: int
) -> NDArray[np.float32]:
    normals = _normals(surface, points)
    directions = np.concatenate(
        [sphere_directions(N_SKY), *(cone_directions(lamp, N_LAMP, LAMP_RADIUS_RAD) for lamp in lamps)]
    )
    visible = _visibility(surface, points, normals, directions, threads)
    weights = np.maximum(directions[:N_SKY] @ normals.T, 0.02)
    exposure = np.ones((len(points), 1 + len(lamps)), np.float32)
    exposure[:, 0] = (weights * visible[:N_SKY]).sum(axis=0) / weights.sum(axis=0)
    for k, lamp in enumerate(lamps):
        of_lamp = slice(N_SKY + k * N_LAMP, N_SKY + (k + 1) * N_LAMP)
        turned = np.clip((normals @ lamp + 0.15) / 0.4, 0.0, 1.0)  # a vertex that faces away is not shadowed
        exposure[:, 1 + k] = 1 - turned + turned * visible[of_lamp].mean(axis=0)
    smooth = _smooth_values(surface, exposure)
    for first, end in surface.rig.eye_spans:
        ball = smooth[first:end]
        np.maximum(ball, HIDDEN_EYE_LIGHT * np.percentile(ball, 85, axis=0), out=ball)
    return smooth


def _normals(surface: Surface, points: NDArray[np.float32]) -> NDArray[np.float32]:
    table = np.zeros((len(points), NORMAL + 3), np.float32)
    table[:, :3] = points
    flat = np.zeros((len(surface.triangles), 3), np.float32)
    face_normals(table, surface.triangles, flat)
    vertex_normals(flat, surface.starts, surface.members, table)
    return table[:, NORMAL:]


def _visibility(
    surface: Surface, points: Any, normals: Any, directions: NDArray[np.float64], threads: int
) -> NDArray[np.float32]:
    """Visibility (D, V): 1 where a vertex is visible from a direction, else 0."""
    lifted = points + np.float32(LIFT_MM) * normals
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    radius = float(np.linalg.norm(points - middle, axis=1).max()) + LIFT_MM
    visible = np.zeros((len(directions), len(points)), np.float32)

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
            visible[v] = np.float32(1)


def _smooth_values(surface: Surface, values: NDArray[np.float32]) -> NDArray[np.float32]:
    """Vertex values (V, C), averaged `N_SMOOTHING_PASSES` times over adjacent triangles."""
    n_around = np.diff(surface.starts)
    inner = np.flatnonzero(n_around > 0)
    for _ in range(N_SMOOTHING_PASSES):
        at_triangles = values[surface.triangles].mean(axis=1)
        sums = np.add.reduceat(at_triangles[surface.members], surface.starts[:-1][inner], axis=0)
        values = values.copy()
        values[inner] = sums / n_around[inner, None]
    return values
