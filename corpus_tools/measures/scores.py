"""Scores of a method over held-out utterances, with bootstrap intervals over utterances."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from corpus_tools.measures import lip_measures
from corpus_tools.measures.intervals import (
    IntervalEstimate,
    correlations,
    curve_moments,
    interval_of,
)
from corpus_tools.measures.reference import OTHER_CLASS, PHONE_CLASSES, LipCurves, ReferenceUtterance, Thresholds
from lexicon.sequence import PhoneSequence
from tts2face.lips import motion_measures
from tts2face.models.talker import ShapeModel
from tts2face.numeric.arrays import FloatArray

N_DRAWS = 1000  # of utterances, with replacement (Efron 1979)
# In the order of tables: name, its head, digits.
FIGURES = (
    ("r_opening", "r opening", 3), ("r_width", "r width", 3), ("r_opening_within", "r opening within", 3),
    ("r_width_within", "r width within", 3), ("rmse_z", "RMSE z", 3), ("dtw_cost", "DTW cost", 3),
    ("free_cost", "DTW cost, free", 3), ("range_ratio", "range ratio", 2), ("closure", "closure", 2),
    ("false_closure", "false closure", 2),
    ("labiodental", "labiodental", 2), ("rounding", "rounding", 2), ("peak_offset_ms", "peak offset (ms)", 0),
)  # fmt: skip
SplitMotion = tuple[
    ShapeModel, Sequence[ReferenceUtterance], Sequence[NDArray[np.float32]]
]  # of one split: (T, S) for each utterance


@dataclass(frozen=True, slots=True)
class UtteranceScore:
    """Scores of one utterance: RMSE and warping cost in units of spread, r and range ratio of opening and width."""

    name: str
    r_opening: float
    r_width: float
    rmse_z: float
    dtw_cost: float
    range_ratio: float
    n_frames: int


@dataclass(frozen=True, slots=True)
class ClassScore:
    """Scores of the frames of one phone class: their number, RMSE in units of spread, error and bias of the opening.

    Error and bias are relative to the eye distance; a negative bias is a mouth that is too closed.
    """

    phones: str
    n_frames: int
    rmse_z: float
    opening_error: float
    opening_bias: float


@dataclass(frozen=True, slots=True)
class Scores:
    """Scores of a method over all held-out utterances: r and range of pooled frames, means or shares otherwise.

    r *within* is that of curves without the mean of their utterance, which no text predicts (a smile). ``figures`` are
    those of `FIGURES` by name, ``free_cost`` only with a voice's own durations;
    ``real_time_factor`` is the synthesis time divided by the duration of the utterances.
    """

    method: str
    figures: Mapping[str, IntervalEstimate]
    classes: tuple[ClassScore, ...]
    real_time_factor: float
    utterances: tuple[UtteranceScore, ...]

    def __getitem__(self, figure: str) -> float:
        """The value of a figure."""
        return self.figures[figure].value

    def values(self) -> dict[str, float]:
        """The figures without their intervals."""
        return {name: figure.value for name, figure in self.figures.items()}


@dataclass(frozen=True, slots=True, eq=False)
class UtteranceStatistics:
    """Sufficient statistics of one utterance for the scores of a method.

    ``opening`` and ``width`` (6,) are moments of real and synthesised curves; ``counts`` (4, 2) numbers of events and
    opportunities: closures, false closures, labiodental contacts, roundings; ``offsets`` seconds between peaks.
    """

    opening: FloatArray
    width: FloatArray
    rmse_z: float
    dtw_cost: float
    free_cost: float | None
    counts: FloatArray
    offsets: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class OwnDurationMotion:
    """Motion for a voice's own durations, on its time axis: phones, parameters (U, S) and lip curves.

    ``evaluated`` are its speech frames.
    """

    phones: PhoneSequence
    evaluated: slice
    values: NDArray[np.floating]
    curves: LipCurves


@dataclass(frozen=True, slots=True, eq=False)
class UtteranceComparison:
    """One real utterance and its synthesis: parameters (T, S) and lip curves on the recorded time axis.

    The first ``len(spread)`` parameters are compared. With a voice's durations, events within phones are evaluated on
    its time axis (``own``).
    """

    real: ReferenceUtterance
    synthesised: NDArray[np.floating]
    curves: LipCurves
    spread: NDArray[np.floating]
    own: OwnDurationMotion | None = None


def available_figures(scores: Sequence[Scores]) -> tuple[tuple[str, str, int], ...]:
    """Those of `FIGURES` that the scores have."""
    return tuple(figure for figure in FIGURES if all(figure[0] in score.figures for score in scores))


def score_splits(method: str, splits: Sequence[SplitMotion], limits: Thresholds, synthesis_s: float = 0.0) -> Scores:
    """Scores of a method over the utterances of all splits; synthesis took `synthesis_s` seconds."""
    comparisons = [
        UtteranceComparison(reference, values, LipCurves.of(model.shapes(values)), speech_spread(model))
        for model, real, synthesised in splits
        for reference, values in zip(real, synthesised, strict=True)
    ]
    return compute_scores(method, comparisons, limits, synthesis_s)


def speech_spread(model: ShapeModel) -> NDArray[np.float32]:
    """(D,) standard deviations of the compared parameters."""
    return model.spread[: min(lip_measures.N_DTW_PARAMETERS, model.n_speech)]


def compute_scores(
    method: str, comparisons: Sequence[UtteranceComparison], limits: Thresholds, synthesis_s: float = 0.0
) -> Scores:
    """Scores of a method over compared utterances; synthesis took `synthesis_s` seconds."""
    tallies = [_utterance_statistics(comparison, limits) for comparison in comparisons]
    return Scores(
        method,
        _estimate_figures(tallies),
        tuple(_class_scores(comparisons)),
        synthesis_s / sum(comparison.real.seconds for comparison in comparisons),
        tuple(_utterance_score(tally, comparison) for tally, comparison in zip(tallies, comparisons, strict=True)),
    )


def _utterance_statistics(comparison: UtteranceComparison, limits: Thresholds) -> UtteranceStatistics:
    recording, curves, n, here = comparison.real, comparison.curves, len(comparison.spread), comparison.real.evaluated
    phones, fps = recording.observation.phones, recording.observation.fps
    real, synthesised = recording.parameters[here, :n], comparison.synthesised[here, :n]
    peaks = [lip_measures.peak_times(curve, phones, fps) for curve in (recording.curves.opening, curves.opening)]
    offsets = peaks[1] - peaks[0]
    return UtteranceStatistics(
        curve_moments(recording.curves.opening[here], curves.opening[here]),
        curve_moments(recording.curves.width[here], curves.width[here]),
        lip_measures.rmse_z(real, synthesised, comparison.spread),
        motion_measures.warping_cost(real, synthesised, comparison.spread, round(motion_measures.DTW_BAND_S * fps)),
        _free_cost(comparison),
        _event_counts(comparison, limits),
        np.abs(offsets[np.isfinite(offsets)]),
    )


def _free_cost(comparison: UtteranceComparison) -> float | None:
    """Warping cost, without a band, of motion on the voice's time axis."""
    if comparison.own is None:
        return None
    n = len(comparison.spread)
    real = comparison.real.parameters[comparison.real.evaluated, :n]
    return motion_measures.warping_cost(
        real, comparison.own.values[comparison.own.evaluated, :n], comparison.spread, None
    )


