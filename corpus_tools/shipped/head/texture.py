"""Procedural texture of the skin and brows, computed per texel from its 3-D position, so that it has no seams."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt, gaussian_filter, map_coordinates
from scipy.spatial import cKDTree

from corpus_tools.dense.texels import Texels, find_texels
from corpus_tools.shipped.head.cards import BROW_COLOUR
from corpus_tools.shipped.head.layout import SIDE, layout_coordinates
from corpus_tools.shipped.head.lid_edges import LidEdge
from corpus_tools.shipped.head.noise import gaussian_bump, value_noise
from corpus_tools.shipped.head.skin import HeadSkin
from corpus_tools.shipped.head.source import SourceMesh
from corpus_tools.shipped.head.subdivision import triangulate
from tts2face.numeric.arrays import FloatArray, smoothstep


@dataclass(frozen=True, slots=True)
class HeadColours:
    """Colours, sRGB 0..1, and the strength of the skin's variation (1 natural, 0 flat)."""

    skin: tuple[float, float, float] = (0.81, 0.615, 0.52)
    lips: tuple[float, float, float] = (0.735, 0.41, 0.39)
    cavity: tuple[float, float, float] = (0.66, 0.30, 0.29)
    brows: tuple[float, float, float] = BROW_COLOUR
    variation: float = 1.0


# Positions (|x|, y, z) and radii in mm, then the colour factor at full strength: blood and shadows of a face.
TINTS = (
    ((39, -27, 15), (17, 15, 30), (1.01, 0.885, 0.90)),  # cheeks
    ((0, -40, 40), (12, 10, 16), (1.00, 0.88, 0.88)),  # tip of the nose
    ((14, -43, 25), (7, 7, 12), (0.99, 0.89, 0.89)),  # wings of the nose
    ((0, -101, 20), (13, 9, 20), (1.00, 0.93, 0.93)),  # chin
    ((0, 55, 30), (40, 24, 40), (1.01, 1.005, 0.985)),  # forehead
    ((17, 1, 15), (6, 9, 14), (0.955, 0.905, 0.905)),  # inner corner of the eye
    ((30, -14, 15), (14, 5, 14), (0.985, 0.96, 0.965)),  # under the eye
    ((33, 9, 15), (17, 6, 14), (0.985, 0.955, 0.955)),  # upper lid
    ((0, -80, 24), (14, 4, 12), (0.955, 0.93, 0.93)),  # under the lower lip
)
FOLD = np.array([(16, -43), (22, -52), (27, -61), (29, -69)])  # from the nose to beside the mouth: |x|, y in mm
N_FRECKLES = 240
UPPER_LINE, LOWER_LINE, LINE_MM = 0.80, 0.24, 1.15  # dark roots of the lashes at the lids: strengths, half width
INNER_LIP_Z, THROAT_Z, THROAT_DARKER = (20.0, 28.0), (-12.0, 25.0), 0.5  # z in mm of the default head
LINE_TINT = np.array([0.90, 1.0, 1.0])


def paint_texture(
    source: SourceMesh, skin: HeadSkin, lids: Sequence[LidEdge], palette: HeadColours, generator: np.random.Generator
) -> NDArray[np.uint8]:
    """(SIDE, SIDE, 3) texture of a skin with the edges `lids` of its lids."""
    texels = find_texels(layout_coordinates(skin.source_uv), triangulate(skin.quads), SIDE)
    place = texels.interpolate(skin.vertices)
    where = texels.interpolate(skin.source_uv)
    colour = _flesh(place, where, source, palette, generator)
    lips = sample_mask(gaussian_filter(source.mask("lips"), 5.0), where)
    colour += (0.88 * smoothstep(lips, 0.12, 0.93))[:, None] * (_lip_colour(place, palette, generator) - colour)
    inside = np.maximum(sample_mask(gaussian_filter(source.mask("inside-mouth"), 2.0), where), in_mouth(where))
    colour += smoothstep(inside, 0.15, 0.95)[:, None] * (_cavity_colour(place, palette) - colour)
    for edge in lids:
        colour *= 1 - UPPER_LINE * _beside(place, skin.vertices[edge.upper])[:, None] * LINE_TINT
        colour *= 1 - LOWER_LINE * _beside(place, skin.vertices[edge.lower])[:, None] * LINE_TINT
    return fill_gaps(texels, colour, SIDE)


def _flesh(
    place: FloatArray, where: FloatArray, source: SourceMesh, palette: HeadColours, generator: np.random.Generator
) -> FloatArray:
    strength = palette.variation
    factors = np.ones((len(place), 3))
    for centre, reach, tint in TINTS:
        factors *= 1 + strength * gaussian_bump(place, centre, reach)[:, None] * (np.array(tint) - 1)
    factors *= 1 - strength * sample_mask(source.mask("ears"), where)[:, None] * np.array([0.0, 0.10, 0.09])
    factors *= 1 - strength * sample_mask(gaussian_filter(source.mask("eyelids"), 3), where)[:, None] * np.array(
        [0.03, 0.065, 0.06]
    )
    factors *= 1 - strength * 0.07 * _fold(place)[:, None] * np.array([0.7, 1.0, 1.0])
    blotch = 0.6 * value_noise(place, 14.0, generator) + 0.4 * value_noise(place, 5.0, generator)
    factors *= 1 + strength * 0.016 * blotch[:, None] * np.array([0.4, 1.3, 1.2])
    factors *= 1 + strength * 0.018 * value_noise(place, 0.9, generator)[:, None]
    factors *= 1 - strength * _freckles(place, generator)[:, None] * np.array([0.06, 0.10, 0.12])
    return np.array(palette.skin) * factors


