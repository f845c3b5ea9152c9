"""Hair in pictures: what of a person is hair, and its colour."""

from dataclasses import dataclass

import numpy as np

from corpus_tools.dense.light_colour import log_colour
from corpus_tools.dense.skin_canvas import polygon_depth
from tts2face.models.landmarks import CHIN, FACE_OVAL, LID_RINGS, OUTER_LIP_LOWER, OUTER_LIP_UPPER
from tts2face.numeric.arrays import FloatArray, Mask

# of the grid in which hair is sought
CELL_MM = 3.0
ACROSS_MM = np.arange(-180.0, 180.1, CELL_MM)  # of the picture, from between the eyes
UP_MM = np.arange(201.0, -231.1, -CELL_MM)
DEPTH_PERCENTILE = 20  # of the face's outline: the depth of the plane, near that of the hair's outline
FOREHEAD, BROW_TOPS = 10, (105, 66, 334, 296)  # landmarks; the first is skin on most people, hair on some
LIP_RING = (*OUTER_LIP_UPPER, *OUTER_LIP_LOWER[-2:0:-1])
PERSON = 0.5  # share from which a cell shows the person
# Cells of surely something: skin below the brows, inside the face and off eyes and lips; the crown above the forehead;
# clothes below and beside the neck, and before it.
IN_FACE_MM = 8.0
BELOW_BROWS_MM = 12.0
OFF_EYES_MM = 9.0
OFF_LIPS_MM = 5.0
SURE_SKIN = 0.75  # of these cells: the others are glasses, beards and shadows
CROWN_MM = 10.0
CROWN_HALF_MM = 75.0
OFF_OVAL_MM = 4.0
INSIDE_CELLS = 2
CLOTHES_MM = 70.0
SHOULDER_MM = 95.0
CHEST_MM = 110.0
COLLAR_MM = 20.0
COLLAR_HALF_MM = 28.0
# Difference from skin, as a distance: 1 for these logarithms of luminance (darker) and of R/G and B/G.
DARKER = 0.45
OTHER_HUE = 0.28
IS_HAIR = 0.9
CHROMA_SCALE, WEAK_LIGHT = 0.3, 0.01  # of distances between colours, beside luminance; dark ones have no hue
N_NEAREST, MIN_SEEDS = 8, 60
SMALL, MOST_APART = 0.05, 2.5  # added to distances before logarithms, and most of their difference
COLLAR_APART = 0.4  # distance of clothes before the neck from hair
SMOOTH_CELLS = 1.0  # Gaussian
BROW_MM, NECK_MM = 4.0, 12.0  # above the brows nothing inside the face is sure; below the chin clothes may be like hair
# hair falls: it lies below hair, at most so far beside it
THROAT_HALF_MM = 30.0
CLOTHES_APART = 0.35
FALL_CELLS = 2
MIN_HAIRY = 0.35  # share of the crown: bald people .19 to .31, cropped ones from .39
# Without a segmentation network, the person is what differs from the edges of the picture.
EDGE_CELLS = 4
MIN_ROW_CELLS = 20
OFF_BACKGROUND = 0.6
WALL_MM = 150.0
# Where the picture cuts the crown off, hair is sought beside it, too: so far from the face, above the brows.
BESIDE_MM = 36.0


@dataclass(frozen=True, slots=True, eq=False)
class Portrait:
    """Median picture of a head on a grid in its own frontal plane.

    Parameters
    ----------
    srgb : (R, C, 3)
        By `UP_MM` and `ACROSS_MM`; NaN outside of the pictures.
    marks : (468, 3)
        The head's landmarks, mm.
    share : (R, C)
        Share of the person in each cell; None where no network has read it.
    fine : (2 R - 1, 2 C - 1, 3)
        One picture, in cells of half the size; None if there is none.
    """

    srgb: FloatArray
    marks: FloatArray
    share: FloatArray | None = None
    fine: FloatArray | None = None


@dataclass(frozen=True, slots=True, eq=False)
class SeenHair:
    """Hair cells (R, C), background's or skin's cells (R, C), colour (3,), `log_colour`, or NaN; share of the crown.

    `hairy` is the share that is darker than skin where no hair is found, NaN if the crown is outside of the picture.
    """

    region: Mask
    other: Mask
    colour: FloatArray
    hairy: float


