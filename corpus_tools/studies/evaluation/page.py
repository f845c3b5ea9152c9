"""HTML page of an evaluation: scores, errors by phone class, curves of the best, median and worst sentences."""

from collections.abc import Iterator, Mapping, Sequence
from itertools import cycle
from typing import TYPE_CHECKING

import numpy as np

from corpus_tools.measures.intervals import CONFIDENCE
from corpus_tools.measures.scores import Scores, available_figures
from corpus_tools.studies.evaluation.evaluate import CEILING_METHOD, SplitResult
from corpus_tools.studies.evaluation.tables import Evaluation, class_rows, figure_rows
from corpus_tools.studies.pages import page, paragraphs, scroll_box, table
from corpus_tools.studies.plots import RULE, SERIES, draw_svg
from corpus_tools.studies.report import Report, as_csv, as_html, as_json
from corpus_tools.studies.videos import MethodVideos
from lexicon.sequence import SILENCE, PhoneSequence
from tts2face.numeric.arrays import RealArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


SHOWN = "exemplar"  # the method whose sentences are shown where it was compared; otherwise the last one
PLAIN = "theobald2007"  # shown beside it
N_SHOWN = 3  # sentences of each kind
WIDTH, HEIGHT = 1100, 236  # px of a plot
N_BINS = 30
ABOUT = {
    False: "{n_test} held-out utterances, {n_train} training utterances; recorded phone edges.",
    True: "{n_test} utterances of another talker with their own phone edges, {n_train} training utterances; each "
    "talker's curves are z-scored over the talker's speech.",
}
ABOUT_AS_TRACKED = (
    "The same motion against landmarks that are not corrected for the head's pose; training uses corrected ones."
)
ABOUT_OWN = (
    "Words spoken by the default English voice with its own durations, mapped to the recorded times word by word. "
    "DTW cost, free: on the voice's own time axis, without a band."
)


def evaluation_page(result: Evaluation, runs: Sequence[SplitResult]) -> str:
    """The page (HTML)."""
    compared = [score.method for score in result.scores if score.method != CEILING_METHOD]
    method = SHOWN if SHOWN in compared else compared[-1]
    head, *classes = class_rows([score for score in result.scores if score.method != CEILING_METHOD])
    about = ABOUT[result.is_across].format(n_test=result.n_test, n_train=result.n_train)
    return page(
        "Accuracy of synthesised lips",
        [
            f"<p>{about} Parentheses: {CONFIDENCE:.0%} bootstrap intervals over utterances.</p>",
            _figures(result.scores),
            *_as_tracked(result.as_tracked),
            *_own_durations(result.own),
            *_folds(result),
            "<h2>By class of phone</h2>",
            table(head, classes, numbers=range(2, 6)),
            "<h2>DTW cost of the sentences</h2>",
            cost_histogram(
                {
                    score.method: [u.dtw_cost for u in score.utterances]
                    for score in result.scores
                    if score.method != CEILING_METHOD
                }
            ),
            *_sentences(result, runs, method, PLAIN if PLAIN in compared and method != PLAIN else None),
        ],
    )


def _figures(scores: Sequence[Scores]) -> str:
    head, *rows = figure_rows(scores, intervals=True)
    return table(head, rows, numbers=range(1, len(head)))


def _as_tracked(scores: Sequence[Scores]) -> Iterator[str]:
    if scores:
        yield f"<h2>Recorded face as tracked</h2>\n{paragraphs(ABOUT_AS_TRACKED)}\n{_figures(scores)}"


def _own_durations(scores: Sequence[Scores]) -> Iterator[str]:
    if scores:
        n = len(scores[0].utterances)
        yield f"<h2>With own durations</h2>\n{paragraphs(f'{n} utterances. {ABOUT_OWN}')}\n{_figures(scores)}"


def _folds(result: Evaluation) -> Iterator[str]:
    """Figures of each fold, and over the folds their mean and standard deviation."""
    if not result.folds:
        return
    heads = available_figures(result.scores)
    rows = []
    for score in result.scores:
        for number, fold in enumerate(result.folds, start=1):
            cells = (f"{fold.figures[score.method][name]:.{digits}f}" for name, _, digits in heads)
            rows.append((score.method, f"{number} ({fold.n_test} held out, {fold.n_train} for training)", *cells))
        over = ((result.fold_mean_and_deviation(score.method, name), digits) for name, _, digits in heads)
        rows.append((score.method, "mean ± spread", *(f"{mean:.{n}f} ± {spread:.{n}f}" for (mean, spread), n in over)))
    yield f"<h2>{len(result.folds)} folds</h2>"
    yield paragraphs(
        "Each fold is tested with methods learnt from the others. Spread: standard deviation over the folds."
    )
    yield table(("method", "fold", *(head for _, head, _ in heads)), rows, numbers=range(2, len(heads) + 2))


