"""Alignment of a transcript with a recording of any length.

Assignment of the words of a long text to the parts of a long recording.

Recognised phones and phones of the text are matched by least edit distance (Wagner and Fischer 1974) within a band, so
that an hour of speech takes seconds and little memory.
"""

from collections.abc import Iterator, Sequence
from itertools import count

import numpy as np
from numpy.typing import NDArray

from lexicon.dictionary import Dictionary, cmudict_lookup
from lexicon.errors import DataError, InputError
from lexicon.foreign_words import make_readable
from lexicon.function_words import weak_forms
from lexicon.marked_text import MarkedText
from lexicon.pronounce import Word, pronounce
from lexicon.sequence import PhoneSequence, WordSpan
from tts2face.numeric.kernels import kernel
from tts2face.sound.alignment import Aligner, TextMismatch, join_alignments, unwritten_part
from tts2face.sound.pauses import cut_at_pauses, cut_sound
from tts2face.sound.word_lattice import PronouncedWords, Pronunciations
from tts2face.types import Progress, Waveform

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
    partner = np.zeros(len(written), np.int64)
    _match_phones(written, sounded, max(BAND, abs(len(written) - len(sounded)) + BAND // 4), partner)
    places = part_of_sounded[np.clip(partner, 0, len(sounded) - 1)]
    ends = np.cumsum([len(word) for word in words])
    found = [
        int(np.median(places[max(end - len(word), 0) : end])) if len(word) else int(places[min(end, len(places) - 1)])
        for word, end in zip(words, ends, strict=True)
    ]
    return np.maximum.accumulate(np.array(found, np.int64))


@kernel
def _match_phones(
    written: NDArray[np.int64], sounded: NDArray[np.int64], band: int, partner: NDArray[np.int64]
) -> None:
    """Write the index (N,) of the recognised phone that is matched with each written one, or of the phone before it."""
    n, m, width = len(written), len(sounded), 2 * band + 1
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


MAX_ALIGNED_S = 60.0  # time of the search grows with the square of the length
MAX_STRETCH_S = 20.0  # longest part into which longer recordings are divided


def pronounce_transcript(text: str, language: str, own: Dictionary | None = None) -> PronouncedWords:
    """Words of a text with their pronunciations; English words also with those of the dictionary and weak forms.

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
    return tuple(
        (word.text, _pronunciations(word, spoken, own))
        for part, spoken in _parts(text, language)
        for word in pronounce(part, spoken, own).words
    )


def _parts(text: str, language: str) -> Iterator[tuple[str, str]]:
    """Parts of a text with their languages: the whole, or what has words where some are of other languages."""
    readable, _ = make_readable(MarkedText(text), language)
    ends = [*(run.start for run in readable.runs[1:]), len(readable.text)]
    for run, end in zip(readable.runs, ends, strict=True):
        part = readable.text[run.start : end]
        if len(ends) == 1 or any(letter.isalnum() for letter in part):
            yield part, run.language or language


def _pronunciations(word: Word, language: str, own: Dictionary | None) -> Pronunciations:
    if not language.startswith("en") or (own is not None and own.lookup(word.text) is not None):
        return (word.phones,)
    alternatives = [word.phones]
    for number in count(1):
        found = cmudict_lookup(word.text if number == 1 else f"{word.text}({number})")
        if found is None:
            break
        alternatives.append(tuple(segment.phone for segment in found))
    return tuple(dict.fromkeys([*alternatives, *weak_forms(word.text)]))


def align_recording(
    sound: Waveform, words: PronouncedWords, on_progress: Progress | None = None
) -> tuple[PhoneSequence, tuple[WordSpan, ...], tuple[TextMismatch, ...]]:
    """Align words with a sound of any length.

    Parameters
    ----------
    on_progress
        Called after each part of a long sound.

    Returns
    -------
    phones
        Phones from 0 s to the end of the sound.
    words
        Spans of phones of the words that are said.
    mismatches
        Words that the sound probably does not contain, and speech that is not in the text.

    Raises
    ------
    DataError
        The sound does not contain these words.
    BackendError
        The phone recogniser does not run on this machine.
    """
    aligner = Aligner()
    if sound.duration <= MAX_ALIGNED_S:
        found = aligner.align(sound, words, may_lack=True)
        found.check()
        return found.phones, found.words, found.mismatches
    parts = [cut_sound(sound, span) for span in cut_at_pauses(sound, MAX_STRETCH_S)]
    tell, n_parts = on_progress or (lambda _done, _of: None), len(parts)
    heard = []
    for at, part in enumerate(parts, start=1):
        heard.append(aligner.hear(part))
        tell(at, 2 * n_parts)
    recognised = [[phone for word in one.words() for phone in word] for one in heard]
    if not any(recognised):
        raise DataError("the recording contains no speech; give another recording")
    places = assign_words([alternatives[0] for _, alternatives in words], recognised)
    aligned = []
    for at, part in enumerate(parts):
        said = [word for word, place in zip(words, places, strict=True) if place == at]
        aligned.append(
            aligner.align(heard[at], said, may_lack=True) if said else unwritten_part(part, len(recognised[at]))
        )
        tell(n_parts + at + 1, 2 * n_parts)
    joined = join_alignments(aligned)
    joined.check()
    return joined.phones, joined.words, joined.mismatches


def recognise_phones(sound: Waveform, on_progress: Progress | None = None) -> PhoneSequence:
    """Phones that are heard in a sound of any length, from 0 s to its end; `on_progress` is called after each part.

    Raises
    ------
    BackendError
        The phone recogniser does not run on this machine.
    """
    aligner, found = Aligner(), []
    spans = cut_at_pauses(sound, MAX_STRETCH_S)
    for span in spans:
        part = cut_sound(sound, span)
        try:
            found.append(aligner.align(part, None))
        except DataError:  # nobody speaks
            found.append(unwritten_part(part, 0))
        if on_progress:
            on_progress(len(found), len(spans))
    return join_alignments(found).phones
