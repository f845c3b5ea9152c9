"""Eyeballs: the lamps mirrored by the cornea, the dark ring of the iris, the lid's shadow, the wet line.

Applies to parts of the kind "eye" that turn with one of the face's eyes. Lengths are for an eyeball of 12 mm radius.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tts2face.face.deformation import FaceRig, eye_rotations, head_transform
from tts2face.models.face import Face
from tts2face.models.landmarks import LEFT_LIDS, RIGHT_LIDS
from tts2face.numeric.arrays import Array
from tts2face.numeric.kernels import UNIT, ZERO, kernel
from tts2face.picture.kernels.tables import AT_ALBEDO, AT_DIFFUSE, AT_EXPOSURE, AT_GLOW, AT_NORMAL, N_EXPOSURES

N_LID = 9
RADIUS_MM = 12.0  # radius of a human eyeball
IRIS_COSINE = 0.868  # of the angle between gaze and limbus: an iris of 11.9 mm
# Columns of the eye table: camera space unless stated; the lids as (across, up) from the centre in the eye's own axes.
CENTRE, GAZE, KEY, FILL, ACROSS, UP, SCALE, IRIS, HAS_LIDS, UPPER, LOWER = 0, 3, 6, 9, 12, 15, 18, 19, 20, 21, 39
N_EYE_COLUMNS = 57
SOFTBOX = (0.17, 0.22)  # half width and height of the key lamp's reflection, as components of the reflected ray
LID_SHADOW, LID_SHADOW_MM = np.float32(0.55), np.float32(1.5)  # share of light at the upper lid's margin, its fade
WET_LINE, WET_LINE_MM = np.float32(0.10), np.float32(0.22)  # brightness and half width of the tear line
SCLERA = np.float32(0.6)  # of its colour: the white of the eye lies in the lids' shade
CATCHLIGHT, FILL_LIGHT = np.float32(1.2), np.float32(0.16)  # brightness of the reflections of key and fill light


@dataclass(frozen=True, slots=True, eq=False)
class EyeGeometry:
    """Geometry of a face's eyes: ``lids`` (E, 2, 9) rows of the landmarks, -1 without; ``iris`` and ``radius`` (E,)."""

    rig: FaceRig
    corners: NDArray[np.int32]
    weights: NDArray[np.float32]
    lids: NDArray[np.int64]
    iris: NDArray[np.float32]
    radius: NDArray[np.float32]

    def table(
        self, pose: tuple[Array, Array, Array], view: NDArray[np.floating], lights: NDArray[np.floating]
    ) -> NDArray[np.float32]:
        """Eye table (E, N_EYE_COLUMNS) for (points, shape weights, head pose), a camera view and the lamps (2+, 3)."""
        points, weights, head = pose
        transform = head_transform(head, self.rig.pivot)
        turned, shift = view[:, :3] @ transform[:, :3], view[:, :3] @ transform[:, 3] + view[:, 3]
        rows = np.zeros((len(self.radius), N_EYE_COLUMNS), np.float32)
        for number, rotation in enumerate(eye_rotations(self.rig.eye_turns, np.asarray(weights))):
            row, scale = rows[number], RADIUS_MM / self.radius[number]
            centre = turned @ self.rig.eye_centres[number] + shift
            row[CENTRE : CENTRE + 3], row[GAZE : GAZE + 3] = centre, turned @ rotation[:, 2]
            row[KEY : KEY + 3], row[FILL : FILL + 3] = lights[0], lights[1]
            row[ACROSS : ACROSS + 3], row[UP : UP + 3] = turned[:, 0], turned[:, 1]
            row[SCALE], row[IRIS], row[HAS_LIDS] = scale, self.iris[number], self.lids[number, 0, 0] >= 0
            if row[HAS_LIDS]:
                for start, lid in zip((UPPER, LOWER), self.lids[number], strict=True):
                    margin = np.einsum("lcx,lc->lx", points[self.corners[lid]], self.weights[lid])
                    offset = (margin @ view[:, :3].T + view[:, 3] - centre) * scale
                    row[start : start + 2 * N_LID] = (offset @ turned[:, :2]).ravel()
        return rows


def eye_geometry(face: Face, rig: FaceRig) -> EyeGeometry:
    """Geometry of a face's eyes."""
    rows = {int(number): row for row, number in enumerate(face.landmarks)}
    lids = np.full((len(face.eyes), 2, N_LID), -1, np.int64)
    iris, radius = np.full(len(face.eyes), IRIS_COSINE, np.float32), np.full(len(face.eyes), RADIUS_MM, np.float32)
    for number, eye in enumerate(face.eyes):
        ball = face.vertices[eye.first : eye.first + eye.count] - eye.centre
        length = np.linalg.norm(ball, axis=1)
        radius[number] = max(float(np.median(length)), 1e-3)
        names = RIGHT_LIDS if eye.centre[0] < 0 else [lid[::-1] for lid in LEFT_LIDS]  # towards the person's left
        if all(name in rows for lid in names for name in lid):
            lids[number] = [[rows[name] for name in lid] for lid in names]
        for part in face.parts:
            used = np.unique(face.triangles[part.first : part.first + part.count]) - eye.first
            if "iris" in part.name and len(used) and used[0] >= 0 and used[-1] < eye.count:
                iris[number] = float((ball[used, 2] / np.maximum(length[used], 1e-3)).min())
    return EyeGeometry(
        rig, np.array(face.landmark_vertices), np.array(face.landmark_weights, np.float32), lids, iris, radius
    )


