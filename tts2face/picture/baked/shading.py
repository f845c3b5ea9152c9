"""From the nearest triangles of samples to pixels: a list of fragments, their colours, and their mean in each pixel."""

from typing import Any

import numpy as np

from tts2face.numeric.arrays import Array
from tts2face.numeric.kernels import HALF, UNIT, ZERO, flat_view, kernel, vectorized_kernel
from tts2face.picture.baked.modes import LIGHT_BITS, LIGHT_STEP, LIGHT_ZERO
from tts2face.picture.baked.visibility import TRIANGLE_BITS, TRIANGLE_MASK, U, X, Y

SAME_DEPTH_BITS = 9  # samples of one piece are one surface if their 1/z differ by less than 1 / 512
N_VALUES = 5  # of a fragment: place in the texture, and light of the vertices
AT_U, AT_V, AT_RED = range(3)
COLOUR_CODING = (8, np.float32(0), np.float32(1))
CHANGE_CODING = (LIGHT_BITS, LIGHT_ZERO, LIGHT_STEP)


@kernel
def list_fragments(
    nearest: Array,
    place: tuple[int, int, int, int],
    piece_of: Array,
    found: tuple[Array, Array, Array, Array, Array],
    pixels: Array,
) -> int:
    """Write what is seen in each pixel of a band of rows; returns the number of fragments.

    Parameters
    ----------
    nearest : (side H, side W + BLOCK)
        Of `tts2face.picture.baked.visibility.find_nearest`.
    place
        Samples along a pixel's side, the band's first row of samples, and the columns [first, end) with any.
    piece_of : (F,)
    found
        Out, for each fragment: its triangle, its place (x, y) in samples, and the number of its samples. Last, scratch
        space (4, side side) for the samples of a pixel.
    pixels : (H W + 1,)
        Out: the first fragment of each pixel.
    """
    triangle, across, down, samples, scratch = found
    keys, right, low, way = scratch[0], scratch[1], scratch[2], scratch[3]
    side, first_row, first_column, end_column = place
    height, stride = nearest.shape[0] // side, nearest.shape[1]
    width = (len(pixels) - 1) // height
    line = flat_view(nearest)
    middle, n_samples = np.float32(side - 1) / np.float32(2), side * side
    half = np.uint64(n_samples // 2 // side * stride + n_samples // 2 % side)
    unit, below = np.uint64(1), np.uint64(stride)
    for s in range(n_samples):
        right[s], low[s], way[s] = s % side, s // side, s // side * stride + s % side
    count = np.uint64(0)
    first_pixel, end_pixel = first_column // side, (end_column + side - 1) // side
    for row in range(height):
        for column in range(first_pixel):
            pixels[row * width + column] = count
        for column in range(first_pixel, end_pixel):
            pixels[np.uint64(row * width + column)] = count
            at = np.uint64(side * (row * stride + column))
            if side == 2:  # as the loop, written out
                a, b, c, d = line[at], line[at + unit], line[at + below], line[at + below + unit]
                least, most, piece = min(a, b, c, d), max(a, b, c, d), piece_of[(a & TRIANGLE_MASK) - 1]
                is_one = (piece_of[(b & TRIANGLE_MASK) - 1] == piece) & (piece_of[(c & TRIANGLE_MASK) - 1] == piece)
                is_one &= piece_of[(d & TRIANGLE_MASK) - 1] == piece
            else:
                least, most, piece, is_one = line[at], line[at], piece_of[(line[at] & TRIANGLE_MASK) - 1], True
                for s in range(1, n_samples):
                    key = line[at + np.uint64(s // side * stride + s % side)]
                    least, most = min(least, key), max(most, key)
                    is_one &= piece_of[(key & TRIANGLE_MASK) - 1] == piece
            if most == 0:
                continue
            x, y = np.float32(side * column), np.float32(side * row + first_row)
            is_one &= (least > 0) & ((most - least) >> TRIANGLE_BITS <= (least >> TRIANGLE_BITS) >> SAME_DEPTH_BITS)
            if is_one:
                triangle[count] = (line[at + half] & TRIANGLE_MASK) - 1
                across[count], down[count], samples[count] = x + middle, y + middle, n_samples
                count += unit
                continue
            for s in range(n_samples):
                keys[s] = line[at + np.uint64(way[s])]
            for first in range(n_samples):
                if keys[first] == 0:
                    continue
                own, depth = (keys[first] & TRIANGLE_MASK) - 1, keys[first] >> TRIANGLE_BITS
                piece, reach = piece_of[own], depth >> SAME_DEPTH_BITS
                n = 0
                total_right = 0
                total_below = 0
                for s in range(first, n_samples):
                    key = keys[s]
                    same = (piece_of[(key & TRIANGLE_MASK) - 1] == piece) & (key != 0)
                    same &= abs((key >> TRIANGLE_BITS) - depth) <= reach
                    n, total_right, total_below = (
                        n + same,
                        total_right + same * right[s],
                        total_below + same * low[s],
                    )
                    keys[s] = 0 if same else key
                share = np.float32(1) / np.float32(n)
                triangle[count], samples[count] = own, n
                across[count], down[count] = x + np.float32(total_right) * share, y + np.float32(total_below) * share
                count += unit
        for column in range(end_pixel, width):
            pixels[row * width + column] = count
    pixels[height * width] = count
    return int(count)


@kernel
def lay_planes(
    triangle: Array, count: int, table: Array, triangles: Array, found: tuple[Array, Array, Array], planes: Array
) -> None:
    """Write the plane (3, 5) of each value over the picture of the triangles of fragments: at 0, per column, per row.

    From one sample to the next, light changes by no more than within the triangle: a fragment may lie beside one that
    is narrower, as at the rims of lips. `found` are the number of the plane of each fragment, that of each triangle
    (F,), and the triangle of each plane: those of the last two that do not agree are of other fragments.
    """
    plane, plane_of, triangle_of = found
    third = np.float32(1 / 3)
    n = 0
    for i in range(count):
        t = np.uint64(triangle[i])
        own = plane_of[t]
        if own < n and triangle_of[own] == triangle[i]:
            plane[i] = own
            continue
        plane[i] = plane_of[t] = n
        triangle_of[n] = triangle[i]
        a, b, c = np.uint64(triangles[t, 0]), np.uint64(triangles[t, 1]), np.uint64(triangles[t, 2])
        ax, ay = table[a, X], table[a, Y]
        bx, by, cx, cy = table[b, X] - ax, table[b, Y] - ay, table[c, X] - ax, table[c, Y] - ay
        inverse = np.float32(1) / (bx * cy - cx * by)
        for k in range(N_VALUES):
            at, e1, e2 = table[a, U + k], table[b, U + k] - table[a, U + k], table[c, U + k] - table[a, U + k]
            columns, rows = (e1 * cy - e2 * by) * inverse, (e2 * bx - e1 * cx) * inverse
            x, y, steep = ax, ay, abs(columns) + abs(rows)
            span = max(e1, e2, ZERO) - min(e1, e2, ZERO)
            if k >= AT_RED and steep > span:
                columns, rows = columns * (span / steep), rows * (span / steep)
                at, x, y = at + (e1 + e2) * third, ax + (bx + cx) * third, ay + (by + cy) * third
            planes[n, 0, k], planes[n, 1, k], planes[n, 2, k] = at - columns * x - rows * y, columns, rows
        n += 1


@vectorized_kernel
def evaluate(plane: Array, across: Array, down: Array, count: int, planes: Array, values: Array) -> None:
    """Write the values (5, N) of fragments by the numbers of their planes."""
    for i in range(count):
        t, x, y = np.uint64(plane[i]), across[i], down[i]
        for k in range(N_VALUES):
            values[k, i] = planes[t, 0, k] + planes[t, 1, k] * x + planes[t, 2, k] * y


@vectorized_kernel
def find_texels(values: Array, count: int, size: tuple[int, int], texel: Array, share: Array) -> None:
    """Write the upper left texel (N,) of fragments in a texture (width, height), and the place in it (2, N)."""
    wide, high = np.float32(size[0]), np.float32(size[1])
    for i in range(count):
        x = min(max(values[AT_U, i] * wide - HALF, np.float32(0)), wide - np.float32(1.01))
        y = min(max(values[AT_V, i] * high - HALF, np.float32(0)), high - np.float32(1.01))
        left, top = np.int32(x), np.int32(y)
        texel[i] = top * np.int32(size[0]) + left
        share[0, i], share[1, i] = x - np.float32(left), y - np.float32(top)


@kernel
def fetch(texels: Array, width: int, texel: Array, count: int, corners: Array) -> None:
    """Write the four texels (4, N) around fragments."""
    unit, below = np.uint64(1), np.uint64(width)
    for i in range(count):
        at = np.uint64(texel[i])
        corners[0, i], corners[1, i] = texels[at], texels[at + unit]
        corners[2, i], corners[3, i] = texels[at + below], texels[at + below + unit]


@vectorized_kernel
def add_texels(corners: Array, share: Array, count: int, coding: tuple[int, Any, Any], values: Array) -> None:
    """Add the colour between four texels to the light of fragments.

    `coding` of a texel's three numbers: bits of each, the number of no light, and the size of a step. What lies above
    them is not read.
    """
    bits, zero, step = coding
    mask = (1 << bits) - 1
    for i in range(count):
        x, y = share[0, i], share[1, i]
        w3 = x * y
        w1, w2 = x - w3, y - w3
        w0 = UNIT - x - w2
        a, b, c, d = corners[0, i], corners[1, i], corners[2, i], corners[3, i]
        red = w0 * np.float32(a & mask) + w1 * np.float32(b & mask)
        red += w2 * np.float32(c & mask) + w3 * np.float32(d & mask)
        a, b, c, d = a >> bits, b >> bits, c >> bits, d >> bits
        green = w0 * np.float32(a & mask) + w1 * np.float32(b & mask)
        green += w2 * np.float32(c & mask) + w3 * np.float32(d & mask)
        a, b, c, d = a >> bits, b >> bits, c >> bits, d >> bits
        blue = w0 * np.float32(a & mask) + w1 * np.float32(b & mask)
        blue += w2 * np.float32(c & mask) + w3 * np.float32(d & mask)
        values[2, i] += (red - zero) * step
        values[3, i] += (green - zero) * step
        values[4, i] += (blue - zero) * step


@kernel
def compose(pixels: Array, samples: Array, n_samples: int, colour: Array, picture: Array) -> None:
    """Write the mean of the fragments of each pixel over a picture (H, W, 3), or with their coverage into (H, W, 4).

    Colours (3, N) are mixed as displayed.
    """
    n_pixels = len(pixels) - 1
    channels = picture.shape[2]
    line = flat_view(picture)
    part = np.float32(1) / np.float32(n_samples)
    most = np.float32(255)
    first = pixels[0]
    unit = np.uint64(1)
    two = np.uint64(2)
    three = np.uint64(3)
    for pixel in range(n_pixels):
        end = pixels[pixel + 1]
        if first == end:
            continue
        red = ZERO
        green = ZERO
        blue = ZERO
        seen = 0
        for i in range(first, end):
            share = np.float32(samples[i]) * part
            seen += samples[i]
            red += share * min(max(colour[0, i], ZERO), most)
            green += share * min(max(colour[1, i], ZERO), most)
            blue += share * min(max(colour[2, i], ZERO), most)
        first, at = end, np.uint64(pixel * channels)
        if channels == 4:
            cover = np.float32(seen) * part
            line[at + three] = np.uint8(cover * most + HALF)
            scale = np.float32(1) / cover
            red, green, blue = red * scale, green * scale, blue * scale
        elif seen < n_samples:
            rest = np.float32(1) - np.float32(seen) * part
            red += rest * np.float32(line[at])
            green += rest * np.float32(line[at + unit])
            blue += rest * np.float32(line[at + two])
        line[at] = np.uint8(np.int32(red + HALF))
        line[at + unit] = np.uint8(np.int32(green + HALF))
        line[at + two] = np.uint8(np.int32(blue + HALF))
