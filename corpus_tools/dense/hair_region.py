"""Hair in videos: a head's median picture, the hair in it, how far it reaches, and its colour."""

from dataclasses import dataclass

import numpy as np

from corpus_tools.dense.light_colour import log_colour
from corpus_tools.dense.skin_canvas import polygon_depth
from tts2face.models.landmarks import CHIN, FACE_OVAL
from tts2face.numeric.arrays import FloatArray, Mask

# of the grid in which hair is sought
CELL_MM = 3.0
ACROSS_MM = np.arange(-165.0, 165.1, CELL_MM)  # of the picture, from between the eyes
UP_MM = np.arange(190.0, -200.1, -CELL_MM)
DEPTH_PERCENTILE = 20  # of the face's outline: the depth of the plane, near that of the hair's outline
FOREHEAD = 10  # landmark; skin on most people, hair on some
CROWN_MM, CROWN_HALF_MM = (24.0, 38.0), 36.0  # above it, and beside it: inside the skull of everyone, never background
# Difference from skin, as a distance: 1 for these logarithms of luminance (darker) and of R/G and B/G.
DARKER, OTHER_HUE, IS_HAIR = 0.45, 0.28, 0.9
SHADED = 1.2  # the first of them outside the crown, where skin is in the shadow of jaw and hair
MIN_HAIRY_SHARE = 0.6  # of the crown: bald people .23 to .29, white stubble .43, others from .92
LUMINANCE_SCALE, CHROMA_SCALE, WEAK_LIGHT = 1.0, 0.3, 0.01  # distances between colours of hair; dark ones have no hue
VIVID = 0.4  # of the hair's difference in hue from skin: chroma scale of vivid hair, whose shine varies in hue
LIGHT_SHARE = 0.9  # of the crown's cells: the others are shine
LIGHTER, DARK = 1.0, -0.5  # logarithm by which other hair is lighter at most, and off skin what may always be hair
BESIDE_SKIN = 0.3  # logarithm of luminance: no hair has so much darker and so much lighter cells than skin
NEAR_HAIR, OFF_BACKGROUND = 0.35, 0.6
WALL_MM = 150.0  # of height, over which a wall may change by a distance of 1
N_GROWTHS = 6
MIN_GROWTH = 1.5  # of the crown's cells: hair that grows less cannot be distinguished from the wall
EDGE_CELLS, MIN_ROW_CELLS = 4, 20
INSIDE_MM = 4.0  # of the face's oval: no hair
TEMPLE_MM, MIN_LOCK_MM = 36.0, 9.0  # hair beside the face, from the middle of it; thinner locks do not count
NECK_MM = 45.0  # half width, in which nothing below the chin is hair
# Lowest hair beside the face, from the chin, mean of both sides: haircuts with free ears -95 and higher up, bobs -58 to
# -7, long hair from 8. A side that shows none beside the temple does not count: its hair is like the wall.
BOB_MM, LONG_MM, TEMPLE_HAIR_MM = -75.0, 0.0, 10.0
FLAT_MM = (55.0, 30.0)  # hair above `FOREHEAD`, and both sides' at the temples: less of both lies on the skull
# Flat hair is cropped where the skin shows through, up to this difference from it, or where the temples show so little.
SEE_THROUGH, CROPPED_MM = 2.0, 6.0


@dataclass(frozen=True, slots=True, eq=False)
class Portrait:
    """Median picture of a head on a grid in its own frontal plane.

    Parameters
    ----------
    srgb : (R, C, 3)
        By `UP_MM` and `ACROSS_MM`; NaN outside of the pictures.
    marks : (468, 3)
        The head's landmarks, mm.
    """

    srgb: FloatArray
    marks: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class SeenHair:
    """Length class, hair cells (R, C), background's or skin's cells (R, C), and colour (3,), `log_colour`, or NaN."""

    length: str
    region: Mask
    other: Mask
    colour: FloatArray


