"""Viseme classes by hierarchical clustering of phones, and their silhouettes."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import BackendError, InputError


@dataclass(frozen=True, slots=True, eq=False)
class Tree:
    """Average-linkage clustering of P phones.

    ``links`` (P - 1, 4) is scipy's linkage matrix: the two clusters joined (phones are 0 to P - 1, join i makes cluster
    P + i), their distance, the number of phones. ``order`` (P,) are the phones in the optimal leaf order of the
    dendrogram (Bar-Joseph et al. 2001).
    """

    links: NDArray[np.float64]
    order: NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class VisemeClasses:
    """P phones in classes: ``labels`` (P,) from 0 in the dendrogram's order; ``silhouettes`` (P,) of the phones."""

    labels: NDArray[np.int64]
    silhouettes: NDArray[np.float64]

    @property
    def n_classes(self) -> int:
        """Number of classes."""
        return int(self.labels.max()) + 1

    @property
    def silhouette(self) -> float:
        """Mean over the phones: near 1 for separate classes, 0 for touching ones."""
        return float(self.silhouettes.mean())


def distances(similarity: NDArray[np.floating]) -> NDArray[np.float64]:
    """(P, P) 1 - similarity, exactly symmetric, 0 on the diagonal."""
    distance = 1.0 - (similarity + similarity.T) / 2.0
    np.fill_diagonal(distance, 0.0)
    return np.asarray(distance, np.float64)


def cluster_tree(distance: NDArray[np.floating]) -> Tree:
    """Average-linkage tree of a (P, P) distance matrix, P at least 2."""
    from scipy.cluster.hierarchy import leaves_list, linkage
    from scipy.spatial.distance import squareform

    links = linkage(squareform(distance, checks=False), "average", optimal_ordering=True)
    return Tree(np.asarray(links, np.float64), leaves_list(links).astype(np.int64))


def cut_into_classes(tree: Tree, n_classes: int) -> NDArray[np.int64]:
    """(P,) class of each phone when the tree is cut into exactly `n_classes`, numbered in the dendrogram's order.

    Raises
    ------
    InputError
        `n_classes` is below 2 or above the number of phones.
    """
    from scipy.cluster.hierarchy import cut_tree

    check_classes(n_classes, len(tree.order))
    clusters = cut_tree(tree.links, [n_classes])[:, 0]
    _, first = np.unique(clusters[tree.order], return_index=True)
    return np.argsort(np.argsort(first))[clusters].astype(np.int64)


def check_classes(n_classes: int, n_phones: int) -> None:
    """Check a number of classes; errors as `cut_into_classes`."""
    if not 2 <= n_classes <= n_phones:
        raise InputError(f"{n_phones} phones cannot make {n_classes} classes; give a number from 2 to {n_phones}")


def silhouettes(distance: NDArray[np.floating], labels: NDArray[np.integer]) -> NDArray[np.float64]:
    """(P,) silhouette of each item: (b - a) / max(a, b).

    a is the mean distance from the others of its own class, b from the members of the nearest other class; 0 for an
    item alone in its class (Rousseeuw 1987).

    Raises
    ------
    InputError
        There is one class only, or the arrays do not fit each other.
    BackendError
        scikit-learn is not installed.
    """
    n_classes = len(np.unique(labels))
    if distance.shape != (len(labels), len(labels)) or n_classes < 2:
        raise InputError(f"a silhouette needs two classes and a square matrix; got {n_classes} and {distance.shape}")
    if n_classes == len(labels):
        return np.zeros(len(labels))  # scikit-learn rejects classes of one item each
    try:
        from sklearn.metrics import silhouette_samples
    except ImportError as missing:
        raise BackendError("silhouettes need scikit-learn; run: pip install 'tts2face[report]'") from missing
    return np.asarray(silhouette_samples(distance, labels, metric="precomputed"), np.float64)


def viseme_classes(distance: NDArray[np.floating], tree: Tree, n_classes: int) -> VisemeClasses:
    """The classes of a cut and their silhouettes; errors as `cut_into_classes`."""
    labels = cut_into_classes(tree, n_classes)
    return VisemeClasses(labels, silhouettes(distance, labels))


def best_classes(candidates: tuple[VisemeClasses, ...]) -> VisemeClasses:
    """The classes with the highest mean silhouette; among equals, the fewest."""
    return max(candidates, key=lambda classes: (classes.silhouette, -classes.n_classes))
