"""Plots of a style: distributions, spectra and autocorrelations of recordings, fields and noise."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from corpus_tools.gesture_study.analysis import MotionComparison, StyleStudy, TraitComparison
from corpus_tools.gesture_study.longrun import FROM_S, LAGS_S
from corpus_tools.report.drawing import SERIES, draw_png, draw_svg

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

WIDTH, HEIGHT, HEAD, COLUMNS = 380, 250, 26, 3  # px of a panel and of the title; panels in a row of the picture
MARGINS = {"left": 0.175, "right": 0.985, "bottom": 0.17, "top": 0.9}  # of a panel of a page
N_BINS = 40
SHOWN = 0.995  # share of the values within a plot; the others count in its first or last bin
DECADES = 7  # of a spectrum
MOST_HZ = 15.0  # half of the frame rate of gestures
SUMMARY_TRAITS = ("head speed", "brow height", "blink interval", "blink duration")  # traits in the picture


@dataclass(frozen=True, slots=True, eq=False)
class Panel:
    """A title and the function that draws the plot below it."""

    title: str
    draw: "Callable[[Axes], None]"


def series_names(style: StyleStudy) -> tuple[str, ...]:
    """Names of the lines of a plot; only measured styles have one of the published field."""
    return ("recorded", "field", "noise", "ju2008") if style.source is None else (style.source, "field", "noise")


def panel_svg(panel: Panel) -> str:
    """A panel for a page."""

    def draw(figure: "Figure") -> tuple[()]:
        figure.set_layout_engine("none")  # a constrained layout takes twice as long
        panel.draw(figure.subplots(gridspec_kw=MARGINS))
        return ()

    return draw_svg(draw, WIDTH, HEIGHT, panel.title)


def panels_png(title: str, panels: Sequence[Panel]) -> bytes:
    """The panels in rows of `COLUMNS` below a title, as PNG bytes."""
    rows = -(-len(panels) // COLUMNS)

    def draw(figure: "Figure") -> tuple[()]:
        figure.suptitle(title)
        for at, panel in enumerate(panels, start=1):
            panel.draw(figure.add_subplot(rows, COLUMNS, at))
        return ()

    return draw_png(draw, COLUMNS * WIDTH, rows * HEIGHT + HEAD)


def distribution_panel(style: StyleStudy, compared: TraitComparison) -> Panel:
    """Histograms of a trait over common bins."""
    kinds = compared.real, compared.field, compared.noise, compared.published
    edges = np.linspace(*_limits(np.concatenate(kinds[:2])), N_BINS + 1)
    unit = f", {compared.trait.unit}" if compared.trait.unit else ""
    names = series_names(style)

    def draw(axes: "Axes") -> None:
        highest = 0.0
        for name, values, (colour, dash) in zip(names, kinds, SERIES, strict=False):
            if len(values):
                counts, _ = np.histogram(np.clip(values, edges[0], edges[-1]), edges)
                shares = 100 * counts / len(values)
                axes.stairs(shares, edges, color=colour, linestyle=dash, linewidth=1.5, label=name)
                highest = max(highest, shares.max() if name in names[:2] else 0.0)
        axes.set(title=compared.trait.name, xlabel=f"{compared.trait.name}{unit}", ylabel="% of values")
        axes.set(xlim=edges[[0, -1]], ylim=(0, 1.25 * highest or 1.0))
        if axes.patches:
            axes.legend()

    return Panel(compared.trait.name, draw)


def spectrum_panel(style: StyleStudy, moving: MotionComparison) -> Panel:
    """Power spectra without the mean, on a logarithmic scale."""
    title = f"{moving.feature}: power"

    def draw(axes: "Axes") -> None:
        from matplotlib.ticker import NullLocator

        highest = [np.nanmax(one.power[1:]) for one in moving.spectra[:2] if np.isfinite(one.power[1:]).any()]
        top = float(np.ceil(np.log10(max(highest, default=1.0))))
        for name, one, (colour, dash) in zip(series_names(style), moving.spectra, SERIES, strict=False):
            axes.plot(one.hz[1:], np.maximum(one.power[1:], 1e-30), color=colour, linestyle=dash, label=name)
        axes.set(
            title=title, xlabel="frequency, Hz", ylabel=f"power, {moving.unit}²/Hz" if moving.unit else "power, 1/Hz"
        )
        axes.set(yscale="log", xlim=(0, MOST_HZ), ylim=(10 ** (top - DECADES), 10**top))
        axes.yaxis.set_major_formatter(lambda value, _: f"{value:g}")
        axes.yaxis.set_minor_locator(NullLocator())
        axes.legend()

    return Panel(title, draw)


def autocorrelation_panel(style: StyleStudy, feature: str) -> Panel:
    """Autocorrelation of ten minutes over the lag."""
    one, title = style.long_run.repetition[feature], f"{feature}: autocorrelation"
    lags = np.arange(FROM_S, LAGS_S) + 0.5
    kinds = ("recordings, shuffled", one.real), ("field, speech", one.speech), ("field, silence", one.silence)

    def draw(axes: "Axes") -> None:
        for (name, values), (colour, dash) in zip(kinds, SERIES, strict=False):
            axes.plot(lags, values[FROM_S:], color=colour, linestyle=dash, label=name)
        axes.set(title=title, xlabel="lag, s", ylabel="highest r in a second", xlim=(0, LAGS_S), ylim=(-0.2, 1))
        axes.legend()

    return Panel(title, draw)


def summary_panels(style: StyleStudy) -> Sequence[Panel]:
    """The panels of the summary picture."""
    traits = [distribution_panel(style, one) for one in style.trait_comparisons if one.trait.name in SUMMARY_TRAITS]
    spectra = [spectrum_panel(style, one) for one in style.motion_comparisons if one.feature in {"head", "brows"}]
    return [*traits, *spectra] or [distribution_panel(style, style.trait_comparisons[0])]


def _limits(values: NDArray[np.float64]) -> tuple[float, float]:
    if not len(values):
        return 0.0, 1.0
    low, high = np.quantile(values, [1 - SHOWN, SHOWN])
    low = 0.0 if values.min() >= 0 else float(low)
    return (low, float(high)) if high > low else (low - 0.5, low + 0.5)
