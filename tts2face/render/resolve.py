"""From samples to pixels: what lies under each pixel is grouped, lit, laid over what is behind it and encoded."""

import math

import numpy as np
from numba import njit

from tts2face.render.raster import NOTHING, draw_band, gather, sort_into_bands, to_camera
from tts2face.render.shade import N_FIELDS, OPACITY, OPEN, SMOOTH, face_normals, lit, point_at, vertex_normals

SHOULDER = np.float32(0.7)  # linear light from which bright places are compressed towards 1
INSIDE = np.float32(0.3)  # share of the light that reaches the back of a closed part
MOST_SAMPLES = 9  # per pixel: 3 x 3


@njit(cache=True, nogil=True)
def toned(value):  # type: ignore[no-untyped-def]
    """Linear light with a soft shoulder, below 1."""
    if value <= SHOULDER:
        return value
    span = np.float32(1) - SHOULDER
    return SHOULDER + span * (np.float32(1) - np.float32(math.exp(-(value - SHOULDER) / span)))


@njit(cache=True, nogil=True)
def group_samples(owner, place, lens, scene, room):  # type: ignore[no-untyped-def]
    """Sort the samples of a pixel into smooth surfaces; returns how many.

    Parameters
    ----------
    owner : (R, W)
        Triangle of each sample of the band.
    place
        Row and column of the pixel's first sample in the band, the band's first row, samples along a pixel's side.
    room
        Scratch and result: points (9, 10), kinds (9,) part and side, sizes (9,), of_sample (9,), one point (10,).
    """
    r0, c0, first_row, side = place
    frame, static, part_of, materials = scene
    points, kinds, sizes, of_sample, point = room
    n_samples = side * side
    n_groups = 0
    for s in range(n_samples):
        of_sample[s] = -2
    for s in range(n_samples):
        if of_sample[s] != -2:
            continue
        number = owner[r0 + s // side, c0 + s % side]
        alike, across, along = 0, 0, 0
        for other in range(s, n_samples):
            if owner[r0 + other // side, c0 + other % side] == number:
                of_sample[other] = -1
                alike, across, along = alike + 1, across + other % side, along + other // side
        if number == NOTHING:
            continue
        share = np.float32(1) / np.float32(alike)
        dx = (np.float32(c0) + np.float32(0.5) + across * share - lens[1]) / lens[0]
        dy = (np.float32(r0 + first_row) + np.float32(0.5) + along * share - lens[2]) / lens[0]
        point_at(number, np.float32(dx), np.float32(dy), frame, static, point)
        t = number if number >= 0 else ~number
        kind = part_of[t] * 2 + (1 if number < 0 else 0)
        chosen = -1
        for g in range(n_groups):
            cosine = (points[g, 0] * point[0] + points[g, 1] * point[1] + points[g, 2] * point[2]) / sizes[g]
            if kinds[g] == kind and cosine > SMOOTH:
                chosen = g
                break
        if chosen < 0:
            chosen = n_groups
            n_groups += 1
            kinds[chosen], sizes[chosen] = kind, 0
            points[chosen, :] = 0
        sizes[chosen] += alike
        for k in range(N_FIELDS):
            points[chosen, k] += point[k] * np.float32(alike)
        for other in range(s, n_samples):
            if owner[r0 + other // side, c0 + other % side] == number:
                of_sample[other] = chosen
    for g in range(n_groups):
        for k in range(3, N_FIELDS):
            points[g, k] /= np.float32(sizes[g])
    return n_groups


@njit(cache=True, nogil=True)
def light_groups(n_groups, dx, dy, room, materials, lights, colours):  # type: ignore[no-untyped-def]
    """Light each group of a pixel: ``colours[g, 0:3]`` diffuse and ``[g, 3:6]`` highlight, toned."""
    points, kinds = room[0], room[1]
    for g in range(n_groups):
        material = materials[kinds[g] >> 1]
        inner = INSIDE if kinds[g] & 1 and material[OPEN] == 0 else np.float32(1)
        lit(points[g], inner, dx, dy, material, lights, colours[g])
        for c in range(3):
            whole = toned(colours[g, c] + colours[g, 3 + c])
            if material[OPACITY] >= np.float32(1):
                colours[g, c], colours[g, 3 + c] = whole, np.float32(0)


@njit(cache=True, nogil=True)
def resolve_pixel(owner, n_layers, place, ray, lens, scene, lights, room, mixed):  # type: ignore[no-untyped-def]
    """Write the mean of a pixel's samples, colour times coverage and coverage, to ``mixed[9]``; samples to the rest."""
    materials, kinds, sizes, of_sample, colours = scene[3], room[0][1], room[0][2], room[0][3], room[1]
    n_samples = place[3] * place[3]
    n_groups = group_samples(owner[0], place, lens, scene, room[0])
    light_groups(n_groups, ray[0], ray[1], room[0], materials, lights, colours)
    total = mixed[MOST_SAMPLES]
    total[:] = 0
    if n_layers == 1:
        for g in range(n_groups):
            weight = np.float32(sizes[g]) / np.float32(n_samples)
            for c in range(3):
                total[c] += colours[g, c] * weight
            total[3] += weight
        return
    for s in range(n_samples):
        g = of_sample[s]
        mixed[s, 3] = np.float32(1) if g >= 0 else np.float32(0)
        for c in range(3):
            mixed[s, c] = colours[g, c] if g >= 0 else np.float32(0)
    for layer in range(n_layers - 1, 0, -1):
        n_groups = group_samples(owner[layer], place, lens, scene, room[0])
        light_groups(n_groups, ray[0], ray[1], room[0], materials, lights, colours)
        for s in range(n_samples):
            g = of_sample[s]
            if g < 0:
                continue
            opacity = materials[kinds[g] >> 1, OPACITY]
            mixed[s, 3] += opacity * (np.float32(1) - mixed[s, 3])
            for c in range(3):
                mixed[s, c] += opacity * (colours[g, c] - mixed[s, c]) + colours[g, 3 + c]
    for s in range(n_samples):
        for c in range(4):
            total[c] += mixed[s, c] / np.float32(n_samples)


@njit(cache=True, nogil=True)
def write_pixel(total, behind, tables, pixel):  # type: ignore[no-untyped-def]
    """Lay a pixel over the background and encode it; four channels keep their coverage instead."""
    linear, encoded = tables
    top = np.float32(len(encoded) - 1)
    if len(pixel) == 4:
        pixel[3] = np.uint8(total[3] * np.float32(255) + np.float32(0.5))
        scale = np.float32(1) / max(total[3], np.float32(1e-6))
        for c in range(3):
            pixel[c] = encoded[int(min(max(total[c] * scale, np.float32(0)), np.float32(1)) * top + np.float32(0.5))]
        return
    for c in range(3):
        value = total[c] + (np.float32(1) - total[3]) * linear[behind[c]]
        pixel[c] = encoded[int(min(max(value, np.float32(0)), np.float32(1)) * top + np.float32(0.5))]


@njit(cache=True, nogil=True)
def resolve_band(owner, n_layers, first_row, side, lens, scene, light, room, picture):  # type: ignore[no-untyped-def]
    """Write the pixels of one band of rows."""
    lights, behind, tables = light
    samples, mixed = room
    n_rows, width = owner.shape[1] // side, picture.shape[1]
    channels = picture.shape[2]
    for r in range(n_rows):
        y = first_row // side + r
        for x in range(width):
            seen = False
            for s in range(side * side):
                for layer in range(n_layers):
                    seen |= owner[layer, r * side + s // side, x * side + s % side] != NOTHING
            if not seen:
                for c in range(channels):
                    picture[y, x, c] = behind[y, x, c] if channels == 3 else np.uint8(0)
                continue
            dx = np.float32((x * side + np.float32(0.5) * side - lens[1]) / lens[0])
            dy = np.float32((y * side + np.float32(0.5) * side - lens[2]) / lens[0])
            place = (r * side, x * side, first_row, side)
            resolve_pixel(owner, n_layers, place, (dx, dy), lens, scene, lights, samples, mixed)
            write_pixel(mixed[MOST_SAMPLES], behind[y, x], tables, picture[y, x])


@njit(cache=True, nogil=True)
def paint(points, surface, optics, light, scratch, picture):  # type: ignore[no-untyped-def]
    """Draw one picture.

    Parameters
    ----------
    points : (V, 3)
        The face in the world, mm.
    surface
        triangles, colours, uv, texture, linear table, textured (F,), part of triangle (F,), translucent (F,),
        materials (P, 6), neighbour starts (V + 1,) and members, exposure (V, 4).
    optics
        view (3, 4), lens (4,), samples along a pixel's side, rows of samples in a band.
    light
        lights (6, 6), background (H, W, 3), (linear table, encoding table).
    scratch
        camera (V, 3), grid (V, 2), corners (2 F, 6), source (2 F,), flat (F, 3), normals (V, 3).
    picture : (H, W, 3) or (H, W, 4)
        Out: sRGB, with coverage.
    """
    triangles, colours, uv, texture, linear, textured, part_of, translucent, materials, starts, members, exposure = (
        surface
    )
    view, lens, side, band_rows = optics
    camera, grid, corners, source, flat, normals = scratch
    height, width = picture.shape[0] * side, picture.shape[1] * side
    to_camera(points, view, lens, camera, grid)
    face_normals(camera, triangles, flat)
    vertex_normals(flat, starts, members, normals)
    count = gather(camera, grid, triangles, lens, (width, height), corners, source)
    n_bands = (height + band_rows - 1) // band_rows
    band_starts, band_members = sort_into_bands(corners, count, band_rows, n_bands)
    depth = np.zeros((3, band_rows, width), np.float32)
    owner = np.zeros((3, band_rows, width), np.int32)
    points_room = np.zeros((MOST_SAMPLES, N_FIELDS), np.float32)
    kinds, sizes = np.zeros(MOST_SAMPLES, np.int64), np.zeros(MOST_SAMPLES, np.int64)
    of_sample = np.zeros(MOST_SAMPLES, np.int64)
    samples = (points_room, kinds, sizes, of_sample, np.zeros(N_FIELDS, np.float32))
    room = ((samples, np.zeros((MOST_SAMPLES, 6), np.float32)), np.zeros((MOST_SAMPLES + 1, 4), np.float32))
    scene = (
        (camera, normals, exposure),
        (triangles, colours, uv, texture, linear, textured),
        part_of,
        materials,
    )
    for band in range(n_bands):
        first_row = band * band_rows
        rows = min(band_rows, height - first_row)
        batch = (corners, source, band_members[band_starts[band] : band_starts[band + 1]])
        n_translucent = draw_band(
            camera, triangles, lens, translucent, batch, first_row, depth[:, :rows], owner[:, :rows]
        )
        n_layers = 3 if n_translucent else 1
        resolve_band(owner[:, :rows], n_layers, first_row, side, lens, scene, light, room, picture)
