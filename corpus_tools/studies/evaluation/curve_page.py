"""Learning curves as a page, a picture and tables in files."""

from typing import TYPE_CHECKING

from corpus_tools.studies.evaluation.curve import LearningCurve
from corpus_tools.studies.evaluation.curve_tables import curve_rows, figure_rows, gain_rows, monotony
from corpus_tools.studies.evaluation.learning_curve import MEAN_FACE
from corpus_tools.studies.evaluation.people_tables import FIGURE_HEADS
from corpus_tools.studies.pages import note_paragraph, page, paragraphs, scroll_box, table
from corpus_tools.studies.plots import SERIES, Plot
from corpus_tools.studies.report import Report, as_csv, as_html, as_json, as_png, as_svg

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


WIDTH, HEIGHT = 960, 320  # px of the picture
N_DRAWN = 3  # figures of the picture; those within sentences are only in the tables
BAND = 0.15  # opacity of the intervals
FLAT = MEAN_FACE  # r 0 and a DTW cost far above the others: only in the tables
MIN_S, MINUTE_S = 100.0, 60.0  # ticks from here on are labelled in minutes
NAME = "learning curves: accuracy against seconds of own material"


def learning_curve_page(curve: LearningCurve) -> str:
    """The page (HTML)."""
    base = "no base" if curve.base is None else f"base {curve.base}"
    about = (
        f"{curve.n_test} held-out utterances ({curve.test_seconds / MINUTE_S:.1f} minutes), {base}; curves z-scored. "
        "Tables: mean ± standard deviation over the random choices of the material. Bands and parentheses: 95 % "
        "bootstrap intervals over held-out utterances and choices."
    )
    parts = [paragraphs(about), scroll_box(_plot(curve).svg()), paragraphs(monotony(curve))]
    for name, head in FIGURE_HEADS:
        heads, *rows = figure_rows(curve, name)
        parts += [f"<h2>{head}</h2>", table(heads, rows, numbers=range(len(heads)))]
    heads, *rows = gain_rows(curve)
    parts += ["<h2>Differences</h2>", table(heads, rows, numbers=(0, 2, 3, 4))]
    parts.append(note_paragraph("Negative differences of the DTW cost are improvements."))
    return page("Learning curves", parts)


def _plot(curve: LearningCurve) -> Plot:
    def draw(figure: "Figure") -> None:
        for at, (name, head) in enumerate(FIGURE_HEADS[:N_DRAWN], start=1):
            axes = figure.add_subplot(1, N_DRAWN, at)
            _draw_figure(axes, curve, name)
            axes.set(title=head, xlabel="own material", xscale="log")
            _label_seconds(axes, [point.seconds for point in curve.points])
        handles, labels = axes.get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=len(curve.methods))

    return Plot(draw, WIDTH, HEIGHT, NAME)


def _draw_figure(axes: "Axes", curve: LearningCurve, name: str) -> None:
    seconds = [point.seconds for point in curve.points]
    shown = [method for method in curve.methods if method != FLAT]
    for method, (colour, dash) in zip(shown, SERIES, strict=False):
        figures = [point.figures[method][name] for point in curve.points]
        low = [figure.low for figure in figures]
        high = [figure.high for figure in figures]
        axes.fill_between(seconds, low, high, color=colour, alpha=BAND, linewidth=0)
        axes.plot(seconds, [figure.value for figure in figures], color=colour, linestyle=dash, label=method)


def _label_seconds(axes: "Axes", seconds: list[float]) -> None:
    from matplotlib.ticker import NullLocator

    axes.set_xticks(seconds, [f"{x:.0f} s" if x < MIN_S else f"{x / MINUTE_S:.0f} min" for x in seconds], rotation=60)
    axes.xaxis.set_minor_locator(NullLocator())


REPORT: Report[LearningCurve] = Report(
    {
        ".html": as_html(learning_curve_page),
        ".svg": as_svg(_plot),
        ".png": as_png(_plot),
        ".json": as_json(LearningCurve.to_json, is_ascii=True),
        ".csv": as_csv(curve_rows),
    }
)
