"""Colour of what is seen: smooth normals, vertex colour or texture, soft lights, highlights, in linear light.

Samples of one pixel that lie on the same smooth surface are averaged before they are lit, the others are lit one by
one: the picture of full supersampling for a third of its time. Camera space as in `tts2face.render.raster`.
"""

import math

import numpy as np
from numba import njit

from tts2face.render.raster import NOTHING

TONE_STEPS = 8192  # entries of the tables between 8-bit sRGB and linear light
SMOOTH = np.float32(0.8)  # cosine between normals down to which samples of a part are lit together
RED_REACH, GREEN_REACH, BLUE_REACH = np.float32(1.0), np.float32(0.45), np.float32(0.3)  # of light under skin
SPECULAR, SHININESS, WRAP, OPACITY, TEXTURED, OPEN = range(6)  # columns of the material table
N_FIELDS = 10  # of a shaded point: normal 3, albedo 3, exposure to ambient light and to three lights 4


@njit(cache=True, nogil=True)
def face_normals(camera, triangles, normals):  # type: ignore[no-untyped-def]
    """Write (F, 3) normals of triangles, as long as twice their area."""
    for t in range(len(triangles)):
        a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        ux, uy, uz = camera[b, 0] - camera[a, 0], camera[b, 1] - camera[a, 1], camera[b, 2] - camera[a, 2]
        vx, vy, vz = camera[c, 0] - camera[a, 0], camera[c, 1] - camera[a, 1], camera[c, 2] - camera[a, 2]
        normals[t, 0], normals[t, 1], normals[t, 2] = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx


@njit(cache=True, nogil=True)
def vertex_normals(flat, starts, members, normals):  # type: ignore[no-untyped-def]
    """Write (V, 3) unit normals: the sum over the triangles ``members[starts[v]:starts[v + 1]]`` around each vertex."""
    for v in range(len(normals)):
        x, y, z = np.float32(0), np.float32(0), np.float32(0)
        for i in range(starts[v], starts[v + 1]):
            t = members[i]
            x, y, z = x + flat[t, 0], y + flat[t, 1], z + flat[t, 2]
        scale = np.float32(1) / np.float32(math.sqrt(x * x + y * y + z * z + np.float32(1e-20)))
        normals[v, 0], normals[v, 1], normals[v, 2] = x * scale, y * scale, z * scale


@njit(cache=True, nogil=True)
def texel(texture, linear, u, v, out):  # type: ignore[no-untyped-def]
    """Write the bilinear colour of a texture in linear light to ``out[3:6]``."""
    height, width = texture.shape[0], texture.shape[1]
    x = min(max(u * width - np.float32(0.5), np.float32(0)), np.float32(width - 1))
    y = min(max(v * height - np.float32(0.5), np.float32(0)), np.float32(height - 1))
    left, top = min(int(x), max(width - 2, 0)), min(int(y), max(height - 2, 0))
    right, below = min(left + 1, width - 1), min(top + 1, height - 1)
    across, along = x - np.float32(left), y - np.float32(top)
    one = np.float32(1)
    for c in range(3):
        upper = linear[texture[top, left, c]] * (one - across) + linear[texture[top, right, c]] * across
        lower = linear[texture[below, left, c]] * (one - across) + linear[texture[below, right, c]] * across
        out[3 + c] = upper * (one - along) + lower * along


