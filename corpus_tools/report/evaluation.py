"""A page about accuracy: figures, where methods differ, and curves of the best, usual and worst sentences."""

from collections.abc import Iterator, Sequence

import numpy as np

from corpus_tools.evaluation.evaluate import CEILING, Run
from corpus_tools.evaluation.scores import CONFIDENCE, Scores, shown
from corpus_tools.evaluation.tables import Evaluation, figure_text
from corpus_tools.report.page import page, table
from corpus_tools.report.trajectories import Series, curves_plot, histogram
from corpus_tools.report.videos import Films

SHOWN = "exemplar"  # whose best, usual and worst sentences are shown, if it was compared; else the last but one
PLAIN = "theobald2007"
N_SHOWN = 3  # sentences of each kind
ABOUT = {
    False: "{n_test} utterances held out, {n_train} learnt from; true phone edges.",
    True: "{n_test} utterances of somebody else with their own phone edges, {n_train} learnt from; curves z-scored "
    "by each one's own speech.",
}
ABOUT_OWN = (
    "The words in the default English voice with its own durations, its clock put onto the real one word by word. "
    "DTW cost, free: on its own clock, without a band."
)


def evaluation_page(result: Evaluation, runs: Sequence[Run]) -> str:
    """The page (HTML)."""
    compared = [one.method for one in result.scores if one.method != CEILING]
    seen = SHOWN if SHOWN in compared else compared[-1]
    about = ABOUT[result.is_across].format(n_test=result.n_test, n_train=result.n_train)
    return page(
        "Accuracy against real lips",
        [
            f"<p>{about} In brackets: {CONFIDENCE:.0%} intervals from drawing utterances again.</p>",
            _figures(result.scores),
            *_own(result.own),
            *_folds(result),
            "<h2>By class of phone</h2>",
            _classes(result.scores),
            "<h2>DTW cost of the sentences</h2>",
            histogram(
                {one.method: [u.dtw_cost for u in one.utterances] for one in result.scores if one.method != CEILING}
            ),
            *_sentences(result, runs, seen, PLAIN if PLAIN in compared and seen != PLAIN else None),
        ],
    )


def _figures(scores: Sequence[Scores]) -> str:
    heads = shown(scores)
    rows = [
        (one.method, *(figure_text(one, name, digits, intervals=True) for name, _, digits in heads)) for one in scores
    ]
    return table(("method", *(head for _, head, _ in heads)), rows, numbers=range(1, len(heads) + 1))


def _own(scores: Sequence[Scores]) -> Iterator[str]:
    if scores:
        n = len(scores[0].utterances)
        yield f"<h2>With own durations</h2>\n<p>{n} utterances. {ABOUT_OWN}</p>\n{_figures(scores)}"


def _folds(result: Evaluation) -> Iterator[str]:
    """Figures of each fold, and over the folds their mean and standard deviation."""
    if not result.folds:
        return
    heads = shown(result.scores)
    rows = []
    for one in result.scores:
        for number, fold in enumerate(result.folds, start=1):
            cells = (f"{fold.figures[one.method][name]:.{digits}f}" for name, _, digits in heads)
            rows.append((one.method, f"{number} ({fold.n_test} held out, {fold.n_train} learnt from)", *cells))
        over = ((result.over_folds(one.method, name), digits) for name, _, digits in heads)
        rows.append((one.method, "mean ± spread", *(f"{mean:.{n}f} ± {spread:.{n}f}" for (mean, spread), n in over)))
    yield f"<h2>{len(result.folds)} folds</h2>\n<p>Each learnt from the utterances of the others. Spread: standard "
    yield "deviation over the folds.</p>"
    yield table(("method", "fold", *(head for _, head, _ in heads)), rows, numbers=range(2, len(heads) + 2))


def _classes(scores: Sequence[Scores]) -> str:
    rows = [
        (one.method, some.phones, str(some.n_frames), f"{some.rmse_z:.3f}", f"{some.opening_error:.4f}",
         f"{some.opening_bias:+.4f}")
        for one in scores
        if one.method != CEILING
        for some in one.classes
    ]  # fmt: skip
    heads = ("method", "phones", "frames", "RMSE z", "error of opening", "bias of opening")
    return table(heads, rows, numbers=range(2, 6))


def _sentences(result: Evaluation, runs: Sequence[Run], seen: str, plain: str | None) -> Iterator[str]:
    """Curves of real and synthesised lips, as in T07, figs 6-8, and for the worst the faces themselves."""
    scores = next(one for one in result.scores if one.method == seen)
    order = np.argsort([one.dtw_cost for one in scores.utterances], kind="stable")
    middle = len(order) // 2 - N_SHOWN // 2
    places = [(run, at) for run in runs for at in range(len(run.real))]
    films = Films(seen)
    for title, chosen in (
        ("Worst sentences", order[::-1][:N_SHOWN]),
        ("Usual sentences", order[middle : middle + N_SHOWN]),
        ("Best sentences", order[:N_SHOWN]),
    ):
        yield f"<h2>{title} of {seen}</h2>"
        for number in chosen:
            run, at = places[number]
            cost = scores.utterances[number].dtw_cost
            yield f"<h3>{run.real[at].observation.name} (DTW cost {cost:.2f})</h3>"
            yield _curves(run, at, [name for name in (seen, plain) if name])
            if title.startswith("Worst"):
                yield films.film(run, at)


def _curves(run: Run, at: int, names: Sequence[str]) -> str:
    one = run.real[at]
    times = np.arange(len(one.parameters)) / one.observation.fps
    unit = "/ eyes" if run.scale is None else "(z)"
    made = {name: run.curves(name, at) for name in names}
    plots = []
    for label, curve in ((f"gap of the lips {unit}", "opening"), (f"width of the mouth {unit}", "width")):
        series = [Series("real", times, getattr(one.curves, curve))]
        series += [Series(name, times, getattr(curves, curve)) for name, curves in made.items()]
        plots.append(curves_plot(series, label, one.observation.phones))
    return "\n".join(plots)
