"""Texture of the cards of brows and lashes, and sets of cards of which a person shows one."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.ndimage import gaussian_filter

from corpus_tools.shipped.head.assets import asset_files, read_picture
from tts2face.models.face import Texture
from tts2face.numeric.arrays import FloatArray

SIDE = 1024
BROWS = ("eyebrow001", "eyebrow010", "eyebrow008", "eyebrow012")  # two finer sets, two fuller ones
LASHES = ("eyelashes02", "eyelashes01")
# Rows of each brow's picture that hold hairs, and where they go: rows of the texture, columns 0 to 512.
BROW_ROWS = {"eyebrow001": (140, 400), "eyebrow010": (252, 512), "eyebrow008": (200, 460), "eyebrow012": (240, 500)}
BROW_HEIGHT = 252
LASH_LEFT = 512
BROW_COLOUR, LASH_COLOUR = (0.195, 0.138, 0.105), (0.065, 0.047, 0.040)  # sRGB
BROW_BLUR_PX, BROW_COVER = 0.7, 0.94  # of the hairs of brows: softer and lighter than ink
HAZE = 40.0  # coverage between the hairs of the pictures, of 255
CARDS_TEXTURE, EYE_TEXTURE = 1, 2  # numbers of the face's textures
HIDDEN = np.array([0.0, 10.0, -85.0])  # inside the skull: cards that a person does not show


@dataclass(frozen=True, slots=True)
class CardChoice:
    """The cards that a person shows: names of `BROWS` and `LASHES`."""

    brows: str = "eyebrow001"
    lashes: str = "eyelashes02"


def cards_texture(folder: Path, brow_colour: tuple[float, float, float] = BROW_COLOUR) -> Texture:
    """The texture of all brows and lashes."""
    alpha = np.zeros((SIDE, SIDE))
    for number, name in enumerate(BROWS):
        low, high = BROW_ROWS[name]
        top = number * BROW_HEIGHT
        picture = read_picture(folder / asset_files()[f"brows/{name}"][1])
        alpha[top : top + BROW_HEIGHT, :512] = picture[low:high, :, 3][:BROW_HEIGHT]
    for number, name in enumerate(LASHES):
        picture = read_picture(folder / asset_files()[f"lashes/{name}"][1])
        alpha[number * 512 : number * 512 + 512, LASH_LEFT:] = picture[:, :, 3]
    pixels = np.zeros((SIDE, SIDE, 3))
    pixels[:], pixels[:, :LASH_LEFT] = LASH_COLOUR, brow_colour
    cover = np.clip((alpha - HAZE) * 255 / (225 - HAZE), 0, 255)
    cover[:, :LASH_LEFT] = BROW_COVER * gaussian_filter(cover[:, :LASH_LEFT], BROW_BLUR_PX)
    return Texture(np.rint(255 * pixels).astype(np.uint8), np.rint(cover).astype(np.uint8))


def brow_coordinates(name: str, uv: FloatArray) -> FloatArray:
    """(N, 2) coordinates in the texture of a brow's own (N, 2)."""
    top = BROWS.index(name) * BROW_HEIGHT
    rows = np.clip(512 * uv[:, 1] - BROW_ROWS[name][0], 1, BROW_HEIGHT - 1)
    placed: FloatArray = np.column_stack([512 * uv[:, 0], top + rows]) / SIDE
    return placed


def lash_coordinates(name: str, uv: FloatArray) -> FloatArray:
    """(N, 2) coordinates in the texture of a set of lashes' own (N, 2)."""
    placed: FloatArray = (512 * uv + [LASH_LEFT, 512 * LASHES.index(name)]) / SIDE
    return placed
