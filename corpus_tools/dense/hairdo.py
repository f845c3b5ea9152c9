"""Which of the shipped haircuts hair in a picture is: its length, volume, fringe and texture."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from corpus_tools.dense.hair_region import (
    ACROSS_MM,
    BROW_TOPS,
    CELL_MM,
    DARKER,
    FOREHEAD,
    PERSON,
    UP_MM,
    Portrait,
    SeenHair,
    difference_from_skin,
    ring_depth,
)
from tts2face.models.landmarks import CHIN, FACE_OVAL
from tts2face.numeric.arrays import LUMINANCE, FloatArray, Mask

HAIRCUTS: Mapping[str, str] = {
    "bald": "bald", "stubble": "stubble", "cropped": "cropped", "flat": "short01", "short": "short02",
    "curly": "curly01", "afro": "afro01", "bob": "bob02", "bob with a fringe": "bob01", "wavy bob": "wavy02",
    "long": "long01", "long with a fringe": "fringe01", "long and wavy": "wavy01", "long and curly": "curly02",
    "short with a fringe": "short03", "tied back": "ponytail01",
}  # fmt: skip  # by what hair is called
UNSEEN = "flat"  # where the top of the head is outside of the picture
TEMPLE_MM, MIN_LOCK_MM = 36.0, 9.0  # hair beside the face, from the middle of it; thinner locks do not count
NECK_HALF_MM = 50.0  # below the chin: the neck's shadow may be as dark as hair
# Lowest hair beside the face above the chin, mean of both sides: haircuts with free ears 94 and higher, bobs 3 to 49,
# long hair below -10. A side that shows none beside the temple does not count.
# Hair that falls so low on one side lies in shadow or behind the shoulder on the other.
BOB_MM = 75.0
LONG_MM = (-6.0, 9.0)
TEMPLE_HAIR_MM = 10.0
ONE_SIDE_MM = -30.0
LONG_WIDE_MM = 114.0  # half width from which hair that ends about the chin lies on shoulders
CURLY_BOB_MM = 45.0  # short curls stand off the neck
FLAT_MM = (62.0, 80.0)  # hair above `FOREHEAD`, and its half width: less of both lies on the skull
# Flat hair is cropped where the temples show so little of it (0 to 12; others from 14), and less or skin through it, up
# to this difference from skin.
SEE_THROUGH, CROPPED_MM = 4.5, (7.5, 13.5)
SHADED_CROWN = 0.24  # share of a bald crown that is unlike skin: shaved hair; bald people have less
# Median coherence of the directions of strands (Bigun and Granlund 1987) over 4.5 mm: afros and short curls .35 to .55,
# short straight hair from .59 (crops .65 to .8); over 9 mm: waves .34 to .54 (some to .7), bobs from .62.
CURLY = 0.57
# Of long hair, that sum with how vertical strands are below the brows (-1 to 1): long curls .63 to .82, waves from .89.
CURLS_FALL = 0.85
UNKNOWN_STRANDS = (np.nan, np.nan, np.nan, np.nan)
WAVY_WIDE = 0.55
# Mean resultant of these directions over 20 mm, of long hair below the brows, is .94 to .97 of straight hair, .90 to
# .93 of waves, whose coherence is .58 to .68; less of straight locks side by side, whose coherence is more.
WAVY_COURSE, WAVY_COHERENT = (0.85, 0.934), 0.69
NEAR_MM = 4.5
WIDE_MM = 9.0
COURSE_MM = 20.0
FINE_MM = 1.5
SHADE_MM = 6.0
FINEST, INSIDE_CELLS = 100, 3  # cells that tell a texture, and their distance from the outline in fine cells
SLEEK_MM = 28.0  # curls of less width at the temples are combed back
# Of the outline of a head: the second deepest hollow between skull and buns is 12 to 34 mm deep, of other hair to 9.
KNOT_MM, HOLLOW_UP_MM, HOLLOW_UNIT = 10.5, 20.0, 256.0  # least depth, and height above the forehead; OpenCV's unit
# Rows below the lowest hair in which the picture ends, and by how much hair that it cuts is taken to be longer.
EDGE_ROWS, CUT_MM = 2, 30.0
# Rows of nearly the largest width: afros have theirs 2 to 23 mm above the brows, curls that hang 18 to 21 below.
WIDE_SHARE, ROUND_MM = 0.95, -8.0
TIED_MM = 105.0  # above `FOREHEAD`: what stands so high is tied
FRINGED_MM = 88.0  # half width of short hair with a fringe that falls
# least share of both halves of the lower forehead under hair
FRINGE = 0.6
FRINGE_HALF_MM = 48.0
FRINGE_FROM_MM = 6.0
FRINGE_TO = 0.55


@dataclass(frozen=True, slots=True)
class HairMeasures:
    """Measures of hair, mm: heights of its lowest ends above the chin, and of its top above the forehead.

    ``temples`` is its width on both sides beside the brows, ``half_width`` that from the middle of the face above the
    chin, ``widest`` the height of that width above the brows. ``fringe`` is the share of the lower forehead under it,
    of the half with less, and ``knot`` the depth of hollows of its outline. ``coherence`` is that of the directions of
    strands over 4 mm, then over 9 mm above and below the brows; ``course`` is how far they stay the same over 20 mm
    below the brows, and ``fall`` how vertical they are there, -1 to 1. NaN where too little is seen.
    """

    end: float
    top: float
    temples: float
    half_width: float
    fringe: float
    coherence: tuple[float, float, float]
    course: float
    fall: float
    widest: float
    knot: float


def measure_hair(portrait: Portrait, hair: Mask) -> HairMeasures:
    """Measures of hair cells (R, C) in a portrait."""
    marks, (across, up) = portrait.marks, np.meshgrid(ACROSS_MM, UP_MM)
    chin = marks[CHIN, 1]
    forehead = marks[FOREHEAD, 1]
    brow = marks[list(BROW_TOPS), 1].max()
    off_neck = np.where(up > chin, TEMPLE_MM, NECK_HALF_MM)
    beside = [(hair & (side * across > off_neck)).sum(axis=1) * CELL_MM for side in (-1, 1)]
    ends = [UP_MM[np.flatnonzero(width >= MIN_LOCK_MM)].min(initial=forehead) for width in beside]
    falling = [end for end in ends if end < forehead - TEMPLE_HAIR_MM] or [forehead]
    is_cut = any(_is_cut(portrait, hair & (side * across > off_neck)) for side in (-1, 1))
    if is_cut or min(falling) < chin + ONE_SIDE_MM:
        falling = [min(falling)]
    middle = hair[:, np.abs(ACROSS_MM) < TEMPLE_MM]
    tops = UP_MM[np.argmax(middle[:, middle.any(axis=0)], axis=0)]
    temples = np.abs(UP_MM - (brow + 10.0)) < CELL_MM
    band = (ring_depth(marks, FACE_OVAL) > INSIDE_CELLS) & (np.abs(across) < FRINGE_HALF_MM)
    band &= (up > brow + FRINGE_FROM_MM) & (up < brow + FRINGE_FROM_MM + FRINGE_TO * (forehead - brow))
    halves = [band & (side * across > 0) for side in (-1, 1)]
    reach = np.where(hair & (up > chin), np.abs(across), 0.0).max(axis=1)
    above, below, whole = _coherence(portrait, hair, (up > brow, up <= brow, up > -np.inf))
    return HairMeasures(
        float(np.mean(falling)) - chin - CUT_MM * is_cut,
        float(np.median(tops)) - forehead if tops.size else 0.0,
        sum(float(width[temples].mean()) for width in beside),
        float(reach.max()),
        min(float((hair & half).sum() / max(half.sum(), 1)) for half in halves),
        (whole[0], above[1], below[1]),
        *below[2:],
        float(UP_MM[reach > WIDE_SHARE * reach.max()].mean()) - brow,
        knot_depth(portrait, hair),
    )


def _is_cut(portrait: Portrait, hair: Mask) -> bool:
    """Whether the edge of the picture lies below the lowest hair (R, C) of a side."""
    wide = np.flatnonzero(hair.sum(axis=1) * CELL_MM >= MIN_LOCK_MM)
    if not wide.size:
        return False
    low, columns = min(wide[-1] + EDGE_ROWS, len(UP_MM) - 1), hair[wide[-1]]
    return bool(np.isnan(portrait.srgb[low, columns, 0]).mean() > 0.5)


def knot_depth(portrait: Portrait, hair: Mask) -> float:
    """Depth, mm, of the second deepest hollow in the outline of a head above the forehead: buns have two, at least.

    An outline that the picture cuts stays convex, as pictures are.
    """
    import cv2

    marks, above = portrait.marks, UP_MM[:, None] > portrait.marks[list(BROW_TOPS), 1].max()
    known = np.isfinite(portrait.srgb[..., 0])
    person = hair | (ring_depth(marks, FACE_OVAL) > 0)
    if portrait.share is not None:
        person |= np.nan_to_num(portrait.share) > PERSON
    outlines, _ = cv2.findContours((person & above & known).astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    outline = max(outlines, key=cv2.contourArea)
    hollows = cv2.convexityDefects(outline, cv2.convexHull(outline, returnPoints=False))
    if hollows is None:
        return 0.0
    at, depth = np.reshape(hollows, (-1, 4))[:, 2:].T
    high = UP_MM[np.reshape(outline, (-1, 2))[at, 1]] > marks[FOREHEAD, 1] + HOLLOW_UP_MM
    deepest = np.sort(np.append(depth[high] / HOLLOW_UNIT, [0.0, 0.0]))
    return float(deepest[-2]) * CELL_MM


def _coherence(portrait: Portrait, hair: Mask, parts: Sequence[Mask]) -> list[tuple[float, float, float, float]]:
    """Coherence of strands over `NEAR_MM` and `WIDE_MM` in parts (R, C) of hair, their course, and how they fall."""
    from scipy.ndimage import gaussian_filter

    if portrait.fine is None:
        return [UNKNOWN_STRANDS] * len(parts)
    inner, relief, fine = _relief(portrait, hair)
    per_cell = 2.0 / CELL_MM
    down, along = np.gradient(gaussian_filter(relief, FINE_MM * per_cell))
    doubled = along + 1j * down
    power, square = (
        np.abs(doubled) ** 2,
        np.asarray(doubled**2, np.complex128),
    )  # the structure tensor: its trace, and its direction, doubled
    near, wide = (
        _blurred(inner * square, reach * per_cell) / (gaussian_filter(inner * power, reach * per_cell) + 1e-12)
        for reach in (NEAR_MM, WIDE_MM)
    )
    found: list[tuple[float, float, float, float]] = []
    for part in parts:
        is_part = part[fine] & inner
        if is_part.sum() < FINEST:
            found.append(UNKNOWN_STRANDS)
            continue
        turned = np.where(is_part, near, 0.0)
        course = np.abs(_blurred(turned, COURSE_MM * per_cell))
        course /= gaussian_filter(np.abs(turned), COURSE_MM * per_cell) + 1e-9
        fall = float(np.sum(square.real * is_part) / (np.sum(power * is_part) + 1e-12))
        medians = [float(np.median(values[is_part])) for values in (np.abs(near), np.abs(wide), course)]
        found.append((medians[0], medians[1], medians[2], fall))
    return found


def _relief(portrait: Portrait, hair: Mask) -> tuple[Mask, FloatArray, tuple[NDArray[np.int64], ...]]:
    """Fine cells off the outline of hair (R, C), light of its strands in them, and cells of (R, C) that they are in."""
    from scipy.ndimage import binary_erosion, gaussian_filter

    if portrait.fine is None:
        raise ValueError("a portrait without a fine picture has no strands")
    fine = np.ix_(*(np.minimum(np.arange(length) // 2, length // 2) for length in portrait.fine.shape[:2]))
    is_hair, reach = hair[fine], SHADE_MM * 2.0 / CELL_MM
    light = np.where(is_hair, np.log(np.nan_to_num(portrait.fine) @ LUMINANCE + 8.0), 0.0)
    around = gaussian_filter(is_hair.astype(np.float64), reach) + 1e-6
    relief = np.where(is_hair, light - gaussian_filter(light, reach) / around, 0.0)
    return np.asarray(binary_erosion(is_hair, iterations=INSIDE_CELLS)), relief, fine


def strand_relief(portrait: Portrait, hair: Mask, part: Mask) -> float:
    """Deviation of the logarithm of light from strand to strand in a part (R, C) of hair; infinite if not seen."""
    if portrait.fine is None:
        return np.inf
    inner, relief, fine = _relief(portrait, hair)
    seen = relief[part[fine] & inner]
    return float(seen.std()) if len(seen) >= FINEST else np.inf


def name_below_hat(portrait: Portrait, hair: SeenHair) -> str:
    """Name of the hair below a hat, which lies over the region."""
    seen = measure_hair(portrait, hair.region)
    strands = seen.coherence[2]
    if seen.end < LONG_MM[int(seen.half_width > LONG_WIDE_MM)]:
        return "long and wavy" if strands < WAVY_WIDE else "long"
    if seen.end < BOB_MM:
        return "wavy bob" if strands < WAVY_WIDE else "bob"
    return UNSEEN


def _blurred(values: NDArray[np.complex128], spread: float) -> NDArray[np.complex128]:
    from scipy.ndimage import gaussian_filter

    return np.asarray(gaussian_filter(values.real, spread) + 1j * gaussian_filter(values.imag, spread))


def name_hair(portrait: Portrait, hair: SeenHair, skin: FloatArray) -> str:
    """Name of hair, a key of `HAIRCUTS`, on skin of a colour (3,), `log_colour`; empty if it is not seen."""
    if np.isnan(hair.hairy):
        return ""
    if not hair.region.any():
        return "stubble" if hair.hairy > SHADED_CROWN else "bald"
    seen = measure_hair(portrait, hair.region)
    if seen.end < LONG_MM[int(seen.half_width > LONG_WIDE_MM)]:
        return _long_name(seen)
    is_curly = _strands(seen) < WAVY_WIDE
    if seen.end < (CURLY_BOB_MM if is_curly else BOB_MM):
        plain = "bob with a fringe" if seen.fringe > FRINGE else "bob"
        return "wavy bob" if is_curly else plain
    return _short_name(seen, float(difference_from_skin(hair.colour - skin, DARKER)))


def _strands(seen: HairMeasures) -> float:
    """Coherence of the directions of strands of hair that falls, over 9 mm."""
    below = seen.coherence[2]
    return (seen.coherence[1] + below) / 2 if np.isfinite(below) else seen.coherence[1]


def _long_name(seen: HairMeasures) -> str:
    strands = _strands(seen)
    if strands + np.nan_to_num(seen.fall) < CURLS_FALL:
        return "long and curly"
    if strands < WAVY_WIDE or (strands < WAVY_COHERENT and WAVY_COURSE[0] < seen.course < WAVY_COURSE[1]):
        return "long and wavy"
    return "long with a fringe" if seen.fringe > FRINGE else "long"


def _short_name(seen: HairMeasures, unlike: float) -> str:
    """Name of hair with free ears that differs from the skin by `unlike`."""
    if seen.top > TIED_MM or seen.knot > KNOT_MM:
        return "tied back"
    if seen.top < FLAT_MM[0] and seen.half_width < FLAT_MM[1]:
        return "cropped" if seen.temples < CROPPED_MM[int(unlike < SEE_THROUGH)] else "flat"
    if seen.coherence[0] < CURLY and seen.temples > SLEEK_MM:
        return "afro" if seen.widest > ROUND_MM else "curly"
    return "short with a fringe" if seen.fringe > FRINGE and seen.half_width > FRINGED_MM else "short"
