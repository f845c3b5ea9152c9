"""A text that arrives in parts, as a language model writes it, cut into sentences as soon as they are complete."""

import re

from lexicon.chunks import split_chunks
from lexicon.errors import InputError
from lexicon.inputs import LARGEST_TEXT_BYTES
from lexicon.sentences import MAX_SENTENCE_CHARACTERS, n_letters

_MAY_END = re.compile(r"[.!?…。！？｡।॥؟۔\n]|.{300}", re.DOTALL)
_OPEN_MARK = re.compile(r"\[[^\]\[]{0,200}$|<[^<>]{0,1000}$")  # a mark or tag that is not yet complete


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
        self._text += part
        if len(self._text) > LARGEST_TEXT_BYTES:
            raise InputError("the text is too long; end it, or send sentences")
        if not _MAY_END.search(self._text) or _OPEN_MARK.search(self._text):
            return []
        chunks = list(split_chunks(self._text, MAX_SENTENCE_CHARACTERS, self._language))
        complete = chunks[:-1]
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