@kernel
def lid_height(eye: Array, start: int, across: float) -> float:
    """Height of a lid's margin above the eye's centre at a place across the eye, mm."""
    for k in range(N_LID - 1):
        x0, x1 = eye[start + 2 * k], eye[start + 2 * k + 2]
        if across <= x1 or k == N_LID - 2:
            share = min(max((across - x0) / (x1 - x0), np.float32(0)), np.float32(1)) if x1 > x0 else np.float32(0)
            return float(eye[start + 2 * k + 1] + share * (eye[start + 2 * k + 3] - eye[start + 2 * k + 1]))
    return 0.0


@kernel
def soft_edge(distance: float, half: float, slope: float) -> Any:
    """1 well within `half` of 0, 0 well beyond it."""
    return np.float32(1) / (np.float32(1) + np.exp(np.float32((abs(distance) - half) * slope)))


@kernel
def reflected_lamps(eye: Array, normal: tuple[float, float, float], view: tuple[float, float, float]) -> Any:
    """Brightness of the lamps in the mirror direction, as two rectangles."""
    nx, ny, nz = normal
    facing: Any = max(nx * view[0] + ny * view[1] + nz * view[2], np.float32(0))
    x, y, z = 2 * facing * nx - view[0], 2 * facing * ny - view[1], 2 * facing * nz - view[2]
    total = np.float32(0)
    if x * eye[KEY] + y * eye[KEY + 1] + z * eye[KEY + 2] > 0:
        box = soft_edge(x - eye[KEY], SOFTBOX[0], 40.0) * soft_edge(y - eye[KEY + 1], SOFTBOX[1], 40.0)
        total += CATCHLIGHT * box
    if x * eye[FILL] + y * eye[FILL + 1] + z * eye[FILL + 2] > 0:
        box = soft_edge(x - eye[FILL], SOFTBOX[0], 30.0) * soft_edge(y - eye[FILL + 1], SOFTBOX[1], 30.0)
        total += FILL_LIGHT * box
    return total


@kernel
def light_eye(eyes: Array, point: tuple[float, float, float], g: int, table: Array) -> None:
    """Change albedo, light and glow of fragment `g` at a point (3,) of an eyeball in camera space."""
    best, nearest = 0, np.float32(1e30)
    for e in range(len(eyes)):
        dx, dy, dz = point[0] - eyes[e, 0], point[1] - eyes[e, 1], point[2] - eyes[e, 2]
        squared = np.float32(dx * dx + dy * dy + dz * dz)
        if squared < nearest:
            best, nearest = e, squared
    eye, length = eyes[best], np.sqrt(nearest) + np.float32(1e-6)
    ox, oy, oz = point[0] - eye[0], point[1] - eye[1], point[2] - eye[2]
    nx, ny, nz = ox / length, oy / length, oz / length
    gx, gy, gz = eye[GAZE], eye[GAZE + 1], eye[GAZE + 2]
    ahead = nx * gx + ny * gy + nz * gz
    bump = min(max((ahead - eye[IRIS] + np.float32(0.008)) * np.float32(20), ZERO), UNIT) * np.float32(0.85)
    cx, cy, cz = nx + bump * (nx - gx * ahead), ny + bump * (ny - gy * ahead), nz + bump * (nz - gz * ahead)
    scale = UNIT / np.sqrt(cx * cx + cy * cy + cz * cz + np.float32(1e-9))
    far = -UNIT / np.sqrt(point[0] * point[0] + point[1] * point[1] + point[2] * point[2] + np.float32(1e-9))
    view = (point[0] * far, point[1] * far, point[2] * far)
    glow = reflected_lamps(eye, (cx * scale, cy * scale, cz * scale), view)
    ring = (ahead - eye[IRIS] - np.float32(0.006)) * np.float32(80)
    ring = UNIT - np.float32(0.6) * np.exp(-ring * ring)
    inside = ahead > eye[IRIS]
    towards = (nx - gx * ahead) * eye[KEY] + (ny - gy * ahead) * eye[KEY + 1]
    focus = UNIT + np.float32(1.6) * max(-towards, ZERO) + np.float32(0.15) if inside else UNIT
    corner = ZERO if inside else min(max((UNIT - ahead) * np.float32(1.6), ZERO), UNIT)
    shade = UNIT
    if eye[HAS_LIDS] > ZERO:
        mm = eye[SCALE]
        across = (ox * eye[ACROSS] + oy * eye[ACROSS + 1] + oz * eye[ACROSS + 2]) * mm
        height = (ox * eye[UP] + oy * eye[UP + 1] + oz * eye[UP + 2]) * mm
        under = max(np.float32(lid_height(eye, UPPER, across)) - height, ZERO)
        over = max(height - np.float32(lid_height(eye, LOWER, across)), ZERO)
        shade -= LID_SHADOW * np.exp(-under / LID_SHADOW_MM) + np.float32(0.18) * np.exp(-over * np.float32(1.6))
        line = (over - np.float32(0.3)) / WET_LINE_MM
        glow += WET_LINE * np.exp(-line * line) * max(-ny * eye[KEY + 1] - nz + np.float32(0.3), ZERO) * shade
    shade = max(shade, np.float32(0.1))
    table[AT_GLOW, g] = glow * shade
    for k in range(3):
        redness = np.float32(0.05) + np.float32(0.06) * np.float32(k)
        white = UNIT if inside else SCLERA
        table[AT_ALBEDO + k, g] *= ring * focus * white * (UNIT - corner * redness)
        table[AT_DIFFUSE + k, g] *= shade
    for k in range(N_EXPOSURES):
        table[AT_EXPOSURE + k, g] *= shade
    if inside:  # the cornea mirrors the lamps by `glow`; its normal is not that of the iris
        table[AT_NORMAL, g], table[AT_NORMAL + 1, g], table[AT_NORMAL + 2, g] = nx, ny, nz
