"""Alignment of a transcript with a recording of any length.

Assignment of the words of a long text to the parts of a long recording.

Recognised phones and phones of the text are matched by least edit distance (Wagner and Fischer 1974) within a band, so
that an hour of speech takes seconds and little memory.

Detection of words that a recording does not contain, by the log likelihoods of their forced alignment.

Forced alignment assigns times to all words of a text, whether the recording contains them or not.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import count

import numpy as np
from numpy.typing import NDArray

from lexicon.dictionary import Dictionary, cmudict_lookup
from lexicon.errors import DataError, InputError
from lexicon.pronounce import Word, pronounce
from lexicon.sequence import PhoneSequence, WordSpan, concatenate_phones
from tts2face.numeric.kernels import kernel
from tts2face.sound.alignment import Aligner, Alignment
from tts2face.sound.pauses import cut_at_pauses, cut_sound
from tts2face.types import Waveform

BAND = 1500  # largest offset in phones between text and sound: two minutes of speech
SUBSTITUTION_COST = 1.0
GAP_COST = 0.7  # of an inserted or deleted phone; two of them cost more than a substitution
MATCHED, INSERTED, DELETED = 0, 1, 2  # steps back: in both sequences, in the recognised one, in the written one

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
    partner = _match_phones(written, sounded, max(BAND, abs(len(written) - len(sounded)) + BAND // 4))
    places = part_of_sounded[np.clip(partner, 0, len(sounded) - 1)]
    ends = np.cumsum([len(word) for word in words])
    found = [
        int(np.median(places[max(end - len(word), 0) : end])) if len(word) else int(places[min(end, len(places) - 1)])
        for word, end in zip(words, ends, strict=True)
    ]
    return np.maximum.accumulate(np.array(found, np.int64))


@kernel
def _match_phones(written: NDArray[np.int64], sounded: NDArray[np.int64], band: int) -> NDArray[np.int64]:
    """(N,) index of the recognised phone that is matched with each written one, or of the phone before it."""
    n, m, width = len(written), len(sounded), 2 * band + 1
    steps = np.full((n + 1, width), DELETED, np.uint8)
    before = np.full(width, np.inf, np.float32)
    for j in range(min(width - band, m + 1)):
        before[j + band] = j * GAP_COST
        steps[0, j + band] = INSERTED
    for i in range(1, n + 1):
        low, low_before = i * m // n - band, (i - 1) * m // n - band
        before = _cost_row(written[i - 1], sounded, before, (low, low_before), steps[i])
    partners: NDArray[np.int64] = _trace_back(steps, m, band)
    return partners


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
def _trace_back(steps: NDArray[np.uint8], m: int, band: int) -> NDArray[np.int64]:
    n = len(steps) - 1
    partner = np.zeros(n, np.int64)
    i, j = n, m
    while i > 0:
        step = steps[i, j - (i * m // n - band)]
        if step == INSERTED:
            j -= 1
        else:
            partner[i - 1] = max(j - 1, 0)
            i -= 1
            j -= step == MATCHED
    return partner


LEAST_CONFIDENCE = -6500.0  # log likelihood per second of a whole utterance; docs/decisions/056-text-mismatch.md
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


Pronunciations = tuple[tuple[str, ...], ...]  # alternative pronunciations of one word
PronouncedTranscript = tuple[tuple[str, Pronunciations], ...]

MAX_ALIGNED_S = 60.0  # memory of the alignment grows with the square of the length; 234 MB at this one
MAX_STRETCH_S = 20.0  # longest part into which longer recordings are divided


def pronounce_transcript(text: str, language: str, own: Dictionary | None = None) -> PronouncedTranscript:
    """Words of a text with their pronunciations; English words also with those of the dictionary (full forms, ...).

    Parameters
    ----------
    own
        A user's dictionary, which takes precedence.

    Raises
    ------
    InputError
        The text has no word, or characters that the language does not read.
    BackendError
        A word needs espeak-ng, which is not installed.
    """
    words = pronounce(text, language, own).words
    return tuple((word.text, _pronunciations(word, language, own)) for word in words)


def _pronunciations(word: Word, language: str, own: Dictionary | None) -> Pronunciations:
    if not language.startswith("en") or (own is not None and own.lookup(word.text) is not None):
        return (word.phones,)
    alternatives = [word.phones]
    for number in count(1):
        found = cmudict_lookup(word.text if number == 1 else f"{word.text}({number})")
        if found is None:
            break
        alternatives.append(tuple(segment.phone for segment in found))
    return tuple(dict.fromkeys(alternatives))


def align_recording(
    sound: Waveform, words: PronouncedTranscript, *, is_english: bool = True
) -> tuple[PhoneSequence, tuple[WordSpan, ...], tuple[TextMismatch, ...]]:
    """Align words with a sound of any length.

    Returns
    -------
    phones
        Phones from 0 s to the end of the sound.
    words
        One span of phones for each word.
    mismatches
        Words that the sound probably does not contain.

    Raises
    ------
    DataError
        The sound does not contain these words.
    BackendError
        The sound is longer than `MAX_ALIGNED_S` and the phone recogniser, which assigns words to its parts, is not
        installed.
    """
    aligner = Aligner()
    if sound.duration <= MAX_ALIGNED_S:
        found = aligner.align(sound, words)
        return found.phones, found.words, _mismatches(aligner, sound, words, found, is_english=is_english)
    parts = [cut_sound(sound, span) for span in cut_at_pauses(sound, MAX_STRETCH_S)]
    phones: list[PhoneSequence] = []
    spans: list[tuple[WordSpan, ...]] = []
    mismatches: list[TextMismatch] = []
    begin = 0.0
    for part, part_words in zip(parts, _words_by_part(parts, words), strict=True):
        if part_words:
            found = aligner.align(part, part_words)
            phones.append(found.phones)
            spans.append(found.words)
            part_mismatches = _mismatches(aligner, part, part_words, found, is_english=is_english)
            mismatches += [mismatch.shift(begin) for mismatch in part_mismatches]
        else:
            phones.append(PhoneSequence(["sil"], [0.0, part.duration]))
            spans.append(())
        begin += part.duration
    return *concatenate_phones(phones, spans), tuple(mismatches)


def _mismatches(
    aligner: Aligner, sound: Waveform, words: PronouncedTranscript, alignment: Alignment, *, is_english: bool
) -> tuple[TextMismatch, ...]:
    """Mismatches of an alignment, each confirmed by a second alignment of the span and its context.

    The acoustic model normalises by the mean of its input, so that pauses lower all scores of a long recording; they
    affect a short excerpt less.
    """
    confirmed: list[TextMismatch] = []
    last_end = 0.0  # end of the last confirmed span
    for misfit in find_misfits(alignment, is_english=is_english):
        first, last, begin, end = extend_range(alignment, *misfit)
        if last - first == len(words):  # the excerpt would be the whole recording
            return (mismatch_of(alignment, *misfit),)
        try:
            excerpt = aligner.align(cut_sound(sound, (begin, end)), words[first:last])
        except DataError:  # the excerpt does not contain the words
            mismatches = [mismatch_of(alignment, *misfit)]
        else:
            misfits = find_misfits(excerpt, is_english=is_english)
            mismatches = [mismatch_of(excerpt, *span).shift(begin) for span in misfits]
        confirmed += [mismatch for mismatch in mismatches if mismatch.begin >= last_end]
        last_end = max([last_end, *(mismatch.end for mismatch in mismatches)])
    return tuple(confirmed)


def _words_by_part(parts: Sequence[Waveform], words: PronouncedTranscript) -> list[PronouncedTranscript]:
    """Words of each part, assigned by phone recognition."""
    from tts2face.sound.listener import PhoneRecogniser

    recogniser = PhoneRecogniser()
    recognised = [[phone for word in recogniser.words(part) for phone in word] for part in parts]
    if not any(recognised):
        raise DataError("the recording contains no speech; give another recording")
    places = assign_words([alternatives[0] for _, alternatives in words], recognised)
    return [tuple(word for word, place in zip(words, places, strict=True) if place == at) for at in range(len(parts))]
