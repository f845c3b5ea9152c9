"""sRGB values and linear light (IEC 61966-2-1)."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

LUMINANCE = np.array([0.2126, 0.7152, 0.0722])  # of linear sRGB, IEC 61966-2-1


def decode_srgb(srgb: NDArray[np.floating]) -> NDArray[np.float64]:
    """Linear light of sRGB values, both in [0, 1]."""
    linear: NDArray[np.float64] = np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)
    return linear


def encode_light(linear: NDArray[np.floating]) -> NDArray[Any]:
    """Values in sRGB of linear light, both in [0, 1]; light beyond is clipped."""
    light = np.clip(linear, 0.0, 1.0)
    srgb: NDArray[Any] = np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)
    return srgb


def encode_srgb(linear: NDArray[np.floating]) -> NDArray[np.uint8]:
    """8-bit sRGB values of linear light; light beyond [0, 1] is clipped."""
    values: NDArray[np.uint8] = np.rint(255.0 * encode_light(linear)).astype(np.uint8)
    return values
