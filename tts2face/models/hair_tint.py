"""Hair of faces with baked light in any colour, between those in which its light was baked.

A colour is that of the middle of the hair as it is seen from in front, which gloss and light that passes from strand to
strand make brighter than the strands.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError
from tts2face.models.baked_light import BakedLight, HairTint
from tts2face.models.face import Face, Hairdo
from tts2face.models.hair import HAIR_PART
from tts2face.models.light import Lamps
from tts2face.models.named_colours import parse_hair_colour
from tts2face.models.view_transform import grey_curves

CELL_MM = 3.0  # cells of that grid
WITHIN = np.array([[4, 1, 1], [1, 4, 1], [1, 1, 4], [2, 2, 2]]) / 6  # places in triangles at which hair is read
DARKEST, LEAST_GLOSS = 1e-3, 0.15  # linear light, and share of the change of gloss on light hair
OTHER_COLOUR, GLOSS_TINT = 0.15, 0.3  # distance from the hair's own colour at which that change has so little of it


def tint_hair(face: Face, colour: str) -> Face:
    """A face with light of its own whose hair has a colour."""
    srgb, light = parse_hair_colour(colour), face.light
    tint = None if isinstance(light, Lamps) else light.baked.tint
    if isinstance(light, Lamps) or tint is None:
        raise DataError("the hair of this face has one colour only; remove the colour of the hair")
    n = len(face.vertices) - tint.vertices.shape[1]
    known = np.concatenate([face.colours[None, n:], tint.vertices]).astype(np.float64)
    colours = face.colours.copy()
    for channel, (pair, share) in enumerate(_brackets(tint.colours.astype(np.float64), srgb)):
        mixed = known[pair[0], :, channel] + share * (known[pair[1], :, channel] - known[pair[0], :, channel])
        colours[n:, channel] = np.rint(np.clip(mixed, 0, 255))
    return replace(
        face,
        colours=colours,
        hairdo=Hairdo("" if face.hairdo is None else face.hairdo.haircut, colour),
        light=light.changed(lambda baked: _tinted(baked, tint, srgb, _seen_texels(face, baked))),
    )


def _seen_texels(face: Face, light: BakedLight) -> NDArray[np.float64]:
    """(N, 2) places in the page of the hair, one in each cell of a grid in which hair is in front."""
    hair = next(part for part in face.parts if part.name == HAIR_PART)
    numbers = np.unique(light.triangle_numbers)
    corners, is_hair = face.triangles[numbers], (numbers >= hair.first) & (numbers < hair.first + hair.count)
    points = (WITHIN @ face.vertices[corners]).reshape(-1, 3)
    cells = np.floor(points[:, :2] / CELL_MM).astype(np.int64)
    _, cell = np.unique(cells, axis=0, return_inverse=True)
    order = np.lexsort((points[:, 2], cell.ravel()))
    last = np.append(np.diff(cell.ravel()[order]) > 0, True)
    nearest = order[last & np.repeat(is_hair, len(WITHIN))[order]]
    places: NDArray[np.float64] = (WITHIN @ np.asarray(face.uv, np.float64)[corners]).reshape(-1, 2)[nearest]
    return places


def _brackets(known: NDArray[np.float64], wanted: NDArray[np.float64]) -> Iterator[tuple[tuple[int, int], float]]:
    """For each channel the two of known colours (C, 3) between which a colour (3,) lies, or nearest, and its share."""
    for levels, level in zip(known.T, wanted, strict=True):
        order = np.argsort(levels)
        above = int(np.clip(np.searchsorted(levels[order], level), 1, len(order) - 1))
        low, high = int(order[above - 1]), int(order[above])
        yield (low, high), float((level - levels[low]) / (levels[high] - levels[low]))


def _tinted(light: BakedLight, tint: HairTint, srgb: NDArray[np.float64], seen: NDArray[np.float64]) -> BakedLight:
    """Light with hair in a colour: linear light is interpolated between those of the hair's known colours.

    The middle of what is `seen` (N, 2) of the hair shows the colour; beyond the known ones their light is scaled.
    The view transform is undone and done along its greys, by one curve a channel; what it mixes of the channels cancels
    at the known colours. What changes with the camera is gloss, which adds to the hair and shows the less the lighter
    it is.
    """
    from PIL import Image

    def resized(pixels: NDArray[np.uint8], size: tuple[int, int]) -> NDArray[np.uint8]:
        return np.asarray(Image.fromarray(pixels).resize(size, Image.Resampling.BILINEAR))

    side, (high, wide) = light.pages.shape[1], tint.pages.shape[1:3]
    pages = light.pages.copy()
    own = pages[1, : high * side // wide]
    known = [own.copy(), *(resized(page, own.shape[1::-1]) for page in tint.pages)]
    small = (light.turn_side, high * light.turn_side // wide)
    before = resized(own, small)
    curves = [*zip(*grey_curves(light.view), strict=True)]
    at = np.minimum((seen * [len(own[0]), side]).astype(np.int64), [len(own[0]) - 1, len(own) - 1])
    for channel, (to_light, bounds) in enumerate(curves):
        pages_light = [to_light[page[..., channel]] for page in known]
        middles = np.array([np.median(page[at[:, 1], at[:, 0]]) for page in pages_light])
        wanted = float(np.interp(255 * srgb[channel], np.arange(256), to_light))
        order = np.argsort(middles)
        above = int(np.clip(np.searchsorted(middles[order], wanted), 1, len(order) - 1))
        low, high = order[above - 1], order[above]
        inside = float(np.clip(wanted, middles[low], middles[high]))
        apart = float(middles[high] - middles[low])
        share = np.float32((inside - middles[low]) / apart if apart else 0.0)  # two dark colours may share a channel
        mixed = pages_light[low] + share * (pages_light[high] - pages_light[low])
        own[..., channel] = np.searchsorted(bounds, np.float32(wanted / max(inside, 1e-6)) * mixed)
    grey = curves[1][0]
    # black hair has next to no light to compare with
    ratio = grey[before.max(axis=2)] / np.maximum(grey[resized(own, small).max(axis=2)], DARKEST)
    gloss = np.clip(ratio, LEAST_GLOSS, 1.0).ravel()
    apart = float(np.abs(srgb - tint.colours[0]).mean()) / OTHER_COLOUR
    end = light.camera_modes.shape[2] - light.turn_side**2
    span = slice(end, end + gloss.size)
    cameras = light.camera_modes.copy()
    changes = cameras[:, :, span].astype(np.float32)
    mean = changes.mean(axis=1, keepdims=True)
    cameras[:, :, span] = np.rint(gloss * (mean + max(1 - apart, GLOSS_TINT) * (changes - mean)))
    return replace(light, pages=pages, camera_modes=cameras)
