"""What is behind the head: a studio wall, a colour or an image."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tts2face.render.picture import STUDIO, Picture, parse_background
from tts2face.storage.picture_files import opened_picture

STUDIO_BRIGHT, STUDIO_DARK = (128.0, 137.0, 148.0), (52.0, 58.0, 67.0)  # sRGB: the pool of light, and the corners
STUDIO_MIDDLE = (0.5, 0.42)  # of the pool, in shares of width and height


def draw_background(picture: Picture) -> NDArray[np.uint8]:
    """(H, W, 3) sRGB pixels behind the head; black where the picture is transparent.

    Raises
    ------
    DataError
        The image cannot be read, or is too large.
    """
    kind = parse_background(picture.background)
    if isinstance(kind, Path):
        return _load_image(kind, picture.width, picture.height)
    plain = np.zeros((picture.height, picture.width, 3), np.uint8)
    if kind == STUDIO:
        return _draw_studio(picture.width, picture.height)
    if isinstance(kind, tuple):
        plain[:] = kind
    return plain


def _draw_studio(width: int, height: int) -> NDArray[np.uint8]:
    """A wall with a soft pool of light; ordered dither keeps its gradient free from steps."""
    across = ((np.arange(width) + 0.5) / width - STUDIO_MIDDLE[0])[None, :] * min(1.6, max(1.0, width / height))
    along = ((np.arange(height) + 0.5) / height - STUDIO_MIDDLE[1])[:, None]
    fall = np.exp(-2.6 * (across**2 + along**2))[:, :, None]
    wall = np.array(STUDIO_DARK) + (np.array(STUDIO_BRIGHT) - STUDIO_DARK) * fall
    bayer = np.array([[0, 8, 2, 10], [12, 4, 14, 6], [3, 11, 1, 9], [15, 7, 13, 5]]) / 16
    dither = np.tile(bayer, (-(-height // 4), -(-width // 4)))[:height, :width, None]
    return np.floor(wall + dither).astype(np.uint8)


def _load_image(path: Path, width: int, height: int) -> NDArray[np.uint8]:
    """An image scaled and cut so that it fills the picture."""
    from PIL import Image, ImageOps

    with opened_picture(path, "the background image") as file:
        return np.array(ImageOps.fit(file.convert("RGB"), (width, height), Image.Resampling.LANCZOS))
