"""A written IPA string to phones of the table, with stress and length.

Reads what espeak-ng and phonemizer write (separators, ties, length and stress marks, diacritics, tone digits) and
what a phonetician writes.
"""

import functools
import unicodedata
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
# Marks that change a phone by less than its neighbours do: they are read and not kept. Superscripts (aspiration,
# palatalisation, ...), tone letters and digits, ejective and unreleased marks, and signs that espeak-ng leaves bare
# (Quechua p`, Icelandic l#, Korean p-).
_IGNORED = frozenset('ʰʱʲʷˠˤⁿˡʼ̚ʴʵʶᵝᵊᵐᶮᵑ˞˥˦˧˨˩↗↘ꜛꜜ0123456789¹²³⁴⁵⁶⁷⁸⁹`#^~*?!"ˀˁ\u200d')


@dataclass(frozen=True, slots=True)
class Segment:
    """One phone as it was written.

    Parameters
    ----------
    phone
        Symbol of the phone table.
    stress
        0 none, 1 primary, 2 secondary; always 0 for a consonant that is not syllabic.
    is_long
        A length mark follows.
    is_syllabic
        A vowel, or a consonant marked as the middle of a syllable.
    """

    phone: str
    stress: int = 0
    is_long: bool = False
    is_syllabic: bool = False


@functools.cache
def _spellings() -> tuple[dict[str, str], int]:
    """Symbol by decomposed spelling, and the length of the longest spelling."""
    spelt = {}
    for symbol, phone in PHONES.items():
        if phone.kind != "silence":
            for spelling in (symbol, *phone.aliases):
                spelt[unicodedata.normalize("NFD", spelling)] = symbol
    return spelt, max(map(len, spelt))


def _longest_spelling(text: str, at: int) -> str:
    """Longest spelling that begins at a place; empty where none does."""
    spelt, longest = _spellings()
    for length in range(min(longest, len(text) - at), 0, -1):
        if text[at : at + length] in spelt:
            return text[at : at + length]
    return ""


def _apply_mark(segments: list[Segment], mark: str) -> bool:
    """Apply a mark to the phone before it; say whether the mark is one."""
    if mark in LENGTHS:
        if segments:
            segments[-1] = replace(segments[-1], is_long=True)
        return True
    if mark in _SYLLABIC:
        if segments:
            segments[-1] = replace(segments[-1], is_syllabic=True)
        return True
    return mark in _IGNORED or mark in SEPARATORS or unicodedata.combining(mark) > 0


def _apply_stress(segments: Sequence[Segment], marks: Sequence[tuple[int, int]]) -> tuple[Segment, ...]:
    """Give each mark (index of the next phone, stress) to the first syllabic phone from there on."""
    stressed = list(segments)
    for start, stress in marks:
        for at in range(start, len(stressed)):
            if stressed[at].is_syllabic:
                stressed[at] = replace(stressed[at], stress=stress)
                break
    return tuple(stressed)


def parse_ipa(text: str) -> tuple[Segment, ...]:
    """Phones of an IPA string in order.

    The longest symbol of the table wins (tʃ is one phone) except across a separator (``t_ʃ`` and ``t.ʃ`` are two).

    Raises
    ------
    InputError
        A letter is no phone of the table; the message names it.
    """
    spelt, _ = _spellings()
    decomposed = unicodedata.normalize("NFD", text).translate(dict.fromkeys(map(ord, _TIES)))
    segments: list[Segment] = []
    marks: list[tuple[int, int]] = []
    at = 0
    while at < len(decomposed):
        letter = decomposed[at]
        spelling = _longest_spelling(decomposed, at)
        if letter in STRESSES:
            marks.append((len(segments), STRESSES[letter]))
        elif spelling:
            symbol = spelt[spelling]
            segments.append(Segment(symbol, is_syllabic=PHONES[symbol].is_vowel))
        elif not _apply_mark(segments, letter):
            name = unicodedata.name(letter, f"U+{ord(letter):04X}")
            raise InputError(f"{letter!r} ({name}) in {text!r} is no phone of the table lexicon/phones.tsv")
        at += max(1, len(spelling))
    return _apply_stress(segments, marks)
