"""Eyes: their texture in the baked light of the socket, the sky that they mirror and the catchlight of the key lamp.

What eyes mirror moves with the gaze and the camera; nothing that is baked can do this. The few fragments of eyeballs
are gathered into rows of long arrays.
"""

from typing import Any

import numpy as np

from tts2face.models.view_transform import OFFSET, SPAN
from tts2face.numeric.arrays import Array
from tts2face.numeric.kernels import HALF, UNIT, ZERO, inlined_kernel, kernel
from tts2face.picture.baked.visibility import NEAR, X, Y
from tts2face.picture.catchlights import N_CATCHLIGHT_COLUMNS, catchlight

EDGE_RAD = 1.1  # angle from the gaze at the edge of the texture
REFRACTION = 1.45  # index of the cornea
CATCHLIGHT_LEVEL = np.float32(1.6)  # linear light of a catchlight's strongest channel: just white
# Columns of a row for an eye: its centre, the rotation from its own axes, by rows, the edges of pupil and iris, the
# scale of the texture in the pupil and beside it, the light of its catchlight and its row.
CENTRE, TURN, PUPIL, IRIS, INNER, OUTER, KEY, CATCHLIGHT = 0, 3, 12, 13, 14, 15, 16, 19
N_EYE_COLUMNS = CATCHLIGHT + N_CATCHLIGHT_COLUMNS
POSITION, AXES, FOCAL, MIDDLE_X, MIDDLE_Y = 0, 3, 12, 13, 14  # of a camera: place, right, down, ahead, lens
LAMP_LIGHT = 14  # column of the radiance of a lamp
# Rows of the fragments of eyes: place, normal, linear light, and number of the eye.
PLACE, FACES, LIGHT, EYE = 0, 3, 6, 9
N_ROWS = 10
TAN_TERMS = (0.9999955, -0.3329886, 0.1955891, -0.1211095, 0.0573306, -0.0134222)  # of the angle over its tangent
_LEVEL_SCALE = np.float32(32 / SPAN / np.log(2.0))
_OFFSET = np.float32(OFFSET)
_HALF_ANGLE = np.float32(1 / (2 * EDGE_RAD))


@kernel
def find_eyes(triangle: Array, count: int, eye_of: Array, numbers: Array) -> int:
    """Write the numbers of the first `count` fragments, of a triangle each, that lie on eyeballs; returns how many."""
    n = 0
    for i in range(count):
        numbers[n] = i
        n += eye_of[triangle[i]] >= 0
    return n


@inlined_kernel
def _angle(across: Any, ahead: Any) -> Any:
    """Angle, rad, of a direction from an axis, of which it goes `across` >= 0 and `ahead`; to 1e-5."""
    length = abs(ahead)
    x = min(across, length) / max(across, length, np.float32(1e-12))
    z = x * x
    turn = np.float32(TAN_TERMS[5])
    turn = turn * z + np.float32(TAN_TERMS[4])
    turn = turn * z + np.float32(TAN_TERMS[3])
    turn = turn * z + np.float32(TAN_TERMS[2])
    turn = turn * z + np.float32(TAN_TERMS[1])
    turn = (turn * z + np.float32(TAN_TERMS[0])) * x
    turn = np.float32(np.pi / 2) - turn if across > length else turn
    return np.float32(np.pi) - turn if ahead < 0 else turn


@kernel
def place_eyes(
    found: tuple[Array, Array, Array, Array],
    surface: tuple[Array, Array, Array],
    eyes: tuple[Array, Array, Array],
    colour: Array,
    rows: Array,
) -> None:
    """Write places, normals, the light of the texture and the eyes (10, M) of the fragments of eyeballs.

    Parameters
    ----------
    found
        Numbers (M,) of these fragments, and triangle and place of every one.
    surface
        Projected vertices (V, 8), triangles (F, 3), and the eye (F,) of each triangle.
    eyes
        Rows of the eyes, their texture (S, S, 3) in linear light, and the camera (15,).
    colour : (3, N)
        Light on every fragment.
    """
    numbers, triangle, across, down = found
    table, triangles, eye_of = surface
    of_eyes, texture, camera = eyes
    side = np.float32(len(texture))
    for n in range(rows.shape[1]):
        i = numbers[n]
        t = triangle[i]
        a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        ax, ay = table[a, X], table[a, Y]
        bx, by, cx, cy = table[b, X] - ax, table[b, Y] - ay, table[c, X] - ax, table[c, Y] - ay
        inverse = UNIT / (bx * cy - cx * by)
        x, y = across[i] - ax, down[i] - ay
        s, r = (x * cy - cx * y) * inverse, (bx * y - x * by) * inverse
        ahead = UNIT / ((UNIT - s - r) * table[a, NEAR] + s * table[b, NEAR] + r * table[c, NEAR])
        right = (across[i] + HALF - camera[MIDDLE_X]) * ahead / camera[FOCAL]
        below = (down[i] + HALF - camera[MIDDLE_Y]) * ahead / camera[FOCAL]
        rows[EYE, n] = e = eye_of[t]
        px = camera[0] + camera[AXES] * right + camera[AXES + 3] * below + camera[AXES + 6] * ahead
        py = camera[1] + camera[AXES + 1] * right + camera[AXES + 4] * below + camera[AXES + 7] * ahead
        pz = camera[2] + camera[AXES + 2] * right + camera[AXES + 5] * below + camera[AXES + 8] * ahead
        nx, ny, nz = px - of_eyes[e, CENTRE], py - of_eyes[e, CENTRE + 1], pz - of_eyes[e, CENTRE + 2]
        scale = UNIT / np.sqrt(nx * nx + ny * ny + nz * nz)
        nx, ny, nz = nx * scale, ny * scale, nz * scale
        rows[PLACE, n], rows[PLACE + 1, n], rows[PLACE + 2, n] = px, py, pz
        rows[FACES, n], rows[FACES + 1, n], rows[FACES + 2, n] = nx, ny, nz
        dx = nx * of_eyes[e, TURN] + ny * of_eyes[e, TURN + 3] + nz * of_eyes[e, TURN + 6]
        dy = nx * of_eyes[e, TURN + 1] + ny * of_eyes[e, TURN + 4] + nz * of_eyes[e, TURN + 7]
        dz = nx * of_eyes[e, TURN + 2] + ny * of_eyes[e, TURN + 5] + nz * of_eyes[e, TURN + 8]
        aside = np.sqrt(max(dx * dx + dy * dy, np.float32(1e-12)))
        off = _angle(aside, dz)
        if off < of_eyes[e, PUPIL]:
            off *= of_eyes[e, INNER]
        elif off < of_eyes[e, IRIS]:
            off = of_eyes[e, IRIS] - (of_eyes[e, IRIS] - off) * of_eyes[e, OUTER]
        scale = off * _HALF_ANGLE / aside
        u = min(max((HALF + scale * dx) * side - HALF, ZERO), side - np.float32(1.01))
        v = min(max((HALF - scale * dy) * side - HALF, ZERO), side - np.float32(1.01))
        left, top = int(u), int(v)
        fx, fy = u - np.float32(left), v - np.float32(top)
        for k in range(3):
            upper = texture[top, left, k] * (UNIT - fx) + texture[top, left + 1, k] * fx
            lower = texture[top + 1, left, k] * (UNIT - fx) + texture[top + 1, left + 1, k] * fx
            rows[LIGHT + k, n] = (upper * (UNIT - fy) + lower * fy) * colour[k, i]


