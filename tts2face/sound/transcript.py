"""Alignment of a transcript with a recording of any length."""

from collections.abc import Iterator, Sequence
from itertools import count

import numpy as np

from lexicon.dictionary import Dictionary, cmudict_lookup
from lexicon.errors import DataError
from lexicon.foreign_words import make_readable
from lexicon.function_words import fitting_forms, weak_forms
from lexicon.marked_text import MarkedText
from lexicon.normalize import spoken_forms
from lexicon.pronounce import Word, pronounce
from lexicon.sequence import PhoneSequence, WordSpan
from lexicon.sources import written_groups
from tts2face.sound.alignment import Aligner, TextMismatch, join_alignments, unwritten_part
from tts2face.sound.pauses import SILENCE_DB, cut_at_pauses, cut_sound
from tts2face.sound.word_assignment import assign_words
from tts2face.sound.word_lattice import PronouncedWords, Pronunciations
from tts2face.types import Progress, Waveform, ignore_progress

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
    found: list[tuple[str, Pronunciations]] = []
    for part, spoken in _parts(text, language):
        words = pronounce(part, spoken, own).words
        if spoken.startswith("en"):
            found += fitting_forms([(word.text, _pronunciations(word, own)) for word in words])
            continue
        groups = written_groups([word.text for word in words], spoken_forms(part, spoken))
        found += ((text, (tuple(phone for k in at for phone in words[k].phones),)) for text, at in groups)
    return tuple(found)


def _parts(text: str, language: str) -> Iterator[tuple[str, str]]:
    """Parts of a text with their languages: the whole, or what has words where some are of other languages."""
    readable, _ = make_readable(MarkedText(text), language)
    ends = [*(run.start for run in readable.runs[1:]), len(readable.text)]
    for run, end in zip(readable.runs, ends, strict=True):
        part = readable.text[run.start : end]
        if len(ends) == 1 or any(letter.isalnum() for letter in part):
            yield part, run.language or language


def _pronunciations(word: Word, own: Dictionary | None) -> Pronunciations:
    # what the user's dictionary says is the only pronunciation
    if own is not None and own.lookup(word.text) is not None:
        return (word.phones,)
    alternatives = [word.phones]
    # CMUdict numbers further pronunciations: read, read(2), read(3)
    for number in count(1):
        found = cmudict_lookup(word.text if number == 1 else f"{word.text}({number})")
        if found is None:
            break
        alternatives.append(tuple(segment.phone for segment in found))
    return tuple(dict.fromkeys([*alternatives, *weak_forms(word.text)]))


def align_recording(
    sound: Waveform, words: PronouncedWords, on_progress: Progress = ignore_progress
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
    n_parts = len(parts)
    heard = []
    for at, part in enumerate(parts, start=1):
        heard.append(aligner.hear(part))
        # each part is heard first and aligned later: two steps of progress
        on_progress(at, 2 * n_parts)
    recognised = [
        [] if is_silent else [phone for word in sentence.words() for phone in word]
        for sentence, is_silent in zip(heard, _silent_parts(sound, parts), strict=True)
    ]
    if not any(recognised):
        raise DataError("the recording contains no speech; give another recording")
    places = assign_words([alternatives[0] for _, alternatives in words], recognised)
    aligned = []
    for at, part in enumerate(parts):
        said = [word for word, place in zip(words, places, strict=True) if place == at]
        aligned.append(
            aligner.align(heard[at], said, may_lack=True) if said else unwritten_part(part, len(recognised[at]))
        )
        on_progress(n_parts + at + 1, 2 * n_parts)
    joined = join_alignments(aligned)
    joined.check()
    return joined.phones, joined.words, joined.mismatches


def _silent_parts(sound: Waveform, parts: Sequence[Waveform]) -> list[bool]:
    """Whether each part of a sound is silent beside the whole; in zeros alone the recogniser hears a vowel."""
    least = float(np.abs(sound.samples).max(initial=0.0)) * 10.0 ** (-SILENCE_DB / 20.0)
    return [float(np.abs(part.samples).max(initial=0.0)) <= least for part in parts]


def recognise_phones(sound: Waveform, on_progress: Progress = ignore_progress) -> PhoneSequence:
    """Phones that are heard in a sound of any length, from 0 s to its end; `on_progress` is called after each part.

    Raises
    ------
    BackendError
        The phone recogniser does not run on this machine.
    """
    aligner, found = Aligner(), []
    spans = cut_at_pauses(sound, MAX_STRETCH_S)
    parts = [cut_sound(sound, span) for span in spans]
    for part, is_silent in zip(parts, _silent_parts(sound, parts), strict=True):
        try:
            found.append(unwritten_part(part, 0) if is_silent else aligner.align(part, None))
        except DataError:  # nobody speaks
            found.append(unwritten_part(part, 0))
        on_progress(len(found), len(spans))
    return join_alignments(found).phones
