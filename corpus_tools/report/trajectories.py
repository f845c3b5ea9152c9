"""Curves over phones and histograms inside a page (SVG)."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape

import numpy as np
from numpy.typing import NDArray

from lexicon.sequence import SILENCE, PhoneSequence

WIDTH, HEIGHT = 1100, 190
LEFT, RIGHT, TOP, BOTTOM = 56, 8, 22, 24  # margins
COLOURS = ("var(--ink)", "var(--first)", "var(--second)", "#2e8b57", "#a0522d", "#8a63d2", "#c2185b")
DASHES = ("", "", "5 3", "2 3", "8 3 2 3", "1 2", "")
N_BINS = 30


@dataclass(frozen=True, slots=True, eq=False)
class Series:
    """A named curve: values (T,) at times (T,) in seconds."""

    name: str
    times: NDArray[np.floating]
    values: NDArray[np.floating]


def line_plot(series: Sequence[Series], label: str, phones: PhoneSequence | None = None) -> str:
    """Curves over time, with the phones below."""
    low = min(float(one.values.min()) for one in series)
    high = max(float(one.values.max()) for one in series)
    room = 0.05 * (high - low) or 1.0
    frame = _Frame((0.0, float(series[0].times[-1])), (low - room, high + room))
    parts = [frame.axes(label), *(_phones(frame, phones) if phones is not None else ())]
    for number, one in enumerate(series):
        points = " ".join(f"{frame.x(t):.1f},{frame.y(v):.1f}" for t, v in zip(one.times, one.values, strict=True))
        parts.append(f'<polyline points="{points}" {_stroke(number)}/>')
    parts.append(_legend([one.name for one in series]))
    return _svg(parts)


def histogram(samples: Mapping[str, Sequence[float]]) -> str:
    """How often values occur, one outline for each name."""
    every = np.concatenate([np.asarray(values, np.float64) for values in samples.values()])
    edges = np.linspace(float(every.min()), float(every.max()) + 1e-9, N_BINS + 1)
    counts = {name: np.histogram(values, edges)[0] for name, values in samples.items()}
    top = max(int(count.max()) for count in counts.values())
    frame = _Frame((float(edges[0]), float(edges[-1])), (0.0, 1.05 * top))
    parts = [frame.axes("utterances")]
    for tick in np.linspace(edges[0], edges[-1], 6):
        parts.append(f'<text x="{frame.x(tick):.0f}" y="{HEIGHT - 8}" text-anchor="middle">{tick:.2f}</text>')
    for number, count in enumerate(counts.values()):
        steps = [(x, c) for bin_, c in enumerate(count) for x in (edges[bin_], edges[bin_ + 1])]
        points = " ".join(f"{frame.x(x):.1f},{frame.y(c):.1f}" for x, c in steps)
        parts.append(f'<polyline points="{points}" {_stroke(number)}/>')
    parts.append(_legend(list(counts)))
    return _svg(parts)


@dataclass(frozen=True, slots=True)
class _Frame:
    """From values to places in the picture."""

    across: tuple[float, float]
    along: tuple[float, float]

    def x(self, value: float) -> float:
        low, high = self.across
        return LEFT + (WIDTH - LEFT - RIGHT) * (value - low) / ((high - low) or 1.0)

    def y(self, value: float) -> float:
        low, high = self.along
        return HEIGHT - BOTTOM - (HEIGHT - TOP - BOTTOM) * (value - low) / ((high - low) or 1.0)

    def axes(self, label: str) -> str:
        """The frame, three values on the left, and what they are."""
        low, high = self.along
        ticks = [low, (low + high) / 2, high]
        texts = [f'<text x="{LEFT - 6}" y="{self.y(v) + 4:.0f}" text-anchor="end">{v:.3g}</text>' for v in ticks]
        box = f'x="{LEFT}" y="{TOP}" width="{WIDTH - LEFT - RIGHT}" height="{HEIGHT - TOP - BOTTOM}"'
        return (
            f'<rect {box} fill="none" stroke="var(--line)"/>{"".join(texts)}'
            f'<text x="{LEFT}" y="{TOP - 8}">{escape(label)}</text>'
        )


def _phones(frame: _Frame, phones: PhoneSequence) -> list[str]:
    parts = []
    for label, begin, end in zip(phones.phones, phones.edges, phones.edges[1:], strict=False):
        if begin > frame.across[1]:
            break
        parts.append(f'<path d="M{frame.x(begin):.1f} {TOP}V{HEIGHT - BOTTOM}" stroke="var(--line)"/>')
        if label != SILENCE:
            middle = frame.x((begin + min(end, frame.across[1])) / 2)
            parts.append(f'<text x="{middle:.0f}" y="{HEIGHT - 8}" text-anchor="middle">{escape(label)}</text>')
    return parts


def _stroke(number: int) -> str:
    colour, dash = COLOURS[number % len(COLOURS)], DASHES[number % len(DASHES)]
    return f'fill="none" stroke="{colour}" stroke-width="1.6" stroke-dasharray="{dash}"'


def _legend(names: Sequence[str]) -> str:
    parts, x = [], WIDTH - RIGHT - sum(44 + 7 * len(name) for name in names)
    for number, name in enumerate(names):
        parts.append(f'<path d="M{x} {TOP - 12}h24" {_stroke(number)}/>')
        parts.append(f'<text x="{x + 28}" y="{TOP - 8}">{escape(name)}</text>')
        x += 44 + 7 * len(name)
    return "".join(parts)


def _svg(parts: Sequence[str]) -> str:
    return f'<svg width="100%" viewBox="0 0 {WIDTH} {HEIGHT}">{"".join(parts)}</svg>'
