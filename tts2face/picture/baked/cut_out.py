"""A photographed person before a background: the cover of the picture moves with it."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from tts2face.models.baked_light import BakedLight
from tts2face.models.photo_view import PhotoView
from tts2face.numeric.arrays import Array
from tts2face.numeric.kernels import HALF, UNIT, ZERO, kernel, vectorized_kernel
from tts2face.picture.baked.surface import COVER_SHIFT, OPAQUE, LitSurface
from tts2face.picture.baked.visibility import U, V, nearest_triangles, project
from tts2face.picture.camera import CameraMatrices


def page_covers(light: BakedLight, view: PhotoView) -> NDArray[np.uint8]:
    """Cover (2, H, W) of the pages of a photograph: that of the picture, and of all that is seen through openings."""
    n_pages, tall, broad = light.pages.shape[:3]
    covers = np.full((n_pages, tall, broad), OPAQUE, np.uint8)
    if view.alpha is None:
        return covers
    high, wide = view.alpha.shape
    left, top = view.corner
    rows = np.clip(np.arange(tall) + top, 0, high - 1)
    columns = np.clip(np.arange(broad) + left, 0, wide - 1)
    covers[0] = view.alpha[rows[:, None], columns]
    return covers


def moving_pixels(surface: LitSurface, optics: CameraMatrices, size: tuple[int, int], side: int) -> NDArray[np.bool_]:
    """(H, W) pixels of a picture (width, height) that the triangles of a face at rest cover in all samples."""
    table = surface.template.copy()
    project(surface.rig.rest, surface.source, optics.view.astype(np.float32), optics.lens.astype(np.float32), table)
    wide, high = size
    nearest, _, _ = nearest_triangles(table, surface.triangles, (high * side, wide * side))
    samples = nearest[:, : wide * side].reshape(high, side, wide, side) > 0
    return np.asarray(samples.all(axis=(1, 3)))


def without_background(surface: LitSurface, texels: Array, width: int) -> LitSurface:
    """A surface without the triangles around which all texels (N,), in rows of a width, are transparent."""
    is_seen = (texels >> COVER_SHIFT).reshape(-1, width) != 0
    counts = np.zeros((len(is_seen) + 1, width + 1), np.int32)
    np.cumsum(is_seen, axis=1, out=counts[1:, 1:])
    np.cumsum(counts, axis=0, out=counts)
    places = surface.template[surface.triangles][:, :, U : V + 1] * np.array(is_seen.shape[::-1], np.float32) - 0.5
    left, top = np.maximum(np.floor(places.min(axis=1)).astype(np.int64), 0).T
    right, bottom = np.minimum(np.floor(places.max(axis=1)).astype(np.int64) + 2, is_seen.shape[::-1]).T
    n_seen = counts[bottom, right] - counts[top, right] - counts[bottom, left] + counts[top, left]
    kept = n_seen > 0
    return replace(
        surface,
        light=replace(surface.light, triangles=surface.light.triangles[kept], is_inside=surface.light.is_inside[kept]),
        triangles=np.ascontiguousarray(surface.triangles[kept]),
        piece_of=surface.piece_of[kept],
        eye_of=surface.eye_of[kept],
    )


@vectorized_kernel
def find_covers(corners: Array, share: Array, count: int, covers: Array) -> None:
    """Write the cover (N,), 0 to 1, between the four texels (4, N) around fragments at places (2, N) between them."""
    most = np.float32(1 / OPAQUE)
    for i in range(count):
        x, y = share[0, i], share[1, i]
        a, b = (corners[0, i] >> COVER_SHIFT) & OPAQUE, (corners[1, i] >> COVER_SHIFT) & OPAQUE
        c, d = (corners[2, i] >> COVER_SHIFT) & OPAQUE, (corners[3, i] >> COVER_SHIFT) & OPAQUE
        above, below = np.float32(a) * (UNIT - x) + np.float32(b) * x, np.float32(c) * (UNIT - x) + np.float32(d) * x
        covers[i] = (above * (UNIT - y) + below * y) * most


@kernel
def compose_over(
    fragments: tuple[Array, Array, int], colour: Array, covers: Array, wall: Array, picture: Array
) -> None:
    """Write the mean of the fragments of each pixel, before a wall (H, W, 3), over a picture (H, W, 3 or 4).

    Parameters
    ----------
    fragments
        First fragment of each pixel, samples of each, and samples of a pixel.
    colour, covers : (3, N), (N,)
        Of fragments; mixed as displayed.
    """
    pixels, samples, n_samples = fragments
    height, width, channels = picture.shape
    part = np.float32(1) / np.float32(n_samples)
    most, least = np.float32(OPAQUE), np.float32(1e-3)
    pixel = 0
    for row in range(height):
        for column in range(width):
            first, end = pixels[pixel], pixels[pixel + 1]
            pixel += 1
            if first == end:
                continue
            red, green, blue, seen, cover = ZERO, ZERO, ZERO, ZERO, ZERO
            for i in range(first, end):
                share = np.float32(samples[i]) * part
                seen += share
                share *= covers[i]
                cover += share
                red += share * min(max(colour[0, i], ZERO), most)
                green += share * min(max(colour[1, i], ZERO), most)
                blue += share * min(max(colour[2, i], ZERO), most)
            rest, scale = UNIT - seen, UNIT
            if channels == 4:
                rest *= np.float32(picture[row, column, 3]) / most
                scale = UNIT / max(cover + rest, least)
            else:
                behind = seen - cover
                red += behind * np.float32(wall[row, column, 0])
                green += behind * np.float32(wall[row, column, 1])
                blue += behind * np.float32(wall[row, column, 2])
            red = (red + rest * np.float32(picture[row, column, 0])) * scale
            green = (green + rest * np.float32(picture[row, column, 1])) * scale
            blue = (blue + rest * np.float32(picture[row, column, 2])) * scale
            picture[row, column, 0] = np.uint8(red + HALF)
            picture[row, column, 1] = np.uint8(green + HALF)
            picture[row, column, 2] = np.uint8(blue + HALF)
            if channels == 4:
                picture[row, column, 3] = np.uint8((cover + rest) * most + HALF)
