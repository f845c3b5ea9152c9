"""Phone tokens of a talker, sampled in time, and their similarity table.

Viseme classes by hierarchical clustering of phones, and their silhouettes.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import InputError, import_of_extra
from lexicon.phones import PHONES, look_up_phone
from lexicon.sequence import SILENCE
from tts2face.lips.similarity import phone_similarity, token_samples
from tts2face.lips.tokens import collect_tokens
from tts2face.models.talker import Talker

LEAST_PHONES = 4  # needed for two classes of two
LEAST_TOKENS = 10  # of a phone, in each half: means of fewer depend as much on their contexts as on the phone
NO_WORD = -1
PHONE_LABELS = ("both", "ipa", "arpabet")


@dataclass(frozen=True, slots=True, eq=False)
class SpokenTokens:
    """Motion of N phone tokens of a talker, including silence.

    Parameters
    ----------
    inventory : Q labels
        Silence is one of them.
    samples : (N, S, D)
        Speech parameters of each token at S instants, in the form of `phone_similarity`.
    phone, utterance, word : (N,)
        Index into `inventory`; of the talker's utterance; of the different words, `NO_WORD` outside them.
    spread : (D,)
        Standard deviation of each parameter over the recordings.
    """

    inventory: tuple[str, ...]
    samples: NDArray[np.float32]
    phone: NDArray[np.int32]
    utterance: NDArray[np.int32]
    word: NDArray[np.int64]
    spread: NDArray[np.float32]


@dataclass(frozen=True, slots=True, eq=False)
class SimilarityTable:
    """Similarity of P phones: `matrix` (P, P) in [0, 1], `counts` (P,) tokens, `silence` (P,) similarity to silence."""

    phones: tuple[str, ...]
    counts: NDArray[np.int64]
    matrix: NDArray[np.float64]
    silence: NDArray[np.float64]


def collect_spoken_tokens(talker: Talker, name: str) -> SpokenTokens:
    """Tokens of a talker."""
    tokens = collect_tokens(talker)
    n_speech = talker.model.n_speech
    # a mode that never moves must not divide by 0
    spread = np.maximum(talker.model.spread[:n_speech], 1e-6).astype(np.float32)
    counts = np.bincount(tokens.phone, minlength=len(tokens.inventory))
    sounding = [label for label in tokens.inventory if label != SILENCE]
    n_enough = sum(
        count >= 2 * LEAST_TOKENS for label, count in zip(tokens.inventory, counts, strict=True) if label != SILENCE
    )
    if n_enough < LEAST_PHONES or len(talker.utterances) < 2:
        raise InputError(
            f"the talker {name} has {len(talker.utterances)} utterances, {len(sounding)} phones and {n_enough} of them "
            f"{2 * LEAST_TOKENS} times or more; the analysis needs 2 utterances and {LEAST_PHONES} such phones: "
            "record more"
        )
    return SpokenTokens(
        tokens.inventory, token_samples(tokens), tokens.phone, tokens.utterance, _word_numbers(talker), spread
    )


def _word_numbers(talker: Talker) -> NDArray[np.int64]:
    """(N,) index of the word, by its text, to which each token belongs."""
    numbers: dict[str, int] = {}
    words = []
    for utterance in talker.utterances:
        indices = np.full(len(utterance.phones), NO_WORD, np.int64)
        for word in utterance.words:
            indices[word.first : word.last] = numbers.setdefault(word.text.lower(), len(numbers))
        words.append(indices)
    return np.concatenate(words)


def similarity_table(tokens: SpokenTokens, chosen: NDArray[np.bool_] | None = None) -> SimilarityTable:
    """Similarity of the sounding phones, in the phone table's order, from all tokens or the `chosen` (N,) ones.

    The figures are those that synthesis uses: silence is measured with the phones and then removed.
    """
    selected = np.ones(len(tokens.phone), bool) if chosen is None else chosen
    found = phone_similarity(tokens.samples[selected], tokens.phone[selected], tokens.inventory, tokens.spread)
    counts = np.bincount(tokens.phone[selected], minlength=len(tokens.inventory))
    place = {label: at for at, label in enumerate(PHONES)}
    sounding = [at for at, label in enumerate(tokens.inventory) if label != SILENCE]
    order = sorted(sounding, key=lambda at: place[look_up_phone(tokens.inventory[at]).symbol])
    silence = tokens.inventory.index(SILENCE)
    return SimilarityTable(
        tuple(tokens.inventory[at] for at in order),
        counts[order].astype(np.int64),
        found.matrix[np.ix_(order, order)],
        found.matrix[order, silence],
    )


def check_labels(labels: str) -> None:
    """Check a kind of label; `InputError` if it is not one of `PHONE_LABELS`."""
    if labels not in PHONE_LABELS:
        raise InputError(f"phones are labelled in {', '.join(PHONE_LABELS[1:])} or {PHONE_LABELS[0]}, not {labels!r}")


def phone_label(phone: str, labels: str) -> str:
    """A phone in IPA, in ARPABET, or in both: ``tʃ CH``; IPA where ARPABET has no name."""
    name = look_up_phone(phone).arpabet
    if not name or labels == "ipa":
        return phone
    return name if labels == "arpabet" else f"{phone} {name}"


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
    """(P,) class of each phone when the tree is cut into exactly `n_classes`, numbered in the dendrogram's order."""
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
    """
    n_classes = len(np.unique(labels))
    if distance.shape != (len(labels), len(labels)) or n_classes < 2:
        raise InputError(f"a silhouette needs two classes and a square matrix; got {n_classes} and {distance.shape}")
    if n_classes == len(labels):
        return np.zeros(len(labels))  # scikit-learn rejects classes of one item each
    with import_of_extra("silhouettes need scikit-learn; run: pip install 'tts2face[report]'"):
        from sklearn.metrics import silhouette_samples
    return np.asarray(silhouette_samples(distance, labels, metric="precomputed"), np.float64)


def viseme_classes(distance: NDArray[np.floating], tree: Tree, n_classes: int) -> VisemeClasses:
    """The classes of a cut and their silhouettes; errors as `cut_into_classes`."""
    labels = cut_into_classes(tree, n_classes)
    return VisemeClasses(labels, silhouettes(distance, labels))


def best_classes(candidates: tuple[VisemeClasses, ...]) -> VisemeClasses:
    """The classes with the highest mean silhouette; among equals, the fewest."""
    return max(candidates, key=lambda classes: (classes.silhouette, -classes.n_classes))
