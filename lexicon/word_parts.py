"""English words of parts that are in dictionaries: endings (dockerized), beginnings (microplastics), compounds.

The tables ``word_endings.tsv`` and ``word_beginnings.tsv`` hold the parts and their phones.
"""

import functools
import re
from collections.abc import Callable, Iterator
from dataclasses import replace

from lexicon.dictionary import arpabet_segments, cmudict_lookup
from lexicon.ipa import IpaPhone
from lexicon.misaki import misaki_readings
from lexicon.written_forms import read_table

Segments = tuple[IpaPhone, ...]
Lookup = Callable[[str], Segments | None]
MIN_STEM = 3  # letters before an ending
MIN_REST = 4  # letters behind a beginning
MIN_PART = 4  # letters of half a compound
MIN_BEGINNING_OF_NAME = 4  # letters; in Revolut and Denali there is no re- or de-
MAX_PARTS = 3  # of endings and beginnings on one word
# after which -s is /s/ and -ed /t/; after sibilants -s is /ɪz/, after stops of the tongue -ed is /ɪd/
VOICELESS = frozenset({"p", "t", "k", "f", "θ", "s", "ʃ", "tʃ"})
SIBILANTS = frozenset({"s", "z", "ʃ", "ʒ", "tʃ", "dʒ"})
_DOUBLED = re.compile(r"([bdfglmnprtvz])\1$")
_CAMEL = re.compile(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])")


def add_s(base: Segments) -> Segments:
    """Phones of a word with the ending -s."""
    if base[-1].phone in SIBILANTS:
        return (*base, IpaPhone("ɪ", is_syllabic=True), IpaPhone("z"))
    return (*base, IpaPhone("s" if base[-1].phone in VOICELESS else "z"))


def add_ed(base: Segments) -> Segments:
    """Phones of a word with the ending -ed."""
    if base[-1].phone in {"t", "d"}:
        return (*base, IpaPhone("ɪ", is_syllabic=True), IpaPhone("d"))
    return (*base, IpaPhone("t" if base[-1].phone in VOICELESS else "d"))


@functools.cache
def _parts(table: str) -> tuple[tuple[str, Segments], ...]:
    """Parts with their phones, the longest first."""
    rows = sorted(read_table(table).items(), key=lambda row: -len(row[0]))
    return tuple((written, arpabet_segments(names)) for written, (names,) in rows)


def beginning(word: str) -> Segments | None:
    """Phones of a beginning that stands before a hyphen (re-, co-); None for another word."""
    return next((segments for written, segments in _parts("word_beginnings.tsv") if written == word), None)


def read_parts(word: str, look_up: Lookup, n_parts: int = MAX_PARTS) -> Segments | None:
    """Phones of a word from those of its parts; None if a part is in no dictionary.

    Parameters
    ----------
    look_up
        Phones of a word in the dictionaries.
    """
    if n_parts == 0 or not word.isalpha() or not word.isascii():
        return None
    humps = _CAMEL.findall(word)
    if len(humps) > 1 and all(len(hump) > 1 for hump in humps):
        parts = [look_up(hump) or read_parts(hump, look_up, n_parts - 1) for hump in humps]
        known = [part for part in parts if part]
        return _joined(known) if len(known) == len(humps) else None
    lower = word.lower()
    # of a name -s is rarely an ending
    is_name = word[:1].isupper()
    return (
        _with_beginning(lower, look_up, n_parts, MIN_BEGINNING_OF_NAME if is_name else 0)
        or (None if is_name else _with_inflection(lower, look_up, n_parts))
        or _with_ending(lower, look_up, n_parts)
        or _compound(lower)
    )


def _known(stem: str, look_up: Lookup, n_parts: int) -> Segments | None:
    return (look_up(stem) or read_parts(stem, look_up, n_parts - 1)) if len(stem) >= MIN_STEM else None


def _stems(rest: str) -> Iterator[str]:
    """Words that may stand before an ending with a vowel: token (-izer), cring(e), unbox, run(n), happ(y)."""
    yield rest
    yield f"{rest}e"
    if _DOUBLED.search(rest):
        yield rest[:-1]
    if rest.endswith("i"):
        yield f"{rest[:-1]}y"


def _with_inflection(word: str, look_up: Lookup, n_parts: int) -> Segments | None:
    endings: tuple[tuple[str, Callable[[Segments], Segments], bool], ...] = (
        ("s", add_s, False), ("es", add_s, True), ("ed", add_ed, True),
    )  # fmt: skip
    for ending, add, is_syllable in endings:
        if not word.endswith(ending) or word.endswith(("ss", "us", "is")):
            continue
        rest = word.removesuffix(ending)
        for stem in _stems(rest) if is_syllable else (rest,):
            base = _known(stem, look_up, n_parts)
            if base and (ending != "es" or stem[-1] == "y" or base[-1].phone in SIBILANTS):
                return add(base)
    return None


def _with_ending(word: str, look_up: Lookup, n_parts: int) -> Segments | None:
    for ending, segments in _parts("word_endings.tsv"):
        if not word.endswith(ending):
            continue
        rest = word.removesuffix(ending)
        if rest.endswith("qu"):  # quishing
            continue
        # hangr(y): hangrily, hangriness
        before_consonant = (rest, f"{rest[:-1]}y") if rest.endswith("i") else (rest,)
        for stem in _stems(rest) if segments[0].is_syllabic else before_consonant:
            base = _known(stem, look_up, n_parts)
            if base:
                is_joined = base[-1].phone == segments[0].phone and not base[-1].is_syllabic  # full + ly
                return (*base[:-1], *segments) if is_joined else (*base, *segments)
    return None


def _with_beginning(word: str, look_up: Lookup, n_parts: int, shortest: int) -> Segments | None:
    for beginning, segments in _parts("word_beginnings.tsv"):
        rest = word.removeprefix(beginning)
        if rest != word and len(rest) >= MIN_REST and len(beginning) >= shortest:
            base = _known(rest, look_up, n_parts)
            if base:
                return (*segments, *base)
    return None


def _compound(word: str) -> Segments | None:
    """A word of two common ones; of several divisions the most even one."""
    places = sorted(range(MIN_PART, len(word) - MIN_PART + 1), key=lambda at: abs(len(word) - 2 * at))
    for at in places:
        halves = [_common(word[:at]), _common(word[at:])]
        known = [half for half in halves if half]
        if len(known) == 2:
            return _joined(known)
    return None


def _common(word: str) -> Segments | None:
    """Phones of a word of the checked dictionary that is no name."""
    return cmudict_lookup(word) if misaki_readings(word, grades=("gold",), is_exact=True) else None


def _joined(parts: list[Segments]) -> Segments:
    """Phones of a compound, of which the first part keeps its stress."""
    first, *others = parts
    lower = {0: 0, 1: 2, 2: 0}
    return (*first, *(replace(segment, stress=lower[segment.stress]) for part in others for segment in part))
