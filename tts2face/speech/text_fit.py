"""Detection of words that a recording does not contain, by the log likelihoods of their forced alignment.

Forced alignment assigns times to all words of a text, whether the recording contains them or not.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tts2face.speech.forced_alignment import Alignment

LEAST_CONFIDENCE = (
    -6500.0
)  # log likelihood per second of a whole utterance; docs/decisions/013-transcript-confidence.md
CONTEXT_S = 1.5  # context on either side of a span that is aligned a second time
WINDOW_S = 1.0  # speech that is scored together, two to four words; scores of single words scatter 1.5 times as much
# Log likelihood per second in the window; measured in docs/decisions/056-text-mismatch.md.
LEAST_LOCAL_CONFIDENCE = -7000.0
LEAST_FOREIGN_CONFIDENCE = -9000.0  # the acoustic model is English: correct texts of other languages reach -8200
LONGEST_GAP_S = 1.0  # spans with a smaller gap are merged


@dataclass(frozen=True, slots=True)
class TextMismatch:
    """Words that a recording probably does not contain, and the times in seconds to which they were aligned."""

    begin: float
    end: float
    words: tuple[str, ...]
    confidence: float

    @property
    def sentence(self) -> str:
        """Warning for the user, one line."""
        shown = " ".join(self.words if len(self.words) <= 8 else (*self.words[:4], "...", *self.words[-3:]))
        return (
            f"the text does not fit the recording from {self.begin:.1f} to {self.end:.1f} s ({shown}); check the words"
        )

    def shift(self, seconds: float) -> "TextMismatch":
        """The same mismatch, later by `seconds`."""
        return replace(self, begin=self.begin + seconds, end=self.end + seconds)


def find_misfits(alignment: Alignment, *, is_english: bool) -> list[tuple[int, int]]:
    """Half-open ranges of words whose log likelihood lies below that of correct texts."""
    least = LEAST_LOCAL_CONFIDENCE if is_english else LEAST_FOREIGN_CONFIDENCE
    edges, words, sums = alignment.phones.edges, alignment.words, _sums(alignment)
    misfits: list[tuple[int, int]] = []
    for first, last in _windows(sums):
        seconds, score = sums[first:last].sum(axis=0)
        if score / seconds >= least:
            continue
        if misfits and edges[words[first].first] - edges[words[misfits[-1][1] - 1].last] < LONGEST_GAP_S:
            misfits[-1] = (misfits[-1][0], max(last, misfits[-1][1]))
        else:
            misfits.append((first, last))
    fits = [bool(score / seconds >= least) for seconds, score in sums]
    return [_trim_range(fits, *misfit) for misfit in misfits]


def _trim_range(fits: Sequence[bool], first: int, last: int) -> tuple[int, int]:
    """Remove words at the ends of a range that fit on their own, since windows reach beyond the wrong words."""
    while last - first > 1 and fits[first]:
        first += 1
    while last - first > 1 and fits[last - 1]:
        last -= 1
    return first, last


def mismatch_of(alignment: Alignment, first: int, last: int) -> TextMismatch:
    """Mismatch of a range of an alignment's words; times are those of the alignment."""
    edges, words, sums = alignment.phones.edges, alignment.words[first:last], _sums(alignment)[first:last]
    begin, end = float(edges[words[0].first]), float(edges[words[-1].last])
    return TextMismatch(begin, end, tuple(word.text for word in words), float(sums[:, 1].sum() / sums[:, 0].sum()))


def extend_range(alignment: Alignment, first: int, last: int) -> tuple[int, int, float, float]:
    """Extend a range of words by all words within `CONTEXT_S`; returns first, last, start and end in seconds."""
    edges, words = alignment.phones.edges, alignment.words
    begin, end = edges[words[first].first] - CONTEXT_S, edges[words[last - 1].last] + CONTEXT_S
    while first > 0 and edges[words[first - 1].first] >= begin:
        first -= 1
    while last < len(words) and edges[words[last].last] <= end:
        last += 1
    before = edges[words[first - 1].last] if first > 0 else alignment.phones.start
    behind = edges[words[last].first] if last < len(words) else alignment.phones.end
    return first, last, float(edges[words[first].first] + before) / 2, float(edges[words[last - 1].last] + behind) / 2


def _sums(alignment: Alignment) -> NDArray[np.float64]:
    """(W, 2) seconds and log likelihood of each word."""
    lengths, scores = np.diff(alignment.phones.edges), alignment.scores
    sums = [[lengths[word.first : word.last].sum(), scores[word.first : word.last].sum()] for word in alignment.words]
    return np.array(sums).reshape(-1, 2)


def _windows(sums: NDArray[np.float64]) -> list[tuple[int, int]]:
    """For each word the range of words around it that lasts `WINDOW_S`, or all words; grows at the nearer side."""
    ends = np.concatenate([[0.0], np.cumsum(sums[:, 0])])
    ranges = []
    for at in range(len(sums)):
        first, last = at, at + 1
        while ends[last] - ends[first] < WINDOW_S and last - first < len(sums):
            is_before_nearer = ends[at] - ends[first] <= ends[last] - ends[at + 1]
            if last == len(sums) or (first > 0 and is_before_nearer):
                first -= 1
            else:
                last += 1
        ranges.append((first, last))
    return ranges
