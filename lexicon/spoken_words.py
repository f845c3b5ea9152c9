"""Words of a marked text as the voices speak them: sentence by sentence, phrase by phrase.

A text that arrives in parts, as a language model writes it, cut into sentences as soon as they are complete.
"""

import re
from collections.abc import Sequence
from dataclasses import replace

from lexicon.chunks import split_chunks
from lexicon.dictionary import Dictionary
from lexicon.errors import InputError, SilentTextError
from lexicon.foreign_words import make_readable
from lexicon.g2p import DEFAULT_LANGUAGE
from lexicon.given_phones import pronounce_words
from lexicon.languages import language_code
from lexicon.marked_text import MarkedText
from lexicon.normalize import split_tokens
from lexicon.pronounce import NOTHING, Pronunciation, Word, pronounce
from lexicon.sentence_length import MAX_SENTENCE_CHARACTERS, n_letters
from lexicon.sentences import Phrase, split_sentences
from lexicon.text_marks import parse_marks
from lexicon.values.files import LARGEST_TEXT_BYTES

_MAY_END = re.compile(r"[.!?…。！？｡।॥؟۔\n]|.{300}", re.DOTALL)
_OPEN_MARK = re.compile(r"\[[^\]\[]{0,200}\Z|<[^<>]{0,1000}\Z")  # a mark or tag that is not yet complete
_MAX_OPEN_CHARACTERS = 1001
_SPACES = re.compile(r"\s{2,}")


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


def reading_notes(text: str, language: str) -> tuple[str, ...]:
    """How words are spoken that the language of a text does not read; raises as `parse_marks`."""
    return () if text.isascii() else make_readable(parse_marks(text, language), language)[1]


def pronounce_phrase(phrase: Phrase, language: str, dictionary: Dictionary | None = None) -> tuple[Word, ...]:
    """Words of a phrase, with their written forms; raises as `lexicon.pronounce.pronounce`."""
    if phrase.words:
        return pronounce_words(phrase.words, language, dictionary)
    return _with_sources(pronounce(phrase.text, language, dictionary).words, phrase.source, language)


def _with_sources(words: Sequence[Word], written: str, language: str) -> tuple[Word, ...]:
    """Words with the written forms ($5) of which they are parts, where these are known."""
    if not language.startswith("en"):
        return tuple(words)
    sources = [
        token.source.strip(" .,;:!?") or piece
        for token in split_tokens(written)
        for piece in token.spoken.split()
        if any(letter.isalnum() for letter in piece)
    ]
    if len(sources) != len(words):
        return tuple(words)
    return tuple(replace(word, source=source) for word, source in zip(words, sources, strict=True))


class GrowingText:
    """Sentences of a text that arrives in parts.

    A sentence is complete when the next one has begun, since only that distinguishes its end from an abbreviation.

    Raises
    ------
    InputError
        More text waits than a request may have.
    """

    def __init__(self, language: str) -> None:
        self._language, self._text = language, ""

    def add(self, part: str) -> list[str]:
        """Append text; the sentences that are complete now."""
        kept = self._text.rstrip()
        self._text = kept + _SPACES.sub(_shortened, self._text[len(kept) :] + part)
        if len(self._text) > LARGEST_TEXT_BYTES:
            raise InputError("the text is too long; end it, or send sentences")
        if not _MAY_END.search(self._text):
            return []
        open_mark = _OPEN_MARK.search(self._text, max(len(self._text) - _MAX_OPEN_CHARACTERS, 0))
        end = open_mark.start() if open_mark else len(self._text)
        complete = list(split_chunks(self._text[:end], MAX_SENTENCE_CHARACTERS, self._language))[:-1]
        self._drop(sum(n_letters(chunk) for chunk in complete))
        return complete

    def flush(self) -> list[str]:
        """All sentences that are left."""
        text, self._text = self._text, ""
        return list(split_chunks(text, MAX_SENTENCE_CHARACTERS, self._language))

    def clear(self) -> None:
        """Forget the text that waits."""
        self._text = ""

    def _drop(self, letters: int) -> None:
        """Remove a number of letters from the beginning."""
        at = 0
        while letters:
            letters -= not self._text[at].isspace()
            at += 1
        self._text = self._text[at:]


def _shortened(spaces: "re.Match[str]") -> str:
    """White space with the same meaning in at most two characters, so that waiting text does not grow by it."""
    return "\n" * min(spaces.group().count("\n"), 2) or " "
