"""Shading in linear light: diffuse light at the vertices, highlights and the tone curve at the fragments.

Diffuse light changes slowly over a surface and is computed at the vertices, where light that scatters under skin is an
average over the vertices around. Highlights are computed for each fragment: two lobes of the distribution of Trowbridge
and Reitz 1975 (GGX), with the reflectance of Schlick 1994.
"""

from typing import Any

import numpy as np

from tts2face.numeric.arrays import Array
from tts2face.numeric.kernels import HALF, UNIT, ZERO, inlined_kernel, kernel, vectorized_kernel
from tts2face.picture.kernels.lamps import BRIGHTNESS, FIRST_LIGHT_ROW, FLOOR_ROW, SKY_ROW, UP_ROW
from tts2face.picture.kernels.tables import (
    AT_ALBEDO,
    AT_DARK_GLOSS,
    AT_DIFFUSE,
    AT_EXPOSURE,
    AT_GLOSS,
    AT_GLOW,
    AT_NORMAL,
    AT_OPACITY,
    AT_RAY,
    AT_ROUGHNESS,
    AT_SECOND_LOBE,
    DIFFUSE,
    EXPOSURE,
    NORMAL,
)

SKIN_SCATTERING = np.array(
    [1.0, 0.75, 0.65], np.float32
)  # scattering of red, green and blue light under skin, relative to the part's wrap
SCATTER_MM = (1.9, 0.8, 0.45)  # standard deviation of the scattering of red, green and blue light in skin
N_SCATTER_PASSES = 2
INTERREFLECTION = np.float32(0.8)  # share of the light that a closed cavity reflects between its walls
REFLECTANCE = np.float32(0.03)  # of skin, enamel and tears at normal incidence
SKY_GLOSS = np.float32(0.35)  # share of the sky that surfaces reflect at grazing incidence
SECOND_ROUGHNESS = np.float32(0.24)  # of the second lobe, relative to the first: (0.7)^4
DARK_ALBEDO, LIGHT_ALBEDO = np.float32(0.03), np.float32(0.30)  # between them the gloss of skin rises to its full value
TONE = tuple(np.float32(value) for value in (2.51, 0.03, 2.43, 0.59, 0.14))  # Narkowicz 2016, fit of the ACES curve
KEPT_HUE = np.float32(0.75)  # share of the tone curve that keeps the hue of dark pixels; by channel it reddens skin
N_SCRATCH_ROWS = 10


@kernel
def light_vertices(exposure: Array, lights: Array, wrap: Array, vertex: Array) -> None:
    """Write the diffuse light and the exposure of highlights of all vertices.

    Parameters
    ----------
    exposure : (V, 5)
        Exposure to the sky and to the four lamps.
    lights : (7, 6)
        Sky and floor colour, direction up, then one row for each lamp: direction towards it, colour.
    wrap : (V,)
        Wrap of diffuse light around the shape; ``-1 - wrap`` on open sheets, which are lit on the side that the camera
        sees.
    vertex : (V, N_VERTEX_COLUMNS)
        Vertex table: reads normals, writes diffuse light and exposure.
    """
    for v in range(len(vertex)):
        nx, ny, nz = vertex[v, NORMAL], vertex[v, NORMAL + 1], vertex[v, NORMAL + 2]
        around_edge = wrap[v]
        if around_edge < ZERO:
            around_edge = -UNIT - around_edge
            if nx * vertex[v, 0] + ny * vertex[v, 1] + nz * vertex[v, 2] > ZERO:
                nx = -nx
                ny = -ny
                nz = -nz
        up = nx * lights[UP_ROW, 0] + ny * lights[UP_ROW, 1] + nz * lights[UP_ROW, 2]
        for c in range(3):
            middle = HALF * (lights[SKY_ROW, c] + lights[FLOOR_ROW, c])
            swing = HALF * (lights[SKY_ROW, c] - lights[FLOOR_ROW, c])
            vertex[v, DIFFUSE + c] = (middle + swing * up) * exposure[v, 0]
        for k in range(FIRST_LIGHT_ROW, len(lights)):
            towards = nx * lights[k, 0] + ny * lights[k, 1] + nz * lights[k, 2]
            visible = exposure[v, 1 + k - FIRST_LIGHT_ROW]
            if towards < -around_edge or visible <= ZERO:
                continue
            for c in range(3):
                reach = around_edge * SKIN_SCATTERING[c]
                soaked = visible + reach * visible * (UNIT - visible)  # scattering reddens the edge of a shadow on skin
                vertex[v, DIFFUSE + c] += lights[k, 3 + c] * soaked * max(towards + reach, ZERO) / (UNIT + reach)
        vertex[v, EXPOSURE] = exposure[v, 0]
        vertex[v, EXPOSURE + 1], vertex[v, EXPOSURE + 2] = exposure[v, 1], exposure[v, 3]
        vertex[v, EXPOSURE + 3] = exposure[v, 4]


