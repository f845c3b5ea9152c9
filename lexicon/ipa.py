"""Parse IPA strings into phones of the table, with stress and length.

Reads the notation of espeak-ng and phonemizer (separators, ties, length and stress marks, diacritics, tone digits) and
standard IPA.
"""

import functools
import unicodedata
from bisect import bisect_left
from collections.abc import Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

from lexicon.errors import InputError
from lexicon.phones import PHONES

STRESSES = MappingProxyType({"ˈ": 1, "'": 1, "ˌ": 2})
LENGTHS = frozenset("ːˑ:")
SEPARATORS = frozenset("_ .|‖‿\t\n-")
_TIES = "\u0361\u035c"
_SYLLABIC = frozenset("\u0329\u030d")
# Marks with less effect on a phone than its neighbours have: they are accepted and dropped. Superscripts (aspiration,
# palatalisation, ...), tone letters and digits, ejective and unreleased marks, and signs without conversion
# by espeak-ng (Quechua p`, Icelandic l#, Korean p-).
_IGNORED = frozenset('ʰʱʲʷˠˤⁿˡʼ̚ʴʵʶᵝᵊᵐᶮᵑ˞˥˦˧˨˩↗↘ꜛꜜ0123456789¹²³⁴⁵⁶⁷⁸⁹`#^~*?!"ˀˁ\u200d')


@dataclass(frozen=True, slots=True)
class IpaPhone:
    """One phone with its stress and length.

    Parameters
    ----------
    phone
        Symbol of the phone table.
    stress
        0 none, 1 primary, 2 secondary; always 0 for non-syllabic consonants.
    is_long
        Whether a length mark follows.
    is_syllabic
        Whether it is a vowel or a consonant marked as a syllable nucleus.
    """

    phone: str
    stress: int = 0
    is_long: bool = False
    is_syllabic: bool = False


@functools.cache
def _spellings() -> tuple[dict[str, str], int]:
    """Symbol by decomposed spelling, and the length of the longest spelling."""
    spellings = {}
    for symbol, phone in PHONES.items():
        if phone.kind != "silence":
            for spelling in (symbol, *phone.aliases):
                spellings[unicodedata.normalize("NFD", spelling)] = symbol
    return spellings, max(map(len, spellings))


def _longest_spelling(text: str, at: int) -> str:
    """Longest spelling that begins at an index; empty if there is none."""
    spellings, longest = _spellings()
    for length in range(min(longest, len(text) - at), 0, -1):
        if text[at : at + length] in spellings:
            return text[at : at + length]
    return ""


def _apply_mark(segments: list[IpaPhone], mark: str) -> bool:
    """Apply a mark to the phone before it; False if the character is not a mark."""
    if mark in LENGTHS:
        if segments:
            segments[-1] = replace(segments[-1], is_long=True)
        return True
    if mark in _SYLLABIC:
        if segments:
            segments[-1] = replace(segments[-1], is_syllabic=True)
        return True
    return mark in _IGNORED or mark in SEPARATORS or unicodedata.combining(mark) > 0


def _apply_stress(segments: Sequence[IpaPhone], marks: Sequence[tuple[int, int]]) -> tuple[IpaPhone, ...]:
    """Assign each stress mark (index of the next phone, stress) to the first syllabic phone from that index."""
    stressed = list(segments)
    syllabic = [at for at, segment in enumerate(segments) if segment.is_syllabic]
    for start, stress in marks:
        number = bisect_left(syllabic, start)
        if number < len(syllabic):
            stressed[syllabic[number]] = replace(stressed[syllabic[number]], stress=stress)
    return tuple(stressed)


def parse_ipa(text: str) -> tuple[IpaPhone, ...]:
    """Phones of an IPA string in order.

    The longest symbol of the table is matched (tʃ is one phone), except across separators (``t_ʃ``, ``t.ʃ`` are two).

    Raises
    ------
    InputError
        A letter is not a phone of the table; the message names it.
    """
    spellings, _ = _spellings()
    decomposed = unicodedata.normalize("NFD", text).translate(dict.fromkeys(map(ord, _TIES)))
    segments: list[IpaPhone] = []
    marks: list[tuple[int, int]] = []
    at = 0
    while at < len(decomposed):
        letter = decomposed[at]
        spelling = _longest_spelling(decomposed, at)
        if letter in STRESSES:
            marks.append((len(segments), STRESSES[letter]))
        elif spelling:
            symbol = spellings[spelling]
            segments.append(IpaPhone(symbol, is_syllabic=PHONES[symbol].is_vowel))
        elif not _apply_mark(segments, letter):
            name = unicodedata.name(letter, f"U+{ord(letter):04X}")
            raise InputError(
                f"{letter!r} ({name}) in {text!r} is not a phone of lexicon/phones.tsv; use one of its symbols"
            )
        at += max(1, len(spelling))
    return _apply_stress(segments, marks)