def _event_counts(comparison: UtteranceComparison, limits: Thresholds) -> FloatArray:
    """(4, 2) numbers of events and of opportunities, in the phones of the time axis of the synthesis."""
    own, fps = comparison.own, comparison.real.observation.fps
    phones, curves = (own.phones, own.curves) if own else (comparison.real.observation.phones, comparison.curves)

    def events(curve: NDArray[np.floating], labels: str, limit: float) -> tuple[float, float]:
        least = lip_measures.min_openings(curve, phones, fps, PHONE_CLASSES[labels])
        return float((least <= limit).sum()), float(len(least))

    middles = lip_measures.midpoint_openings(curves.opening, phones, fps)
    return np.array(
        [
            events(curves.opening, "bilabial", limits.closed),
            (float((middles <= limits.closed).sum()), float(len(middles))),
            events(curves.opening, "labiodental", limits.labiodental),
            events(curves.width, "rounded", limits.rounded),
        ]
    )


def _estimate_figures(tallies: Sequence[UtteranceStatistics]) -> dict[str, IntervalEstimate]:
    draws = np.random.default_rng(0).multinomial(len(tallies), np.full(len(tallies), 1 / len(tallies)), N_DRAWS)
    weights = np.concatenate([np.ones((1, len(tallies))), draws])  # the first row: each utterance once
    moments = np.array([[tally.opening, tally.width] for tally in tallies])
    rows = {
        **correlations(weights, moments),
        "range_ratio": _range_ratio(weights @ moments[:, 0]),
        "rmse_z": weights @ [tally.rmse_z for tally in tallies] / weights.sum(axis=1),
        "dtw_cost": weights @ [tally.dtw_cost for tally in tallies] / weights.sum(axis=1),
        "peak_offset_ms": 1000 * _weighted_medians(weights, [tally.offsets for tally in tallies]),
    }
    free = [tally.free_cost for tally in tallies if tally.free_cost is not None]
    if len(free) == len(tallies):
        rows["free_cost"] = weights @ free / weights.sum(axis=1)
    counts = np.tensordot(weights, np.array([tally.counts for tally in tallies]), axes=1)
    for at, name in enumerate(("closure", "false_closure", "labiodental", "rounding")):
        # a draw of utterances may hold no opportunity
        rows[name] = counts[:, at, 0] / np.maximum(counts[:, at, 1], 1.0)
    return {name: interval_of(rows[name]) for name, _, _ in FIGURES if name in rows}


