"""Strips of lips as SVG: outlines of `tts2face.serving.studio.tasks.explain` at the instants of a phone (pure)."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape
from typing import Any

MARGIN_MM = 2.0  # around the lips of a cell
UPPER_MID, LOWER_MID = 5, 15  # places of the middles of the lips in an inner outline
Outlines = Sequence[Mapping[str, Sequence[Sequence[float]]]]


@dataclass(frozen=True, slots=True)
class Cell:
    """Place of a pair of lips in a strip: mm from the middle of the mouth to the sides, and to top and bottom."""

    half_width: float
    top: float
    bottom: float


def common_cell(strips: Sequence[Outlines]) -> Cell:
    """Cell that holds the lips of all strips, so that they are drawn at one scale."""
    points = [point for strip in strips for outline in strip for point in outline["outer"]]
    half = max((abs(x) for x, _ in points), default=1.0) + MARGIN_MM
    heights = [y for _, y in points] or [0.0]
    return Cell(half, min(heights) - MARGIN_MM, max(heights) + MARGIN_MM)


def strip_svg(outlines: Outlines, cell: Cell, whose: str) -> str:
    """Picture of the lips from the first instant to the last, with what it shows in words.

    Parameters
    ----------
    whose
        Start of the words, such as ``Lips of bbaf2n``.
    """
    width, height = 2 * cell.half_width, cell.bottom - cell.top
    gaps = ", ".join(f"{opening_mm(outline):.1f}" for outline in outlines)
    words = escape(f"{whose}, from its beginning to its end: open by {gaps} mm", quote=True)
    lips = "".join(
        f'<g transform="translate({width * number + cell.half_width:.2f} {-cell.top:.2f})">'
        f'<path class="lips" d="{_path(outline["outer"])}"/><path class="mouth" d="{_path(outline["inner"])}"/></g>'
        for number, outline in enumerate(outlines)
    )
    size = f"{width * len(outlines):.2f} {height:.2f}"
    return f'<svg class="lip-strip" role="img" aria-label="{words}" viewBox="0 0 {size}">{lips}</svg>'


def opening_mm(outline: Mapping[str, Sequence[Sequence[float]]]) -> float:
    """Vertical gap between the middles of the inner lips, mm, at least 0."""
    return max(float(outline["inner"][LOWER_MID][1] - outline["inner"][UPPER_MID][1]), 0.0)


def _path(points: Any) -> str:
    return "M" + "L".join(f"{x:.2f} {y:.2f}" for x, y in points) + "Z"
