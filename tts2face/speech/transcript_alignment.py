"""Alignment of a transcript with a recording of any length."""

from collections.abc import Sequence
from itertools import count

from lexicon.dictionary import Dictionary, cmudict_lookup
from lexicon.errors import DataError
from lexicon.pronounce import Word, pronounce
from lexicon.sequence import PhoneSequence, WordSpan, concatenate_phones
from tts2face.speech.forced_alignment import Aligner, Alignment
from tts2face.speech.pauses import cut_at_pauses, cut_sound
from tts2face.speech.text_fit import TextMismatch, extend_range, find_misfits, mismatch_of
from tts2face.types import Waveform

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
    from tts2face.speech.phone_recognition import PhoneRecogniser
    from tts2face.speech.transcript_placement import assign_words

    recogniser = PhoneRecogniser()
    recognised = [[phone for word in recogniser.words(part) for phone in word] for part in parts]
    if not any(recognised):
        raise DataError("the recording contains no speech; give another recording")
    places = assign_words([alternatives[0] for _, alternatives in words], recognised)
    return [tuple(word for word, place in zip(words, places, strict=True) if place == at) for at in range(len(parts))]
