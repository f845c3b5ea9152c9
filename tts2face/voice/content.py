"""Pronunciation of what a voice is given: text, or words some of which have phones."""

from types import MappingProxyType

from lexicon.dictionary import Dictionary
from lexicon.given_pronunciations import TextWord, pronounce_words
from lexicon.ipa import Segment
from lexicon.phones import PHONES
from lexicon.pronounce import Word, pronounce
from tts2face.voice.engine import PronunciationMap, SpeechInput


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
