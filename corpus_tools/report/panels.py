"""Plots of lines as data, to be drawn inside a page (SVG) or into a picture (PNG)."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from html import escape
from io import BytesIO

import numpy as np
from numpy.typing import NDArray

from corpus_tools.report.plots import BOTTOM, LEFT, RIGHT, TOP, Axes, picture, scales, text, ticks, x_axis, y_axis

INK, SOFT, RULE = (29, 35, 41), (102, 112, 122), (213, 218, 224)
COLOURS = {
    "ink": ("var(--ink)", INK),
    "first": ("var(--first)", (11, 108, 176)),
    "second": ("var(--second)", (184, 134, 11)),
}
HEAD = 26  # px above a panel of a picture
DOWN = 14  # px from there to the panel: room for its title
LETTER = 12  # px
SCALE = 2  # pictures are drawn larger and then made smaller: smooth lines

Floats = NDArray[np.floating]


@dataclass(frozen=True, slots=True, eq=False)
class Line:
    """A named line through (N,) places; one of `COLOURS`."""

    name: str
    colour: str
    x: Floats
    y: Floats


@dataclass(frozen=True, slots=True, eq=False)
class Panel:
    """Lines over the same axes; where `is_logarithmic` y is a power of ten."""

    title: str
    axes: Axes
    lines: tuple[Line, ...]
    is_logarithmic: bool = False


def histogram(values: Floats, edges: Floats) -> tuple[Floats, Floats]:
    """Outline of a histogram: places and shares of all values in each bin, as steps."""
    counts, _ = np.histogram(np.clip(values, edges[0], edges[-1]), edges)
    shares = counts / max(len(values), 1)
    return np.repeat(edges, 2)[1:-1], np.repeat(shares, 2)


def panel_svg(panel: Panel) -> str:
    """The panel for a page, with a legend."""
    x, y = scales(panel.axes)
    parts = [*_upright(panel), *x_axis(panel.axes)]
    for line in panel.lines:
        places = " ".join(f"{x(a):.1f},{y(b):.1f}" for a, b in _inside(panel, line))
        parts.append(
            f'<polyline points="{places}" fill="none" stroke="{COLOURS[line.colour][0]}" stroke-width="1.5">'
            f"<title>{escape(line.name)}</title></polyline>"
        )
    right = panel.axes.width - RIGHT
    for row, line in enumerate(panel.lines):
        at = TOP + 12 + 15 * row
        parts.append(f'<path d="M{right - 12} {at - 4}h12" stroke="{COLOURS[line.colour][0]}" stroke-width="2"/>')
        parts.append(text(right - 18, at, line.name, anchor="end"))
    return (
        f"<figure><figcaption>{escape(panel.title)}</figcaption>"
        f"{picture(panel.axes.width, panel.axes.height, parts, name=panel.title)}</figure>"
    )


def panels_png(title: str, panels: Sequence[Panel], columns: int) -> bytes:
    """The panels in rows, as PNG bytes; all of one size."""
    from PIL import Image, ImageDraw

    width, height = panels[0].axes.width, panels[0].axes.height + HEAD
    rows = -(-len(panels) // columns)
    size = columns * width, rows * height + HEAD
    image = Image.new("RGB", (size[0] * SCALE, size[1] * SCALE), "white")
    pen = _Pen(ImageDraw.Draw(image))
    pen.text(width * columns / 2, HEAD / 2, title, INK, "mm", LETTER + 3)
    for at, panel in enumerate(panels):
        pen.move(at % columns * width, HEAD + DOWN + at // columns * height)
        _draw(pen, panel)
    file = BytesIO()
    image.resize(size, Image.Resampling.LANCZOS).quantize(64).save(file, "PNG", optimize=True)
    return file.getvalue()


def _inside(panel: Panel, line: Line) -> list[tuple[float, float]]:
    (x_low, x_high), (y_low, y_high) = panel.axes.x_range, panel.axes.y_range
    kept = (line.x >= x_low) & (line.x <= x_high) & np.isfinite(line.y)
    return list(zip(line.x[kept].tolist(), np.clip(line.y[kept], y_low, y_high).tolist(), strict=True))


def _marks(panel: Panel) -> list[tuple[float, str]]:
    values = ticks(*panel.axes.y_range)
    if panel.is_logarithmic:
        return [
            (value, f"1e{value:.0f}" if value < -2 else f"{10.0**value:g}") for value in values if value == round(value)
        ]
    return [(value, f"{value:g}") for value in values]


def _upright(panel: Panel) -> list[str]:
    if not panel.is_logarithmic:
        return y_axis(panel.axes)
    _, y = scales(panel.axes)
    right = panel.axes.width - RIGHT
    parts = []
    for value, name in _marks(panel):
        parts.append(f'<path d="M{LEFT} {y(value):.1f}H{right}" stroke="var(--line)"/>')
        parts.append(text(LEFT - 6, y(value) + 4, name, anchor="end"))
    middle = (TOP + panel.axes.height - BOTTOM) / 2
    parts.append(text(14, middle, panel.axes.y_label, more=f'transform="rotate(-90 14 {middle:.1f})"'))
    return parts


class _Pen:
    """Draws at the picture's scale, from a corner that moves."""

    def __init__(self, draw: object) -> None:
        self._draw, self._x, self._y = draw, 0.0, 0.0

    def move(self, x: float, y: float) -> None:
        """Set the corner."""
        self._x, self._y = x, y

    def line(self, places: Sequence[tuple[float, float]], colour: tuple[int, int, int], width: float) -> None:
        """Draw a line."""
        moved = [((x + self._x) * SCALE, (y + self._y) * SCALE) for x, y in places]
        self._draw.line(moved, fill=colour, width=round(width * SCALE))  # type: ignore[attr-defined]

    def text(
        self, x: float, y: float, word: str, colour: tuple[int, int, int], anchor: str, size: int = LETTER
    ) -> None:
        """Draw a word."""
        from PIL import ImageFont

        place = (x + self._x) * SCALE, (y + self._y) * SCALE
        self._draw.text(place, word, colour, font=ImageFont.load_default(size * SCALE), anchor=anchor)  # type: ignore[attr-defined]


def _draw(pen: _Pen, panel: Panel) -> None:
    taller = replace(panel.axes, height=panel.axes.height)
    x, y = scales(taller)
    right, bottom = taller.width - RIGHT, taller.height - BOTTOM
    pen.text((LEFT + right) / 2, 0, f"{panel.title} ({panel.axes.y_label})", INK, "mm")
    for value, name in _marks(panel):
        pen.line([(LEFT, y(value)), (right, y(value))], RULE, 1)
        pen.text(LEFT - 6, y(value), name, SOFT, "rm")
    for value in ticks(*panel.axes.x_range):
        pen.line([(x(value), bottom), (x(value), bottom + 4)], SOFT, 1)
        pen.text(x(value), bottom + 13, f"{value:g}", SOFT, "mm")
    pen.line([(LEFT, bottom), (right, bottom)], SOFT, 1)
    pen.text((LEFT + right) / 2, taller.height - 12, panel.axes.x_label, INK, "mm")
    for row, line in enumerate(panel.lines):
        places = [(x(a), y(b)) for a, b in _inside(panel, line)]
        if len(places) > 1:
            pen.line(places, COLOURS[line.colour][1], 1.5)
        at = TOP + 8 + 15 * row
        pen.line([(right - 12, at), (right, at)], COLOURS[line.colour][1], 2)
        pen.text(right - 18, at, line.name, INK, "rm")
