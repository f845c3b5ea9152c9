"""A table of phones as a picture inside a page (SVG): heat map, dendrogram, legend, numbers under the mouse."""

from collections.abc import Sequence
from html import escape
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from corpus_tools.report.plots import picture, text, ticks
from corpus_tools.report.ramps import Ramp
from corpus_tools.similarity.figure import TableFigure

CELL, LETTER = 20, 12  # px
TREE = 170  # px, width of the dendrogram
LABEL = 62  # px, room for "tʃ CH"
LEGEND = (240, 12)  # px, width and height of the colour scale
N_SHADES = 48
FOOT = 58  # px under the cells: the dendrogram's axis and the colour scale


def heatmap(figure: TableFigure) -> str:
    """The figure."""
    n = len(figure.names)
    tree = TREE if figure.brackets else 0
    left, top = tree + LABEL, LABEL
    parts = [*_cells(figure, left, top), *_blocks(figure.blocks, left, top), *_names(figure, left, top)]
    if figure.brackets:
        parts += _tree(figure, top)
    parts.append(f'<g transform="translate({left} {top + n * CELL + 14})">{legend(figure.ramp, figure.scale)}</g>')
    width = left + max(n * CELL, LEGEND[0] + 280) + 4
    return picture(width, top + n * CELL + FOOT, parts, size=LETTER, name=figure.title)


def grid(rows: Sequence[str], columns: Sequence[str], values: NDArray[np.floating], ramp: Ramp) -> str:
    """Numbers (R, K) as coloured fields under named columns, each with its number in it."""
    field, high, head = 64, 20, 96
    parts = []
    for k, name in enumerate(columns):
        x, y = LABEL + (k + 0.5) * field, head - 8
        parts.append(text(x, y, name, anchor="start", more=f'transform="rotate(-38 {x:.0f} {y:.0f})"'))
    for r, name in enumerate(rows):
        y = head + r * high
        parts.append(text(LABEL - 8, y + 14, name, anchor="end"))
        for k, value in enumerate(values[r]):
            x = LABEL + k * field
            red, green, blue = ramp.colour(value)
            ink = "#000" if 0.3 * red + 0.6 * green + 0.1 * blue > 120 else "#fff"
            parts.append(f'<rect x="{x}" y="{y}" width="{field}" height="{high}" fill="{ramp.hexadecimal(value)}"/>')
            parts.append(text(x + field / 2, y + 14, f"{value:.2f}", more=f'style="fill:{ink}"'))
    return picture(LABEL + len(columns) * field + 70, head + len(rows) * high, parts, size=LETTER, name="table")


def legend(ramp: Ramp, scale: str) -> str:
    """The colour scale with its numbers, and what they mean."""
    width, high = LEGEND
    shade = width / N_SHADES
    parts = [text(width + 14, high - 1, scale, anchor="start")]
    for k in range(N_SHADES):
        value = ramp.low + (k + 0.5) / N_SHADES * (ramp.high - ramp.low)
        colour = ramp.hexadecimal(value)
        parts.append(f'<rect x="{k * shade:.1f}" y="0" width="{shade + 0.5:.1f}" height="{high}" fill="{colour}"/>')
    for value in ticks(ramp.low, ramp.high):
        parts.append(text((value - ramp.low) / (ramp.high - ramp.low) * width, high + 15, f"{value:g}"))
    return "".join(parts)


def _cells(figure: TableFigure, left: int, top: int) -> list[str]:
    parts = []
    for i, row in enumerate(figure.names):
        for j, column in enumerate(figure.names):
            value = figure.values[i, j]
            parts.append(
                f'<rect class="cell" x="{left + j * CELL}" y="{top + i * CELL}" width="{CELL}" height="{CELL}" '
                f'fill="{figure.ramp.hexadecimal(value)}"><title>{escape(row)} – {escape(column)}: {value:.3f}'
                "</title></rect>"
            )
    return parts


def _blocks(blocks: Sequence[int], left: int, top: int) -> list[str]:
    """Frames around the classes."""
    return [
        f'<rect x="{left + first * CELL}" y="{top + first * CELL}" width="{(last - first) * CELL}" '
        f'height="{(last - first) * CELL}" fill="none" stroke="#fff" stroke-width="2" pointer-events="none"/>'
        for first, last in pairwise(blocks)
    ]


def _names(figure: TableFigure, left: int, top: int) -> list[str]:
    parts = []
    for at, name in enumerate(figure.names):
        middle = (at + 0.5) * CELL
        x, y = left + middle + 4, top - 6
        parts.append(text(left - 6, top + middle + 4, name, anchor="end"))
        parts.append(text(x, y, name, anchor="start", more=f'transform="rotate(-90 {x:.0f} {y})"'))
    return parts


def _tree(figure: TableFigure, top: int) -> list[str]:
    """The dendrogram, its root to the left, and its axis."""
    highest = figure.brackets[-1].height * 1.04
    foot = top + len(figure.names) * CELL

    def x(height: float) -> float:
        return TREE - 4 - height / highest * (TREE - 14)

    parts = []
    for bracket in figure.brackets:
        (a, b), (at_a, at_b) = bracket.rows, bracket.heights
        path = f"M{x(at_a):.1f} {top + a * CELL:.1f}H{x(bracket.height):.1f}V{top + b * CELL:.1f}H{x(at_b):.1f}"
        parts.append(
            f'<path d="{path}" fill="none" stroke="var(--ink)" stroke-width="1.3">'
            f"<title>1 - similarity {bracket.height:.3f}</title></path>"
        )
    if figure.cut is not None:
        parts.append(
            f'<path d="M{x(figure.cut):.1f} {top}V{foot}" stroke="var(--second)" stroke-width="1.5" '
            'stroke-dasharray="5 4"/>'
        )
    parts.append(f'<path d="M{x(highest):.1f} {foot + 4}H{x(0):.1f}" stroke="var(--soft)"/>')
    for value in ticks(0.0, highest):
        parts.append(f'<path d="M{x(value):.1f} {foot + 4}v4" stroke="var(--soft)"/>')
        parts.append(text(x(value), foot + 20, f"{value:g}"))
    parts.append(text(TREE / 2, foot + 38, "1 - similarity"))
    return parts
