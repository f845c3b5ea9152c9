"""The skin's texture, painted by rule: every texel knows its place on the head, so seams do not show."""

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt, map_coordinates

from corpus_tools.head.layout import SIDE, laid_out, texels_of
from corpus_tools.head.skin import Skin
from corpus_tools.head.source import Source
from corpus_tools.head.subdivide import triangulated

Floats = NDArray[np.float64]

SKIN = np.array([0.835, 0.640, 0.545])
LIPS = np.array([0.70, 0.385, 0.36])
CAVITY = np.array([0.36, 0.13, 0.13])


def painted(source: Source, skin: Skin, generator: np.random.Generator) -> NDArray[np.uint8]:
    """(SIDE, SIDE, 3) texture of a skin."""
    texels = texels_of(laid_out(skin.source_uv), triangulated(skin.quads), SIDE)
    place = texels.carried(skin.base)
    where = texels.carried(skin.source_uv)
    colour = np.tile(SKIN, (len(place), 1))
    lips, inside = _sampled(source.mask("lips"), where), _sampled(source.mask("inside-mouth"), where)
    colour += lips[:, None] * (LIPS - colour)
    colour += inside[:, None] * (CAVITY - colour)
    colour *= 1 + 0.012 * generator.standard_normal((len(place), 1))
    return _filled(texels.rows, texels.columns, colour)


def _sampled(mask: Floats, where: Floats) -> Floats:
    height, width = mask.shape
    return map_coordinates(mask, [(1 - where[:, 1]) * (height - 1), where[:, 0] * (width - 1)], order=1, mode="nearest")


def _filled(rows: NDArray[np.int64], columns: NDArray[np.int64], colour: Floats) -> NDArray[np.uint8]:
    """The picture, texels off the surface taking the nearest colour on it."""
    picture = np.zeros((SIDE, SIDE, 3))
    known = np.zeros((SIDE, SIDE), bool)
    picture[rows, columns], known[rows, columns] = colour, True
    nearest = distance_transform_edt(~known, return_distances=False, return_indices=True)
    filled: NDArray[np.uint8] = np.rint(np.clip(picture[tuple(nearest)], 0, 1) * 255).astype(np.uint8)
    return filled
