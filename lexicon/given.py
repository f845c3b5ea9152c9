"""Words whose phones the text itself gives, within the words as they are said."""

import re
import string
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

from lexicon.dictionary import Dictionary
from lexicon.errors import InputError
from lexicon.g2p import DEFAULT_LANGUAGE
from lexicon.ipa import Segment
from lexicon.marked_text import MarkedText, PhoneMark
from lexicon.pronounce import Pronunciation, Word, pronounce
from lexicon.said import as_said

_STEM = "qzx"  # of the words that stand for given ones while a text is normalised; no word of any language
_MARKS = frozenset(".,;:!?")


@dataclass(frozen=True, slots=True)
class GivenWord:
    """A word as it is said, the phones that are given for it (or none), and the punctuation behind it."""

    text: str
    segments: tuple[Segment, ...] = ()
    after: str = ""


def given_words(written: str, phones: Sequence[PhoneMark], language: str) -> tuple[GivenWord, ...]:
    """The words of a text as they are said, some with given phones.

    Parameters
    ----------
    phones
        Their places are characters of `written`; in order, none within another.

    Raises
    ------
    InputError
        A word with given phones belongs to a number, an address or the like, which is read as a whole.
    """
    names = _names(written, len(phones))
    stands_for = re.compile(rf"{_stem(written)}[a-z]+")
    said = as_said(_with_names(written, phones, names), language).split()
    marks = dict(zip(names, phones, strict=True))
    words: list[GivenWord] = []
    for word in said:
        match = stands_for.search(word.lower())
        mark = marks.pop(match.group(), None) if match else None
        if match is None or mark is None:
            words.append(GivenWord(word))
        else:
            after = "".join(character for character in word[match.end() :] if character in _MARKS)
            words.append(GivenWord(written[mark.at : mark.end], mark.segments, after))
    if marks:
        mark = next(iter(marks.values()))
        raise InputError(
            f"the phones of {written[mark.at : mark.end]!r} are given where it is part of a number or an address; "
            "put a space around it"
        )
    return tuple(words)


def pronounce_marked(
    text: MarkedText, language: str = DEFAULT_LANGUAGE, dictionary: Dictionary | None = None
) -> Pronunciation:
    """As `lexicon.pronounce.pronounce`, with the phones that the text gives.

    Raises
    ------
    InputError, BackendError
        As there.
    """
    phones = [mark for mark in text.marks if isinstance(mark, PhoneMark)]
    if not phones:
        return pronounce(text.text, language, dictionary)
    names = _names(text.text, len(phones))
    known = dict(dictionary.entries) if dictionary else {}
    known |= {name: mark.segments for name, mark in zip(names, phones, strict=True)}
    written = {name: text.text[mark.at : mark.end] for name, mark in zip(names, phones, strict=True)}
    found = pronounce(_with_names(text.text, phones, names), language, Dictionary(MappingProxyType(known)))
    return replace(found, text=text.text, words=tuple(_renamed(word, written) for word in found.words))


def _renamed(word: Word, written: dict[str, str]) -> Word:
    name = written.get(word.text.lower())
    return word if name is None else replace(word, text=name, source=name)


def _stem(written: str) -> str:
    stem, lower = _STEM, written.lower()
    while stem in lower:
        stem += "qx"
    return stem


def _names(written: str, n: int) -> list[str]:
    """Words that do not occur in a text: letters only, so that every normalisation leaves them as they are."""
    stem, letters = _stem(written), string.ascii_lowercase
    return [
        stem + letters[k // 676 % 26] + letters[k // 26 % 26] + letters[k % 26] + "q" * (k // 17576) for k in range(n)
    ]


def _with_names(written: str, phones: Sequence[PhoneMark], names: Sequence[str]) -> str:
    return "".join(_pieces(written, phones, names))


def _pieces(written: str, phones: Sequence[PhoneMark], names: Sequence[str]) -> Iterator[str]:
    behind = 0
    for mark, name in zip(phones, names, strict=True):
        before = written[behind : mark.at]
        shown = name.capitalize() if written[mark.at : mark.at + 1].isupper() else name
        yield before + " " * before[-1:].isalnum() + shown + " " * written[mark.end : mark.end + 1].isalnum()
        behind = mark.end
    yield written[behind:]
