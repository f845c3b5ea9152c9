"""The study of a palette as a page, a line for each trait, all figures and the main plots, and their files."""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from corpus_tools.studies.gestures.analysis import (
    FeatureComparison,
    GestureStudy,
    StudyOptions,
    StyleStudy,
    TraitComparison,
    study_gestures,
)
from corpus_tools.studies.gestures.clips import VISITED_AFTER
from corpus_tools.studies.gestures.page import gestures_page, panels_plot, summary_panels, target_result
from corpus_tools.studies.gestures.speech import speech_rows
from corpus_tools.studies.plots import Plot
from corpus_tools.studies.report import Report, Rows, as_csv, as_html, as_json, as_png
from tts2face.models.palette_file import load_palette
from tts2face.types import Progress, ignore_progress

KINDS = ("real", "field", "noise", "ju2008")  # the last one of measured styles only
QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95)
HEAD = ("style", "source", "trait", "unit", "n", "w_halves", "w_field", "w_noise", "w_ju2008", "target")


def gesture_rows(study: GestureStudy) -> Rows:
    """Distances of the traits of every style."""
    yield HEAD
    for style in study.styles:
        for compared in style.trait_comparisons:
            distances = (compared.halves, compared.to_field, compared.to_noise, compared.to_published)
            trait = compared.trait
            yield [
                style.name,
                style.source,
                trait.name,
                trait.unit,
                len(compared.real),
                *map(_cell, distances),
                target_result(style, compared),
            ]


def gesture_figures(study: GestureStudy) -> dict[str, Any]:
    """All figures, and quantiles of the values."""
    options = study.options
    content: dict[str, Any] = {
        "palette": study.name,
        "held_out_one_in": options.one_in,
        "halves": options.halves,
        "clips": options.clips,
        "seed": options.seed,
        "quantiles": list(QUANTILES),
        "styles": [_style(style) for style in study.styles],
        "body": [
            {
                "name": measure.name,
                "value": _round_number(measure.value),
                "unit": measure.unit,
                "published": list(measure.published),
            }
            for measure in study.body
        ],
    }
    if study.gaze is not None:
        content["gaze"] = [
            {
                "state": comparison.state,
                "trait": comparison.trait,
                "people": _round_number(comparison.people),
                "made": _round_number(comparison.made),
            }
            for comparison in study.gaze.comparisons
        ]
    if study.speech:
        heads = ("name", "unit", "value", "interval", "people")
        content["speech"] = [dict(zip(heads, row, strict=True)) for row in speech_rows(study.speech)]
    return content


def _style(style: StyleStudy) -> dict[str, Any]:
    return {
        "name": style.name,
        "derived_from": style.source,
        "summary": style.summary,
        "minutes": _round_number(style.minutes),
        "recordings_learnt": style.n_training,
        "recordings_held_out": style.n_held_out if style.is_held_out else 0,
        "blinks_per_minute": _by_kind(style.blinks_per_minute),
        "traits": [_trait_figures(style, compared) for compared in style.trait_comparisons],
        "features": [_motion_figures(moving) for moving in style.motion_comparisons],
        "visited": {
            feature: {
                f"{minutes} min": _round_number(share) for minutes, share in zip(VISITED_AFTER, shares, strict=True)
            }
            for feature, shares in style.long_run.coverage.items()
        },
        "repetition": {
            feature: {
                kind: _round_number(value)
                for kind, value in zip(("real", "speech", "silence"), item.highest, strict=True)
            }
            for feature, item in style.long_run.repetition.items()
        },
    }


def _trait_figures(style: StyleStudy, compared: TraitComparison) -> dict[str, Any]:
    kinds = {"real": compared.real, "field": compared.field, "noise": compared.noise}
    if len(compared.published):
        kinds["ju2008"] = compared.published
    return {
        "name": compared.trait.name,
        "unit": compared.trait.unit,
        "feature": compared.trait.feature,
        "n": len(compared.real),
        "halves": _round_number(compared.halves),
        "field": _round_number(compared.to_field),
        "noise": _round_number(compared.to_noise),
        "ju2008": _round_number(compared.to_published),
        "target": target_result(style, compared) or None,
        "means": {kind: _round_number(float(values.mean())) if len(values) else None for kind, values in kinds.items()},
        "quantiles": {kind: _quantiles(values) for kind, values in kinds.items()},
    }


def _motion_figures(moving: FeatureComparison) -> dict[str, Any]:
    return {
        "name": moving.feature,
        "r_with_intensity": _by_kind(moving.with_intensity),
        "fast_power": {kind: _round_number(share) for kind, share in zip(KINDS[1:], moving.fast_power, strict=False)},
        "diversity": {
            kind: _round_number(share) for kind, share in zip(("field", "noise"), moving.diversity, strict=True)
        },
        "hz": moving.spectra[0].hz.round(4).tolist(),
        "power": {
            kind: [_round_number(float(value)) for value in spectrum.power]
            for kind, spectrum in zip(KINDS, moving.spectra, strict=False)
        },
    }


def _by_kind(values: tuple[float, ...]) -> dict[str, float | None]:
    return {kind: _round_number(value) for kind, value in zip(KINDS, values, strict=False)}


def _cell(value: float) -> str:
    return "" if np.isnan(value) else f"{value:.6g}"


def _quantiles(values: NDArray[np.float64]) -> list[float | None]:
    return [_round_number(float(value)) for value in np.quantile(values, QUANTILES)] if len(values) else []


def _round_number(value: float) -> float | None:
    return float(f"{value:.6g}") if np.isfinite(value) else None


def write_gestures(
    palette: str, out: Path, options: StudyOptions, *, on_progress: Progress = ignore_progress
) -> GestureStudy:
    """Study a palette (by name or path), write the file, and return the study.

    ``.html`` is a page, ``.json`` has every figure, ``.csv`` the distances, ``.png`` the main plots of the first style.

    Raises
    ------
    InputError
        The suffix is unknown; errors as `load_palette`. Nothing is written then.
    BackendError
        matplotlib is not installed, or the file cannot be written.
    """
    return REPORT.write(out, lambda: study_gestures(palette, load_palette(palette), options, on_progress))


def _summary_plot(found: GestureStudy) -> Plot:
    first = found.styles[0]
    return panels_plot(f"Gestures of {first.name}: recordings, fields, noise, published fields", summary_panels(first))


REPORT: Report[GestureStudy] = Report(
    {
        ".html": as_html(gestures_page),
        ".csv": as_csv(gesture_rows),
        ".json": as_json(gesture_figures),
        ".png": as_png(_summary_plot),
    }
)
