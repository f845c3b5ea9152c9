"""Eyes: their texture in the baked light of the socket, and the lamps that they mirror, through the view transform.

What eyes mirror moves with the gaze and the camera; nothing that is baked can do this.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from tts2face.compilation import inlined_kernel, kernel
from tts2face.render.film.view_transform import OFFSET, SPAN
from tts2face.render.film.visibility import NEAR, X, Y

Array = NDArray[Any]

EDGE_RAD = 1.1  # angle from the gaze at the edge of the texture (`corpus_tools.head.eyes`)
REFRACTION = 1.45  # index of the cornea
SOFT_EDGE = 0.035  # of a mirrored lamp, a share of its distance
# Columns of a row for an eye: its centre, the rotation from its own axes, by rows, the edges of pupil and iris, and the
# scale of the texture in the pupil and beside it.
CENTRE, TURN, PUPIL, IRIS, INNER, OUTER = 0, 3, 12, 13, 14, 15
N_EYE_COLUMNS = 16
POSITION, AXES, FOCAL, MIDDLE_X, MIDDLE_Y = 0, 3, 12, 13, 14  # of a camera: place, right, down, ahead, lens
LAMP_CENTRE, LAMP_ACROSS, LAMP_UP, LAMP_NORMAL, LAMP_WIDE, LAMP_HIGH, LAMP_LIGHT = 0, 3, 6, 9, 12, 13, 14
_LEVEL_SCALE = np.float32(32 / SPAN / np.log(2.0))
_OFFSET = np.float32(OFFSET)
_HALF_ANGLE = np.float32(1 / (2 * EDGE_RAD))


@inlined_kernel
def _level(light: Any) -> Any:
    """Place of linear light in the table of the view transform."""
    return min(
        max(np.log(max(light, np.float32(0)) / _OFFSET + np.float32(1)) * _LEVEL_SCALE, np.float32(0)),
        np.float32(31.999),
    )


@kernel
def look_up(view: Array, light: Array, colour: Array) -> None:
    """Write the displayed colour (3,) of linear light (3,) by a table (33, 33, 33, 3), between its entries."""
    x, y, z = _level(light[0]), _level(light[1]), _level(light[2])
    i, j, k = int(x), int(y), int(z)
    f, g, h = x - np.float32(i), y - np.float32(j), z - np.float32(k)
    one = np.float32(1)
    for c in range(3):
        low = (view[i, j, k, c] * (one - h) + view[i, j, k + 1, c] * h) * (one - g)
        low += (view[i, j + 1, k, c] * (one - h) + view[i, j + 1, k + 1, c] * h) * g
        high = (view[i + 1, j, k, c] * (one - h) + view[i + 1, j, k + 1, c] * h) * (one - g)
        high += (view[i + 1, j + 1, k, c] * (one - h) + view[i + 1, j + 1, k + 1, c] * h) * g
        colour[c] = low * (one - f) + high * f


@kernel
def mirror_lamps(point: Array, normal: Array, camera: Array, lamps: Array, sky: Array, light: Array) -> None:
    """Write the radiance (3,) of lamps (L, 17) and sky in the mirror direction, by Fresnel's share."""
    x, y, z = point[0] - camera[0], point[1] - camera[1], point[2] - camera[2]
    scale = np.float32(1) / np.sqrt(x * x + y * y + z * z)
    x, y, z = x * scale, y * scale, z * scale
    facing = -(x * normal[0] + y * normal[1] + z * normal[2])
    light[0] = light[1] = light[2] = np.float32(0)
    if facing <= 0:
        return
    x, y, z = x + 2 * facing * normal[0], y + 2 * facing * normal[1], z + 2 * facing * normal[2]
    g = np.sqrt(np.float32(REFRACTION * REFRACTION - 1) + facing * facing)
    a, b = (g - facing) / (g + facing), (facing * (g + facing) - 1) / (facing * (g - facing) + 1)
    share = np.float32(0.5) * a * a * (1 + b * b)
    for c in range(3):
        light[c] = sky[c]
    for n in range(len(lamps)):
        lamp = lamps[n]
        towards = x * lamp[LAMP_NORMAL] + y * lamp[LAMP_NORMAL + 1] + z * lamp[LAMP_NORMAL + 2]
        if towards >= np.float32(-1e-4):  # from behind
            continue
        dx, dy, dz = lamp[0] - point[0], lamp[1] - point[1], lamp[2] - point[2]
        far = (dx * lamp[LAMP_NORMAL] + dy * lamp[LAMP_NORMAL + 1] + dz * lamp[LAMP_NORMAL + 2]) / towards
        if far <= 0:
            continue
        hx, hy, hz = far * x - dx, far * y - dy, far * z - dz
        across = abs(hx * lamp[LAMP_ACROSS] + hy * lamp[LAMP_ACROSS + 1] + hz * lamp[LAMP_ACROSS + 2])
        up = abs(hx * lamp[LAMP_UP] + hy * lamp[LAMP_UP + 1] + hz * lamp[LAMP_UP + 2])
        soft = np.float32(SOFT_EDGE) * far
        p = min(max((lamp[LAMP_WIDE] + soft - across) / (2 * soft), np.float32(0)), np.float32(1))
        q = min(max((lamp[LAMP_HIGH] + soft - up) / (2 * soft), np.float32(0)), np.float32(1))
        part = p * p * (3 - 2 * p) * q * q * (3 - 2 * q)
        for c in range(3):
            light[c] += part * lamp[LAMP_LIGHT + c]
    for c in range(3):
        light[c] *= share


