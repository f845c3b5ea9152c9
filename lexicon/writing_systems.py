"""Which writing systems a language is read in, and which letters of a text it cannot read."""

import unicodedata
from types import MappingProxyType

from lexicon.errors import InputError

_CYRILLIC = frozenset({"CYRILLIC"})
_ARABIC = frozenset({"ARABIC"})
_DEVANAGARI = frozenset({"DEVANAGARI"})
_HAN = frozenset({"CJK"})

# First words of the Unicode names of a language's letters, by its espeak-ng code or the first part of it. Latin is read
# in every language (espeak-ng spells it or switches to English); a language without a line reads nothing else. Chinese
# characters are missing under ja, ko and hak: espeak-ng says "Chinese letter" for each. Japanese goes in as kana.
SCRIPTS = MappingProxyType({
    "am": frozenset({"ETHIOPIC"}), "ar": _ARABIC, "as": frozenset({"BENGALI"}), "ba": _CYRILLIC,
    "be": _CYRILLIC, "bg": _CYRILLIC, "bn": frozenset({"BENGALI"}), "bpy": frozenset({"BENGALI"}),
    "chr": frozenset({"CHEROKEE"}), "cmn": _HAN, "cv": _CYRILLIC, "el": frozenset({"GREEK"}), "fa": _ARABIC,
    "grc": frozenset({"GREEK"}), "gu": frozenset({"GUJARATI"}), "he": frozenset({"HEBREW"}), "hi": _DEVANAGARI,
    "hy": frozenset({"ARMENIAN"}), "hyw": frozenset({"ARMENIAN"}), "ja": frozenset({"HIRAGANA", "KATAKANA"}),
    "ka": frozenset({"GEORGIAN"}), "kk": _CYRILLIC, "kn": frozenset({"KANNADA"}), "ko": frozenset({"HANGUL"}),
    "kok": _DEVANAGARI, "ky": _CYRILLIC, "mk": _CYRILLIC, "ml": frozenset({"MALAYALAM"}), "mr": _DEVANAGARI,
    "my": frozenset({"MYANMAR"}), "ne": _DEVANAGARI, "nog": _CYRILLIC, "or": frozenset({"ORIYA"}),
    "pa": frozenset({"GURMUKHI"}), "ru": _CYRILLIC, "sd": _ARABIC, "shn": frozenset({"MYANMAR"}),
    "si": frozenset({"SINHALA"}), "sr": _CYRILLIC, "ta": frozenset({"TAMIL"}), "te": frozenset({"TELUGU"}),
    "th": frozenset({"THAI"}), "ti": frozenset({"ETHIOPIC"}), "tt": _CYRILLIC, "ug": _ARABIC, "uk": _CYRILLIC,
    "ur": _ARABIC, "yue": _HAN, "en-shaw": frozenset({"SHAVIAN"}),
})  # fmt: skip
_EVERYWHERE = frozenset({"LATIN", "MODIFIER", "MASCULINE", "FEMININE", "KATAKANA-HIRAGANA", "VULGAR"})
SHOWN_LETTERS = 8  # letters that a refusal names


def script_of(letter: str) -> str:
    """First word of a letter's Unicode name: LATIN, CYRILLIC, CJK, ...; empty for a letter without name."""
    return unicodedata.name(letter, "").partition(" ")[0]


def scripts_of(language: str) -> frozenset[str]:
    """Writing systems that a language is read in, Latin included."""
    own = SCRIPTS.get(language, SCRIPTS.get(language.partition("-")[0], frozenset()))
    return own | _EVERYWHERE


def check_script(text: str, language: str) -> None:
    """Refuse letters that a language cannot read; digits, punctuation and symbols are fine everywhere.

    Raises
    ------
    InputError
        The text holds letters of another script; the message names them, their script and the language.
    """
    if text.isascii():
        return
    readable = scripts_of(language)
    foreign = [c for c in sorted(set(text)) if unicodedata.category(c)[0] == "L" and script_of(c) not in readable]
    if foreign:
        shown = " ".join(foreign[:SHOWN_LETTERS]) + (" ..." if len(foreign) > SHOWN_LETTERS else "")
        scripts = ", ".join(sorted({script_of(c).capitalize() or "unnamed" for c in foreign}))
        raise InputError(
            f"language {language!r} cannot read {shown} ({scripts} letters); choose the text's own language"
        )
