"""Figures of the analysis: heat maps of phones, silhouettes, articulation, variation of movements."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from corpus_tools.studies.plots import FIRST, INK, RULE, SECOND, SOFT, Plot, Tip, draw_svg
from corpus_tools.studies.similarity.analysis import Analysis, TableComparison
from corpus_tools.studies.similarity.mantel import upper_triangle
from corpus_tools.studies.similarity.tables import cluster_tree, phone_label
from lexicon.phones import look_up_phone
from tts2face.numeric.arrays import FloatArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


CELL = 20  # px of a heat map
TREE, LABEL, MARGIN = 170, 62, 14  # px: width of the dendrogram, room for "tʃ CH", border
HEAD, FOOT = 30, 74  # px: the title above, the scales below
BAR = (240, 12)  # px of the colour scale
# Lightness changes evenly along viridis and cividis, so that they also work in grey; the ends of PuOr are distinct for
# colour-blind readers.
LIKENESS, DIFFERENCE, FREEDOM = "viridis", "PuOr_r", "cividis"
FREE_RANGE = (0.3, 1.2)
SIZE = (560, 300)  # px of a small plot


@dataclass(frozen=True, slots=True, eq=False)
class TableFigure:
    """A heat map of P phones in the order of its rows.

    ``values`` (P, P) are coloured by the colour map ``colours`` over ``limits``; ``scale`` labels the colour bar;
    ``blocks`` are the first rows of the classes, and P; ``joins`` (P - 1, 4, 2) the dendrogram's brackets as corners
    (1 - similarity, row), or None; ``cut`` the 1 - similarity at which the tree is cut.
    """

    title: str
    names: tuple[str, ...]
    values: FloatArray
    colours: str
    limits: tuple[float, float]
    scale: str
    blocks: tuple[int, ...] = ()
    joins: FloatArray | None = None
    cut: float | None = None


def tree_joins(links: FloatArray) -> FloatArray:
    """(P - 1, 4, 2) corners (height, row) of a tree's brackets; the phone of rank r is at row r."""
    from scipy.cluster.hierarchy import dendrogram

    drawn = dendrogram(links, no_plot=True)
    rows = (np.array(drawn["icoord"]) - 5.0) / 10.0  # scipy's leaves are at 5, 15, ...
    return np.stack([np.array(drawn["dcoord"]), rows], axis=2)


def similarity_figure(analysis: Analysis, labels: str) -> TableFigure:
    """The similarity table in the dendrogram's order, with frames around the best classes."""
    order, n_classes = analysis.tree.order, analysis.best.n_classes
    n = len(order)
    starts = [0, *(np.flatnonzero(np.diff(analysis.best.labels[order])) + 1).tolist(), n]
    return TableFigure(
        f"Similarity of phones: {analysis.name}",
        tuple(phone_label(analysis.table.phones[at], labels) for at in order),
        analysis.table.matrix[np.ix_(order, order)],
        LIKENESS,
        (0.0, 1.0),
        f"similarity; dashed line and frames: {n_classes} classes",
        tuple(starts),
        tree_joins(analysis.tree.links),
        float(analysis.tree.links[n - n_classes - 1 : n - n_classes + 1, 2].mean()),
    )


def difference_figure(analysis: Analysis, compared: TableComparison, labels: str) -> TableFigure:
    """The differences of two talkers, ordered by similarity of the differences."""
    distance = np.sqrt(np.square(compared.difference[:, None] - compared.difference[None, :]).sum(axis=2))
    order = cluster_tree(distance).order
    # a round end of the scale, and equal tables have one, too
    largest = max(0.1, float(np.ceil(np.abs(compared.difference).max() * 10) / 10))
    return TableFigure(
        f"{analysis.name} minus {compared.other}",
        tuple(phone_label(compared.phones[at], labels) for at in order),
        compared.difference[np.ix_(order, order)],
        DIFFERENCE,
        (-largest, largest),
        "difference of similarity",
    )


def table_plot(table: TableFigure) -> Plot:
    """The heat map, with the value of each cell as tooltip in a page."""
    return Plot(lambda figure: draw_table(figure, table), *_table_size(table), table.title)


def _table_size(table: TableFigure) -> tuple[int, int]:
    side, tree = CELL * len(table.names), 0 if table.joins is None else TREE
    return MARGIN + tree + LABEL + max(side, BAR[0]) + MARGIN, HEAD + LABEL + side + FOOT


def draw_table(figure: "Figure", table: TableFigure) -> list[Tip]:
    """Draw the title, the dendrogram, the cells with frames around the classes, and the colour scale."""
    figure.set_layout_engine("none")
    (width, height), side, n = _table_size(table), CELL * len(table.names), len(table.names)
    left = MARGIN + LABEL + (0 if table.joins is None else TREE)

    def place(x: float, y: float, wide: float, high: float) -> tuple[float, float, float, float]:
        return x / width, 1 - (y + high) / height, wide / width, high / height

    figure.text(MARGIN / width, 1 - MARGIN / height, table.title, fontsize=14, va="top")
    axes = figure.add_axes(place(left, HEAD + LABEL, side, side))
    low, high = table.limits
    cells = axes.imshow(table.values, table.colours, vmin=low, vmax=high, interpolation="none", aspect="auto")
    axes.set_xticks(range(n), table.names, rotation=90)
    axes.set_yticks(range(n), table.names)
    axes.tick_params(length=0, top=False, labeltop=True, labelbottom=False)
    axes.grid(visible=False)
    axes.spines[:].set_visible(False)
    for first, last in pairwise(table.blocks):
        axes.plot(
            np.array([first, last, last, first, first]) - 0.5,
            np.array([first, first, last, last, first]) - 0.5,
            color="white",
            linewidth=2,
        )
    bar = figure.add_axes(place(left, HEAD + LABEL + side + 16, *BAR))
    figure.colorbar(cells, cax=bar, orientation="horizontal", label=table.scale).outline.set_visible(False)
    if table.joins is not None:
        _draw_tree(figure.add_axes(place(MARGIN, HEAD + LABEL, TREE - 6, side)), table.joins, table.cut)
    return [
        Tip(axes, column - 0.5, row - 0.5, f"{a} – {b}: {table.values[row, column]:.3f}", 1, 1)
        for row, a in enumerate(table.names)
        for column, b in enumerate(table.names)
    ]


