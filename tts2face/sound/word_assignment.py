"""Assignment of the words of a long text to the parts of a long recording.

Recognised phones and phones of the text are matched by least edit distance (Wagner and Fischer 1974) within a band, so
that an hour of speech takes seconds and little memory.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import InputError
from tts2face.numeric.kernels import kernel

BAND = 1500  # largest offset in phones between text and sound: two minutes of speech
SUBSTITUTION_COST = 1.0
GAP_COST = 0.7  # of an inserted or deleted phone; two of them cost more than a substitution
# Steps back through the table of costs:
MATCHED = 0  # in both sequences
INSERTED = 1  # in the recognised one
DELETED = 2  # in the written one
Phones = Sequence[str]


def assign_words(words: Sequence[Phones], recognised: Sequence[Phones]) -> NDArray[np.int64]:
    """(W,) index of the part of the recording that contains each word, non-decreasing.

    Parameters
    ----------
    words
        Phones of each of W written words.
    recognised
        Phones recognised in each part of the recording.

    Raises
    ------
    InputError
        There is no word or no part.
    """
    if not words or not recognised:
        raise InputError("the assignment needs at least one word and one part of a recording")
    numbers: dict[str, int] = {}
    written = np.array([numbers.setdefault(phone, len(numbers)) for word in words for phone in word], np.int64)
    sounded = np.array([numbers.setdefault(phone, len(numbers)) for phones in recognised for phone in phones], np.int64)
    part_of_sounded = np.repeat(np.arange(len(recognised)), [len(phones) for phones in recognised])
    if not len(sounded) or not len(written):
        return np.zeros(len(words), np.int64)
    partner = np.zeros(len(written), np.int64)
    _match_phones(written, sounded, max(BAND, abs(len(written) - len(sounded)) + BAND // 4), partner)
    places = part_of_sounded[np.clip(partner, 0, len(sounded) - 1)]
    ends = np.cumsum([len(word) for word in words])
    found = [
        _most_frequent(places[max(end - len(word), 0) : end]) if len(word) else int(places[min(end, len(places) - 1)])
        for word, end in zip(words, ends, strict=True)
    ]
    return np.maximum.accumulate(np.array(found, np.int64))


def _most_frequent(places: NDArray[np.int64]) -> int:
    """The part that has most phones of a word, the first of several; never one between two that have them."""
    found, counts = np.unique(places, return_counts=True)
    return int(found[counts.argmax()])


@kernel
def _match_phones(
    written: NDArray[np.int64], sounded: NDArray[np.int64], band: int, partner: NDArray[np.int64]
) -> None:
    """Write the index (N,) of the recognised phone that is matched with each written one, or of the phone before it."""
    n = len(written)
    m = len(sounded)
    width = 2 * band + 1
    steps = np.full((n + 1, width), DELETED, np.uint8)
    before = np.full(width, np.inf, np.float32)
    for j in range(min(width - band, m + 1)):
        before[j + band] = j * GAP_COST
        steps[0, j + band] = INSERTED
    for i in range(1, n + 1):
        low, low_before = i * m // n - band, (i - 1) * m // n - band
        before = _cost_row(written[i - 1], sounded, before, (low, low_before), steps[i])
    _trace_back(steps, m, band, partner)


@kernel
def _cost_row(
    phone: int,
    sounded: NDArray[np.int64],
    before: NDArray[np.float32],
    lows: tuple[int, int],
    steps: NDArray[np.uint8],
) -> NDArray[np.float32]:
    """Costs in the band of one written phone from those of the previous one; writes the optimal steps."""
    low, low_before = lows
    width = len(before)
    row = np.full(width, np.inf, np.float32)
    for k in range(max(0, -low), min(width, len(sounded) + 1 - low)):
        j = low + k
        above = j - low_before
        if above < width:
            row[k] = before[above] + GAP_COST
        if j > 0 and 0 < above <= width:
            cost = before[above - 1] + (0.0 if phone == sounded[j - 1] else SUBSTITUTION_COST)
            if cost <= row[k]:
                row[k], steps[k] = cost, MATCHED
        if j > 0 and k > 0 and row[k - 1] + GAP_COST < row[k]:
            row[k], steps[k] = row[k - 1] + GAP_COST, INSERTED
    return row


@kernel
def _trace_back(steps: NDArray[np.uint8], m: int, band: int, partner: NDArray[np.int64]) -> None:
    n = len(steps) - 1
    i, j = n, m
    while i > 0:
        step = steps[i, j - (i * m // n - band)]
        if step == INSERTED:
            j -= 1
        else:
            partner[i - 1] = max(j - 1, 0)
            i -= 1
            j -= step == MATCHED
