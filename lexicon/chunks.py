"""A long text in sentence-sized pieces, in bounded memory."""

import re
from collections.abc import Iterator

from lexicon.errors import InputError
from lexicon.stops import ends_sentence

# A sentence ends at ., !, ? or … (with closing quotes) before a space and no small letter, at an end mark of East Asian
# or Indic writing, or at a blank line.
_END = re.compile(r"""[.!?…]+["'”’)\]]*(?=\s+[^\sa-z])|[。！？｡।॥؟۔]+["'”’」』）]*|\n\s*\n""")
_CLAUSE = re.compile(r"[,;:—–、，；：،؛](?=\s)|[、，；：]")
_SEEN_BEFORE, _SEEN_BEHIND = 24, 40  # characters around a full stop by which an abbreviation is known


def split_chunks(text: str, limit: int, language: str = "en-us") -> Iterator[str]:
    """Sentences of a text, none longer than `limit` characters unless a single word is.

    A longer sentence is cut behind the last clause mark that fits, else at the last space, and where a text has neither
    (Chinese, Japanese) behind `limit` characters. Nothing but space is lost. Abbreviations are those of the language
    (`lexicon.stops`).

    Raises
    ------
    InputError
        `limit` is below 1.
    """
    if limit < 1:
        raise InputError(f"a piece of text needs at least 1 character, not {limit}")
    begin = 0
    for match in _END.finditer(text):
        if _is_abbreviated(text, begin, match, language):
            continue
        yield from _split_sentence(text[begin : match.end()], limit)
        begin = match.end()
    yield from _split_sentence(text[begin:], limit)


def _is_abbreviated(text: str, begin: int, end: "re.Match[str]", language: str) -> bool:
    """The full stop of a possible sentence end belongs to an abbreviation."""
    if end.group().rstrip("\"'”’)]") != ".":
        return False
    before = text[max(begin, end.start() - _SEEN_BEFORE) : end.start()]
    return not ends_sentence(before, text[end.end() : end.end() + _SEEN_BEHIND].lstrip(), language)


def _split_sentence(sentence: str, limit: int) -> Iterator[str]:
    rest = " ".join(sentence.split())
    while len(rest) > limit:
        at = _cut_position(rest, limit)
        yield rest[:at].rstrip()
        rest = rest[at:].lstrip()
    if rest:
        yield rest


def _cut_position(text: str, limit: int) -> int:
    """Where a text that is too long is cut."""
    clauses = [match.end() for match in _CLAUSE.finditer(text, limit // 3, limit)]
    if clauses:
        return clauses[-1]
    space = text.rfind(" ", 1, limit + 1)
    if space > 0:
        return space
    word_end = text.find(" ", limit)
    is_word = text[limit - 1].isascii() and text[limit].isascii()
    return (word_end if word_end > 0 else len(text)) if is_word else limit
