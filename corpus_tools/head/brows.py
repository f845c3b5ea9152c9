"""Brows: many fine hairs stroked into the skin's texture."""

import numpy as np
from numpy.typing import NDArray

from corpus_tools.head.noise import stroke_cover

Floats = NDArray[np.float64]

N_HAIRS = 330  # each side
ARCH = np.array([(10.5, 10.4), (18, 13.2), (28, 16.0), (37, 17.3), (45, 15.6), (52, 11.6)])  # middle line: |x|, y in mm
THICK_MM = np.array([5.6, 6.6, 5.8, 4.6, 3.2, 1.4])  # across the line, at the points of ARCH


def brow_cover(places: Floats, generator: np.random.Generator, thickness: float = 1.0) -> Floats:
    """(P,) cover by brow hairs at places (P, 3), mm; both sides, not quite alike."""
    cover = np.zeros(len(places))
    in_front = places[:, 2] > 0
    for side in (1.0, -1.0):
        near = in_front & (side * places[:, 0] > 5) & (np.abs(places[:, 1] - 14) < 14)
        flat = places[near, :2] * [side, 1]
        starts, ends, widths = _hairs(generator, thickness)
        soft = _shadow(flat, thickness)
        cover[near] = np.maximum(0.42 * soft, 0.92 * stroke_cover(flat, starts, ends, widths) * (0.25 + 0.75 * soft))
    return cover


def _hairs(generator: np.random.Generator, thickness: float) -> tuple[Floats, Floats, Floats]:
    """Roots (H, 2), tips (H, 2) and widths (H,) of the hairs of the left brow."""
    along = generator.beta(1.0, 1.15, N_HAIRS)
    across = np.clip(generator.normal(0, 0.42, N_HAIRS), -1, 1)
    x = ARCH[0, 0] + along * (ARCH[-1, 0] - ARCH[0, 0])
    slope = np.gradient(np.interp(ARCH[:, 0], ARCH[:, 0], ARCH[:, 1]), ARCH[:, 0])
    thick = thickness * np.interp(x, ARCH[:, 0], THICK_MM)
    roots = np.column_stack([x, np.interp(x, ARCH[:, 0], ARCH[:, 1]) + across * thick / 2])
    lift = np.interp(
        along, [0, 0.12, 0.4, 1], [1.35, 1.0, 0.45, -0.05]
    )  # hairs stand up at the nose and lie down outside
    turn = np.arctan(np.interp(x, ARCH[:, 0], slope)) + lift - 0.55 * across * np.clip(along + 0.3, 0, 1)
    turn += generator.normal(0, 0.13, N_HAIRS)
    length = np.interp(along, [0, 0.3, 1], [4.2, 6.2, 4.6]) * generator.uniform(0.75, 1.15, N_HAIRS)
    tips = roots + length[:, None] * np.column_stack([np.cos(turn), np.sin(turn)])
    return roots, tips, generator.uniform(0.22, 0.40, N_HAIRS)


def _shadow(flat: Floats, thickness: float) -> Floats:
    """Soft body of the brow under the hairs."""
    x = flat[:, 0]
    off = np.abs(flat[:, 1] - np.interp(x, ARCH[:, 0], ARCH[:, 1]) - 0.6)
    thick = thickness * np.interp(x, ARCH[:, 0], THICK_MM) / 2
    ends = np.clip((x - ARCH[0, 0] + 2.5) / 6, 0, 1) * np.clip((ARCH[-1, 0] + 3 - x) / 7, 0, 1)
    body: Floats = np.exp(-((off / (thick + 0.4)) ** 2)) * ends
    return body
