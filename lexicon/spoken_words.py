"""Words of a marked text as the voices speak them: sentence by sentence, phrase by phrase."""

from collections.abc import Sequence
from dataclasses import replace

from lexicon.dictionary import Dictionary
from lexicon.errors import SilentTextError
from lexicon.foreign_words import make_readable
from lexicon.g2p import DEFAULT_LANGUAGE
from lexicon.given_phones import pronounce_words
from lexicon.languages import language_code
from lexicon.marked_text import MarkedText
from lexicon.normalize import split_tokens, spoken_forms
from lexicon.pronounce import NOTHING, Pronunciation, Word, pronounce
from lexicon.sentences import Phrase, split_sentences
from lexicon.sources import english_sources, sources_of


def pronounce_marked(
    text: MarkedText, language: str = DEFAULT_LANGUAGE, dictionary: Dictionary | None = None
) -> Pronunciation:
    """Words of a text with the phones that a voice of its language speaks.

    Raises
    ------
    InputError, BackendError
        As `lexicon.pronounce.pronounce`.
    """
    language = language_code(language)
    words: list[Word] = []
    text, _ = make_readable(text, language)
    for sentence in split_sentences(text, language, dictionary.entries if dictionary else None):
        for phrase in sentence.utterances:
            words += pronounce_phrase(phrase, phrase.language or language, dictionary)
    if not words:
        raise SilentTextError(NOTHING)
    return Pronunciation(text.text, language, tuple(words))


def pronounce_phrase(phrase: Phrase, language: str, dictionary: Dictionary | None = None) -> tuple[Word, ...]:
    """Words of a phrase, with their written forms; raises as `lexicon.pronounce.pronounce`."""
    if phrase.words:
        return pronounce_words(phrase.words, language, dictionary)
    return _with_sources(pronounce(phrase.text, language, dictionary).words, phrase.source, language)


def _with_sources(words: Sequence[Word], written: str, language: str) -> tuple[Word, ...]:
    """Words with the written forms ($5) of which they are parts, where these are known."""
    said = [word.text for word in words]
    if language.startswith("en"):
        found = english_sources(said, split_tokens(written))
    else:
        found = sources_of(said, spoken_forms(written, language))
    pairs = zip(words, found or (), strict=False)
    return tuple(replace(word, source=source) for word, (_, source) in pairs) or tuple(words)