@kernel
def colour_eyes(
    found: tuple[Array, Array, Array],
    count: int,
    surface: tuple[Array, Array, Array],
    eyes: tuple[Array, Array, Array],
    light: tuple[Array, Array, Array],
    colour: Array,
) -> None:
    """Replace the colour (3, N) of fragments of eyeballs, which is the light on them, by how they look.

    Parameters
    ----------
    found
        Triangle and place of each fragment.
    surface
        Projected vertices (V, 8), triangles (F, 3), and the eye (F,) of each triangle, -1 for others.
    eyes
        Rows of the eyes, their texture (S, S, 3) in linear light, and the camera (15,).
    light
        Lamps, sky, and the table of the view transform.
    """
    triangle, across, down = found
    table, triangles, eye_of = surface
    rows, texture, camera = eyes
    lamps, sky, view = light
    side = np.float32(len(texture))
    one, half, zero = np.float32(1), np.float32(0.5), np.float32(0)
    point, normal = np.zeros(3, np.float32), np.zeros(3, np.float32)
    mirrored, total = np.zeros(3, np.float32), np.zeros(3, np.float32)
    for i in range(count):
        t = triangle[i]
        if eye_of[t] < 0:
            continue
        a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        ax, ay = table[a, X], table[a, Y]
        bx, by, cx, cy = table[b, X] - ax, table[b, Y] - ay, table[c, X] - ax, table[c, Y] - ay
        inverse = one / (bx * cy - cx * by)
        x, y = across[i] - ax, down[i] - ay
        s, r = (x * cy - cx * y) * inverse, (bx * y - x * by) * inverse
        ahead = one / ((one - s - r) * table[a, NEAR] + s * table[b, NEAR] + r * table[c, NEAR])
        right = (across[i] + half - camera[MIDDLE_X]) * ahead / camera[FOCAL]
        below = (down[i] + half - camera[MIDDLE_Y]) * ahead / camera[FOCAL]
        eye = rows[eye_of[t]]
        length = zero
        for k in range(3):
            point[k] = (
                camera[k] + camera[AXES + k] * right + camera[AXES + 3 + k] * below + camera[AXES + 6 + k] * ahead
            )
            normal[k] = point[k] - eye[k]
            length += normal[k] * normal[k]
        length = one / np.sqrt(length)
        for k in range(3):
            normal[k] *= length
        dx = normal[0] * eye[TURN] + normal[1] * eye[TURN + 3] + normal[2] * eye[TURN + 6]
        dy = normal[0] * eye[TURN + 1] + normal[1] * eye[TURN + 4] + normal[2] * eye[TURN + 7]
        dz = normal[0] * eye[TURN + 2] + normal[1] * eye[TURN + 5] + normal[2] * eye[TURN + 8]
        aside = np.sqrt(max(dx * dx + dy * dy, np.float32(1e-12)))
        off = np.arctan2(aside, dz)
        if off < eye[PUPIL]:
            off *= eye[INNER]
        elif off < eye[IRIS]:
            off = eye[IRIS] - (eye[IRIS] - off) * eye[OUTER]
        scale = off * _HALF_ANGLE / aside
        px = min(max((half + scale * dx) * side - half, zero), side - np.float32(1.01))
        py = min(max((half - scale * dy) * side - half, zero), side - np.float32(1.01))
        left, top = int(px), int(py)
        fx, fy = px - np.float32(left), py - np.float32(top)
        mirror_lamps(point, normal, camera, lamps, sky, mirrored)
        for k in range(3):
            upper = texture[top, left, k] * (one - fx) + texture[top, left + 1, k] * fx
            lower = texture[top + 1, left, k] * (one - fx) + texture[top + 1, left + 1, k] * fx
            total[k] = (upper * (one - fy) + lower * fy) * colour[k, i] + mirrored[k]
        look_up(view, total, normal)
        for k in range(3):
            colour[k, i] = normal[k]
