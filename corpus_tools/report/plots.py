"""Plots as pictures inside a page (SVG): lines, points and bars over two axes."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from html import escape

import numpy as np

LEFT, RIGHT, TOP, BOTTOM = 56, 14, 12, 44  # px around the plot
BAR, NAME = 20, 150  # px: height of a bar with its gap, width of its name
N_TICKS = 8


@dataclass(frozen=True, slots=True)
class Point:
    """Where it lies, its text under the mouse, and its colour (CSS)."""

    x: float
    y: float
    title: str
    colour: str = "var(--first)"


@dataclass(frozen=True, slots=True)
class Axes:
    """What the axes say, how far they go, and the size of the picture in px."""

    x_label: str
    y_label: str
    x_range: tuple[float, float]
    y_range: tuple[float, float]
    width: int = 560
    height: int = 300


def text(x: float, y: float, content: str, *, anchor: str = "middle", more: str = "") -> str:
    """A word at a place; `more` are further attributes."""
    return f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" {more}>{escape(content)}</text>'


def picture(width: float, height: float, parts: Sequence[str], *, size: int = 11, name: str = "") -> str:
    """An SVG with letters of `size` px, and a name for those who cannot see it."""
    return (
        f'<svg role="img" aria-label="{escape(name)}" width="{width:.0f}" height="{height:.0f}" '
        f'viewBox="0 0 {width:.0f} {height:.0f}" class="figure" style="--letters:{size}px">{"".join(parts)}</svg>'
    )


def ticks(low: float, high: float) -> list[float]:
    """Round numbers within a range, about `N_TICKS` of them."""
    raw = (high - low) / N_TICKS
    size = 10.0 ** np.floor(np.log10(raw))
    step = next(size * factor for factor in (1, 2, 5, 10) if size * factor >= raw * 0.999)
    return [float(k * step) for k in range(int(np.ceil(low / step - 1e-9)), int(np.floor(high / step + 1e-9)) + 1)]


def scatter(axes: Axes, points: Sequence[Point], line: tuple[float, float] | None = None) -> str:
    """Points; `line` is the intercept and slope of a straight line through them."""
    x, y = scales(axes)
    parts = [*y_axis(axes), *x_axis(axes)]
    for point in points:
        parts.append(
            f'<circle cx="{x(point.x):.1f}" cy="{y(point.y):.1f}" r="3" fill="{point.colour}" fill-opacity=".65">'
            f"<title>{escape(point.title)}</title></circle>"
        )
    if line is not None:
        low, high = axes.x_range
        ends = [(at, float(np.clip(line[0] + line[1] * at, *axes.y_range))) for at in (low, high)]
        path = "L".join(f"{x(a):.1f} {y(b):.1f}" for a, b in ends)
        parts.append(f'<path d="M{path}" stroke="var(--ink)" stroke-width="1.5" fill="none"/>')
    return picture(axes.width, axes.height, parts, name=f"{axes.y_label} over {axes.x_label}")


def line_plot(axes: Axes, points: Sequence[Point], marked: int) -> str:
    """Points joined by a line; the one at index `marked` is larger."""
    x, y = scales(axes)
    places = " ".join(f"{x(point.x):.1f},{y(point.y):.1f}" for point in points)
    line = f'<polyline points="{places}" fill="none" stroke="var(--first)" stroke-width="1.5"/>'
    parts = [*y_axis(axes), *x_axis(axes), line]
    for at, point in enumerate(points):
        radius, colour = (6, "var(--second)") if at == marked else (3.5, point.colour)
        parts.append(
            f'<circle cx="{x(point.x):.1f}" cy="{y(point.y):.1f}" r="{radius}" fill="{colour}">'
            f"<title>{escape(point.title)}</title></circle>"
        )
    return picture(axes.width, axes.height, parts, name=f"{axes.y_label} over {axes.x_label}")


def bars(values: Sequence[tuple[str, float]], *, width: int = 560) -> str:
    """Bars from 0 to 1, one a line: its name, the bar, the number."""
    room = width - NAME - 46
    parts = []
    for row, (name, value) in enumerate(values):
        top = row * BAR
        parts += [
            text(NAME - 8, top + 14, name, anchor="end"),
            f'<rect x="{NAME}" y="{top + 3}" width="{room}" height="14" fill="var(--line)" fill-opacity=".5"/>',
            f'<rect x="{NAME}" y="{top + 3}" width="{room * min(value, 1.0):.1f}" height="14" fill="var(--first)"/>',
            text(NAME + room + 8, top + 14, f"{value:.2f}", anchor="start"),
        ]
    return picture(width, len(values) * BAR, parts, size=12, name="bars")


def scales(axes: Axes) -> tuple[Callable[[float], float], Callable[[float], float]]:
    """From values to places in the picture, across and down."""
    (x_low, x_high), (y_low, y_high) = axes.x_range, axes.y_range
    room, tall = axes.width - LEFT - RIGHT, axes.height - TOP - BOTTOM
    return (
        lambda value: LEFT + (value - x_low) / (x_high - x_low) * room,
        lambda value: TOP + (y_high - value) / (y_high - y_low) * tall,
    )


def y_axis(axes: Axes) -> list[str]:
    """The axis on the left, its lines across the plot, and its name."""
    _, y = scales(axes)
    right, bottom = axes.width - RIGHT, axes.height - BOTTOM
    parts = []
    for value in ticks(*axes.y_range):
        parts.append(f'<path d="M{LEFT} {y(value):.1f}H{right}" stroke="var(--line)"/>')
        parts.append(text(LEFT - 6, y(value) + 4, f"{value:g}", anchor="end"))
    middle = (TOP + bottom) / 2
    parts.append(text(14, middle, axes.y_label, more=f'transform="rotate(-90 14 {middle:.1f})"'))
    return parts


def x_axis(axes: Axes, marks: Sequence[tuple[float, str]] | None = None) -> list[str]:
    """The axis below with its name, and what stands at which values: round numbers without `marks`."""
    x, _ = scales(axes)
    right, bottom = axes.width - RIGHT, axes.height - BOTTOM
    parts = [f'<path d="M{LEFT} {bottom}H{right}" stroke="var(--soft)"/>']
    if marks is None:
        marks = [(value, f"{value:g}") for value in ticks(*axes.x_range)]
        parts += [f'<path d="M{x(value):.1f} {bottom}v4" stroke="var(--soft)"/>' for value, _ in marks]
    parts += [text(x(value), bottom + 17, name) for value, name in marks]
    parts.append(text((LEFT + right) / 2, axes.height - 8, axes.x_label))
    return parts
