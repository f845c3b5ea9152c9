"""Words of misaki's dictionaries, in the package of hibari-tts: 183,000 of American, 197,000 of British English.

Each is JSON text, sorted, and searched by bisection: parsed as tables they take .15 s and 45 MB.
"""

import functools
import gzip
import importlib.util
import re
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType

from lexicon.errors import DataError
from lexicon.ipa import IpaPhone
from lexicon.phones import PHONES

# Letters of its alphabet as phones of the table, in American English.
PHONE_OF_LETTER = MappingProxyType({
    "A": "eɪ", "I": "aɪ", "O": "oʊ", "Q": "oʊ", "W": "aʊ", "Y": "ɔɪ", "ʤ": "dʒ", "ʧ": "tʃ", "ə": "ə", "ɐ": "ə",
    "ᵊ": "ə", "ᵻ": "ɪ", "ɪ": "ɪ", "i": "i", "ɛ": "ɛ", "æ": "æ", "a": "æ", "ɑ": "ɑ", "ɒ": "ɑ", "ɔ": "ɔ", "ʊ": "ʊ",
    "u": "u", "ʌ": "ʌ", "ɜ": "ɝ", "ɚ": "ɚ", "e": "ɛ", "o": "ɔ", "ɹ": "ɹ", "r": "ɹ", "ð": "ð", "θ": "θ", "ʃ": "ʃ",
    "ʒ": "ʒ", "ŋ": "ŋ", "j": "j", "ɡ": "ɡ", "T": "t", "ɾ": "t", "ʔ": "t", "h": "h", "x": "k", "b": "b", "d": "d",
    "f": "f", "k": "k", "l": "l", "m": "m", "n": "n", "p": "p", "s": "s", "t": "t", "v": "v", "w": "w", "z": "z",
})  # fmt: skip
STRESSES = MappingProxyType({"ˈ": 1, "ˌ": 2})
DEFAULT = "DEFAULT"  # reading of a word in other parts of speech than are named
GRADES = ("gold", "silver")  # the first was checked by hand
_READING = re.compile(rb'"(\w+)":"([^"]*)"')  # of a part of speech; those without letters are left out
_VALUE = re.compile(rb'"[^"]*"|\{[^}]*\}')
_RHOTIC = MappingProxyType({"ɝ": "ɝ", "ə": "ɚ", "ɚ": "ɚ"})


@functools.cache
def _text(accent: str, grade: str) -> bytes:
    """JSON text of a dictionary; empty where hibari-tts is not installed."""
    found = importlib.util.find_spec("hibari")
    folders = [] if found is None else list(found.submodule_search_locations or ())
    if not folders:
        return b"{}"
    path = Path(folders[0]) / "assets" / f"lexicon_{accent}_{grade}.json.gz"
    try:
        return gzip.decompress(path.read_bytes())
    except (OSError, EOFError) as broken:
        raise DataError(f"{path} is damaged ({broken}); reinstall hibari-tts") from broken


def has_dictionary(accent: str) -> bool:
    """Whether the dictionary of an accent is installed, ``us`` or ``gb``."""
    return len(_text(accent, GRADES[0])) > len(b"{}")


def _entry_before(text: bytes, low: int, middle: int) -> int:
    """Start of the last entry that begins between two places, the first of which is the start of one."""
    at = text.rfind(b',"', low, middle) + 1 or low
    brace = text.rfind(b"{", low, at)
    # within the readings of a word by parts of speech
    if brace > text.rfind(b"}", low, at):
        at = text.rfind(b',"', low, brace) + 1 or low
    return at


def _find(text: bytes, word: str) -> dict[str, str]:
    """Letters of a word by part of speech, by bisection; DEFAULT where all have one, none for no word."""
    key = word.encode()
    low, high = 1, len(text) - 1
    while low < high:
        at = _entry_before(text, low, (low + high + 1) // 2)
        end = text.index(b'":', at)
        value = _VALUE.match(text, end + 2)
        if value is None:
            return {}
        if text[at + 1 : end] == key:
            readings = _READING.findall(value[0]) or [(DEFAULT.encode(), value[0].strip(b'"'))]
            return {tag.decode(): letters.decode() for tag, letters in readings}
        if text[at + 1 : end] < key:
            low = value.end() + 1
        else:
            high = at
    return {}


@functools.lru_cache(maxsize=50_000)
def misaki_readings(
    word: str, accent: str = "us", grades: tuple[str, ...] = GRADES, *, is_exact: bool = False
) -> Mapping[str, str]:
    """A word in misaki's alphabet by part of speech, of which DEFAULT is always one; empty if it has none.

    Parameters
    ----------
    is_exact
        Whether it is searched as it is written only, not in small letters and capitalised, too.
    """
    forms = (word,) if is_exact else dict.fromkeys((word, word.lower(), word.lower().capitalize()))
    found = (_find(_text(accent, grade), form) for grade in grades for form in forms)
    return MappingProxyType(next((readings for readings in found if readings), {}))


def letter_segments(letters: str, phones: Mapping[str, str] = PHONE_OF_LETTER) -> tuple[IpaPhone, ...]:
    """Phones of a word in misaki's alphabet, with their stress; American vowels with /ɹ/ are one phone (bird)."""
    segments: list[IpaPhone] = []
    stress = 0
    for letter in letters:
        if letter in STRESSES:
            stress = STRESSES[letter]
        elif letter in phones:
            phone = phones[letter]
            if phone == "ɹ" and phones is PHONE_OF_LETTER and segments and segments[-1].phone in _RHOTIC:
                segments[-1] = IpaPhone(_RHOTIC[segments[-1].phone], segments[-1].stress, is_syllabic=True)
                continue
            is_vowel = PHONES[phone].is_vowel
            segments.append(IpaPhone(phone, stress if is_vowel else 0, is_syllabic=is_vowel))
            stress = 0 if is_vowel else stress
    return tuple(segments)


def misaki_lookup(
    word: str, grades: tuple[str, ...] = GRADES, *, is_exact: bool = False
) -> tuple[IpaPhone, ...] | None:
    """Phones of an American English word, or None; arguments as of `misaki_readings`."""
    readings = misaki_readings(word, "us", grades, is_exact=is_exact)
    return letter_segments(readings[DEFAULT]) if readings else None