def portrait_grid(marks: FloatArray) -> FloatArray:
    """(R * C, 3) places of a portrait's cells on the head, mm."""
    across, up = np.meshgrid(ACROSS_MM, UP_MM)
    depth = np.percentile(marks[list(FACE_OVAL), 2], DEPTH_PERCENTILE)
    return np.column_stack([across.ravel(), up.ravel(), np.full(across.size, depth)])


def find_hair(portrait: Portrait, skin: FloatArray) -> SeenHair:
    """Hair in a portrait of a person with a skin colour (3,), `log_colour`.

    Colours of the crown, inside the skull, separate hair from skin; neighbours that are nearer to hair already found
    than to the background at the picture's edges, and are not shaded skin, follow in turn.
    """
    across, up = np.meshgrid(ACROSS_MM, UP_MM)
    known = np.isfinite(portrait.srgb[..., 0])
    colours = log_colour(np.nan_to_num(portrait.srgb))
    off = colours - skin
    above = up - portrait.marks[FOREHEAD, 1]
    crown = (np.abs(across) < CROWN_HALF_MM) & (above > CROWN_MM[0]) & (above < CROWN_MM[1])
    unlike = difference_from_skin(off, np.where(crown, DARKER, SHADED).astype(np.float64))
    seed = crown & known & (unlike > IS_HAIR)
    background = known & _edge_cells(known) & (up > portrait.marks[CHIN, 1])
    plain = SeenHair("", seed & False, background, np.full(3, np.nan))
    # most of the crown lies outside the picture
    if 2 * (crown & known).sum() < crown.sum():
        return plain
    if seed.sum() < MIN_HAIRY_SHARE * (crown & known).sum():
        return SeenHair("bald", plain.region, background | (known & (unlike < IS_HAIR)), plain.colour)
    is_inside = _oval_depth(portrait.marks, across, up) > INSIDE_MM
    throat = (up < portrait.marks[CHIN, 1]) & (np.abs(across) < NECK_MM)
    seed = _without_gloss(seed, off[..., 0])
    most = max(np.quantile(off[seed, 0], LIGHT_SHARE) + LIGHTER, DARK)
    allowed = known & (unlike > IS_HAIR) & ~is_inside & ~throat & (off[..., 0] < most)
    space = _colour_space(colours, np.median(off[seed], axis=0))
    region = _grow(space, seed, background, (allowed, up < portrait.marks[CHIN, 1]))
    colour: FloatArray = np.median(colours[region], axis=0)
    other = background | (known & (unlike < IS_HAIR))
    length = _length(region, portrait.marks, colour - skin)
    is_distinct = region.sum() > MIN_GROWTH * seed.sum()
    return SeenHair(length if is_distinct or length != "cropped" else "flat", region, other, colour)


def _without_gloss(hair: Mask, light: FloatArray) -> Mask:
    """Cells of a crown without those lighter than skin where others are darker: dark hair and gloss of the skin."""
    if not hair.any():
        return hair
    low, high = np.quantile(light[hair], [1 - LIGHT_SHARE, LIGHT_SHARE])
    return hair & (light < 0) if low < -BESIDE_SKIN and high > BESIDE_SKIN else hair


def difference_from_skin(off: FloatArray, darker: float | FloatArray) -> FloatArray:
    """(...) distance of colours from skin, of differences (..., 3) of `log_colour`; lighter ones may be shine."""
    scaled: FloatArray = np.sqrt(
        (np.minimum(off[..., 0], 0.0) / darker) ** 2 + ((off[..., 1:] / OTHER_HUE) ** 2).sum(axis=-1)
    )
    return scaled


def _edge_cells(known: Mask) -> Mask:
    """The first and last cells of each row that is in the pictures."""
    edges = np.zeros_like(known)
    for row in np.flatnonzero(known.sum(axis=1) > MIN_ROW_CELLS):
        inside = np.flatnonzero(known[row])
        edges[row, inside[1 : 1 + EDGE_CELLS]] = edges[row, inside[-1 - EDGE_CELLS : -1]] = True
    return edges