def _fold(place: FloatArray) -> FloatArray:
    nearest = np.full(len(place), np.inf)
    flat = np.column_stack([np.abs(place[:, 0]), place[:, 1]])
    for start, end in pairwise(FOLD):
        share = np.clip((flat - start) @ (end - start) / ((end - start) @ (end - start)), 0, 1)
        nearest = np.minimum(nearest, np.linalg.norm(flat - start - share[:, None] * (end - start), axis=1))
    return np.exp(-((nearest / 3.0) ** 2)) * (place[:, 2] > 0)


def _freckles(place: FloatArray, generator: np.random.Generator) -> FloatArray:
    """(P,) small spots on cheeks, nose and forehead."""
    chance = 0.9 * gaussian_bump(place, (32, -22), (24, 18)) + 0.5 * gaussian_bump(place, (0, -25), (16, 20)) + 0.12
    chance *= place[:, 2] > -30
    centres = place[generator.choice(len(place), N_FRECKLES, p=chance / chance.sum())]
    spots = np.zeros(len(place))
    tree = cKDTree(place)
    for centre, size in zip(centres, generator.uniform(0.35, 0.9, N_FRECKLES), strict=True):
        near = tree.query_ball_point(centre, 2.2 * size)
        spots[near] += generator.uniform(0.15, 0.7) * np.exp(-(((place[near] - centre) / size) ** 2).sum(axis=1))
    return np.clip(spots, 0, 1)


def _lip_colour(place: FloatArray, palette: HeadColours, generator: np.random.Generator) -> FloatArray:
    lines = value_noise(place * np.array([1.0, 0.22, 0.3]), 0.9, generator)  # fine creases from edge to edge
    colour = np.tile(np.array(palette.lips), (len(place), 1))
    return colour * (1 + palette.variation * (0.035 * lines + 0.03 * value_noise(place, 4.0, generator))[:, None])


def _cavity_colour(place: FloatArray, palette: HeadColours) -> FloatArray:
    """Colour of the lips at their inner edge, that of the cavity at the cheeks, darker towards the throat."""
    inner = np.array(palette.cavity) * (1 - THROAT_DARKER * smoothstep(-place[:, 2], *THROAT_Z))[:, None]
    near = smoothstep(place[:, 2], *INNER_LIP_Z)[:, None]
    return inner + near * (np.array(palette.lips) - inner)


def _beside(place: FloatArray, line: FloatArray) -> FloatArray:
    """(P,) 1 on a line of points (L, 3), falling off beside it."""
    near: FloatArray = np.exp(-((line_distance(place, line, 6.0) / LINE_MM) ** 2))
    return near


def line_distance(place: FloatArray, line: FloatArray, most: float) -> FloatArray:
    """(P,) distance of points from a line of points (L, 3), mm; infinite beyond `most`."""
    fine = np.linspace(0, len(line) - 1, 12 * len(line))
    dense = np.stack([np.interp(fine, np.arange(len(line)), line[:, k]) for k in range(3)], axis=1)
    return np.asarray(cKDTree(dense).query(place, distance_upper_bound=most)[0])


def in_mouth(where: FloatArray) -> FloatArray:
    """(P,) 1 on the island of the mouth's cavity, fading to the lips' colour at its rim."""
    inside = (where[:, 0] > 0.75) & (where[:, 0] < 0.93) & (where[:, 1] < 0.14)
    return inside.astype(float)


def sample_mask(mask: FloatArray, where: FloatArray) -> FloatArray:
    """(P,) values of a mask of the source at coordinates (P, 2), v up."""
    height, width = mask.shape
    return map_coordinates(mask, [(1 - where[:, 1]) * (height - 1), where[:, 0] * (width - 1)], order=1, mode="nearest")


def fill_gaps(texels: Texels, colour: FloatArray, side: int) -> NDArray[np.uint8]:
    """(side, side, 3) texture of the colours (P, 3) of texels; those off the surface take the nearest one on it."""
    picture = np.zeros((side, side, 3))
    known = np.zeros((side, side), bool)
    picture[texels.rows, texels.columns], known[texels.rows, texels.columns] = colour, True
    nearest = distance_transform_edt(~known, return_distances=False, return_indices=True)
    filled: NDArray[np.uint8] = np.rint(np.clip(picture[tuple(nearest)], 0, 1) * 255).astype(np.uint8)
    return filled
