"""A text that arrives in parts, as a language model writes it, cut into sentences as soon as they are complete."""

import re

from lexicon.chunks import split_chunks
from lexicon.errors import InputError
from lexicon.sentence_length import MAX_SENTENCE_CHARACTERS, n_letters
from lexicon.values.files import LARGEST_TEXT_BYTES

_MAY_END = re.compile(r"[.!?…。！？｡।॥؟۔\n]|.{300}", re.DOTALL)
_OPEN_MARK = re.compile(r"\[[^\]\[]{0,200}\Z|<[^<>]{0,1000}\Z")  # a mark or tag that is not yet complete
# the longest tag of `_OPEN_MARK`, and its bracket
_MAX_OPEN_CHARACTERS = 1001
_SPACES = re.compile(r"\s{2,}")


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
        # the last one may go on: the next part may bring small letters or an abbreviation
        complete = list(split_chunks(self._text[:end], MAX_SENTENCE_CHARACTERS, self._language))[:-1]
        return [chunk + self._drop(n_letters(chunk)) for chunk in complete]

    def flush(self) -> list[str]:
        """All sentences that are left."""
        text, self._text = self._text, ""
        return list(split_chunks(text, MAX_SENTENCE_CHARACTERS, self._language))

    def clear(self) -> None:
        """Forget the text that waits."""
        self._text = ""

    def _drop(self, letters: int) -> str:
        """Remove a number of letters from the beginning; the blank line behind them, if there is one."""
        at = 0
        while letters:
            letters -= not self._text[at].isspace()
            at += 1
        self._text = self._text[at:]
        return "\n\n" if self._text[:2] == "\n\n" else ""


def _shortened(spaces: "re.Match[str]") -> str:
    """White space with the same meaning in at most two characters, so that waiting text does not grow by it."""
    return "\n" * min(spaces.group().count("\n"), 2) or " "
