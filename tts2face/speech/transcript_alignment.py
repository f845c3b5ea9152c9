"""What a transcript says, word by word, and where in a recording each phone of it sounds."""

from collections.abc import Sequence
from itertools import count

from lexicon.dictionary import Dictionary, cmudict_lookup
from lexicon.errors import DataError
from lexicon.pronounce import Word, pronounce
from lexicon.sequence import PhoneSequence, WordSpan, concatenate_phones
from tts2face.speech.forced_alignment import Aligner, Alignment
from tts2face.speech.pauses import cut_at_pauses
from tts2face.speech.text_fit import TextMismatch, find_misfits, mismatch_of, surrounded
from tts2face.types import Waveform

Pronunciations = tuple[tuple[str, ...], ...]  # pronunciations of one word, each a row of phones
PronouncedTranscript = tuple[tuple[str, Pronunciations], ...]

MAX_ALIGNED_S = 60.0  # alignment takes memory with the square of the length: 234 MB
MAX_STRETCH_S = 20.0  # of the parts into which longer recordings are cut


def pronounce_transcript(text: str, language: str, own: Dictionary | None = None) -> PronouncedTranscript:
    """The words of a text with their pronunciations; English ones with all that the dictionary knows.

    Raises
    ------
    InputError
        The text holds no word, or the language cannot read it.
    BackendError
        A word needs espeak-ng, which is not installed.
    """
    said = pronounce(text, language, own).words
    return tuple((word.text, _pronunciations(word, language, own)) for word in said)


def _pronunciations(word: Word, language: str, own: Dictionary | None) -> Pronunciations:
    if not language.startswith("en") or (own is not None and own.lookup(word.text) is not None):
        return (word.phones,)
    ways = [word.phones]
    for number in count(2):
        found = cmudict_lookup(f"{word.text}({number})")
        if found is None:
            break
        ways.append(tuple(segment.phone for segment in found))
    return tuple(dict.fromkeys(ways))


def align_recording(
    sound: Waveform, words: PronouncedTranscript, *, is_english: bool = True
) -> tuple[PhoneSequence, tuple[WordSpan, ...], tuple[TextMismatch, ...]]:
    """Phones and words on the clock of a sound, from 0 s to its end, and where the words do not fit it.

    Raises
    ------
    DataError
        The sound does not hold these words.
    BackendError
        It is longer than a minute, and nothing on this machine recognises phones, by which the words are placed.
    """
    aligner = Aligner()
    if sound.duration <= MAX_ALIGNED_S:
        found = aligner.align(sound, words)
        return found.phones, found.words, _mismatches(aligner, sound, words, found, is_english=is_english)
    parts = [_cut_sound(sound, span) for span in cut_at_pauses(sound, MAX_STRETCH_S)]
    phones: list[PhoneSequence] = []
    spans: list[tuple[WordSpan, ...]] = []
    mismatches: list[TextMismatch] = []
    begin = 0.0
    for part, said in zip(parts, _words_by_part(parts, words), strict=True):
        if said:
            found = aligner.align(part, said)
            phones.append(found.phones)
            spans.append(found.words)
            fits = _mismatches(aligner, part, said, found, is_english=is_english)
            mismatches += [one.shifted(begin) for one in fits]
        else:
            phones.append(PhoneSequence(["sil"], [0.0, part.duration]))
            spans.append(())
        begin += part.duration
    return *concatenate_phones(phones, spans), tuple(mismatches)


def _mismatches(
    aligner: Aligner, sound: Waveform, words: PronouncedTranscript, found: Alignment, *, is_english: bool
) -> tuple[TextMismatch, ...]:
    """Spans that do not fit, each confirmed by aligning it again with what surrounds it.

    The acoustic model normalises by the mean of what it is given: pauses of a long recording lower all of its scores,
    those of a few seconds cut out of it less.
    """
    confirmed: list[TextMismatch] = []
    behind = 0.0  # where the last confirmed span ends
    for misfit in find_misfits(found, is_english=is_english):
        first, last, begin, end = surrounded(found, *misfit)
        if last - first == len(words):  # there is nothing else to compare with
            return (mismatch_of(found, *misfit),)
        try:
            again = aligner.align(_cut_sound(sound, (begin, end)), words[first:last])
        except DataError:  # not even found there
            here = [mismatch_of(found, *misfit)]
        else:
            misfits = find_misfits(again, is_english=is_english)
            here = [mismatch_of(again, *span).shifted(begin) for span in misfits]
        confirmed += [one for one in here if one.begin >= behind]
        behind = max([behind, *(one.end for one in here)])
    return tuple(confirmed)


def _words_by_part(parts: Sequence[Waveform], words: PronouncedTranscript) -> list[PronouncedTranscript]:
    """The words that are said in each part."""
    from tts2face.speech.phone_recognition import PhoneRecogniser
    from tts2face.speech.transcript_placement import assign_words

    recogniser = PhoneRecogniser()
    heard = [[phone for word in recogniser.words(part) for phone in word] for part in parts]
    if not any(heard):
        raise DataError("no speech is heard; give a recording of somebody who speaks")
    places = assign_words([ways[0] for _, ways in words], heard)
    return [tuple(word for word, place in zip(words, places, strict=True) if place == at) for at in range(len(parts))]


def _cut_sound(sound: Waveform, span: tuple[float, float]) -> Waveform:
    first, last = (round(second * sound.rate) for second in span)
    return Waveform(sound.samples[first:last], sound.rate)
