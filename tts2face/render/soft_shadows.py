"""How much of the sky and of each light reaches every vertex: the head's soft shadows, found once before drawing.

The head is looked at from many directions by the rasteriser itself; a vertex that is seen from a direction gets the
light that comes from there. Shadows stay on the skin while the head moves a little, as they would under large lamps;
between the mouth closed and wide open they are mixed by how far the shapes part the lips.
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
from tts2face.render.fragments import NORMAL, face_normals, vertex_normals
from tts2face.render.picture_kernels import allocate_buffers, project_surface
from tts2face.render.raster import GRID_SHIFT, draw_band, transform_to_camera
from tts2face.render.studio_light import LAMP_RADIUS_RAD
from tts2face.render.surface import Surface

VIEW_SAMPLES = 192  # samples along a side of the views: 1.5 mm of a head
N_SKY, N_LAMP = 36, 7  # views for the sky and for each lamp
LIFT_MM, SLACK_MM = 1.2, 1.2  # a vertex is looked for this far before the surface, and this far before what hides it
VIEW_DISTANCE_MM = 20_000.0  # distance of the views: almost parallel light
OPEN_JAW_WEIGHT = 0.6  # weight of the wide open mouth
HIDDEN_EYE_LIGHT = 0.75  # light on the parts of an eyeball that come out when it turns, of its lit parts' light
HIDDEN_TOOTH_LIGHT = 0.6  # likewise of teeth behind the lips of the open mouth: enamel scatters light along itself
N_SMOOTHING_PASSES = 2  # means over neighbours, against the grain of few views


@dataclass(frozen=True, slots=True, eq=False)
class Exposure:
    """Light that reaches each vertex: ``rest`` (V, 4) of the sky and of three lamps, plus ``gain`` with open mouth.

    ``opening`` (K,) is how far each shape at weight 1 opens the lips, of the wide open mouth.
    """

    rest: NDArray[np.float32]
    gain: NDArray[np.float32]
    opening: NDArray[np.float32]

    def at(self, weights: NDArray[np.floating]) -> NDArray[np.float32]:
        """(V, 4) for the weights of the face's shapes; light enters through a slit faster than the slit opens."""
        opened = min(max(float(np.dot(self.opening, weights)), 0.0), 1.0)
        return self.rest + np.float32(math.sqrt(opened)) * self.gain


def compute_exposure(face: Face, surface: Surface, lamps: NDArray[np.float64], threads: int) -> Exposure:
    """Exposure of a face to the sky and to lamps in the directions (3, 3) of the world."""
    jaw = face.shape_names.index("jawOpen") if "jawOpen" in face.shape_names else -1
    poses = np.zeros((1 if jaw < 0 else 2, len(face.shape_names)), np.float32)
    if jaw >= 0:
        poses[1, jaw] = OPEN_JAW_WEIGHT
    baked = [_rest_exposure(surface, surface.rig.pose(pose), lamps, threads) for pose in poses]
    for part in face.parts:
        if part.name.startswith("teeth"):
            teeth = np.unique(face.triangles[part.first : part.first + part.count])
            lit = HIDDEN_TOOTH_LIGHT * np.percentile(baked[-1][teeth], 90, axis=0)
            baked[-1][teeth] = np.maximum(baked[-1][teeth], lit)
    return Exposure(baked[0], baked[-1] - baked[0], lip_opening(face, jaw))


def lip_opening(face: Face, jaw: int) -> NDArray[np.float32]:
    """(K,) how far each shape parts the middle of the lips, of what the wide open jaw does.

    On a face without landmarks the jaw alone is known to.
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
    """(n, 3) directions spread evenly (Fibonacci lattice; Gonzalez 2010)."""
    height = 1 - (2 * np.arange(n) + 1) / n
    around = np.arange(n) * math.pi * (3 - math.sqrt(5))
    level = np.sqrt(1 - height**2)
    return np.column_stack([level * np.cos(around), height, level * np.sin(around)])


def cone_directions(axis: NDArray[np.float64], n: int, radius: float) -> NDArray[np.float64]:
    """(n, 3) directions spread over a disc of a radius (rad) about an axis."""
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
    seen = _visibility(surface, points, normals, directions, threads)
    weights = np.maximum(directions[:N_SKY] @ normals.T, 0.02)
    exposure = np.ones((len(points), 1 + len(lamps)), np.float32)
    exposure[:, 0] = (weights * seen[:N_SKY]).sum(axis=0) / weights.sum(axis=0)
    for k, lamp in enumerate(lamps):
        of_lamp = slice(N_SKY + k * N_LAMP, N_SKY + (k + 1) * N_LAMP)
        turned = np.clip((normals @ lamp + 0.15) / 0.4, 0.0, 1.0)  # turning away is no shadow
        exposure[:, 1 + k] = 1 - turned + turned * seen[of_lamp].mean(axis=0)
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
    """(D, V) 1 where a vertex is seen from a direction."""
    lifted = points + np.float32(LIFT_MM) * normals
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    radius = float(np.linalg.norm(points - middle, axis=1).max()) + LIFT_MM
    seen = np.zeros((len(directions), len(points)), np.float32)

    def look(share: range) -> None:
        room = allocate_buffers(surface, (VIEW_SAMPLES, VIEW_SAMPLES), 1)
        grid, camera = np.zeros_like(room.grid), np.zeros((len(points), 3), np.float32)
        for d in share:
            view, lens = _shadow_view(directions[d], middle, radius)
            members = project_surface(points, surface, (view, lens), room, (VIEW_SAMPLES, VIEW_SAMPLES))
            geometry = (room.vertex, surface.triangles, surface.translucent, lens)
            draw_band(geometry, (room.corners, room.source, members), 0, room.depth, room.owner)
            transform_to_camera(lifted, view, lens, camera, grid)
            mark_visible(camera, grid, room.depth, np.float32(SLACK_MM), seen[d])

    with ThreadPoolExecutor(threads) as pool:
        list(pool.map(look, [range(i, len(directions), threads) for i in range(threads)]))
    return seen


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
def mark_visible(camera: Any, grid: Any, depth: Any, slack: Any, seen: Any) -> None:
    """Mark in `seen` (V,) the vertices before which nothing nearer than `slack` mm lies."""
    for v in range(len(camera)):
        x = min(max(grid[v, 0] >> GRID_SHIFT, 0), depth.shape[2] - 1)
        y = min(max(grid[v, 1] >> GRID_SHIFT, 0), depth.shape[1] - 1)
        if depth[0, y, x] * (camera[v, 2] - slack) <= np.float32(1):
            seen[v] = np.float32(1)


def _smooth_values(surface: Surface, values: NDArray[np.float32]) -> NDArray[np.float32]:
    """Values at vertices, each replaced by the mean over its triangles, a few times."""
    n_around = np.diff(surface.starts)
    inner = np.flatnonzero(n_around > 0)
    for _ in range(N_SMOOTHING_PASSES):
        at_triangles = values[surface.triangles].mean(axis=1)
        sums = np.add.reduceat(at_triangles[surface.members], surface.starts[:-1][inner], axis=0)
        values = values.copy()
        values[inner] = sums / n_around[inner, None]
    return values