@kernel
def scatter_light(triangles: Array, around: Any, share: Array, vertex: Array, total: Array) -> None:
    """Average the diffuse light of skin with that of the vertices around, `N_SCATTER_PASSES` times.

    Parameters
    ----------
    triangles : (F, 3)
        All triangles.
    around
        Vertices of skin (S,), the triangles around every vertex as starts (V + 1,) and members, triangles of skin.
    share : (S, 3)
        Share of the mean of the vertices around, for red, green and blue.
    total : (F, 3)
        Buffer for the sums over triangles.
    """
    skin, starts, members, of_skin = around
    for _ in range(N_SCATTER_PASSES):
        for t in of_skin:
            a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
            for k in range(DIFFUSE, DIFFUSE + 3):
                total[t, k - DIFFUSE] = vertex[a, k] + vertex[b, k] + vertex[c, k]
        for i in range(len(skin)):
            v = skin[i]
            n = starts[v + 1] - starts[v]
            red, green, blue = np.float32(0), np.float32(0), np.float32(0)
            for m in range(starts[v], starts[v + 1]):
                t = members[m]
                red, green, blue = red + total[t, 0], green + total[t, 1], blue + total[t, 2]
            scale = np.float32(0.5) / np.float32(max(n, 1))
            own = np.float32(0.5)
            vertex[v, DIFFUSE] += share[i, 0] * (red * scale - (own + np.float32(1)) * vertex[v, DIFFUSE])
            vertex[v, DIFFUSE + 1] += share[i, 1] * (green * scale - (own + np.float32(1)) * vertex[v, DIFFUSE + 1])
            vertex[v, DIFFUSE + 2] += share[i, 2] * (blue * scale - (own + np.float32(1)) * vertex[v, DIFFUSE + 2])


@inlined_kernel
def tone_curve(light: float) -> Any:
    """Filmic tone curve: light from 0 on to display light in [0, 1]."""
    x = light * np.float32(BRIGHTNESS)
    return min((x * (TONE[0] * x + TONE[1])) / (x * (TONE[2] * x + TONE[3]) + TONE[4]), np.float32(1))


@inlined_kernel
def kept_hue(red: float, green: float, blue: float) -> Any:
    """Share of the tone curve that keeps the hue, and its factor for the light of a fragment.

    The curve of the strongest channel scales all of them where it is dark; bright light fades to white by channel.
    """
    strongest: Any = max(red, green, blue, np.float32(1e-6))
    display = tone_curve(strongest)
    share = KEPT_HUE * (np.float32(1) - display)
    return share, share * display / strongest


