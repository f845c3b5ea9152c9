"""Soft shadows: the share of sky light and of each lamp's light that reaches every vertex.

A face carries for each vertex the directions from which it is hidden (`tts2face.picture.occlusion`), so that the light
of any lamp is a sum over directions. Shadows are fixed to the skin, an approximation that holds for large lamps and
small head motion, and are interpolated between the closed and the wide open mouth by the lip opening of the shape
weights.
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tts2face.models.face import Face
from tts2face.models.landmarks import LOWER_LIP_INNER_MID, UPPER_LIP_INNER_MID
from tts2face.numeric.kernels import ZERO, kernel
from tts2face.picture.kernels.lamps import LAMP_RADIUS_RAD
from tts2face.picture.occlusion import OPEN_JAW_WEIGHT, occlusion_of, occlusion_poses, pose_normals, sphere_directions
from tts2face.picture.surface import Surface

HIDDEN_EYE_LIGHT = 0.6  # least exposure of an eyeball, as a share of that of its lit parts: it turns
HIDDEN_TOOTH_LIGHT = 0.6  # likewise of teeth behind the lips of the open mouth: enamel scatters light
N_SMOOTHING_PASSES = 2  # smoothing passes over neighbours, against the noise of few directions


@dataclass(frozen=True, slots=True, eq=False)
class Exposure:
    """Exposure of each vertex to the sky and to the lamps: ``rest`` (V, 5), plus ``gain`` (V, 5) with an open mouth.

    ``opening`` (K,) is the lip opening of each shape at weight 1, relative to the wide open mouth.
    """

    rest: NDArray[np.float32]
    gain: NDArray[np.float32]
    opening: NDArray[np.float32]

    def at(self, weights: NDArray[np.floating]) -> NDArray[np.float32]:
        """Exposure (V, 5) for shape weights (K,); it grows with the square root of the lip opening."""
        opened = min(max(float(np.dot(self.opening, weights)), 0.0), 1.0)
        return self.rest + np.float32(math.sqrt(opened)) * self.gain


def compute_exposure(face: Face, surface: Surface, lamps: NDArray[np.float64], threads: int) -> Exposure:
    """Exposure of a face to the sky and to lamps in the world directions `lamps` (L, 3)."""
    hidden = occlusion_of(face, surface, threads)
    exposures = [
        _pose_exposure(surface, pose_normals(surface, pose), bits, lamps)
        for pose, bits in zip(occlusion_poses(face), hidden, strict=True)
    ]
    for part in face.parts:
        if part.name.startswith("teeth"):
            teeth = np.unique(face.triangles[part.first : part.first + part.count])
            lit = HIDDEN_TOOTH_LIGHT * np.percentile(exposures[-1][teeth], 90, axis=0)
            exposures[-1][teeth] = np.maximum(exposures[-1][teeth], lit)
    return Exposure(exposures[0], exposures[-1] - exposures[0], lip_opening(face))


def lip_opening(face: Face) -> NDArray[np.float32]:
    """Lip opening (K,) of each shape at its middle, relative to that of the wide open mouth.

    On a face without lip landmarks only the shape `Face.opened_by` opens the lips.
    """
    opening, widest = np.zeros(len(face.shape_names), np.float32), face.opening
    if widest is not None:
        opening[widest] = 1 / OPEN_JAW_WEIGHT
    rows = {int(number): row for row, number in enumerate(face.landmarks)}
    if widest is None or not {UPPER_LIP_INNER_MID, LOWER_LIP_INNER_MID} <= rows.keys():
        return opening
    upper, lower = (
        np.einsum("kv,v->k", face.shapes[:, face.landmark_vertices[rows[lip]], 1], face.landmark_weights[rows[lip]])
        for lip in (UPPER_LIP_INNER_MID, LOWER_LIP_INNER_MID)
    )
    parted = upper - lower
    return (parted / (OPEN_JAW_WEIGHT * parted[widest])).astype(np.float32) if parted[widest] > 0 else opening


def lamp_weights(directions: NDArray[np.float64], lamps: NDArray[np.float64]) -> NDArray[np.float32]:
    """Weights (D, L) of directions in the light of lamps, soft lobes of `LAMP_RADIUS_RAD`; each column adds up to 1."""
    lobes = np.exp((directions @ lamps.T - 1) / LAMP_RADIUS_RAD**2)
    weights: NDArray[np.float32] = (lobes / lobes.sum(axis=0)).astype(np.float32)
    return weights


def _pose_exposure(
    surface: Surface, normals: NDArray[np.float32], hidden: NDArray[np.uint8], lamps: NDArray[np.float64]
) -> NDArray[np.float32]:
    """Exposure (V, 1 + L) of vertices with normals (V, 3) that are hidden from directions, packed bits (V, D / 8)."""
    directions = sphere_directions(8 * hidden.shape[1])
    exposure = np.zeros((len(normals), 1 + len(lamps)), np.float32)
    sum_directions(hidden, directions.astype(np.float32), normals, lamp_weights(directions, lamps), exposure)
    turned = np.clip((normals @ lamps.T.astype(np.float32) + 0.15) / 0.4, 0.0, 1.0)
    exposure[:, 1:] = 1 - turned + turned * exposure[:, 1:]  # a vertex that faces away is not shadowed
    sums = np.zeros((len(surface.triangles), exposure.shape[1]), np.float32)
    for _ in range(N_SMOOTHING_PASSES):
        smooth_values(surface.triangles, surface.starts, surface.members, exposure, sums)
    for first, end in surface.rig.eye_spans:
        ball = exposure[first:end]
        np.maximum(ball, HIDDEN_EYE_LIGHT * np.percentile(ball, 85, axis=0), out=ball)
    return exposure


@kernel
def sum_directions(hidden: Any, directions: Any, normals: Any, weights: Any, exposure: Any) -> None:
    """Write the share of the light of the sky (V, 1) and of lamps (V, L) that comes from directions not `hidden`."""
    n_lamps = weights.shape[1]
    for v in range(len(hidden)):
        whole, seen = ZERO, ZERO
        for k in range(n_lamps):
            exposure[v, 1 + k] = ZERO
        for d in range(len(directions)):
            facing = (
                directions[d, 0] * normals[v, 0] + directions[d, 1] * normals[v, 1] + directions[d, 2] * normals[v, 2]
            )
            # scattered light reaches a vertex from beside it, too
            facing = max(facing, np.float32(0.02))
            whole += facing
            if hidden[v, d >> 3] & (128 >> (d & 7)):
                continue
            seen += facing
            for k in range(n_lamps):
                exposure[v, 1 + k] += weights[d, k]
        exposure[v, 0] = seen / whole


@kernel
def smooth_values(triangles: Any, starts: Any, members: Any, values: Any, sums: Any) -> None:
    """Replace vertex values (V, C) by the mean over the triangles around each vertex; `sums` (F, C) is a buffer."""
    n_columns = values.shape[1]
    for t in range(len(triangles)):
        a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        for k in range(n_columns):
            sums[t, k] = values[a, k] + values[b, k] + values[c, k]
    for v in range(len(values)):
        n = starts[v + 1] - starts[v]
        if n == 0:
            continue
        for k in range(n_columns):
            total = np.float32(0)
            for m in range(starts[v], starts[v + 1]):
                total += sums[members[m], k]
            values[v, k] = total / np.float32(3 * n)
