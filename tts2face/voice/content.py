"""Pronunciation of what a voice is given: text, or words some of which have phones."""

from collections.abc import Iterator, Sequence
from types import MappingProxyType

from lexicon.dictionary import Dictionary
from lexicon.given_pronunciations import TextWord, pronounce_words
from lexicon.ipa import Segment
from lexicon.phones import PHONES
from lexicon.pronounce import Word, pronounce
from tts2face.voice.engine import PronunciationMap, SpeechInput

SENTENCE_MARKS = frozenset(".!?")


def pronounce_content(content: SpeechInput, language: str, own_words: PronunciationMap) -> tuple[Word, ...]:
    """Words with phones, stress and punctuation, as `tts2face phones` prints them.

    Raises
    ------
    InputError
        The content has no word, or characters that the language does not read.
    BackendError
        A word needs espeak-ng, which is not installed.
    """
    own = Dictionary(MappingProxyType(dict(own_words)))
    if isinstance(content, str):
        return pronounce(content, language, own).words
    return pronounce_words([TextWord(word.text, word.segments, word.after) for word in content], language, own)


def word_segments(word: Word) -> tuple[Segment, ...]:
    """Phones of a word with their stress."""
    return tuple(
        Segment(phone, stress, is_syllabic=PHONES[phone].is_vowel)
        for phone, stress in zip(word.phones, word.stress, strict=True)
    )


def split_spoken_sentences(words: Sequence[Word]) -> Iterator[Sequence[Word]]:
    """Words of each sentence: after a full stop, question or exclamation mark, unless a small letter follows."""
    first = 0
    for at, (word, following) in enumerate(zip(words, [*words[1:], None], strict=True), start=1):
        if following is None or (word.mark in SENTENCE_MARKS and not following.text[:1].islower()):
            yield words[first:at]
            first = at
