"""Curves over phones, and histograms, inside a page (SVG)."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from corpus_tools.report.plots import BOTTOM, RIGHT, TOP, Axes, picture, scales, text, x_axis, y_axis
from lexicon.sequence import SILENCE, PhoneSequence

WIDTH, HEIGHT = 1100, 236
COLOURS = ("var(--ink)", "var(--first)", "var(--second)", "#2e8b57", "#a0522d", "#8a63d2", "#c2185b")
DASHES = ("", "", "5 3", "2 3", "8 3 2 3", "1 2", "")
LETTER = 7  # px across a letter of the legend
N_BINS = 30


@dataclass(frozen=True, slots=True, eq=False)
class Series:
    """A named curve: values (T,) at times (T,) in seconds."""

    name: str
    times: NDArray[np.floating]
    values: NDArray[np.floating]


def curves_plot(series: Sequence[Series], label: str, phones: PhoneSequence) -> str:
    """Curves over time, with the phones below."""
    low = min(float(one.values.min()) for one in series)
    high = max(float(one.values.max()) for one in series)
    room = 0.05 * (high - low) or 1.0
    end = float(series[0].times[-1])
    axes = Axes("", label, (0.0, end), (low - room, high + room), WIDTH, HEIGHT)
    curves = {one.name: (one.times, one.values) for one in series}
    return _drawn(axes, [*_borders(axes, phones), *x_axis(axes, _middles(phones, end))], curves)


def histogram(samples: Mapping[str, Sequence[float]]) -> str:
    """How often values occur, one outline for each name."""
    every = np.concatenate([np.asarray(values, np.float64) for values in samples.values()])
    edges = np.linspace(float(every.min()), float(every.max()) + 1e-9, N_BINS + 1)
    counts = {name: np.histogram(values, edges)[0] for name, values in samples.items()}
    top = max(int(count.max()) for count in counts.values())
    axes = Axes("", "utterances", (float(edges[0]), float(edges[-1])), (0.0, 1.05 * top), WIDTH, HEIGHT)
    steps = np.repeat(edges, 2)[1:-1]
    return _drawn(axes, x_axis(axes), {name: (steps, np.repeat(count, 2)) for name, count in counts.items()})


def _drawn(
    axes: Axes, below: Sequence[str], curves: Mapping[str, tuple[NDArray[np.floating], NDArray[np.number]]]
) -> str:
    x, y = scales(axes)
    parts = [*y_axis(axes), *below]
    for number, (across, along) in enumerate(curves.values()):
        points = " ".join(f"{x(a):.1f},{y(b):.1f}" for a, b in zip(across, along, strict=True))
        parts.append(f'<polyline points="{points}" {_stroke(number)}/>')
    drawn = picture(axes.width, axes.height, [*parts, *_legend(list(curves))], name=axes.y_label)
    return f'<div class="wide">{drawn}</div>'


def _borders(axes: Axes, phones: PhoneSequence) -> list[str]:
    x, _ = scales(axes)
    seen = [edge for edge in phones.edges if edge <= axes.x_range[1]]
    return [f'<path d="M{x(edge):.1f} {TOP}V{HEIGHT - BOTTOM}" stroke="var(--line)"/>' for edge in seen]


def _middles(phones: PhoneSequence, end: float) -> list[tuple[float, str]]:
    spans = zip(phones.phones, phones.edges, phones.edges[1:], strict=False)
    return [
        (float(begin + min(stop, end)) / 2, label) for label, begin, stop in spans if label != SILENCE and begin < end
    ]


def _stroke(number: int) -> str:
    colour, dash = COLOURS[number % len(COLOURS)], DASHES[number % len(DASHES)]
    return f'fill="none" stroke="{colour}" stroke-width="1.6" stroke-dasharray="{dash}"'


def _legend(names: Sequence[str]) -> list[str]:
    parts, x, y = [], WIDTH - RIGHT - sum(44 + LETTER * len(name) for name in names), HEIGHT - 8
    for number, name in enumerate(names):
        parts += [f'<path d="M{x} {y - 4}h24" {_stroke(number)}/>', text(x + 28, y, name, anchor="start")]
        x += 44 + LETTER * len(name)
    return parts
