"""The light that fragments send to the camera: soft lights, light under skin, highlights, a bright sky; linear light."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from tts2face.render.compiled import streaming
from tts2face.render.fragments import (
    AT_ALBEDO,
    AT_EXPOSURE,
    AT_NORMAL,
    AT_OPACITY,
    AT_RAY,
    AT_SHININESS,
    AT_SPECULAR,
    AT_WRAP,
)

Array = NDArray[Any]

REACH = np.array([1.0, 0.5, 0.36], np.float32)  # of red, green and blue light under skin, of the part's wrap
BOUNCE = np.float32(0.8)  # share of the light between walls of a hollow that stays in it
SKY_GLOSS = np.float32(0.1)  # of the sky that a glossy part mirrors
SHOULDER = np.float32(0.65)  # linear light from which bright places are pressed together, below 1
SKY, FLOOR, UP, LIGHTS = 0, 1, 2, 3  # rows of the table of lights; a light has a direction and a colour


@streaming
def light(table: Array, n: int, lights: Array, ambient: Array, colour: Array) -> None:
    """Write the light of n fragments.

    Parameters
    ----------
    table : (17, H)
        Fragments, by the rows of `tts2face.render.fragments`.
    lights : (L, 6)
        Sky and floor colour, direction up, then one row for each light: direction towards it, colour.
    ambient : (4, H)
        Scratch.
    colour : (3, H)
        Out: light in [0, 1) that a fragment adds, its opacity counted in.
    """
    one, zero, half = np.float32(1), np.float32(0), np.float32(0.5)
    nx, ny, nz = table[AT_NORMAL], table[AT_NORMAL + 1], table[AT_NORMAL + 2]
    gloss, view_x, view_y, view_z = ambient[0], ambient[1], ambient[2], ambient[3]
    for i in range(n):
        scale = one / np.sqrt(nx[i] * nx[i] + ny[i] * ny[i] + nz[i] * nz[i] + np.float32(1e-20))
        nx[i], ny[i], nz[i] = nx[i] * scale, ny[i] * scale, nz[i] * scale
        dx, dy = table[AT_RAY, i], table[AT_RAY + 1, i]
        towards = one / np.sqrt(dx * dx + dy * dy + one)
        view_x[i], view_y[i], view_z[i] = -dx * towards, -dy * towards, -towards
        edge = one - max(nx[i] * view_x[i] + ny[i] * view_y[i] + nz[i] * view_z[i], zero)
        gloss[i] = table[AT_SPECULAR, i] * (one + np.float32(3) * edge * edge * edge)  # after Schlick 1994
    for c in range(3):
        for i in range(n):
            seen, albedo = table[AT_EXPOSURE, i], table[AT_ALBEDO + c, i]
            sky = half + half * (nx[i] * lights[UP, 0] + ny[i] * lights[UP, 1] + nz[i] * lights[UP, 2])
            around = (lights[FLOOR, c] + (lights[SKY, c] - lights[FLOOR, c]) * sky) * seen
            matt = around / (one - (one - seen) * albedo * BOUNCE)
            shine = zero
            reach = table[AT_WRAP, i] * REACH[c]
            for k in range(LIGHTS, len(lights)):
                lx, ly, lz = lights[k, 0], lights[k, 1], lights[k, 2]
                arriving = lights[k, 3 + c] * table[AT_EXPOSURE + 1 + k - LIGHTS, i]
                towards = nx[i] * lx + ny[i] * ly + nz[i] * lz
                matt += arriving * max(towards + reach, zero) / (one + reach)
                hx, hy, hz = lx + view_x[i], ly + view_y[i], lz + view_z[i]
                length = np.sqrt(hx * hx + hy * hy + hz * hz + np.float32(1e-20))
                off = one - max((nx[i] * hx + ny[i] * hy + nz[i] * hz) / length, zero)
                lobe = one / (one + off * table[AT_SHININESS, i] * np.float32(0.125))  # eighth power: near exp(-off s)
                lobe *= lobe
                lobe *= lobe
                shine += arriving * lobe * lobe * min(max(towards * np.float32(4), zero), one)
            opacity = table[AT_OPACITY, i]
            value = opacity * matt * albedo + gloss[i] * (shine + SKY_GLOSS * around)
            over = max(value - SHOULDER, zero) / (one - SHOULDER)
            colour[c, i] = min(value, SHOULDER) + (one - SHOULDER) * over / (one + over)