def _range_ratio(moments: FloatArray) -> FloatArray:
    """(W,) ratio of the synthesised spread to the real one for moments (W, 6)."""
    n, a, b, aa, bb, _ = moments.T
    return np.asarray(np.sqrt(np.maximum(bb - b * b / n, 0.0) / np.maximum(aa - a * a / n, 1e-12)))


def _weighted_medians(weights: FloatArray, offsets: Sequence[FloatArray]) -> FloatArray:
    """Weighted median of all offsets for each row of weights (W, U); 0 where there is none."""
    values = np.concatenate(offsets)
    if not len(values):
        return np.zeros(len(weights))
    order = np.argsort(values)
    owner = np.repeat(np.arange(len(offsets)), [len(some) for some in offsets])[order]
    total = np.cumsum(weights[:, owner], axis=1)
    at = (total < total[:, -1:] / 2).sum(axis=1)
    return np.asarray(values[order][np.minimum(at, len(values) - 1)])


def _class_scores(comparisons: Sequence[UtteranceComparison]) -> list[ClassScore]:
    classes, errors, opening = [], [], []
    for each in comparisons:
        recording, here, n = each.real, each.real.evaluated, len(each.spread)
        classes.append(recording.classes[here])
        errors.append((each.synthesised - recording.parameters)[here, :n] / each.spread)
        opening.append((each.curves.opening - recording.curves.opening)[here])
    return _score_classes(np.concatenate(classes), np.concatenate(errors), np.concatenate(opening))


def _score_classes(classes: NDArray[np.str_], errors: NDArray[np.float32], opening: FloatArray) -> list[ClassScore]:
    found = []
    for name in (*PHONE_CLASSES, OTHER_CLASS):
        here = classes == name
        if here.any():
            rmse = float(np.sqrt(np.square(errors[here]).mean()))
            error, bias = float(np.abs(opening[here]).mean()), float(opening[here].mean())
            found.append(ClassScore(name, int(here.sum()), rmse, error, bias))
    return found


def _utterance_score(tally: UtteranceStatistics, comparison: UtteranceComparison) -> UtteranceScore:
    recording, synthesised = comparison.real, comparison.curves
    here, recorded = recording.evaluated, recording.curves
    return UtteranceScore(
        recording.observation.name,
        motion_measures.correlation(recorded.opening[here], synthesised.opening[here]),
        motion_measures.correlation(recorded.width[here], synthesised.width[here]),
        tally.rmse_z,
        tally.dtw_cost,
        motion_measures.range_ratio(recorded.opening[here], synthesised.opening[here]),
        int(tally.opening[0]),
    )