def portrait_grid(marks: FloatArray, step: int = 1) -> FloatArray:
    """(R * C, 3) places of a portrait's cells on the head, mm; of half the size with a `step` of 2."""
    across, up = (np.linspace(axis[0], axis[-1], step * (len(axis) - 1) + 1) for axis in (ACROSS_MM, UP_MM))
    wide, high = np.meshgrid(across, up)
    depth = np.percentile(marks[list(FACE_OVAL), 2], DEPTH_PERCENTILE)
    return np.column_stack([wide.ravel(), high.ravel(), np.full(wide.size, depth)])


def find_hair(portrait: Portrait, skin: FloatArray) -> SeenHair:
    """Hair in a portrait of a person with a skin colour (3,), `log_colour`.

    Cells of the person are hair where their colours are nearer to those of the crown than to those of the face, and
    below the chin to those of clothes; all are connected with the crown.
    """
    from scipy.ndimage import binary_erosion, gaussian_filter, label

    marks, (across, up) = portrait.marks, np.meshgrid(ACROSS_MM, UP_MM)
    known = np.isfinite(portrait.srgb[..., 0])
    colours = log_colour(np.nan_to_num(portrait.srgb))
    light = np.exp(colours[..., :1])
    space = np.concatenate([colours[..., :1], colours[..., 1:] * light / (light + WEAK_LIGHT) / CHROMA_SCALE], axis=-1)
    oval = ring_depth(marks, FACE_OVAL)
    chin = marks[CHIN, 1]
    brow = marks[list(BROW_TOPS), 1].max()
    person = known & _person(portrait, space, known, oval)
    is_skin = _skin_cells(portrait, person, oval, space)
    unlike = difference_from_skin(colours - skin, DARKER)
    above = up - marks[FOREHEAD, 1]
    crown = (above > CROWN_MM) & (np.abs(across) < CROWN_HALF_MM) & (oval < -OFF_OVAL_MM)
    top = crown & (above < 2 * CLOTHES_MM / 3) & (np.abs(across) < CROWN_HALF_MM / 2)
    is_cut = 2 * (top & known).sum() < top.sum()
    if is_cut:
        crown |= (up > brow) & (oval < -OFF_OVAL_MM) & (oval > -BESIDE_MM)
    seen = crown & person & binary_erosion(person | ~known, iterations=INSIDE_CELLS)
    other, nothing = known & (~person | (unlike < IS_HAIR)), np.full(3, np.nan)
    seed = seen & (unlike > IS_HAIR)
    hairy = float(seed.sum() / max(seen.sum(), 1))
    if hairy < MIN_HAIRY and is_cut and (seen & (above > CROWN_MM)).sum() < MIN_SEEDS:
        return SeenHair(seen & False, other, nothing, np.nan)
    if hairy < MIN_HAIRY:
        # shaved hair is darker than skin, gloss is lighter
        shaded = seen & (colours[..., 0] - skin[0] < -DARKER)
        return SeenHair(seen & False, other, nothing, float(shaded.sum() / max(seen.sum(), 1)))
    to_hair = _distance(space, seed)
    apart = np.clip(np.log(_distance(space, is_skin) + SMALL) - np.log(to_hair + SMALL), -MOST_APART, MOST_APART)
    hair = person & (gaussian_filter(apart, SMOOTH_CELLS) > 0) & ~((oval > 0) & (up < brow + BROW_MM))
    clothes = person & (up < chin - CLOTHES_MM) & ((np.abs(across) > SHOULDER_MM) | (up < chin - CHEST_MM))
    collar = person & (up < chin - COLLAR_MM) & (np.abs(across) < COLLAR_HALF_MM) & (unlike > IS_HAIR)
    clothes |= collar & (to_hair > COLLAR_APART)  # the shaded neck may be as dark as hair
    low = up < chin - NECK_MM
    if clothes.sum() > MIN_SEEDS:
        from_clothes = np.log(_distance(space, clothes) + SMALL) - np.log(to_hair + SMALL)
        hair &= ~low | (gaussian_filter(from_clothes, SMOOTH_CELLS) > CLOTHES_APART)
    hair = _falling(hair & ~(low & (np.abs(across) < THROAT_HALF_MM)), low.any(axis=1))
    numbers, _ = label(hair | seed, np.ones((3, 3)))
    hair = np.isin(numbers, np.unique(numbers[seed]))
    return SeenHair(hair, other, np.median(colours[hair], axis=0), hairy)


