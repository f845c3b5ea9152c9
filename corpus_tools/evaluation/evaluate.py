"""Held-out comparison: a talker learnt from some utterances speaks others, and is measured against the real face."""

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from corpus_tools.effort import Progress
from corpus_tools.evaluation.methods import Method, methods_of
from corpus_tools.evaluation.real import Real, Thresholds
from corpus_tools.evaluation.scores import FIGURES, Scores, scored
from corpus_tools.evaluation.splits import Parts, require_parted
from corpus_tools.evaluation.tracks import Track, mapped
from corpus_tools.leak import pose_leak
from corpus_tools.learn import learn_talker
from corpus_tools.lips import with_network
from corpus_tools.observation import Observation
from tts2face.exemplar.options import SynthesisOptions
from tts2face.talker import ShapeModel

LEARNT_FOR_EVALUATION = {
    "name": "evaluation", "language": "", "sources": "", "licence": "", "attribution": "", "command": "", "created": "",
}  # fmt: skip
TRACKS, CEILING = "tracks", "real, through the model"


@dataclass(frozen=True, slots=True)
class Evaluation:
    """All methods on held-out utterances."""

    n_train: int
    n_test: int
    scores: tuple[Scores, ...]

    def to_json(self) -> dict[str, Any]:
        """Plain dictionary, utterances included."""
        return asdict(self)

    def table(self, *, intervals: bool = False) -> str:
        """Markdown table, one method a line."""
        lines = [f"| method | {' | '.join(head for _, head, _ in FIGURES)} |", "| --- |" + " --- |" * len(FIGURES)]
        for one in self.scores:
            cells = [_cell(one, name, digits, intervals=intervals) for name, _, digits in FIGURES]
            lines.append(f"| {one.method} | {' | '.join(cells)} |")
        return "\n".join(lines)

    def class_table(self) -> str:
        """Markdown table of the classes of phones, one method and class a line."""
        lines = ["| method | phones | frames | RMSE z | error of opening | bias |", "| --- |" + " --- |" * 5]
        lines += [
            f"| {one.method} | {some.phones} | {some.n_frames} | {some.rmse_z:.3f} | {some.opening_error:.4f} | "
            f"{some.opening_bias:+.4f} |"
            for one in self.scores
            for some in one.classes
        ]
        return "\n".join(lines)

    def rows(self) -> tuple[tuple[str, ...], ...]:
        """All figures with their intervals, for a CSV file; the first row names the columns."""
        head = ("method", *(part for name, _, _ in FIGURES for part in (name, f"{name}_low", f"{name}_high")))
        rows = []
        for one in self.scores:
            figures = [one.figures[name] for name, _, _ in FIGURES]
            rows.append(
                (one.method, *(f"{x:.6g}" for figure in figures for x in (figure.value, figure.low, figure.high)))
            )
        return (head, *rows)


def _cell(scores: Scores, name: str, digits: int, *, intervals: bool) -> str:
    figure = scores.figures[name]
    text = f"{figure.value:.{digits}f}"
    return f"{text} ({figure.low:.{digits}f}-{figure.high:.{digits}f})" if intervals else text


@dataclass(frozen=True, slots=True, eq=False)
class Run:
    """One split, made: the model, the real utterances, and what each method made of them (T, S), by name."""

    model: ShapeModel
    real: tuple[Real, ...]
    made: Mapping[str, tuple[NDArray[np.float32], ...]]
    spent: Mapping[str, float]


def evaluate(
    parts: Sequence[Parts],
    *,
    options: Mapping[str, SynthesisOptions] | None = None,
    tracks: Mapping[str, Track] | None = None,
    on_progress: Progress | None = None,
) -> tuple[Evaluation, tuple[Run, ...]]:
    """Every method on held-out utterances, with their true phone edges; all is learnt from the training parts.

    Parameters
    ----------
    parts
        Training and held-out utterances; of several splits the held-out parts are taken together, and the figures in
        units of spread refer to each split's own model.
    options
        Exemplar methods by name; by default `METHODS`.
    tracks
        Somebody's curves by utterance, to be measured beside them.

    Raises
    ------
    InputError
        There is nothing to learn from or nothing to test, or an utterance is on both sides.
    BackendError
        scikit-learn is missing.
    """
    runs = []
    for number, (train, test) in enumerate(parts):
        require_parted(train, test)
        tell = _stage(on_progress, number, len(parts))
        runs.append(run(train, test, options=options, tracks=tracks, on_progress=tell))
    n_train = len(parts[0][0]) if len(parts) == 1 else min(len(train) for train, _ in parts)
    return Evaluation(n_train, sum(len(one.real) for one in runs), _together(runs)), tuple(runs)


def run(
    train: Sequence[Observation],
    test: Sequence[Observation],
    *,
    options: Mapping[str, SynthesisOptions] | None = None,
    tracks: Mapping[str, Track] | None = None,
    on_progress: Progress | None = None,
) -> Run:
    """One split: learn a talker from `train`, and make the motion of `test` by every method."""
    leak = pose_leak(train)
    train, test = ([leak.removed(seen) for seen in part] for part in (train, test))
    talker = with_network(learn_talker(train, metadata=LEARNT_FOR_EVALUATION))
    methods = methods_of(talker, options)
    real = tuple(Real.of(seen, talker.model) for seen in test)
    made, spent = {}, {}
    for number, (name, method) in enumerate(methods.items()):
        made[name], spent[name] = _made(method, real)
        if on_progress:
            on_progress(number + 1, len(methods))
    if tracks is not None:
        made[TRACKS], spent[TRACKS] = mapped(tracks, talker, real), 0.0
    made[CEILING], spent[CEILING] = tuple(one.parameters for one in real), 0.0
    return Run(talker.model, real, made, spent)


def _made(method: Method, real: Sequence[Real]) -> tuple[tuple[NDArray[np.float32], ...], float]:
    began = time.perf_counter()
    made = tuple(method(one.observation.phones, len(one.parameters), one.observation.fps) for one in real)
    return made, time.perf_counter() - began


def _together(runs: Sequence[Run]) -> tuple[Scores, ...]:
    """Scores of each method over all runs; thresholds come from all real utterances."""
    limits = Thresholds.of([one for each in runs for one in each.real])
    return tuple(
        scored(
            name, [(each.model, each.real, each.made[name]) for each in runs], limits, sum(r.spent[name] for r in runs)
        )
        for name in runs[0].made
    )


def _stage(on_progress: Progress | None, number: int, of: int) -> Callable[[int, int], None] | None:
    if on_progress is None:
        return None
    return lambda done, n_methods: on_progress(number * n_methods + done, of * n_methods)
