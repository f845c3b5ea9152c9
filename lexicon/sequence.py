"""Phones in time: labels on shared edges, which exclude gaps and overlaps."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lexicon.errors import InputError
from lexicon.values.fields import check_fields

SILENCE = "sil"  # label of segments without speech
DOUBTFUL = 0.5  # words below this confidence
MIN_PHONE_S = 0.005  # shorter phones and silences cannot be resolved


@dataclass(frozen=True, slots=True, eq=False)
class PhoneSequence:
    """N contiguous phones.

    Parameters
    ----------
    phones : N labels
        IPA symbols of the phone table (`lexicon.phones`), or `SILENCE`.
    edges : (N + 1,)
        Seconds, strictly increasing: phone i lies in [edges[i], edges[i + 1]).

    Raises
    ------
    InputError
        There is no phone, the number of edges is not N + 1, an edge is not finite, or they do not increase.
    """

    phones: tuple[str, ...]
    edges: NDArray[np.float64]

    def __init__(self, phones: Sequence[str], edges: ArrayLike) -> None:
        locked = np.array(edges, dtype=np.float64)
        if not phones:
            raise InputError("a phone sequence needs at least one phone; use SILENCE for a segment without speech")
        if locked.shape != (len(phones) + 1,):
            raise InputError(f"{len(phones)} phones need {len(phones) + 1} edges, not an array of shape {locked.shape}")
        if not np.isfinite(locked).all():
            raise InputError(f"phone edges must be finite seconds; edge {int(np.argmin(np.isfinite(locked)))} is not")
        steps = np.diff(locked)
        if (steps <= 0).any():
            at = int(np.argmax(steps <= 0))
            raise InputError(
                f"phone edges must increase; phone {at} ({phones[at]}) runs from {locked[at]} s to {locked[at + 1]} s"
            )
        locked.setflags(write=False)
        object.__setattr__(self, "phones", tuple(phones))
        object.__setattr__(self, "edges", locked)

    def __len__(self) -> int:
        """Count the phones, silences included."""
        return len(self.phones)

    @property
    def durations(self) -> NDArray[np.float64]:
        """(N,) seconds."""
        return np.diff(self.edges)

    @property
    def start(self) -> float:
        """Start of the first phone in seconds."""
        return float(self.edges[0])

    @property
    def end(self) -> float:
        """End of the last phone in seconds."""
        return float(self.edges[-1])

    def index_at(self, seconds: float) -> int:
        """Index of the phone at an instant; the first or last one outside the sequence."""
        at = int(np.searchsorted(self.edges, seconds, side="right")) - 1
        return min(max(at, 0), len(self.phones) - 1)


@dataclass(frozen=True, slots=True)
class WordSpan:
    """A written word, its half-open range of phones, ``[first, last)``, and the probability that it is said there."""

    text: str
    first: int
    last: int
    confidence: float = 1.0

    @property
    def is_doubtful(self) -> bool:
        """Whether the word is probably not said there."""
        return self.confidence < DOUBTFUL

    def shift(self, phones: int) -> "WordSpan":
        """The same word, later by a number of phones."""
        return replace(self, first=self.first + phones, last=self.last + phones)

    def __post_init__(self) -> None:
        """Refuse values of other types, and an empty or reversed range."""
        check_fields(self)
        if not 0 <= self.first < self.last:
            raise InputError(f"word {self.text!r} needs a nonempty range of phones, not [{self.first}, {self.last})")


def concatenate_phones(
    parts: Sequence[PhoneSequence], words: Sequence[Sequence[WordSpan]]
) -> tuple[PhoneSequence, tuple[WordSpan, ...]]:
    """Concatenate sequences and their words; adjacent silences are merged.

    Raises
    ------
    InputError
        A sequence does not begin at 0 s.
    """
    phones: list[str] = []
    edges: list[float] = [0.0]
    spans: list[WordSpan] = []
    for part, part_words in zip(parts, words, strict=True):
        if part.start != 0.0:
            raise InputError(
                f"concatenated sequences must begin at 0 s, but one begins at {part.start} s; shift it first"
            )
        offset = edges[-1]
        # two silences side by side are one pause for the networks of the lips
        if phones and phones[-1] == SILENCE == part.phones[0]:
            phones.pop()
            edges.pop()
        spans += [word.shift(len(phones)) for word in part_words]
        phones += part.phones
        edges += [offset + float(end) for end in part.edges[1:]]
    return PhoneSequence(phones, edges), tuple(spans)


def enforce_increasing(edges: NDArray[np.float64]) -> NDArray[np.float64]:
    """Move (N + 1,) edges so that successive ones differ by at least `MIN_PHONE_S`; the first and last are fixed.

    Phones that are too short are lengthened at the cost of their neighbours. If the total duration is less than
    `MIN_PHONE_S` for each phone, all phones get equal durations.
    """
    n = len(edges) - 1
    first, last = float(edges[0]), float(edges[-1])
    if (last - first) <= n * MIN_PHONE_S:
        # too short for all phones: equal ones, so that the edges still increase
        return np.linspace(first, last, n + 1)
    room = np.arange(n + 1) * MIN_PHONE_S
    slack = np.clip(np.maximum.accumulate(edges - room), first, last - n * MIN_PHONE_S)
    moved: NDArray[np.float64] = slack + room
    moved[0], moved[-1] = first, last
    return moved
