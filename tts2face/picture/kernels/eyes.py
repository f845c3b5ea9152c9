"""Eyeballs: the catchlight, the dark ring of the iris, the lid's shadow, the wet line.

Applies to parts of the kind "eye" that turn with one of the face's eyes. Lengths are for an eyeball of 12 mm radius.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tts2face.face.deformation import FaceRig, eye_rotations, head_transform
from tts2face.face.eyeballs import EyeOpenings
from tts2face.models.face import Face
from tts2face.numeric.arrays import Array
from tts2face.numeric.kernels import UNIT, ZERO, kernel
from tts2face.picture.catchlights import N_CATCHLIGHT_COLUMNS, catchlight, catchlight_sizes, place_catchlight
from tts2face.picture.kernels.tables import AT_ALBEDO, AT_DIFFUSE, AT_EXPOSURE, AT_GLOW, AT_NORMAL, N_EXPOSURES

N_LID = 9
RADIUS_MM = 12.0  # radius of a human eyeball
IRIS_COSINE = 0.868  # of the angle between gaze and limbus: an iris of 11.9 mm
# Columns of the eye table: camera space unless stated; the lids as (across, up) from the centre in the eye's own axes.
CENTRE, GAZE, KEY, ACROSS, UP, SCALE, IRIS, HAS_LIDS, UPPER, LOWER, CATCHLIGHT = 0, 3, 6, 9, 12, 15, 16, 17, 18, 36, 54
N_EYE_COLUMNS = CATCHLIGHT + N_CATCHLIGHT_COLUMNS
LID_SHADOW, LID_SHADOW_MM = np.float32(0.55), np.float32(1.5)  # share of light at the upper lid's margin, its fade
WET_LINE, WET_LINE_MM = np.float32(0.10), np.float32(0.22)  # brightness and half width of the tear line
SCLERA = np.float32(0.6)  # of its colour: the white of the eye lies in the lids' shade
SHINE = np.float32(1.2)  # brightness of a catchlight


@dataclass(frozen=True, slots=True, eq=False)
class EyeGeometry:
    """Geometry of a face's eyes: cosine ``iris`` (E,) of its edge, and ``sizes`` (E,) of the catchlights."""

    rig: FaceRig
    openings: EyeOpenings
    iris: NDArray[np.float32]
    sizes: NDArray[np.float64]

    def seen(
        self, pose: tuple[Array, Array, Array], view: NDArray[np.floating]
    ) -> tuple[NDArray[np.floating], NDArray[np.floating], NDArray[np.floating], NDArray[np.floating]]:
        """Centres (E, 3), gazes (E, 3) and lids (E, 2, 9, 3) in camera space, mm, and the head's rotation (3, 3) there.

        `pose` is (points, shape weights, head pose); lids without landmarks are NaN.
        """
        points, weights, head = pose
        transform = head_transform(head, self.rig.pivot)
        turned, shift = view[:, :3] @ transform[:, :3], view[:, :3] @ transform[:, 3] + view[:, 3]
        centres = self.rig.eye_centres @ turned.T + shift
        gazes = eye_rotations(self.rig.eye_turns, np.asarray(weights))[:, :, 2] @ turned.T
        lids = np.full((*self.openings.lids.shape, 3), np.nan)
        lids[self.openings.found] = self.openings.edges(points) @ view[:, :3].T + view[:, 3]
        return centres, gazes, lids, turned

    def catchlights(
        self,
        seen: tuple[NDArray[np.floating], NDArray[np.floating], NDArray[np.floating], NDArray[np.floating]],
        side: float,
    ) -> NDArray[np.float64]:
        """Rows (E, N_CATCHLIGHT_COLUMNS) of `seen` eyes, with the key light on a side (`place_catchlight`)."""
        rows = np.zeros((len(self.openings.radius), N_CATCHLIGHT_COLUMNS))
        for number, (row, centre, gaze, lids) in enumerate(zip(rows, *seen[:3], strict=True)):
            edges = (lids - centre) / self.openings.radius[number] if self.openings.found[number] else None
            row[:] = place_catchlight(centre, gaze, edges, (float(self.iris[number]), float(self.sizes[number])), side)
        return rows

    def table(
        self, pose: tuple[Array, Array, Array], view: NDArray[np.floating], lights: NDArray[np.floating]
    ) -> NDArray[np.float32]:
        """Eye table (E, N_EYE_COLUMNS) for (points, shape weights, head pose), a camera view and the lamps (2+, 3)."""
        rows = np.zeros((len(self.openings.radius), N_EYE_COLUMNS), np.float32)
        seen = self.seen(pose, view)
        centres, gazes, lids, turned = seen
        rows[:, CENTRE : CENTRE + 3], rows[:, GAZE : GAZE + 3], rows[:, KEY : KEY + 3] = centres, gazes, lights[0]
        rows[:, ACROSS : ACROSS + 3], rows[:, UP : UP + 3] = turned[:, 0], turned[:, 1]
        rows[:, SCALE], rows[:, IRIS], rows[:, HAS_LIDS] = (
            RADIUS_MM / self.openings.radius,
            self.iris,
            self.openings.found,
        )
        offset = (lids - centres[:, None, None]) * (RADIUS_MM / self.openings.radius)[:, None, None, None]
        rows[:, UPPER:CATCHLIGHT] = np.nan_to_num(offset @ turned[:, :2]).reshape(len(rows), CATCHLIGHT - UPPER)
        rows[:, CATCHLIGHT:] = self.catchlights(seen, float(np.sign(lights[0][0])))
        return rows


def eye_geometry(face: Face, rig: FaceRig) -> EyeGeometry:
    """Geometry of a face's eyes."""
    iris, openings = np.full(len(face.eyes), IRIS_COSINE, np.float32), rig.clearance.openings
    for number, eye in enumerate(face.eyes):
        ball = face.vertices[eye.first : eye.first + eye.count] - eye.centre
        length = np.linalg.norm(ball, axis=1)
        for part in face.parts:
            used = np.unique(face.triangles[part.first : part.first + part.count]) - eye.first
            if "iris" in part.name and len(used) and used[0] >= 0 and used[-1] < eye.count:
                iris[number] = float((ball[used, 2] / np.maximum(length[used], 1e-3)).min())
    return EyeGeometry(rig, openings, iris, catchlight_sizes(rig.eye_centres, openings.radius))


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
    glow = SHINE * catchlight(eye, CATCHLIGHT, nx, ny, nz)
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
