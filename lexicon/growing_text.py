"""A text that arrives in parts, as a language model writes it, cut into sentences as soon as they are complete.

Sentences between the two ends of a mark or an element stay together.
"""

import re
from collections.abc import Sequence

from lexicon.chunks import split_chunks
from lexicon.errors import InputError
from lexicon.sentence_length import MAX_SENTENCE_CHARACTERS, n_letters
from lexicon.text_marks import is_ssml
from lexicon.values.files import LARGEST_TEXT_BYTES

_MAY_END = re.compile(r"[.!?…。！？｡।॥؟۔\n]|.{300}", re.DOTALL)
_OPEN_MARK = re.compile(r"\[[^\]\[]{0,200}\Z|<[^<>]{0,1000}\Z")  # a mark or tag that is not yet complete
# the longest tag of `_OPEN_MARK`, and its bracket
_MAX_OPEN_CHARACTERS = 1001
_SPACES = re.compile(r"\s{2,}")
_STYLE_END = re.compile(r"\[(?P<closing>/?)style\b[^\[\]]*\]")
_ELEMENT_END = re.compile(r"<(?P<closing>/?)[A-Za-z][^<>]*(?<!/)>|<[^<>]*\Z")
MAX_HELD_CHARACTERS = 10_000  # that wait for the end of a mark or an element, and are searched with each part


class GrowingText:
    """Sentences of a text that arrives in parts, with the markup of the request (`lexicon.text_marks.MARKUPS`).

    A sentence is complete when the next one has begun, since only that distinguishes its end from an abbreviation.

    Raises
    ------
    InputError
        More text waits than a request may have.
    """

    def __init__(self, language: str, markup: str = "auto") -> None:
        self._language, self._markup = language, markup
        self._text = ""
        self._is_held = False  # whether the first sentence waits for the end of a mark

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
        if self._is_held and self._is_open(self._text[:end]):
            return []
        # the last one may go on: the next part may bring small letters or an abbreviation
        return self._taken(list(split_chunks(self._text[:end], MAX_SENTENCE_CHARACTERS, self._language))[:-1])

    def flush(self) -> list[str]:
        """All sentences that are left."""
        sentences = self._taken(list(split_chunks(self._text, MAX_SENTENCE_CHARACTERS, self._language)))
        rest, self._text = self._text.strip(), ""
        return [*sentences, rest] if rest else sentences

    def clear(self) -> None:
        """Forget the text that waits."""
        self._text = ""

    def _taken(self, chunks: Sequence[str]) -> list[str]:
        """Remove sentences from the beginning, each with the blank line behind it; those in an open mark stay."""
        found: list[str] = []
        letters, n_held = 0, 0
        for chunk in chunks:
            letters, n_held = letters + n_letters(chunk), n_held + 1
            end = _after_letters(self._text, letters)
            if self._is_open(self._text[:end]):
                continue
            found.append(chunk if n_held == 1 else self._text[:end].strip())
            self._text = self._text[end:]
            found[-1] += "\n\n" if self._text[:2] == "\n\n" else ""
            letters = n_held = 0
        self._is_held = n_held > 0
        return found

    def _is_open(self, text: str) -> bool:
        """Whether a mark or an element of a text has begun and not ended."""
        if self._markup == "plain" or len(text) > MAX_HELD_CHARACTERS:
            return False
        ends = _ELEMENT_END if self._markup == "ssml" or is_ssml(text) else _STYLE_END
        return sum(-1 if match["closing"] else 1 for match in ends.finditer(text)) > 0


def _after_letters(text: str, letters: int) -> int:
    """Place after so many letters."""
    at = 0
    while letters:
        letters -= not text[at].isspace()
        at += 1
    return at


def _shortened(spaces: "re.Match[str]") -> str:
    """White space with the same meaning in at most two characters, so that waiting text does not grow by it."""
    return "\n" * min(spaces.group().count("\n"), 2) or " "
