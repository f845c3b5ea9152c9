"""Words of a text as they are written, in languages that espeak-ng reads: 3,5 and € and aujourd'hui are one each.

Where espeak-ng is given another spelling than the written one (kana of Japanese), each word has both.
"""

import functools
import re
import unicodedata
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise

from lexicon.japanese import as_espeak_reads, japanese_phrases, to_kana
from lexicon.mandarin import espeak_characters
from lexicon.pauses import MARK_OF_SIGN, PAUSES_S
from lexicon.sentence_ends import ends_sentence

_CONTEXT_BEFORE, _CONTEXT_AFTER = 24, 40  # characters by which `ends_sentence` decides
# digits in groups of three with spaces between are one number: 12 000 zł
_PIECE = re.compile(r"[^\s\w]*\d{1,3}(?: \d{3})+(?!\d)\S*|\S+")
# Chinese is written without spaces, and espeak-ng reads it character by character
_MANDARIN = "cmn"
_UNSPACED = frozenset({"cmn", "yue", "hak"})
_CHARACTER = r"[\u3400-\u9fff\uf900-\ufaff\U00020000-\U0003ffff]"
_SPOKEN_SIGNS = frozenset("%‰&@#§")  # punctuation of Unicode with a name that is spoken
_MARK_OF_SIGN = {**MARK_OF_SIGN, **dict.fromkeys("()（）", ",")}
_STRENGTH = " " + "".join(PAUSES_S)  # from none


@dataclass(frozen=True, slots=True)
class WrittenWord:
    """A word, what espeak-ng reads of it (with the signs around it), and the strongest mark after it (or none)."""

    text: str
    piece: str
    mark: str = ""


def is_unspaced(language: str) -> bool:
    """Whether a language is written without spaces, and each character is a word of its own here."""
    return language.partition("-")[0] in _UNSPACED


def espeak_text(text: str, language: str) -> str:
    """Text that espeak-ng is given for a text: Japanese in kana, Mandarin in characters of the reading that is wanted.

    Raises
    ------
    BackendError
        The text is Japanese with Chinese characters, and the library that reads them is not installed.
    """
    if language == "ja":
        return as_espeak_reads(to_kana(text))
    return "".join(espeak_characters(text)) if language == _MANDARIN else text


def spaced_words(text: str, language: str) -> list[str]:
    """A text as it is written, divided at its spaces, and in Japanese into accent phrases."""
    if language != "ja":
        return text.split()
    starts = [phrase.start for phrase in japanese_phrases(text)[1:]]
    pieces = (text[first:last] for first, last in pairwise([0, *starts, len(text)]))
    return ["".join(piece.split()) for piece in pieces if piece.strip()]


def written_words(text: str, language: str) -> tuple[WrittenWord, ...]:
    """Words of a text in order; signs that are spoken (€, %) are words, punctuation is none.

    Raises
    ------
    BackendError
        As `espeak_text`.
    """
    if language == "ja":
        return tuple(_japanese_words(text))
    found: list[WrittenWord] = []
    characters = espeak_characters(text) if language == _MANDARIN else text
    for start, piece in _pieces(text, language):
        first, last = _span_of_word(piece)
        if found and (mark := _mark(text, start, start + first, language)):  # the dash, French "?", a bracket
            strongest = max(found[-1].mark, mark, key=_STRENGTH.find)
            found[-1] = replace(found[-1], mark=strongest)
        if first < last:
            mark = _mark(text, start + last, start + len(piece), language)
            read = "".join(characters[start : start + len(piece)])
            found.append(WrittenWord(piece[first:last], read, mark))
    return tuple(found)


def _japanese_words(text: str) -> Iterator[WrittenWord]:
    """Accent phrases of a text."""
    phrases = japanese_phrases(text)
    for phrase, following in zip(phrases, [*phrases[1:], None], strict=False):
        end = len(text) if following is None else following.start
        written = text[phrase.start : phrase.end]
        first, last = _span_of_word(written)
        mark = _mark(text, phrase.start + last, end, "ja")
        yield WrittenWord(written[first:last] or written, as_espeak_reads(phrase.kana), mark)


@functools.cache
def _characters() -> re.Pattern[str]:
    """A Chinese character, or what stands between two; compiled at its first use, which takes 2 ms."""
    return re.compile(rf"{_CHARACTER}|(?:(?!{_CHARACTER}).)+")


def _pieces(text: str, language: str) -> Iterator[tuple[int, str]]:
    for piece in _PIECE.finditer(text):
        if is_unspaced(language):
            yield from ((piece.start() + part.start(), part[0]) for part in _characters().finditer(piece[0]))
        else:
            yield piece.start(), piece[0]


def _span_of_word(piece: str) -> tuple[int, int]:
    """Half-open range of a word within its punctuation; an empty one at the end where there is none."""
    kept = [at for at, sign in enumerate(piece) if not _is_punctuation(sign)]
    if not kept:
        return len(piece), len(piece)
    first = kept[0]
    is_number = piece[first].isdigit() and piece[first - 1 : first] in {"-", "–", "."}
    return first - is_number, kept[-1] + 1  # -5 and .5 begin with a sign of theirs


def _is_punctuation(sign: str) -> bool:
    return unicodedata.category(sign)[0] in "PZC" and sign not in _SPOKEN_SIGNS


def _mark(text: str, start: int, end: int, language: str) -> str:
    """Strongest mark among the signs of a range, without the full stop of an abbreviation (d. h.)."""
    marks = [_MARK_OF_SIGN[sign] for sign in text[start:end] if sign in _MARK_OF_SIGN]
    if marks == ["."] and text[start : start + 1] == ".":
        after = text[end : end + _CONTEXT_AFTER].lstrip()
        before = text[max(0, start - _CONTEXT_BEFORE) : start]
        if after and (after[0].islower() or not ends_sentence(before, after, language)):
            return ""
    return max(marks, key=_STRENGTH.find, default="")