def _skin_cells(portrait: Portrait, person: Mask, oval: FloatArray, space: FloatArray) -> Mask:
    """Cells of the face that surely show skin."""
    marks, up = portrait.marks, UP_MM[:, None]
    eyes = np.maximum(*(ring_depth(marks, ring) for ring in LID_RINGS))
    brow = marks[list(BROW_TOPS), 1].max()
    inside = person & (oval > IN_FACE_MM) & (up < brow - BELOW_BROWS_MM)
    inside &= (eyes < -OFF_EYES_MM) & (ring_depth(marks, LIP_RING) < -OFF_LIPS_MM)
    off = np.linalg.norm(space - np.median(space[inside], axis=0), axis=-1)
    return np.asarray(inside & (off < np.quantile(off[inside], SURE_SKIN)))


def _falling(hair: Mask, is_low: Mask) -> Mask:
    """Hair (R, C) without what lies in low rows and not below other hair."""
    from scipy.ndimage import binary_dilation

    found = hair.copy()
    for row in np.flatnonzero(is_low)[1:]:
        found[row] &= binary_dilation(found[row - 1], iterations=FALL_CELLS)
    return found


def difference_from_skin(off: FloatArray, darker: float | FloatArray) -> FloatArray:
    """(...) distance of colours from skin, of differences (..., 3) of `log_colour`; lighter ones may be shine."""
    scaled: FloatArray = np.sqrt(
        (np.minimum(off[..., 0], 0.0) / darker) ** 2 + ((off[..., 1:] / OTHER_HUE) ** 2).sum(axis=-1)
    )
    return scaled


def ring_depth(marks: FloatArray, ring: tuple[int, ...]) -> FloatArray:
    """(R, C) distance of the cells from a ring of landmarks, mm, positive inside."""
    across, up = np.meshgrid(ACROSS_MM, UP_MM)
    places = np.column_stack([across.ravel(), up.ravel()])
    depth = np.asarray(polygon_depth(places, marks[list(ring), :2], CROWN_HALF_MM), np.float64)
    return depth.reshape(across.shape)


def _distance(space: FloatArray, seeds: Mask) -> FloatArray:
    """(R, C) mean distance of colours from the nearest ones of some cells."""
    from scipy.spatial import cKDTree

    apart = np.asarray(cKDTree(space[seeds]).query(space.reshape(-1, 3), k=N_NEAREST)[0]).mean(axis=1)
    return np.asarray(np.minimum(apart, 1 / SMALL).reshape(seeds.shape), np.float64)


def _person(portrait: Portrait, space: FloatArray, known: Mask, oval: FloatArray) -> Mask:
    """Cells of the person: as a network has read them, or else those unlike the picture's edges on the same side."""
    from scipy.spatial import cKDTree

    if portrait.share is not None:
        return np.nan_to_num(portrait.share) > PERSON
    edges = np.zeros_like(known)
    for row in np.flatnonzero((known.sum(axis=1) > MIN_ROW_CELLS) & (portrait.marks[CHIN, 1] < UP_MM)):
        inside = np.flatnonzero(known[row])
        edges[row, inside[1 : 1 + EDGE_CELLS]] = edges[row, inside[-1 - EDGE_CELLS : -1]] = True
    height = np.broadcast_to(UP_MM[:, None, None] / WALL_MM, (*known.shape, 1))
    placed, apart = np.concatenate([space, height], axis=-1), np.full(known.shape, np.inf)
    for side in (ACROSS_MM < 0, ACROSS_MM >= 0):
        if (edges & side).any():
            apart[:, side] = cKDTree(placed[edges & side]).query(placed[:, side])[0]
    return np.asarray((apart > OFF_BACKGROUND) | (oval > 0))
