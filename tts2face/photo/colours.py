"""Colours of a picture at places in it."""

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def lab_at(pixels: NDArray[np.uint8], places: Floats, blur: float) -> Floats:
    """CIE Lab of 8 bits (..., 3) of a blurred picture (H, W, 3) at places (..., 2), x and y."""
    import cv2

    part, low = _around(pixels, places, blur)
    return _sample(
        np.asarray(cv2.cvtColor(np.ascontiguousarray(part), cv2.COLOR_RGB2LAB), np.float64), places - low, blur
    )


def grey_at(pixels: NDArray[np.uint8], places: Floats, blur: float) -> Floats:
    """Mean (...) of the channels of a blurred picture (H, W, 3) at places (..., 2), x and y."""
    part, low = _around(pixels, places, blur)
    return _sample(part.mean(axis=2)[..., None], places - low, blur)[..., 0]


def _around(pixels: NDArray[np.uint8], places: Floats, blur: float) -> tuple[NDArray[np.uint8], NDArray[np.int64]]:
    """The part of a picture that a blur reads at places, and its left top pixel."""
    margin = int(np.ceil(4 * blur)) + 1
    last = np.array(pixels.shape[1::-1]) - 1
    low = np.clip(np.floor(places.reshape(-1, 2).min(axis=0)).astype(np.int64) - margin, 0, last)
    high = np.clip(np.ceil(places.reshape(-1, 2).max(axis=0)).astype(np.int64) + margin + 1, low + 1, last + 1)
    return pixels[low[1] : high[1], low[0] : high[0]], low


def _sample(values: Floats, places: Floats, blur: float) -> Floats:
    """Values (..., C) of a blurred picture (h, w, C) at places (..., 2)."""
    from scipy.ndimage import gaussian_filter

    return colours_at(gaussian_filter(values, (blur, blur, 0)), places)


def colours_at(values: Floats, places: Floats) -> Floats:
    """Values (..., C) of a picture (H, W, C) at places (..., 2), x and y, between its pixels."""
    from scipy.ndimage import map_coordinates

    at = np.moveaxis(places, -1, 0)[::-1]
    return np.stack(
        [map_coordinates(part, at, order=1, mode="nearest") for part in np.moveaxis(values, -1, 0)], axis=-1
    )
