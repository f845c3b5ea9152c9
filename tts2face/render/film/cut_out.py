"""A photographed person before another background: the coverage of the picture, moved with it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tts2face.models.baked_light import BLACK_SHARE, BakedLight
from tts2face.models.face import PhotoView
from tts2face.render.film.shading import AT_RED, COLOUR_CODING, add_texels, compose, fetch

Float32Array = NDArray[np.float32]

OPAQUE = 255


@dataclass(frozen=True, slots=True, eq=False)
class CutOut:
    """Coverage of a photograph and what lies behind it.

    Attributes
    ----------
    texels : (N,)
        Coverage at the places of the texels of colour, as three equal numbers.
    width
        Of a row of them.
    behind : (H, W, 3)
        The background.
    still : (H, W)
        Coverage of what does not move.
    """

    texels: NDArray[np.int32]
    width: int
    behind: NDArray[np.uint8]
    still: NDArray[np.uint8]

    def blend(
        self,
        rows: slice,
        fragments: tuple[NDArray[np.int32], NDArray[np.int32], int],
        places: tuple[NDArray[np.int32], Float32Array, NDArray[np.int32], int],
        values: Float32Array,
        band: NDArray[np.uint8],
    ) -> None:
        """Put what `compose` drew into a band (h, W, 3 or 4) before the background, in place.

        Parameters
        ----------
        rows
            Of the picture, that the band holds.
        fragments
            First fragment of each pixel, samples of each, and samples of a pixel.
        places
            Texels of fragments, places in them, scratch space for their corners, and their number.
        values
            Scratch space.
        """
        texel, share, corners, count = places
        values[AT_RED:, :count] = 0
        fetch(self.texels, self.width, texel, count, corners)
        add_texels(corners, share, count, COLOUR_CODING, values)
        covers = np.zeros((*band.shape[:2], 4), np.uint8)
        compose(*fragments, values[AT_RED:], covers)
        seen = covers[..., 3] > 0
        cover = np.where(seen, covers[..., 0], self.still[rows])
        if band.shape[2] == 4:
            band[..., 3] = cover
            return
        part = cover[seen][:, None].astype(np.uint32)
        wall = self.behind[rows][seen]
        band[seen] = ((part * band[seen] + (OPAQUE - part) * wall + OPAQUE // 2) // OPAQUE).astype(np.uint8)


def build_cut_out(
    light: BakedLight, view: PhotoView, still: NDArray[np.uint8], behind: NDArray[np.uint8], level: int
) -> CutOut:
    """Cut-out of a photograph whose coverage is known, for colours in pages that are halved `level` times."""
    height, width = light.pages.shape[1:3]
    page = np.full((2 * height, width), OPAQUE, np.uint8)
    left, top = (int(edge) for edge in view.corner)
    wide, high = view.size
    from_x, to_x = max(0, -left), min(width, wide - left)
    from_y, to_y = max(0, -top), min(height, high - top)
    alpha = view.alpha if view.alpha is not None else np.full((high, wide), OPAQUE, np.uint8)
    page[from_y:to_y, from_x:to_x] = alpha[from_y + top : to_y + top, from_x + left : to_x + left]
    shrunk = page.astype(np.float64)
    for _ in range(level):
        shrunk = (shrunk[::2, ::2] + shrunk[1::2, ::2] + shrunk[::2, 1::2] + shrunk[1::2, 1::2]) / 4
    below = np.full((shrunk.shape[0] // 2 // BLACK_SHARE, shrunk.shape[1]), float(OPAQUE))
    numbers = np.rint(np.concatenate([shrunk, below])).astype(np.int32)
    return CutOut((numbers | numbers << 8 | numbers << 16).ravel(), numbers.shape[1], behind, still)
