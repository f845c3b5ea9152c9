"""The plots of a style: what is real in ink, what a field makes in the first colour, noise in the second."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from corpus_tools.gesture_study.analysis import Compared, Moving, StyleFound
from corpus_tools.gesture_study.longrun import FROM_S, LAGS_S
from corpus_tools.report.panels import Line, Panel, histogram
from corpus_tools.report.plots import Axes

WIDTH, HEIGHT = 380, 250  # px of a panel
N_BINS = 40
SHOWN = 0.995  # of the values lie within a plot; those beyond are in its first or last bin
DECADES = 7.0  # of a spectrum
COLOURS = ("ink", "first", "second")
BRIEF = ("head speed", "brow height", "blink interval", "blink duration")  # in the picture


def names_of(found: StyleFound) -> tuple[str, str, str]:
    """What the three lines of a plot show."""
    return ("recorded" if found.source is None else found.source, "field", "noise")


def distribution(found: StyleFound, compared: Compared) -> Panel:
    """Histograms of a trait; the same bins for all."""
    kinds = compared.real, compared.field, compared.noise
    values = np.concatenate([compared.real, compared.field])
    low, high = _range(values)
    edges = np.linspace(low, high, N_BINS + 1)
    drawn = [histogram(kind, edges) for kind in kinds if len(kind)]
    names = [(name, colour) for name, colour, kind in zip(names_of(found), COLOURS, kinds, strict=True) if len(kind)]
    lines = [Line(name, colour, x, 100 * y) for (name, colour), (x, y) in zip(names, drawn, strict=True)]
    top = max((float(line.y.max()) for line in lines[:2]), default=1.0) * 1.25
    unit = f", {compared.trait.unit}" if compared.trait.unit else ""
    return Panel(
        compared.trait.name,
        Axes(f"{compared.trait.name}{unit}", "% of values", (low, high), (0.0, top or 1.0), WIDTH, HEIGHT),
        tuple(lines),
    )


def power(found: StyleFound, moving: Moving) -> Panel:
    """Power spectra, on a logarithmic scale; without the mean."""
    lines = []
    for name, colour, one in zip(names_of(found), COLOURS, moving.spectra, strict=True):
        lines.append(Line(name, colour, one.hz[1:], np.log10(np.maximum(one.power[1:], 1e-30))))
    highest = max(float(np.nanmax(line.y)) if np.isfinite(line.y).any() else 0.0 for line in lines[:2])
    top = np.ceil(highest)
    unit = f"{moving.unit}^2/Hz" if moving.unit else "1/Hz"
    return Panel(
        f"{moving.feature}: power",
        Axes("Hz", unit, (0.0, 15.0), (top - DECADES, top), WIDTH, HEIGHT),
        tuple(lines),
        is_logarithmic=True,
    )


def repetition(found: StyleFound, feature: str) -> Panel:
    """Autocorrelation of ten minutes over the lag."""
    one = found.long.repeating[feature]
    lags = np.arange(FROM_S, LAGS_S) + 0.5
    kinds = ("recordings, shuffled", one.real), ("field, speech", one.speech), ("field, silence", one.silence)
    lines = [Line(name, colour, lags, values[FROM_S:]) for (name, values), colour in zip(kinds, COLOURS, strict=True)]
    return Panel(
        f"{feature}: likeness to itself",
        Axes("lag, s", "highest r in a second", (0.0, float(LAGS_S)), (-0.2, 1.0), WIDTH, HEIGHT),
        tuple(lines),
    )


def brief(found: StyleFound) -> Sequence[Panel]:
    """The panels of the picture."""
    traits = [distribution(found, one) for one in found.compared if one.trait.name in BRIEF]
    spectra = [power(found, one) for one in found.moving if one.feature in {"head", "brows"}]
    return [*traits, *spectra] or [distribution(found, found.compared[0])]


def _range(values: NDArray[np.float64]) -> tuple[float, float]:
    if not len(values):
        return 0.0, 1.0
    low, high = np.quantile(values, [1 - SHOWN, SHOWN])
    low = 0.0 if values.min() >= 0 else float(low)
    return (low, float(high)) if high > low else (low - 0.5, low + 0.5)
