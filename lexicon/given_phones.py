"""Words with phones given in the text (``<phoneme>``), or with a tone, within the normalised text."""

import re
import string
from bisect import bisect_right
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import accumulate
from types import MappingProxyType

from lexicon.dictionary import Dictionary
from lexicon.errors import InputError
from lexicon.ipa import IpaPhone
from lexicon.marked_text import PhoneMark
from lexicon.normalize import spoken_form
from lexicon.pauses import MARKS
from lexicon.pronounce import Word, pronounce
from lexicon.tones import EVEN, Tone
from lexicon.written_words import spaced_words

_STEM = "qzx"  # of the placeholders of given words during normalisation; not a word of any language


@dataclass(frozen=True, slots=True)
class TextWord:
    """A normalised word, the phones given for it (or none), the punctuation after it, and how it is said."""

    text: str
    segments: tuple[IpaPhone, ...] = ()
    after: str = ""
    tone: Tone = EVEN


@dataclass(frozen=True, slots=True)
class ToneSpan:
    """How a half-open range of characters is said."""

    start: int
    end: int
    tone: Tone


def phrase_words(
    written: str, phones: Sequence[PhoneMark], spans: Sequence[ToneSpan], language: str
) -> tuple[TextWord, ...]:
    """The normalised words of a text, some with given phones or a tone; arguments as of `words_with_given_phones`.

    A span has the words that its beginning does not have: the text up to each end is normalised by itself, so that any
    reading of numbers is followed, and words that its continuation changes belong to what follows.
    """
    words = words_with_given_phones(written, phones, language)
    keys = [_letters(word.text) for word in words]
    toned = [*words]
    for span in spans:
        first, last = (
            _n_alike(
                keys, words_with_given_phones(written[:end], [mark for mark in phones if mark.end <= end], language)
            )
            for end in (span.start, span.end)
        )
        # of a part of a word the whole, but not of a sentence without spaces
        if last <= first < len(words) and 2 * len(_letters(written[span.start : span.end])) >= len(keys[first]):
            last = first + 1
        toned[first:last] = (replace(word, tone=span.tone) for word in toned[first:last])
    return tuple(toned)


def _n_alike(keys: Sequence[str], beginning: Sequence[TextWord]) -> int:
    """Number of words with which two texts begin alike."""
    pairs = zip(keys, (_letters(word.text) for word in beginning), strict=False)
    return next((at for at, (key, other) in enumerate(pairs) if key != other), min(len(keys), len(beginning)))


def _letters(text: str) -> str:
    """Letters and digits, in small ones, by which a word is the same with and without punctuation."""
    return "".join(filter(str.isalnum, text.casefold()))


def words_with_given_phones(written: str, phones: Sequence[PhoneMark], language: str) -> tuple[TextWord, ...]:
    """The normalised words of a text, some with given phones.

    Parameters
    ----------
    phones
        Their places are characters of `written`; in order, none within another.
    """
    if not phones:
        return tuple(TextWord(word) for word in spaced_words(spoken_form(written, language), language))
    names = _placeholders(written, len(phones))
    placeholder = re.compile(rf"{_placeholder_stem(written)}[a-z]+")
    normalised = spoken_form("".join(_pieces_of_phones(written, phones, names)), language)
    spoken = spaced_words(normalised, language)
    marks = dict(zip(names, phones, strict=True))
    words: list[TextWord] = []
    for word in spoken:
        match = placeholder.search(word.lower())
        mark = marks.pop(match.group(), None) if match else None
        if match is None or mark is None:
            words.append(TextWord(word))
        else:
            after = "".join(character for character in word[match.end() :] if character in MARKS)
            words.append(TextWord(written[mark.at : mark.end], mark.segments, after))
    if marks:
        mark = next(iter(marks.values()))
        raise InputError(
            f"the phones of {written[mark.at : mark.end]!r} are given, but it is part of a number or an address; "
            "put spaces around it"
        )
    return tuple(words)


def pronounce_words(words: Sequence[TextWord], language: str, dictionary: Dictionary | None = None) -> tuple[Word, ...]:
    """Pronounced words of a text, of which some have given phones.

    Raises
    ------
    InputError, BackendError
        As `lexicon.pronounce.pronounce`.
    """
    written = " ".join(word.text for word in words)
    given = [word for word in words if word.segments]
    names = iter(_placeholders(written, len(given)))
    by_name = {next(names): word for word in given}
    named = iter(by_name)
    pieces = [_as_capitalised(next(named), word.text) if word.segments else word.text for word in words]
    text = " ".join(piece + word.after for piece, word in zip(pieces, words, strict=True))
    known = dict(dictionary.entries) if dictionary else {}
    known |= {name: word.segments for name, word in by_name.items()}
    spoken = pronounce(text, language, Dictionary(MappingProxyType(known))).words
    if any(word.tone != EVEN for word in words):
        spoken = _with_tones(spoken, pieces, [word.tone for word in words])
    return tuple(_restore_spelling(word, {name: given.text for name, given in by_name.items()}) for word in spoken)


def _with_tones(spoken: Sequence[Word], pieces: Sequence[str], tones: Sequence[Tone]) -> tuple[Word, ...]:
    """Spoken words with the tones of the pieces of text whose letters they have."""
    letters = [_letters(piece) for piece in pieces]
    whole, ends = "".join(letters), [*accumulate(map(len, letters))]
    at, toned = 0, list[Word]()
    for word in spoken:
        key = _letters(word.text)
        found = max(whole.find(key, at), at)
        toned.append(replace(word, tone=tones[min(bisect_right(ends, found), len(tones) - 1)]))
        at = found + len(key)
    return tuple(toned)


def _restore_spelling(word: Word, written: dict[str, str]) -> Word:
    name = written.get(word.text.lower())
    return word if name is None else replace(word, text=name, source=name)


def _as_capitalised(name: str, spelling: str) -> str:
    return name.capitalize() if spelling[:1].isupper() else name


def _placeholder_stem(written: str) -> str:
    stem, lower = _STEM, written.lower()
    while stem in lower:
        # until the text does not contain it
        stem += "qx"
    return stem


def _placeholders(written: str, n: int) -> list[str]:
    """Words that do not occur in a text; of letters only, so that normalisation does not change them."""
    stem, letters = _placeholder_stem(written), string.ascii_lowercase
    return [
        stem + letters[k // 676 % 26] + letters[k // 26 % 26] + letters[k % 26] + "q" * (k // 17576) for k in range(n)
    ]


def _pieces_of_phones(written: str, phones: Sequence[PhoneMark], names: Sequence[str]) -> Iterator[str]:
    at = 0
    for mark, name in zip(phones, names, strict=True):
        before = written[at : mark.at]
        placeholder = _as_capitalised(name, written[mark.at : mark.at + 1])
        yield before + " " * before[-1:].isalnum() + placeholder + " " * written[mark.end : mark.end + 1].isalnum()
        at = mark.end
    yield written[at:]
