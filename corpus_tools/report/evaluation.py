"""A page about accuracy: figures, where methods differ, and curves of the best, usual and worst sentences."""

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from corpus_tools.evaluation.evaluate import CEILING, Evaluation, Run
from corpus_tools.evaluation.real import Curves, Real
from corpus_tools.evaluation.scores import CONFIDENCE, FIGURES, Scores
from corpus_tools.report.page import page, picture_tag, table
from corpus_tools.report.trajectories import Series, curves_plot, histogram
from lexicon.errors import DataError, InputError
from tts2face.landmarks import EYE_OUTER_LEFT, EYE_OUTER_RIGHT, INNER_LIP_LOWER, INNER_LIP_UPPER
from tts2face.video.media import read_pictures

SHOWN = "exemplar"  # whose best, usual and worst sentences are shown, if it was compared; else the last but one
PLAIN = "theobald2007"
N_SHOWN = 3  # sentences of each kind
FRAMES_APART, STRIP_PX = 3, 88


def evaluation_page(result: Evaluation, runs: Sequence[Run]) -> str:
    """The page (HTML)."""
    compared = [one.method for one in result.scores if one.method != CEILING]
    shown = SHOWN if SHOWN in compared else compared[-1]
    return page(
        "Accuracy against real lips",
        [
            f"<p>{result.n_test} utterances held out, {result.n_train} learnt from; true phone edges. In brackets: "
            f"{CONFIDENCE:.0%} intervals from drawing utterances again.</p>",
            _figures(result.scores),
            "<h2>By class of phone</h2>",
            _classes(result.scores),
            "<h2>DTW cost of the sentences</h2>",
            histogram(
                {one.method: [u.dtw_cost for u in one.utterances] for one in result.scores if one.method != CEILING},
                "DTW cost",
            ),
            *_sentences(result, runs, shown, PLAIN if PLAIN in compared and shown != PLAIN else None),
        ],
    )


def _figures(scores: Sequence[Scores]) -> str:
    rows = []
    for one in scores:
        cells = [
            f"{figure.value:.{digits}f} ({figure.low:.{digits}f}-{figure.high:.{digits}f})"
            for figure, digits in ((one.figures[name], digits) for name, _, digits in FIGURES)
        ]
        rows.append((one.method, *cells))
    return table(("method", *(head for _, head, _ in FIGURES)), rows, numbers=range(1, len(FIGURES) + 1))


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


def _sentences(result: Evaluation, runs: Sequence[Run], shown: str, plain: str | None) -> Iterator[str]:
    """Curves of real and synthesised lips, as in T07, figs 6-8, and the lips themselves for the worst."""
    scores = next(one for one in result.scores if one.method == shown)
    order = np.argsort([one.dtw_cost for one in scores.utterances], kind="stable")
    middle = len(order) // 2 - N_SHOWN // 2
    places = [(run, at) for run in runs for at in range(len(run.real))]
    for title, chosen in (
        ("Worst sentences", order[::-1][:N_SHOWN]),
        ("Usual sentences", order[middle : middle + N_SHOWN]),
        ("Best sentences", order[:N_SHOWN]),
    ):
        yield f"<h2>{title} of {shown}</h2>"
        for number in chosen:
            run, at = places[number]
            cost = scores.utterances[number].dtw_cost
            yield f"<h3>{run.real[at].observation.name} (DTW cost {cost:.2f})</h3>"
            yield _curves(run, at, [name for name in (shown, plain) if name])
            if title.startswith("Worst"):
                yield _strip(run, at, shown)


def _curves(run: Run, at: int, names: Sequence[str]) -> str:
    one = run.real[at]
    times = np.arange(len(one.parameters)) / one.observation.fps
    made = {name: Curves.of(run.model.shapes(run.made[name][at])) for name in names}
    plots = []
    for label, curve in (("gap of the lips / eye distance", "opening"), ("width of the mouth / eye distance", "width")):
        series = [Series("real", times, getattr(one.curves, curve))]
        series += [Series(name, times, getattr(curves, curve)) for name, curves in made.items()]
        plots.append(curves_plot(series, label, one.observation.phones))
    return "\n".join(plots)


def _strip(run: Run, at: int, name: str) -> str:
    """Every third frame: the picture, and the synthesised inner lips over the real ones."""
    one = run.real[at]
    made = run.model.shapes(run.made[name][at])
    first, last = one.judged.start, one.judged.stop
    cells = []
    for number, picture in _pictures(one, range(first, last, FRAMES_APART)):
        lips = _lips(one.observation.landmarks[number], made[number])
        cells.append(f'<div style="display:inline-block">{picture_tag(picture, STRIP_PX)}<br>{lips}</div>')
    note = "Below each picture: real inner lips (blue) and synthesised ones (ochre)."
    return f'<p class="soft">{note}</p><div>{"".join(cells)}</div>' if cells else ""


def _pictures(one: Real, wanted: range) -> Iterator[tuple[int, NDArray[np.uint8]]]:
    seen, begin = one.observation, one.observation.quality.cut
    waiting = list(wanted)[::-1]
    try:
        for picture in read_pictures(seen.video):
            while waiting and picture.time >= begin + waiting[-1] / seen.fps - 0.5 / seen.fps:
                yield waiting.pop(), picture.pixels
            if not waiting:
                return
    except (DataError, InputError):
        return  # the video has gone since; the curves stay


def _lips(real: NDArray[np.floating], made: NDArray[np.floating]) -> str:
    ring = [*INNER_LIP_UPPER, *reversed(INNER_LIP_LOWER)]
    eyes = float(np.linalg.norm(real[EYE_OUTER_LEFT] - real[EYE_OUTER_RIGHT]))
    middle = real[ring].mean(axis=0)
    paths = []
    for shape, colour in ((real, "var(--first)"), (made, "var(--second)")):
        places = (shape[ring, :2] - middle[:2]) * (1.0, -1.0) / eyes * 150 + (44, 22)
        points = " ".join(f"{x:.1f},{y:.1f}" for x, y in places)
        paths.append(f'<polygon points="{points}" fill="none" stroke="{colour}" stroke-width="1.5"/>')
    return f'<svg width="88" height="44">{"".join(paths)}</svg>'
