"""HTML page of a gesture study."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from html import escape
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from corpus_tools.studies.gestures.analysis import (
    HALF,
    NEAR,
    FeatureComparison,
    GestureStudy,
    StyleStudy,
    TraitComparison,
)
from corpus_tools.studies.gestures.clips import FROM_S, LAGS_S, MINUTES, VISITED_AFTER
from corpus_tools.studies.gestures.gaze import GazeStudy
from corpus_tools.studies.gestures.measures import FAST_HZ, ratio
from corpus_tools.studies.gestures.speech import speech_rows
from corpus_tools.studies.pages import note_paragraph, page, paragraphs, scroll_box, table
from corpus_tools.studies.plots import SERIES, Plot, draw_svg

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
LAYOUT = "<style>.panels { display: flex; flex-wrap: wrap; gap: .5rem 1rem; }</style>"


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

    def draw(figure: "Figure") -> None:
        figure.set_layout_engine("none")  # a constrained layout takes twice as long
        panel.draw(figure.subplots(gridspec_kw=MARGINS))

    return draw_svg(draw, WIDTH, HEIGHT, panel.title)


def panels_plot(title: str, panels: Sequence[Panel]) -> Plot:
    """The panels in rows of `COLUMNS` below a title."""
    rows = -(-len(panels) // COLUMNS)

    def draw(figure: "Figure") -> None:
        figure.suptitle(title)
        for at, panel in enumerate(panels, start=1):
            panel.draw(figure.add_subplot(rows, COLUMNS, at))

    return Plot(draw, COLUMNS * WIDTH, rows * HEIGHT + HEAD, title)


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
        # room above for the legend
        axes.set(xlim=edges[[0, -1]], ylim=(0, 1.25 * highest or 1.0))
        if axes.patches:
            axes.legend()

    return Panel(compared.trait.name, draw)


def spectrum_panel(style: StyleStudy, moving: FeatureComparison) -> Panel:
    """Power spectra without the mean, on a logarithmic scale."""
    title = f"{moving.feature}: power"

    def draw(axes: "Axes") -> None:
        from matplotlib.ticker import NullLocator

        highest = [
            np.nanmax(spectrum.power[1:]) for spectrum in moving.spectra[:2] if np.isfinite(spectrum.power[1:]).any()
        ]
        top = float(np.ceil(np.log10(max(highest, default=1.0))))
        for name, spectrum, (colour, dash) in zip(series_names(style), moving.spectra, SERIES, strict=False):
            # without 0 Hz (the mean was removed); the scale is logarithmic, where 0 has no place
            axes.plot(spectrum.hz[1:], np.maximum(spectrum.power[1:], 1e-30), color=colour, linestyle=dash, label=name)
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
    repetition, title = style.long_run.repetition[feature], f"{feature}: autocorrelation"
    lags = np.arange(FROM_S, LAGS_S) + 0.5
    kinds = (
        ("recordings, shuffled", repetition.real),
        ("field, speech", repetition.speech),
        ("field, silence", repetition.silence),
    )

    def draw(axes: "Axes") -> None:
        for (name, values), (colour, dash) in zip(kinds, SERIES, strict=False):
            axes.plot(lags, values[FROM_S:], color=colour, linestyle=dash, label=name)
        axes.set(title=title, xlabel="lag, s", ylabel="highest r in a second", xlim=(0, LAGS_S), ylim=(-0.2, 1))
        axes.legend()

    return Panel(title, draw)


def summary_panels(style: StyleStudy) -> Sequence[Panel]:
    """The panels of the summary picture."""
    traits = [
        distribution_panel(style, compared)
        for compared in style.trait_comparisons
        if compared.trait.name in SUMMARY_TRAITS
    ]
    spectra = [
        spectrum_panel(style, moving) for moving in style.motion_comparisons if moving.feature in {"head", "brows"}
    ]
    return [*traits, *spectra] or [distribution_panel(style, style.trait_comparisons[0])]


def _limits(values: NDArray[np.float64]) -> tuple[float, float]:
    if not len(values):
        return 0.0, 1.0
    low, high = np.quantile(values, [1 - SHOWN, SHOWN])
    low = 0.0 if values.min() >= 0 else float(low)
    return (low, float(high)) if high > low else (low - 0.5, low + 0.5)


def gestures_page(study: GestureStudy) -> str:
    """The page (HTML)."""
    parts = [LAYOUT, _method(study)]
    for style in study.styles:
        parts += _style(style)
    parts += ["<h2>Breath and eyes</h2>", _body(study)]
    if study.gaze is not None:
        parts += ["<h2>Gaze in conversation</h2>", *_gaze(study.gaze)]
    if study.speech:
        head = ("what", "unit", "made", "95 %", "people")
        parts += ["<h2>Speech</h2>", table(head, [*speech_rows(study.speech)], numbers=(2,))]
    return page(f"Gestures: {study.name}", parts)


def _gaze(study: GazeStudy) -> list[str]:
    rows = [
        (
            comparison.state,
            comparison.trait,
            format_number(comparison.people, 3),
            format_number(comparison.made, 3),
            _met(comparison.is_met),
        )
        for comparison in study.comparisons
    ]
    head = ("state", "trait", "two people", "a made one and a person", "target")
    n_made = len(next(iter(study.made.values())))
    return [
        table(head, rows, numbers=(2, 3)),
        note_paragraph(
            "Medians over pairs of Kolmogorov-Smirnov distances, and of differences of the share on the face; "
            f"{n_made} made people. Target: a made person is no further from people than they are from each other."
        ),
        _panels(gaze_panels(study)),
    ]


def gaze_panels(study: GazeStudy) -> list[Panel]:
    """Shares of what lasts longer, or is larger, than a length or a jump: a line for each person and made person."""
    kinds = (("looks at the face, s", "face"), ("looks away, s", "away"), ("jumps, degrees", "jumps"))
    return [_survival_panel(study, state, name, trait) for state in study.people for name, trait in kinds]


def _survival_panel(study: GazeStudy, state: str, name: str, trait: str) -> Panel:
    title = f"{state}: {name.partition(',')[0]}"
    people, made = ([getattr(item, trait) for item in kind[state]] for kind in (study.people, study.made))

    def draw(axes: "Axes") -> None:
        from matplotlib.ticker import NullFormatter

        kinds = ("people", people, 1.4), ("made", made[: len(people)], 0.8)
        for (label, ones, width), (colour, _) in zip(kinds, SERIES, strict=False):
            for at, item in enumerate([item for item in ones if item is not None]):
                (line,) = axes.step(item.values, 100 * item.shares, where="post", label=label if at == 0 else None)
                line.set(color=colour, linewidth=width, alpha=0.5)
        axes.set(title=title, xlabel=name, ylabel="% longer", xscale="log", ylim=(0, 100))
        axes.xaxis.set_major_formatter(lambda value, _: f"{value:g}")
        axes.xaxis.set_minor_formatter(NullFormatter())
        if axes.lines:
            axes.legend()

    return Panel(title, draw)


def _body(study: GestureStudy) -> str:
    rows = [
        (
            measure.name,
            format_number(measure.value),
            measure.unit,
            f"{measure.published[0]:g} to {measure.published[1]:g}",
            measure.source,
        )
        for measure in study.body
    ]
    return table(("what", "made", "unit", "published", "source"), rows, numbers=(1,)) + note_paragraph(
        "Of any style and face that has them; the seed is that of the study."
    )


def format_number(value: float, digits: int = 2) -> str:
    """A number, or a dash for NaN."""
    if not np.isfinite(value):
        return "\N{EN DASH}"
    return f"{value:.{digits}f}" if abs(value) >= 0.01 or value == 0 else f"{value:.1g}"


def _method(study: GestureStudy) -> str:
    options = study.options
    return note_paragraph(
        f"One in {options.one_in} recordings is held out (seed {options.seed}). Fields are built from the others and "
        "sampled for the intensity of the held-out ones; noise does not depend on the sound. "
        f"{options.clips} clips of each, and for measured styles one of the published fields (ju2008: Ju and Lee 2008, "
        "section 5.1), are cut to the recordings' lengths, so that all have the same borders. "
        f"Distances are Wasserstein distances (W) in the trait's unit: between {options.halves} random halves of the "
        "held-out recordings, and from all of them to a clip (means). "
        f"Target: at most {NEAR:g} times the distance between halves, and below {HALF:g} times that of noise."
    )


def _style(style: StyleStudy) -> list[str]:
    by_feature: dict[str, list[TraitComparison]] = {}
    for compared in style.trait_comparisons:
        by_feature.setdefault(compared.trait.feature, []).append(compared)
    return [
        f"<h2>{escape(style.name)}</h2>",
        _origin(style),
        _distances(style),
        "<h3>Distributions</h3>",
        note_paragraph("Values outside a plot count in its first or last bin."),
        _panels(distribution_panel(style, item) for ones in by_feature.values() for item in ones),
        "<h3>Spectra, sound, seeds</h3>",
        _motion_table(style),
        _panels(spectrum_panel(style, moving) for moving in style.motion_comparisons),
        *_long_run(style),
    ]


def _origin(style: StyleStudy) -> str:
    rates = " / ".join(format_number(rate, 1) for rate in style.blinks_per_minute)
    if style.source is not None:
        return paragraphs(
            f"{style.summary[:1].upper()}{style.summary[1:]}.",
            f"A derived style without recordings: compared with the motion of the field of {style.source}; no targets.",
            f"Blinks per minute, {style.source} / field / noise: {rates}.",
        )
    held = (
        f"{style.n_training} training recordings, {style.n_held_out} held out."
        if style.is_held_out
        else f"{style.n_training} recordings, too few to hold any out: compared with the recordings of the fields."
    )
    return paragraphs(
        f"{style.minutes:.1f} minutes. {held}", f"Blinks per minute, recorded / field / noise / ju2008: {rates}."
    )


def _distances(style: StyleStudy) -> str:
    real, *_ = series_names(style)
    rows = [
        (
            compared.trait.name,
            compared.trait.unit,
            str(len(compared.real)),
            *(
                format_number(float(np.mean(values)) if len(values) else np.nan)
                for values in (compared.real, compared.field, compared.noise, compared.published)
            ),
            *(
                format_number(apart, 3)
                for apart in (compared.halves, compared.to_field, compared.to_noise, compared.to_published)
            ),
            format_number(ratio(compared.to_field, compared.halves)),
            format_number(ratio(compared.to_field, compared.to_noise)),
            format_number(ratio(compared.to_published, compared.halves)),
            target_result(style, compared),
        )
        for compared in style.trait_comparisons
    ]
    head = ("trait", "unit", "n", f"mean {real}", "field", "noise", "ju2008")
    distances = ("W halves", "W field", "W noise", "W ju2008")
    ratios = ("field / halves", "field / noise", "ju2008 / halves")
    return scroll_box(table((*head, *distances, *ratios, "target"), rows, numbers=range(2, 14)))


def target_result(style: StyleStudy, compared: TraitComparison) -> str:
    """Whether a trait with a target meets it; empty without a target."""
    if not compared.trait.has_target or style.source is not None:
        return ""
    return _met(compared.is_met)


def _met(is_met: bool) -> str:
    return "met" if is_met else "missed"


def _motion_table(style: StyleStudy) -> str:
    real, *_ = series_names(style)
    rows = [
        (
            moving.feature,
            *(format_number(r) for r in _pad_columns(moving.with_intensity, 4)),
            _correlation_result(style, moving),
            *(format_number(share) for share in _pad_columns(moving.fast_power, 3)),
            *(format_number(share) for share in moving.diversity),
        )
        for moving in style.motion_comparisons
    ]
    above = f"power above {FAST_HZ:g} Hz / {real}"
    correlations = (f"r of speed with intensity: {real}", "field", "noise", "ju2008", "target")
    head = ("feature", *correlations, f"{above}: field", "noise", "ju2008", "diversity: field", "noise")
    return scroll_box(table(head, rows, numbers=(1, 2, 3, 4, 6, 7, 8, 9, 10))) + note_paragraph(
        "Diversity: distance between clips of different seeds for the same sound, over that between recordings."
    )


def _pad_columns(values: tuple[float, ...], n: int) -> tuple[float, ...]:
    """Values for n columns, NaN where a derived style has no published field."""
    return (*values, *[float("nan")] * (n - len(values)))


def _correlation_result(style: StyleStudy, moving: FeatureComparison) -> str:
    if moving.feature != "head" or style.source is not None:
        return ""
    return _met(moving.follows_sound)


def _long_run(style: StyleStudy) -> list[str]:
    if not style.long_run.coverage:
        return []
    rows = [
        (
            feature,
            *(f"{100 * share:.0f} %" for share in style.long_run.coverage[feature]),
            *(format_number(highest) for highest in style.long_run.repetition[feature].highest),
        )
        for feature in style.long_run.coverage
    ]
    after = [f"moments visited after {minutes} min" for minutes in VISITED_AFTER]
    highest = [f"highest r from {FROM_S} s: {kind}" for kind in ("recordings", "speech", "silence")]
    return [
        f"<h3>Clips of {MINUTES} minutes</h3>",
        table(("feature", *after, *highest), rows, numbers=range(1, 7)),
        note_paragraph("A clip that repeats itself has r = 1 at the period of the repetition."),
        _panels(autocorrelation_panel(style, feature) for feature in style.long_run.repetition),
    ]


def _panels(panels: Iterable[Panel]) -> str:
    return f'<div class="panels">{"".join(panel_svg(panel) for panel in panels)}</div>'
