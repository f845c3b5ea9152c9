"""The study as a page."""

from collections.abc import Sequence
from html import escape

import numpy as np

from corpus_tools.gesture_study.analysis import (
    HALF,
    NEAR,
    Compared,
    GesturesFound,
    Moving,
    StyleFound,
)
from corpus_tools.gesture_study.figure import distribution, names_of, power, repetition
from corpus_tools.gesture_study.longrun import FROM_S, MINUTES, VISITED_AFTER
from corpus_tools.gesture_study.measures import FAST_HZ, ratio
from corpus_tools.report.page import page, table
from corpus_tools.report.panels import panel_svg

LAYOUT = (
    "<style>.panels { display: flex; flex-wrap: wrap; gap: .5rem 1rem; } figure { margin: 0; } "
    "figcaption { font-size: .85rem; color: var(--soft); text-align: center; }</style>"
)


def gestures_page(found: GesturesFound) -> str:
    """The page (HTML)."""
    parts = [LAYOUT, _method(found)]
    for style in found.styles:
        parts += _style(style)
    return page(f"Gestures: {found.name}", parts)


def number(value: float, digits: int = 2) -> str:
    """A number, or a dash where there is none."""
    if not np.isfinite(value):
        return "\N{EN DASH}"
    return f"{value:.{digits}f}" if abs(value) >= 0.01 or value == 0 else f"{value:.1g}"


def _method(found: GesturesFound) -> str:
    options = found.options
    return _soft(
        f"One in {options.one_in} recordings is held out (seed {options.seed}). Fields are made of the others and hear "
        f"the held-out ones' intensity; noise hears nothing. {options.clips} clips of each are cut into recordings' "
        "lengths, so that what a border hides is hidden alike. Distances are Wasserstein's, in the trait's unit: "
        f"between {options.halves} random halves of the held-out recordings, and from all of them to a clip (means). "
        f"Target: at most {NEAR:g} times the halves' distance, below {HALF:g} of noise's."
    )


def _style(found: StyleFound) -> list[str]:
    real, *_ = names_of(found)
    by_feature: dict[str, list[Compared]] = {}
    for one in found.compared:
        by_feature.setdefault(one.trait.feature, []).append(one)
    return [
        f"<h2>{escape(found.name)}</h2>",
        _origin(found),
        _distances(found),
        "<h3>Distributions</h3>",
        _soft(f"Those beyond a plot are in its first or last bin. Ink: {real}."),
        _panels([panel_svg(distribution(found, one)) for ones in by_feature.values() for one in ones]),
        "<h3>Spectra, sound, seeds</h3>",
        _moving(found),
        _panels([panel_svg(power(found, one)) for one in found.moving]),
        *_long(found),
    ]


def _origin(found: StyleFound) -> str:
    rates = " / ".join(number(rate, 1) for rate in found.blinks_per_minute)
    if found.source is not None:
        return _said(
            f"{found.summary[:1].upper()}{found.summary[1:]}.",
            f"Nobody recorded it: it is compared with what the field of {found.source} makes; no targets.",
            f"Blinks a minute, {found.source} / field / noise: {rates}.",
        )
    held = (
        f"{found.n_learnt} recordings learnt from, {found.n_held} held out."
        if found.is_held_out
        else f"{found.n_learnt} recordings, too few to hold any out: compared with those learnt from."
    )
    return _said(f"{found.minutes:.1f} minutes. {held}", f"Blinks a minute, recorded / field / noise: {rates}.")


def _distances(found: StyleFound) -> str:
    real, *_ = names_of(found)
    rows = [
        (
            one.trait.name,
            one.trait.unit,
            str(len(one.real)),
            number(float(np.mean(one.real)) if len(one.real) else np.nan),
            number(float(np.mean(one.field)) if len(one.field) else np.nan),
            number(float(np.mean(one.noise)) if len(one.noise) else np.nan),
            number(one.halves, 3),
            number(one.to_field, 3),
            number(one.to_noise, 3),
            number(ratio(one.to_field, one.halves)),
            number(ratio(one.to_field, one.to_noise)),
            verdict(found, one),
        )
        for one in found.compared
    ]
    head = ("trait", "unit", "n", f"mean {real}", "field", "noise", "W halves", "W field", "W noise")
    return table((*head, "field / halves", "field / noise", "target"), rows, numbers=range(2, 11))


def verdict(found: StyleFound, one: Compared) -> str:
    """Whether a trait with a target meets it."""
    if not one.trait.has_target or found.source is not None:
        return ""
    return "met" if one.is_met else "missed"


def _moving(found: StyleFound) -> str:
    real, *_ = names_of(found)
    rows = [
        (
            one.feature,
            *(number(r) for r in one.with_intensity),
            _near(found, one),
            *(number(share) for share in one.fast),
            *(number(share) for share in one.diversity),
        )
        for one in found.moving
    ]
    above = f"power above {FAST_HZ:g} Hz / {real}"
    head = ("feature", f"r of speed with intensity: {real}", "field", "noise", "target", f"{above}: field", "noise")
    return table((*head, "diversity: field", "noise"), rows, numbers=(1, 2, 3, 5, 6, 7, 8)) + _soft(
        "Diversity: distance between clips of different seeds for the same sound, over that between recordings."
    )


def _near(found: StyleFound, one: Moving) -> str:
    if one.feature != "head" or found.source is not None:
        return ""
    return "met" if one.goes_with_sound else "missed"


def _long(found: StyleFound) -> list[str]:
    if not found.long.visited:
        return []
    rows = [
        (
            feature,
            *(f"{100 * share:.0f} %" for share in found.long.visited[feature]),
            *(number(highest) for highest in found.long.repeating[feature].highest),
        )
        for feature in found.long.visited
    ]
    after = [f"moments visited after {minutes} min" for minutes in VISITED_AFTER]
    likeness = [f"highest r from {FROM_S} s: {kind}" for kind in ("recordings", "speech", "silence")]
    return [
        f"<h3>Clips of {MINUTES} minutes</h3>",
        table(("feature", *after, *likeness), rows, numbers=range(1, 7)),
        _soft("A clip that runs in a loop is like itself (r = 1) at the loop's lag."),
        _panels([panel_svg(repetition(found, feature)) for feature in found.long.repeating]),
    ]


def _panels(parts: Sequence[str]) -> str:
    return f'<div class="panels">{"".join(parts)}</div>'


def _said(*sentences: str) -> str:
    return "".join(f"<p>{escape(sentence)}</p>" for sentence in sentences)


def _soft(sentence: str) -> str:
    return f'<p class="soft">{escape(sentence)}</p>'