def _draw_tree(axes: "Axes", joins: FloatArray, cut: float | None) -> None:
    """Draw a dendrogram with its root to the left."""
    from matplotlib.collections import LineCollection

    axes.add_collection(LineCollection(list(joins), colors=INK, linewidths=1.3))
    if cut is not None:
        axes.axvline(cut, color=SECOND, linestyle="dashed")
    # leaves at the right, beside their rows
    axes.set(xlim=(1.04 * joins[..., 0].max(), 0), ylim=(len(joins) + 0.5, -0.5), yticks=(), xlabel="1 - similarity")
    axes.spines["left"].set_visible(False)
    axes.grid(visible=False)


def silhouettes_svg(analysis: Analysis) -> str:
    """Mean silhouette over the number of classes, the best one marked."""
    numbers = [classes.n_classes for classes in analysis.curve]
    heights = [classes.silhouette for classes in analysis.curve]

    def draw(figure: "Figure") -> list[Tip]:
        axes = figure.subplots()
        axes.plot(numbers, heights, color=FIRST, marker="o", markersize=5)
        axes.plot([analysis.best.n_classes], [analysis.best.silhouette], color=SECOND, marker="D", markersize=9)
        axes.set(xlabel="number of classes", ylabel="mean silhouette", xlim=(1, numbers[-1] + 1))
        axes.set_ylim(min(0.0, *heights), max(0.05, *heights) * 1.1)
        return [Tip(axes, n, value, f"{n} classes: {value:.3f}") for n, value in zip(numbers, heights, strict=True)]

    return draw_svg(draw, *SIZE, "mean silhouette over number of classes")


def articulation_svg(analysis: Analysis, labels: str) -> str:
    """Similarity of all pairs of phones over their articulatory distance, with the least-squares line."""
    phones = analysis.table.phones
    rows, columns = np.triu_indices(len(phones), 1)
    apart, alike = analysis.articulation[rows, columns], upper_triangle(analysis.table.matrix)
    vowels = np.array([look_up_phone(phone).is_vowel for phone in phones]).astype(int)
    n_vowels = vowels[rows] + vowels[columns]

    def draw(figure: "Figure") -> list[Tip]:
        axes = figure.subplots()
        for n, (name, colour, marker) in enumerate(
            (("two consonants", FIRST, "o"), ("one of each", SOFT, "x"), ("two vowels", SECOND, "^"))
        ):
            here = n_vowels == n
            axes.scatter(apart[here], alike[here], s=16, c=colour, marker=marker, alpha=0.65, linewidths=1, label=name)
        slope, intercept = np.polyfit(apart, alike, 1)
        axes.axline((0, float(intercept)), slope=float(slope), color=INK)
        axes.set(xlabel="distance by articulatory features", ylabel="similarity", ylim=(0, 1))
        axes.set_xlim(0, apart.max() * 1.03)
        axes.legend(loc="upper right")
        return [
            Tip(axes, x, y, f"{phone_label(phones[a], labels)} – {phone_label(phones[b], labels)}: {y:.3f}")
            for a, b, x, y in zip(rows, columns, apart, alike, strict=True)
        ]

    return draw_svg(draw, *SIZE, "similarity over articulatory distance")


def shares_svg(names: Sequence[str], shares: FloatArray) -> str:
    """Shares from 0 to 1 as named bars, each with its number."""

    def draw(figure: "Figure") -> None:
        axes = figure.subplots()
        axes.barh(names, np.ones(len(names)), color=RULE, alpha=0.5)
        axes.bar_label(axes.barh(names, shares, color=FIRST), [f"{share:.2f}" for share in shares], padding=3)
        axes.set(xlim=(0, 1), xlabel="share of the variance")
        axes.invert_yaxis()
        axes.grid(visible=False)

    return draw_svg(draw, SIZE[0], 50 + 22 * len(names), "share of each movement that the phones do not explain")


def freedom_svg(rows: Sequence[str], columns: Sequence[str], values: FloatArray) -> str:
    """(R, K) spread within phones over that of all speech as coloured cells with their numbers."""

    def draw(figure: "Figure") -> None:
        axes = figure.subplots()
        low, high = FREE_RANGE
        axes.imshow(values, FREEDOM, vmin=low, vmax=high, interpolation="none", aspect="auto")
        for (row, column), value in np.ndenumerate(values):
            colour = "white" if value < (low + high) / 2 else "black"
            axes.text(column, row, f"{value:.2f}", color=colour, ha="center", va="center")
        axes.set_yticks(range(len(rows)), rows)
        axes.set_xticks(range(len(columns)), columns, rotation=38, ha="left", rotation_mode="anchor")
        axes.tick_params(length=0, labeltop=True, labelbottom=False)
        axes.grid(visible=False)
        axes.spines[:].set_visible(False)

    return draw_svg(
        draw, LABEL + 64 * len(columns) + 60, 90 + CELL * len(rows), "spread within phones over that of all speech"
    )
