"""Class of a word that may be several: noun, verb or modifier, by the words and tags around it.

A multinomial logistic regression, whose weights are in ``word_class.tsv``: a row a feature, with its weight for each
class, from example sentences of WordNet (`corpus_tools.shipped.training.word_class`). It sees two words on each side
and their tags, and whether the clause has another finite verb, but not the word itself, so that it judges words of
which it has no example.
"""

import functools
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from lexicon.pauses import MARKS
from lexicon.written_forms import read_table

CLASSES = ("NN", "VB", "JJ")  # nouns, verbs, adjectives and adverbs
CLAUSE_WORDS = 9  # on each side in which a finite verb is searched
_FINITE = frozenset({"VBZ", "VBP", "VBD", "MD"})
_OUTSIDE = "-"  # before the first and after the last word


def class_of_tag(tag: str) -> str:
    """Class of a tag of the Penn Treebank."""
    return "VB" if tag.startswith("VB") else "JJ" if tag.startswith(("JJ", "RB")) else "NN"


def features(lower: Sequence[str], tags: Sequence[str], at: int) -> tuple[str, ...]:
    """Names of the features of a word.

    Parameters
    ----------
    lower, tags
        Words and marks of the sentence in lower case, and their tags; the sentence ends with a mark.
    at
        Index of the word.
    """

    def word(place: int) -> str:
        return lower[place] if 0 <= place < len(lower) else _OUTSIDE

    def tag(place: int) -> str:
        return tags[place] if 0 <= place < len(tags) else _OUTSIDE

    own, first, second, third, fourth = (tag(at + step) for step in (0, -2, -1, 1, 2))
    verbs = _finite_verbs(lower, tags, at)
    return (
        "b", f"t={own}", f"t-2={first}", f"t-1={second}", f"t+1={third}", f"t+2={fourth}",
        f"w-2={word(at - 2)}", f"w-1={word(at - 1)}", f"w+1={word(at + 1)}", f"w+2={word(at + 2)}",
        f"t-2-1={first},{second}", f"t-1+1={second},{third}", f"t+1+2={third},{fourth}", f"t-1,t={second},{own}",
        f"t,t+1={own},{third}", f"s={lower[at].endswith('s')}",
        f"v={verbs}", f"v,t-1={verbs},{second}", f"v,t+1={verbs},{third}",
    )  # fmt: skip


def _finite_verbs(lower: Sequence[str], tags: Sequence[str], at: int) -> str:
    """Whether a finite verb stands before and after a word, between marks: a clause has one."""
    found = ""
    for step in (-1, 1):
        place = at + step
        while 0 <= place < len(lower) and abs(place - at) <= CLAUSE_WORDS and lower[place] not in MARKS:
            if tags[place] in _FINITE:
                found += "<" if step < 0 else ">"
                break
            place += step
    return found


@functools.cache
def _weights() -> dict[str, tuple[float, ...]]:
    return {name: tuple(map(float, row)) for name, row in read_table("word_class.tsv").items()}


def class_probabilities(lower: Sequence[str], tags: Sequence[str], at: int) -> NDArray[np.float64]:
    """Probabilities of `CLASSES` for a word; arguments as of `features`."""
    known = [_weights()[name] for name in features(lower, tags, at) if name in _weights()]
    scores = np.exp(np.sum(known, axis=0) - np.max(np.sum(known, axis=0)))
    return np.asarray(scores / scores.sum())