@vectorized_kernel
def shade_fragments(table: Array, n: int, lights: Array, scratch: Array, colour: Array) -> None:
    """Compute the light of n fragments.

    Parameters
    ----------
    table : (N_ROWS, H)
        Fragments, by the rows of `tts2face.picture.kernels.tables`.
    lights : (7, 6)
        As for `light_vertices`.
    scratch : (N_SCRATCH_ROWS, H)
        Buffer for intermediate values.
    colour : (3, H)
        Out: display light in [0, 1] of each fragment, multiplied by its opacity.
    """
    nx, ny, nz = table[AT_NORMAL], table[AT_NORMAL + 1], table[AT_NORMAL + 2]
    gloss, view_x, view_y, view_z = scratch[0], scratch[1], scratch[2], scratch[3]
    facing, lobe, depth, around = scratch[4], scratch[5], scratch[9], table[AT_EXPOSURE]
    ray_x, ray_y, rough, second = table[AT_RAY], table[AT_RAY + 1], table[AT_ROUGHNESS], table[AT_SECOND_LOBE]
    specular, dim, glow = table[AT_GLOSS], table[AT_DARK_GLOSS], table[AT_GLOW]
    red, green = table[AT_ALBEDO], table[AT_ALBEDO + 1]
    for i in range(n):
        scale = UNIT / np.sqrt(nx[i] * nx[i] + ny[i] * ny[i] + nz[i] * nz[i] + np.float32(1e-20))
        nx[i], ny[i], nz[i] = nx[i] * scale, ny[i] * scale, nz[i] * scale
        scale = -UNIT / np.sqrt(ray_x[i] * ray_x[i] + ray_y[i] * ray_y[i] + UNIT)
        view_x[i], view_y[i], view_z[i] = ray_x[i] * scale, ray_y[i] * scale, scale
        facing[i] = max(nx[i] * view_x[i] + ny[i] * view_y[i] + nz[i] * view_z[i], np.float32(1e-3))
        tone = np.float32(0.5) * (red[i] + green[i])
        light = min(max((tone - DARK_ALBEDO) / (LIGHT_ALBEDO - DARK_ALBEDO), ZERO), UNIT)
        gloss[i] = specular[i] * (UNIT - dim[i] * (UNIT - light))
        edge = UNIT - facing[i]
        edge *= edge * edge * edge * edge
        depth[i] = np.sqrt(rough[i]) * np.float32(0.5)  # of the shadowing term
        smooth = UNIT - np.sqrt(np.sqrt(rough[i]))
        grazing = (np.float32(0.25) * specular[i] + smooth * edge) * SKY_GLOSS * min(specular[i] * np.float32(8), UNIT)
        up = nx[i] * lights[UP_ROW, 0] + ny[i] * lights[UP_ROW, 1] + nz[i] * lights[UP_ROW, 2]
        lobe[i] = grazing * around[i] * around[i] * (np.float32(0.7) + np.float32(0.3) * up)
    for c in range(3):
        shine = scratch[6 + c]
        for i in range(n):
            shine[i] = lobe[i] * lights[SKY_ROW, c] + glow[i] * lights[FIRST_LIGHT_ROW, 3 + c]
    for k in range(FIRST_LIGHT_ROW, len(lights)):
        lx, ly, lz = lights[k, 0], lights[k, 1], lights[k, 2]
        visible = table[AT_EXPOSURE + max(k - FIRST_LIGHT_ROW, 1) if k > FIRST_LIGHT_ROW + 1 else AT_EXPOSURE]
        if k == FIRST_LIGHT_ROW:
            visible = table[AT_EXPOSURE + 1]
        for i in range(n):
            towards = max(nx[i] * lx + ny[i] * ly + nz[i] * lz, ZERO)
            hx, hy, hz = lx + view_x[i], ly + view_y[i], lz + view_z[i]
            inverse = UNIT / np.sqrt(hx * hx + hy * hy + hz * hz + np.float32(1e-9))
            middle = max((nx[i] * hx + ny[i] * hy + nz[i] * hz) * inverse, ZERO)
            edge = UNIT - min((lx * hx + ly * hy + lz * hz) * inverse, UNIT)
            fresnel = UNIT + (UNIT / REFLECTANCE - UNIT) * edge * edge * edge * edge * edge
            squared = middle * middle
            spread = squared * (rough[i] - UNIT) + UNIT
            first = rough[i] / spread
            tight = rough[i] * SECOND_ROUGHNESS
            spread = squared * (tight - UNIT) + UNIT
            other = tight / spread
            shadow = (towards * (UNIT - depth[i]) + depth[i]) * (facing[i] * (UNIT - depth[i]) + depth[i])
            both = (first * first + second[i] * other * other) / shadow
            lobe[i] = gloss[i] * fresnel * towards * both * visible[i] * min(around[i] * np.float32(1.3), UNIT)
        for c in range(3):
            shine, strength = scratch[6 + c], lights[k, 3 + c]
            for i in range(n):
                shine[i] += strength * lobe[i]
    for c in range(3):
        matt, shine, albedo = table[AT_DIFFUSE + c], scratch[6 + c], table[AT_ALBEDO + c]
        for i in range(n):
            hidden = UNIT - around[i]
            colour[c, i] = matt[i] * albedo[i] / (UNIT - hidden * hidden * albedo[i] * INTERREFLECTION) + shine[i]
    opacity = table[AT_OPACITY]
    for i in range(n):
        kept, scale = kept_hue(colour[0, i], colour[1, i], colour[2, i])
        for c in range(3):
            colour[c, i] = opacity[i] * (scale * colour[c, i] + (UNIT - kept) * tone_curve(colour[c, i]))