def _sentences(result: Evaluation, runs: Sequence[SplitResult], method: str, plain: str | None) -> Iterator[str]:
    """Curves of real and synthesised lips, as in T07, figs 6-8, and videos of the worst sentences."""
    scores = next(score for score in result.scores if score.method == method)
    order = np.argsort([utterance.dtw_cost for utterance in scores.utterances], kind="stable")
    middle = len(order) // 2 - N_SHOWN // 2
    places = [(run, at) for run in runs for at in range(len(run.real))]
    videos = MethodVideos(method)
    for title, chosen in (
        ("Worst sentences", order[::-1][:N_SHOWN]),
        ("Median sentences", order[middle : middle + N_SHOWN]),
        ("Best sentences", order[:N_SHOWN]),
    ):
        yield f"<h2>{title} of {method}</h2>"
        for number in chosen:
            run, at = places[number]
            cost = scores.utterances[number].dtw_cost
            yield f"<h3>{run.real[at].observation.name} (DTW cost {cost:.2f})</h3>"
            yield _curves(run, at, [name for name in (method, plain) if name])
            if title.startswith("Worst"):
                yield videos.render_tag(run, at)


def _curves(run: SplitResult, at: int, names: Sequence[str]) -> str:
    recording = run.real[at]
    times = np.arange(len(recording.parameters)) / recording.observation.fps
    unit = "/ eyes" if run.scale is None else "(z)"
    synthesised = {name: run.curves(name, at) for name in names}
    plots = []
    for label, curve in ((f"lip gap {unit}", "opening"), (f"mouth width {unit}", "width")):
        values = {"real": getattr(recording.curves, curve)}
        values |= {name: getattr(curves, curve) for name, curves in synthesised.items()}
        plots.append(curves_plot(times, values, label, recording.observation.phones))
    return "\n".join(plots)


def curves_plot(times: RealArray, curves: Mapping[str, RealArray], label: str, phones: PhoneSequence) -> str:
    """Plot of named curves (T,) at times (T,) in seconds, with the phones above (SVG)."""

    def draw(figure: "Figure") -> None:
        axes = _series_axes(figure, label, "seconds")
        for (name, values), (colour, dash) in zip(curves.items(), cycle(SERIES), strict=False):
            axes.plot(times, values, color=colour, linestyle=dash, label=name)
        label_phones(axes, phones, float(times[-1]))
        figure.legend(loc="outside lower right", ncols=len(curves))

    return scroll_box(draw_svg(draw, WIDTH, HEIGHT, f"{label} over time"))


def label_phones(axes: "Axes", phones: PhoneSequence, end: float) -> None:
    """Draw a line at each phone edge up to `end` seconds and write the phones above the axes."""
    place = axes.get_xaxis_transform()
    axes.vlines(phones.edges[phones.edges <= end], 0, 1, RULE, linewidth=1, transform=place, zorder=0)
    for phone, start, stop in zip(phones.phones, phones.edges, phones.edges[1:], strict=False):
        if phone != SILENCE and start < end:
            axes.text(float(start + min(stop, end)) / 2, 1.02, phone, ha="center", va="bottom", transform=place)


def cost_histogram(samples: Mapping[str, Sequence[float]]) -> str:
    """Histogram of the DTW costs of utterances, one outline for each method (SVG)."""
    edges = np.histogram_bin_edges(np.concatenate([np.asarray(values) for values in samples.values()]), N_BINS)

    def draw(figure: "Figure") -> None:
        from matplotlib.ticker import MaxNLocator

        axes = _series_axes(figure, "utterances", "DTW cost")
        for (name, values), (colour, dash) in zip(samples.items(), cycle(SERIES), strict=False):
            axes.stairs(np.histogram(values, edges)[0], edges, color=colour, linestyle=dash, linewidth=1.5, label=name)
        axes.yaxis.set_major_locator(MaxNLocator(integer=True))
        figure.legend(loc="outside lower right", ncols=len(samples))

    return scroll_box(draw_svg(draw, WIDTH, HEIGHT, "histogram of DTW costs"))


def _series_axes(figure: "Figure", y_label: str, x_label: str) -> "Axes":
    axes = figure.subplots()
    axes.grid(visible=False, axis="x")
    axes.set(xlabel=x_label, ylabel=y_label)
    return axes


REPORT: Report[tuple[Evaluation, Sequence[SplitResult]]] = Report(
    {
        ".json": as_json(lambda found: found[0].to_json(), is_ascii=True),
        ".csv": as_csv(lambda found: found[0].rows()),
        ".html": as_html(lambda found: evaluation_page(*found)),
    }
)