def _oval_depth(marks: FloatArray, across: FloatArray, up: FloatArray) -> FloatArray:
    places = np.column_stack([across.ravel(), up.ravel()])
    depth = np.asarray(polygon_depth(places, marks[list(FACE_OVAL), :2], 2 * INSIDE_MM), np.float64)
    return depth.reshape(across.shape)


def _colour_space(colours: FloatArray, off: FloatArray) -> FloatArray:
    """(R, C, 3) colours in which distances of 1 are large, for hair that differs from skin by `off` (3,)."""
    light = np.exp(colours[..., :1])
    scale = max(CHROMA_SCALE, VIVID * float(np.linalg.norm(off[1:])))
    return np.concatenate(
        [colours[..., :1] / LUMINANCE_SCALE, colours[..., 1:] * light / (light + WEAK_LIGHT) / scale], axis=-1
    )


def _grow(space: FloatArray, seed: Mask, background: Mask, limits: tuple[Mask, Mask]) -> Mask:
    """Cells of hair, connected with `seed`; `limits`: where hair may be, and where clothes are excluded strictly."""
    from scipy.ndimage import label
    from scipy.spatial import cKDTree

    allowed, is_low = limits
    cells = space.reshape(-1, 3)
    to_background = _distance_to_edges(space, background)
    most = np.where(is_low, 0.5 * NEAR_HAIR, np.minimum(NEAR_HAIR, to_background))
    region = seed
    for _ in range(N_GROWTHS):
        to_hair = np.asarray(cKDTree(cells[region.ravel()]).query(cells)[0]).reshape(seed.shape)
        candidates = seed | (allowed & (to_hair < most) & (to_background > OFF_BACKGROUND))
        numbers, _ = label(candidates, np.ones((3, 3)))
        region = np.isin(numbers, np.unique(numbers[seed]))
    return region


def _distance_to_edges(space: FloatArray, background: Mask) -> FloatArray:
    """(R, C) distance of colours from those at the picture's edge on the same side, at about the same height."""
    from scipy.spatial import cKDTree

    height = np.broadcast_to(UP_MM[:, None, None] / WALL_MM, (*background.shape, 1))
    placed = np.concatenate([space, height], axis=-1)
    apart = np.full(background.shape, np.inf)
    for side in (ACROSS_MM < 0, ACROSS_MM >= 0):
        edge = placed[background & side]
        if len(edge):
            apart[:, side] = cKDTree(edge).query(placed[:, side])[0]
    return apart


def _length(region: Mask, marks: FloatArray, off: FloatArray) -> str:
    """Length class: cropped, flat, short, bob or long."""
    chin, forehead = marks[CHIN, 1], marks[FOREHEAD, 1]
    beside = [(region & (side * ACROSS_MM > TEMPLE_MM)).sum(axis=1) * CELL_MM for side in (-1, 1)]
    ends = [UP_MM[np.flatnonzero(width >= MIN_LOCK_MM)].min(initial=forehead) for width in beside]
    falling = [end for end in ends if end < forehead - TEMPLE_HAIR_MM] or [forehead]
    reach = chin - float(np.mean(falling))
    if reach > BOB_MM:
        return "long" if reach > LONG_MM else "bob"
    middle = region[:, np.abs(ACROSS_MM) < TEMPLE_MM]
    height = float(np.median(UP_MM[np.argmax(middle[:, middle.any(axis=0)], axis=0)])) - forehead
    temples = np.abs(UP_MM - (marks[105, 1] + 10.0)) < 2 * CELL_MM
    thickness = sum((region & (side * ACROSS_MM > 0))[temples].sum(axis=1).mean() * CELL_MM for side in (-1, 1))
    if height > FLAT_MM[0] or thickness > FLAT_MM[1]:
        return "short"
    return "cropped" if difference_from_skin(off, DARKER) < SEE_THROUGH or thickness < CROPPED_MM else "flat"
