"""A table of phones with its dendrogram as geometry, for a page and for a picture to draw alike."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from corpus_tools.report.ramps import Ramp, difference_ramp, likeness_ramp
from corpus_tools.similarity.analysis import Analysis
from corpus_tools.similarity.classes import Tree, cluster_tree
from corpus_tools.similarity.compare import Comparison
from corpus_tools.similarity.labels import label


@dataclass(frozen=True, slots=True, eq=False)
class Bracket:
    """One join of the dendrogram: the two joined at their rows and heights (1 - similarity), and its own height."""

    rows: tuple[float, float]
    heights: tuple[float, float]
    height: float


@dataclass(frozen=True, slots=True, eq=False)
class TableFigure:
    """A heat map of P rows in the order in which they are drawn.

    ``values`` (P, P); ``blocks`` the first row of each class and P; ``brackets`` the dendrogram, none without one;
    ``cut`` its height between the classes; ``scale`` what the colours mean.
    """

    title: str
    names: tuple[str, ...]
    values: NDArray[np.float64]
    ramp: Ramp
    scale: str
    blocks: tuple[int, ...] = ()
    brackets: tuple[Bracket, ...] = ()
    cut: float | None = None


def brackets_of(tree: Tree) -> tuple[Bracket, ...]:
    """The joins of a tree; row r is drawn from r to r + 1, so that a phone stands at its middle."""
    n = len(tree.order)
    row = {int(phone): rank + 0.5 for rank, phone in enumerate(tree.order)}
    height = dict.fromkeys(row, 0.0)
    made = []
    for step, (first, second, apart, _) in enumerate(tree.links):
        pair = sorted((int(first), int(second)), key=row.__getitem__)
        rows, heights = (row[pair[0]], row[pair[1]]), (height[pair[0]], height[pair[1]])
        made.append(Bracket(rows, heights, float(apart)))
        row[n + step], height[n + step] = sum(rows) / 2, float(apart)
    return tuple(made)


def similarity_figure(found: Analysis, labels: str) -> TableFigure:
    """The similarity table in the dendrogram's order, its best classes marked."""
    order, n_classes = found.tree.order, found.best.n_classes
    sorted_labels = found.best.labels[order]
    starts = [0, *(np.flatnonzero(np.diff(sorted_labels)) + 1).tolist(), len(order)]
    n = len(order)
    cut = float(found.tree.links[n - n_classes - 1 : n - n_classes + 1, 2].mean())
    return TableFigure(
        f"Similarity of phones: {found.name}",
        tuple(label(found.table.phones[at], labels) for at in order),
        found.table.matrix[np.ix_(order, order)],
        likeness_ramp(),
        f"similarity; dashed and framed: {n_classes} classes",
        tuple(starts),
        brackets_of(found.tree),
        cut,
    )


def difference_figure(found: Analysis, compared: Comparison, labels: str) -> TableFigure:
    """The differences of two talkers; phones that differ alike stand together."""
    apart = np.sqrt(np.square(compared.difference[:, None] - compared.difference[None, :]).sum(axis=2))
    order = cluster_tree(apart).order
    largest = max(0.1, float(np.ceil(np.abs(compared.difference).max() * 10) / 10))
    return TableFigure(
        f"{found.name} minus {compared.other}",
        tuple(label(compared.phones[at], labels) for at in order),
        compared.difference[np.ix_(order, order)],
        difference_ramp(largest),
        "difference of similarity",
    )