@kernel
def shine(camera: Array, eyes: Array, sky: Array, rows: Array) -> None:
    """Add the radiance of the sky (3,) by Fresnel's share to rows (10, M), and lay catchlights over them."""
    for i in range(rows.shape[1]):
        a, b, c = rows[0, i] - camera[0], rows[1, i] - camera[1], rows[2, i] - camera[2]
        x, y, z = rows[FACES, i], rows[FACES + 1, i], rows[FACES + 2, i]
        facing = -(a * x + b * y + c * z) / np.sqrt(a * a + b * b + c * c)
        seen = max(facing, np.float32(1e-3))
        g = np.sqrt(np.float32(REFRACTION * REFRACTION - 1) + seen * seen)
        p, q = (g - seen) / (g + seen), (seen * (g + seen) - UNIT) / (seen * (g - seen) + UNIT)
        share = np.float32(0.5) * p * p * (UNIT + q * q) if facing > ZERO else ZERO
        eye = eyes[int(rows[EYE, i])]
        lit = catchlight(eye, CATCHLIGHT, x, y, z)
        for k in range(3):
            light = rows[LIGHT + k, i] + share * sky[k]
            rows[LIGHT + k, i] = light + lit * max(eye[KEY + k] - light, ZERO)


@inlined_kernel
def _level(light: Any) -> Any:
    """Place of linear light in the table of the view transform, along a colour."""
    level = np.log(max(light, np.float32(0)) / _OFFSET + np.float32(1)) * _LEVEL_SCALE
    return min(max(level, np.float32(0)), np.float32(31.999))


@kernel
def look_up(view: Array, light: Array, numbers: Array, colour: Array) -> None:
    """Write displayed colours of linear light (3, M) by a table (33, 33, 33, 3), between its entries, into (3, N)."""
    for n in range(light.shape[1]):
        x, y, z = _level(light[0, n]), _level(light[1, n]), _level(light[2, n])
        i, j, k = int(x), int(y), int(z)
        f, g, h = x - np.float32(i), y - np.float32(j), z - np.float32(k)
        for c in range(3):
            low = (view[i, j, k, c] * (UNIT - h) + view[i, j, k + 1, c] * h) * (UNIT - g)
            low += (view[i, j + 1, k, c] * (UNIT - h) + view[i, j + 1, k + 1, c] * h) * g
            high = (view[i + 1, j, k, c] * (UNIT - h) + view[i + 1, j, k + 1, c] * h) * (UNIT - g)
            high += (view[i + 1, j + 1, k, c] * (UNIT - h) + view[i + 1, j + 1, k + 1, c] * h) * g
            colour[c, numbers[n]] = low * (UNIT - f) + high * f


def colour_eyes(
    found: tuple[Array, Array, Array],
    count: int,
    surface: tuple[Array, Array, Array],
    eyes: tuple[Array, Array, Array],
    light: tuple[Array, Array],
    colour: Array,
) -> None:
    """Replace the colour (3, N) of fragments of eyeballs, which is the light on them, by how they look.

    Parameters
    ----------
    found, surface, eyes
        As `place_eyes`; `found` without the numbers.
    light
        Sky, and the table of the view transform.
    """
    sky, view = light
    numbers = np.zeros(count + 1, np.int32)
    numbers = numbers[: find_eyes(found[0], count, surface[2], numbers)]
    if len(numbers):
        rows = np.zeros((N_ROWS, len(numbers)), np.float32)
        place_eyes((numbers, *found), surface, eyes, colour, rows)
        shine(eyes[2], eyes[0], sky, rows)
        look_up(view, rows[LIGHT:EYE], numbers, colour)
