"""HTML page of a gesture study."""

from collections.abc import Iterable
from html import escape

import numpy as np

from corpus_tools.gesture_study.analysis import (
    HALF,
    NEAR,
    GestureStudy,
    MotionComparison,
    StyleStudy,
    TraitComparison,
)
from corpus_tools.gesture_study.figure import (
    Panel,
    autocorrelation_panel,
    distribution_panel,
    panel_svg,
    series_names,
    spectrum_panel,
)
from corpus_tools.gesture_study.longrun import FROM_S, MINUTES, VISITED_AFTER
from corpus_tools.gesture_study.measures import FAST_HZ, ratio
from corpus_tools.report.page import note_paragraph, page, paragraphs, scroll_box, table

LAYOUT = "<style>.panels { display: flex; flex-wrap: wrap; gap: .5rem 1rem; }</style>"


def gestures_page(study: GestureStudy) -> str:
    """The page (HTML)."""
    parts = [LAYOUT, _method(study)]
    for style in study.styles:
        parts += _style(style)
    parts += ["<h2>Breath and eyes</h2>", _body(study)]
    return page(f"Gestures: {study.name}", parts)


def _body(study: GestureStudy) -> str:
    rows = [
        (one.name, format_number(one.value), one.unit, f"{one.published[0]:g} to {one.published[1]:g}", one.source)
        for one in study.body
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
    for one in style.trait_comparisons:
        by_feature.setdefault(one.trait.feature, []).append(one)
    return [
        f"<h2>{escape(style.name)}</h2>",
        _origin(style),
        _distances(style),
        "<h3>Distributions</h3>",
        note_paragraph("Values outside a plot count in its first or last bin."),
        _panels(distribution_panel(style, one) for ones in by_feature.values() for one in ones),
        "<h3>Spectra, sound, seeds</h3>",
        _motion_table(style),
        _panels(spectrum_panel(style, one) for one in style.motion_comparisons),
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
            one.trait.name,
            one.trait.unit,
            str(len(one.real)),
            *(
                format_number(float(np.mean(values)) if len(values) else np.nan)
                for values in (one.real, one.field, one.noise, one.published)
            ),
            *(format_number(apart, 3) for apart in (one.halves, one.to_field, one.to_noise, one.to_published)),
            format_number(ratio(one.to_field, one.halves)),
            format_number(ratio(one.to_field, one.to_noise)),
            format_number(ratio(one.to_published, one.halves)),
            target_result(style, one),
        )
        for one in style.trait_comparisons
    ]
    head = ("trait", "unit", "n", f"mean {real}", "field", "noise", "ju2008")
    distances = ("W halves", "W field", "W noise", "W ju2008")
    ratios = ("field / halves", "field / noise", "ju2008 / halves")
    return scroll_box(table((*head, *distances, *ratios, "target"), rows, numbers=range(2, 14)))


def target_result(style: StyleStudy, one: TraitComparison) -> str:
    """Whether a trait with a target meets it; empty without a target."""
    if not one.trait.has_target or style.source is not None:
        return ""
    return "met" if one.is_met else "missed"


def _motion_table(style: StyleStudy) -> str:
    real, *_ = series_names(style)
    rows = [
        (
            one.feature,
            *(format_number(r) for r in _pad_columns(one.with_intensity, 4)),
            _correlation_result(style, one),
            *(format_number(share) for share in _pad_columns(one.fast_power, 3)),
            *(format_number(share) for share in one.diversity),
        )
        for one in style.motion_comparisons
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


def _correlation_result(style: StyleStudy, one: MotionComparison) -> str:
    if one.feature != "head" or style.source is not None:
        return ""
    return "met" if one.follows_sound else "missed"


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
