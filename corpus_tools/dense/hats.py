"""Hats in a portrait: found by their colour and smoothness, and the hair that is seen below them."""

from dataclasses import replace

import numpy as np

from corpus_tools.dense.hair_region import (
    ACROSS_MM,
    BROW_TOPS,
    CELL_MM,
    CROWN_HALF_MM,
    CROWN_MM,
    FOREHEAD,
    UP_MM,
    Portrait,
    SeenHair,
)
from corpus_tools.dense.hairdo import strand_relief
from corpus_tools.dense.light_colour import log_colour
from tts2face.numeric.arrays import FloatArray

# Natural hair lies on a line of log R/G and B/G, from black and grey to brown and blond: browner by so much bluer less.
HAIR_LINE = np.array([1.0, -0.9])
# Distance of the crown's hue from that line, and deviation of its strands' light, logarithm: hats from .72 and to .06,
# natural hair to .46; dyed hair shows strands (.07 and more).
UNNATURAL, SMOOTH = 0.6, 0.065
OFF_HAT, MIN_CELLS = 0.5, 40  # distance of hair from the hat's colour (log R/G and B/G), and its least cells
BROW_HALF_MM, BROW_DOWN_MM, BROW_DARK = 6.0, 4.0, 0.3  # cells about a brow, of which the darkest share shows its colour
BROW_SHINE = np.array([0.5, 0.0, 0.0])  # logarithm by which hair is lighter than brows


def off_natural(hue: FloatArray) -> FloatArray:
    """Distance (...) of log R/G and B/G (..., 2) from those of natural hair."""
    brown = np.maximum(hue @ HAIR_LINE / (HAIR_LINE @ HAIR_LINE), 0.0)
    return np.asarray(np.linalg.norm(hue - brown[..., None] * HAIR_LINE, axis=-1))


def below_hat(portrait: Portrait, hair: SeenHair, cast: FloatArray) -> SeenHair | None:
    """Visible hair where the crown is a hat's, in light of a cast (2,); None if there is none.

    The region stays, since a hat hides skin as hair does. Where it hides all hair the colour is the brows'.
    """
    across, up = np.meshgrid(ACROSS_MM, UP_MM)
    crown = hair.region & (up > portrait.marks[FOREHEAD, 1] + CROWN_MM) & (np.abs(across) < CROWN_HALF_MM)
    if crown.sum() < MIN_CELLS:
        return None
    colours = log_colour(np.nan_to_num(portrait.srgb))
    usual = np.median(colours[crown], axis=0)
    if off_natural(usual[1:] - cast) < UNNATURAL or strand_relief(portrait, hair.region, crown) > SMOOTH:
        return None
    below = hair.region & (up < portrait.marks[FOREHEAD, 1])
    below &= np.linalg.norm(colours[..., 1:] - usual[1:], axis=-1) > OFF_HAT
    below &= off_natural(colours[..., 1:] - cast) < UNNATURAL
    if below.sum() >= MIN_CELLS:
        return replace(hair, colour=np.median(colours[below], axis=0))
    tops = portrait.marks[list(BROW_TOPS), :2] - (0.0, BROW_DOWN_MM)
    near = np.min([np.hypot(across - x, up - y) for x, y in tops], axis=0) < max(BROW_HALF_MM, CELL_MM)
    brows = colours[near & np.isfinite(portrait.srgb[..., 0])]
    dark = brows[brows[:, 0] <= np.quantile(brows[:, 0], BROW_DARK)]
    return replace(hair, colour=np.median(dark, axis=0) + BROW_SHINE)
