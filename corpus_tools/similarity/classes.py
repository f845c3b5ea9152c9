"""Viseme classes from data: phones clustered by how they look, and how well the classes stand apart."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import InputError


@dataclass(frozen=True, slots=True, eq=False)
class Tree:
    """Average-linkage clustering of P phones.

    ``links`` (P - 1, 4) as scipy gives them: the two clusters joined (phones are 0 to P - 1, join i makes cluster
    P + i), their distance, the number of phones. ``order`` (P,) is the phones from one end of the dendrogram to the
    other, neighbours as alike as the tree allows (Bar-Joseph et al. 2001).
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
        """Mean over the phones; near 1 where classes stand apart, 0 where they touch."""
        return float(self.silhouettes.mean())


def distances(similarity: NDArray[np.floating]) -> NDArray[np.float64]:
    """(P, P) 1 - similarity, exactly symmetric, 0 on the diagonal."""
    apart = 1.0 - (similarity + similarity.T) / 2.0
    np.fill_diagonal(apart, 0.0)
    return np.asarray(apart, np.float64)


def cluster_tree(distance: NDArray[np.floating]) -> Tree:
    """Average-linkage tree of a (P, P) distance matrix, P at least 2."""
    from scipy.cluster.hierarchy import leaves_list, linkage
    from scipy.spatial.distance import squareform

    links = linkage(squareform(distance, checks=False), "average", optimal_ordering=True)
    return Tree(np.asarray(links, np.float64), leaves_list(links).astype(np.int64))


def cut(tree: Tree, n_classes: int) -> NDArray[np.int64]:
    """(P,) class of each phone when the tree is cut into exactly `n_classes`, numbered in the dendrogram's order.

    Raises
    ------
    InputError
        There are fewer than 2 classes, or more than phones.
    """
    n = len(tree.order)
    check_classes(n_classes, n)
    members: dict[int, list[int]] = {at: [at] for at in range(n)}
    for step, (first, second, *_) in enumerate(tree.links[: n - n_classes]):
        members[n + step] = members.pop(int(first)) + members.pop(int(second))
    cluster_of = {phone: cluster for cluster, phones in members.items() for phone in phones}
    numbers: dict[int, int] = {}
    for phone in tree.order:
        numbers.setdefault(cluster_of[int(phone)], len(numbers))
    return np.array([numbers[cluster_of[phone]] for phone in range(n)], np.int64)


def check_classes(n_classes: int, n_phones: int) -> None:
    """Refuse a number of classes that the phones cannot have; errors as `cut`."""
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
    """
    if distance.shape != (len(labels), len(labels)) or len(np.unique(labels)) < 2:
        raise InputError(
            f"a silhouette needs two classes and a square matrix; got {len(np.unique(labels))} and {distance.shape}"
        )
    member = labels[:, None] == np.unique(labels)[None, :]  # (P, K)
    sizes = member.sum(axis=0)
    sums = distance @ member
    own_size = (member * sizes).sum(axis=1)
    a = np.where(member, sums, 0.0).sum(axis=1) / np.maximum(own_size - 1, 1)
    b = np.where(member, np.inf, sums / sizes).min(axis=1)
    widest = np.maximum(a, b)
    return np.where((own_size > 1) & (widest > 0), (b - a) / np.where(widest > 0, widest, 1.0), 0.0)


def viseme_classes(distance: NDArray[np.floating], tree: Tree, n_classes: int) -> VisemeClasses:
    """The classes of a cut and their silhouettes; errors as `cut`."""
    labels = cut(tree, n_classes)
    return VisemeClasses(labels, silhouettes(distance, labels))


def best_classes(candidates: tuple[VisemeClasses, ...]) -> VisemeClasses:
    """The classes with the highest mean silhouette; the fewest of equals."""
    return max(candidates, key=lambda classes: (classes.silhouette, -classes.n_classes))
