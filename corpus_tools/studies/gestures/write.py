"""Write the study of a palette as HTML, JSON, CSV or PNG.

Export of a gesture study: one line for each trait as CSV, all figures as JSON.
"""

import csv
import json
from collections.abc import Callable, Mapping
from io import StringIO
from pathlib import Path
from types import MappingProxyType
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
from corpus_tools.studies.gestures.page import gestures_page, panels_png, summary_panels, target_result
from corpus_tools.studies.pages import report_writer
from tts2face.models.palette_file import load_palette
from tts2face.storage.files import write_atomically
from tts2face.types import Progress

KINDS = ("real", "field", "noise", "ju2008")  # the last one of measured styles only
QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95)
HEAD = ("style", "source", "trait", "unit", "n", "w_halves", "w_field", "w_noise", "w_ju2008", "target")


def gestures_csv(study: GestureStudy) -> str:
    """Distances of the traits of every style."""
    file = StringIO()
    rows = csv.writer(file, lineterminator="\n")
    rows.writerow(HEAD)
    for style in study.styles:
        for one in style.trait_comparisons:
            distances = [_cell(value) for value in (one.halves, one.to_field, one.to_noise, one.to_published)]
            trait = one.trait
            rows.writerow(
                [style.name, style.source, trait.name, trait.unit, len(one.real), *distances, target_result(style, one)]
            )
    return file.getvalue()


def gestures_json(study: GestureStudy) -> str:
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
            {"name": one.name, "value": _round_number(one.value), "unit": one.unit, "published": list(one.published)}
            for one in study.body
        ],
    }
    if study.gaze is not None:
        content["gaze"] = [
            {
                "state": one.state,
                "trait": one.trait,
                "people": _round_number(one.people),
                "made": _round_number(one.made),
            }
            for one in study.gaze.comparisons
        ]
    return json.dumps(content, ensure_ascii=False, indent=1) + "\n"


def _style(style: StyleStudy) -> dict[str, Any]:
    return {
        "name": style.name,
        "derived_from": style.source,
        "summary": style.summary,
        "minutes": _round_number(style.minutes),
        "recordings_learnt": style.n_training,
        "recordings_held_out": style.n_held_out if style.is_held_out else 0,
        "blinks_per_minute": _by_kind(style.blinks_per_minute),
        "traits": [_trait_figures(style, one) for one in style.trait_comparisons],
        "features": [_motion_figures(one) for one in style.motion_comparisons],
        "visited": {
            feature: {
                f"{minutes} min": _round_number(share) for minutes, share in zip(VISITED_AFTER, shares, strict=True)
            }
            for feature, shares in style.long_run.coverage.items()
        },
        "repetition": {
            feature: {
                kind: _round_number(value)
                for kind, value in zip(("real", "speech", "silence"), one.highest, strict=True)
            }
            for feature, one in style.long_run.repetition.items()
        },
    }


def _trait_figures(style: StyleStudy, one: TraitComparison) -> dict[str, Any]:
    kinds = {"real": one.real, "field": one.field, "noise": one.noise}
    if len(one.published):
        kinds["ju2008"] = one.published
    return {
        "name": one.trait.name,
        "unit": one.trait.unit,
        "feature": one.trait.feature,
        "n": len(one.real),
        "halves": _round_number(one.halves),
        "field": _round_number(one.to_field),
        "noise": _round_number(one.to_noise),
        "ju2008": _round_number(one.to_published),
        "target": target_result(style, one) or None,
        "means": {kind: _round_number(float(values.mean())) if len(values) else None for kind, values in kinds.items()},
        "quantiles": {kind: _quantiles(values) for kind, values in kinds.items()},
    }


def _motion_figures(one: FeatureComparison) -> dict[str, Any]:
    return {
        "name": one.feature,
        "r_with_intensity": _by_kind(one.with_intensity),
        "fast_power": {kind: _round_number(share) for kind, share in zip(KINDS[1:], one.fast_power, strict=False)},
        "diversity": {
            kind: _round_number(share) for kind, share in zip(("field", "noise"), one.diversity, strict=True)
        },
        "hz": one.spectra[0].hz.round(4).tolist(),
        "power": {
            kind: [_round_number(float(value)) for value in spectrum.power]
            for kind, spectrum in zip(KINDS, one.spectra, strict=False)
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
    palette: str, out: Path, options: StudyOptions, *, on_progress: Progress | None = None
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
    writer = report_writer(out, WRITERS)
    found = study_gestures(palette, load_palette(palette), options, on_progress)
    write_atomically(out, writer(found))
    return found


def _summary_png(found: GestureStudy) -> bytes:
    first = found.styles[0]
    return panels_png(f"Gestures of {first.name}: recordings, fields, noise, published fields", summary_panels(first))


WRITERS: Mapping[str, Callable[[GestureStudy], bytes]] = MappingProxyType(
    {
        ".html": lambda found: gestures_page(found).encode(),
        ".csv": lambda found: gestures_csv(found).encode(),
        ".json": lambda found: gestures_json(found).encode(),
        ".png": _summary_png,
    }
)