@njit(cache=True, nogil=True)
def point_at(number, dx, dy, frame, static, out):  # type: ignore[no-untyped-def]
    """Write what a triangle is like where the ray (dx, dy, 1) from the camera meets it (Moeller and Trumbore 1997)."""
    camera, normals, exposure = frame
    triangles, colours, uv, texture, linear, textured = static
    t = number if number >= 0 else ~number
    a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
    sx, sy, sz = -camera[a, 0], -camera[a, 1], -camera[a, 2]
    e1x, e1y, e1z = camera[b, 0] + sx, camera[b, 1] + sy, camera[b, 2] + sz
    e2x, e2y, e2z = camera[c, 0] + sx, camera[c, 1] + sy, camera[c, 2] + sz
    qx, qy, qz = dy * e2z - e2y, e2x - dx * e2z, dx * e2y - dy * e2x
    determinant = e1x * qx + e1y * qy + e1z * qz
    rx, ry, rz = sy * e1z - sz * e1y, sz * e1x - sx * e1z, sx * e1y - sy * e1x
    one, zero = np.float32(1), np.float32(0)
    inverse = one / determinant if determinant != zero else zero
    wb = min(max((sx * qx + sy * qy + sz * qz) * inverse, zero), one)
    wc = min(max((dx * rx + dy * ry + rz) * inverse, zero), one - wb)
    wa = one - wb - wc
    for k in range(3):
        out[k] = wa * normals[a, k] + wb * normals[b, k] + wc * normals[c, k]
    for k in range(4):
        out[6 + k] = wa * exposure[a, k] + wb * exposure[b, k] + wc * exposure[c, k]
    if textured[t]:
        u, v = wa * uv[a, 0] + wb * uv[b, 0] + wc * uv[c, 0], wa * uv[a, 1] + wb * uv[b, 1] + wc * uv[c, 1]
        texel(texture, linear, u, v, out)
    else:
        for k in range(3):
            out[3 + k] = wa * colours[a, k] + wb * colours[b, k] + wc * colours[c, k]
    scale = one / np.float32(math.sqrt(out[0] * out[0] + out[1] * out[1] + out[2] * out[2] + np.float32(1e-20)))
    if number < 0:
        scale = -scale
    out[0], out[1], out[2] = out[0] * scale, out[1] * scale, out[2] * scale


@njit(cache=True, nogil=True)
def lit(point, inner, dx, dy, material, lights, colour):  # type: ignore[no-untyped-def]
    """Write the light that a point sends to the camera: ``colour[0:3]`` diffuse, ``colour[3:6]`` highlight.

    Parameters
    ----------
    point : (10,)
        Normal, albedo, exposure.
    inner
        Share of light that reaches this side of the surface.
    lights : (6, 6)
        Sky, ground and up direction, then three lights: direction towards it, colour.
    """
    one, zero, half = np.float32(1), np.float32(0), np.float32(0.5)
    length = one / np.float32(math.sqrt(point[0] * point[0] + point[1] * point[1] + point[2] * point[2]))
    nx, ny, nz = point[0] * length, point[1] * length, point[2] * length
    to_eye = one / np.float32(math.sqrt(dx * dx + dy * dy + one))
    vx, vy, vz = -dx * to_eye, -dy * to_eye, -to_eye
    wrap, specular, shininess = material[WRAP], material[SPECULAR], material[SHININESS]
    facing = max(nx * vx + ny * vy + nz * vz, zero)
    grazing = (one - facing) * (one - facing)
    gloss = specular * (one + np.float32(3) * grazing * grazing * (one - facing))
    sky = half + half * (nx * lights[2, 0] + ny * lights[2, 1] + nz * lights[2, 2])
    for c in range(3):
        seen = point[6] * inner
        ambient = lights[1, c] + (lights[0, c] - lights[1, c]) * sky
        colour[c] = ambient * seen / (one - (one - seen) * point[3 + c] * np.float32(0.8))
        colour[3 + c] = gloss * np.float32(0.1) * ambient * seen
    reach_r, reach_g, reach_b = wrap * RED_REACH, wrap * GREEN_REACH, wrap * BLUE_REACH
    for k in range(3, 6):
        seen = point[4 + k] * inner
        lx, ly, lz = lights[k, 0], lights[k, 1], lights[k, 2]
        towards = nx * lx + ny * ly + nz * lz
        colour[0] += lights[k, 3] * seen * max(towards + reach_r, zero) / (one + reach_r)
        colour[1] += lights[k, 4] * seen * max(towards + reach_g, zero) / (one + reach_g)
        colour[2] += lights[k, 5] * seen * max(towards + reach_b, zero) / (one + reach_b)
        if towards <= zero or gloss == zero:
            continue
        hx, hy, hz = lx + vx, ly + vy, lz + vz
        off = one - (nx * hx + ny * hy + nz * hz) / np.float32(math.sqrt(hx * hx + hy * hy + hz * hz))
        if off * shininess < np.float32(7):
            shine = gloss * seen * np.float32(math.exp(-off * shininess)) * min(towards * np.float32(4), one)
            colour[3] += lights[k, 3] * shine
            colour[4] += lights[k, 4] * shine
            colour[5] += lights[k, 5] * shine
    for c in range(3):
        colour[c] *= point[3 + c]
