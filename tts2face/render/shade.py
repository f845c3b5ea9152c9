"""Shading of fragments in linear light: area lamps, subsurface scattering, highlights, sky and floor."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from tts2face.compilation import vectorized_kernel
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

SKIN_SCATTERING = np.array(
    [1.0, 0.5, 0.36], np.float32
)  # scattering of red, green and blue light under skin, relative to the part's wrap
INTERREFLECTION = np.float32(0.8)  # share of the light that a cavity reflects between its walls
SKY_GLOSS = np.float32(0.1)  # share of the sky that glossy parts reflect
TONE_SHOULDER = np.float32(0.65)  # linear light above which highlights are compressed to below 1
N_SCRATCH_ROWS = 9
SKY_ROW, FLOOR_ROW, UP_ROW, FIRST_LIGHT_ROW = range(4)  # rows of the light table; a light has direction and colour


@vectorized_kernel
def shade_fragments(table: Array, n: int, lights: Array, scratch: Array, colour: Array) -> None:
    """Compute the light of n fragments.

    Parameters
    ----------
    table : (17, H)
        Fragments, by the rows of `tts2face.render.fragments`.
    lights : (L, 6)
        Sky and floor colour, direction up, then one row for each light: direction towards it, colour.
    scratch : (N_SCRATCH_ROWS, H)
        Buffer for intermediate values.
    colour : (3, H)
        Out: light in [0, 1) of each fragment, multiplied by its opacity.
    """
    one, zero = np.float32(1), np.float32(0)
    nx, ny, nz = table[AT_NORMAL], table[AT_NORMAL + 1], table[AT_NORMAL + 2]
    gloss, view_x, view_y, view_z = scratch[0], scratch[1], scratch[2], scratch[3]
    towards, lobe, wrap = scratch[4], scratch[5], table[AT_WRAP]
    ray_x, ray_y, specular, shininess = table[AT_RAY], table[AT_RAY + 1], table[AT_SPECULAR], table[AT_SHININESS]
    for i in range(n):
        scale = one / np.sqrt(nx[i] * nx[i] + ny[i] * ny[i] + nz[i] * nz[i] + np.float32(1e-20))
        nx[i], ny[i], nz[i] = nx[i] * scale, ny[i] * scale, nz[i] * scale
        scale = -one / np.sqrt(ray_x[i] * ray_x[i] + ray_y[i] * ray_y[i] + one)
        view_x[i], view_y[i], view_z[i] = ray_x[i] * scale, ray_y[i] * scale, scale
        edge = one - max(nx[i] * view_x[i] + ny[i] * view_y[i] + nz[i] * view_z[i], zero)
        gloss[i] = specular[i] * (one + np.float32(3) * edge * edge * edge)  # after Schlick 1994
        towards[i] = nx[i] * lights[UP_ROW, 0] + ny[i] * lights[UP_ROW, 1] + nz[i] * lights[UP_ROW, 2]
    for c in range(3):
        matt, shine, albedo, visible = colour[c], scratch[6 + c], table[AT_ALBEDO + c], table[AT_EXPOSURE]
        middle = np.float32(0.5) * (lights[SKY_ROW, c] + lights[FLOOR_ROW, c])
        swing = np.float32(0.5) * (lights[SKY_ROW, c] - lights[FLOOR_ROW, c])
        for i in range(n):
            around = (middle + swing * towards[i]) * visible[i]
            matt[i] = around / (one - (one - visible[i]) * albedo[i] * INTERREFLECTION)
            shine[i] = SKY_GLOSS * around
    for k in range(FIRST_LIGHT_ROW, len(lights)):
        lx, ly, lz = lights[k, 0], lights[k, 1], lights[k, 2]
        visible = table[AT_EXPOSURE + 1 + k - FIRST_LIGHT_ROW]
        for i in range(n):
            towards[i] = nx[i] * lx + ny[i] * ly + nz[i] * lz
            hx, hy, hz = lx + view_x[i], ly + view_y[i], lz + view_z[i]
            length = np.sqrt(hx * hx + hy * hy + hz * hz + np.float32(1e-20))
            off = one - max((nx[i] * hx + ny[i] * hy + nz[i] * hz) / length, zero)
            base = one / (one + off * shininess[i] * np.float32(0.125))  # its eighth power is near exp(-off s)
            base *= base
            base *= base
            lobe[i] = base * base * min(max(towards[i] * np.float32(4), zero), one) * visible[i]
        for c in range(3):
            matt, shine, strength, reach = colour[c], scratch[6 + c], lights[k, 3 + c], SKIN_SCATTERING[c]
            for i in range(n):
                around_edge = wrap[i] * reach
                wrapped = visible[i] + around_edge * visible[i] * (
                    one - visible[i]
                )  # scattering reddens the edge of a shadow on skin
                matt[i] += strength * wrapped * max(towards[i] + around_edge, zero) / (one + around_edge)
                shine[i] += strength * lobe[i]
    for c in range(3):
        matt, shine, albedo, opacity = colour[c], scratch[6 + c], table[AT_ALBEDO + c], table[AT_OPACITY]
        for i in range(n):
            value = opacity[i] * matt[i] * albedo[i] + gloss[i] * shine[i]
            over = max(value - TONE_SHOULDER, zero) / (one - TONE_SHOULDER)
            matt[i] = min(value, TONE_SHOULDER) + (one - TONE_SHOULDER) * over / (one + over)
