"""Writing systems: which letters a language reads, names of single other ones, and whether a text can be read."""

import functools
import re
import unicodedata
from collections.abc import Iterator
from types import MappingProxyType

from lexicon import written_forms as readings
from lexicon.errors import InputError
from lexicon.g2p import check_language
from lexicon.japanese import has_kanji, load_reader
from lexicon.marked_text import MarkedText, PhoneMark

_CYRILLIC = frozenset({"CYRILLIC"})
_ARABIC = frozenset({"ARABIC"})
_DEVANAGARI = frozenset({"DEVANAGARI"})
_HAN = frozenset({"CJK"})
_JAPANESE = frozenset({"HIRAGANA", "KATAKANA", "CJK", "IDEOGRAPHIC"})
# First words of the Unicode names of a language's letters, by its espeak-ng code or primary subtag. Latin is read in
# every language (espeak-ng spells it or switches to English); a language without an entry reads Latin only. Chinese
# characters are not listed for ko and hak, where espeak-ng speaks "Chinese letter" for each; in Japanese
# `lexicon.g2p` reads them.
SCRIPTS = MappingProxyType({
    "am": frozenset({"ETHIOPIC"}), "ar": _ARABIC, "as": frozenset({"BENGALI"}), "ba": _CYRILLIC,
    "be": _CYRILLIC, "bg": _CYRILLIC, "bn": frozenset({"BENGALI"}), "bpy": frozenset({"BENGALI"}),
    "chr": frozenset({"CHEROKEE"}), "cmn": _HAN, "cv": _CYRILLIC, "el": frozenset({"GREEK"}), "fa": _ARABIC,
    "grc": frozenset({"GREEK"}), "gu": frozenset({"GUJARATI"}), "he": frozenset({"HEBREW"}), "hi": _DEVANAGARI,
    "hy": frozenset({"ARMENIAN"}), "hyw": frozenset({"ARMENIAN"}), "ja": _JAPANESE,
    "ka": frozenset({"GEORGIAN"}), "kk": _CYRILLIC, "kn": frozenset({"KANNADA"}), "ko": frozenset({"HANGUL"}),
    "kok": _DEVANAGARI, "ky": _CYRILLIC, "mk": _CYRILLIC, "ml": frozenset({"MALAYALAM"}), "mr": _DEVANAGARI,
    "my": frozenset({"MYANMAR"}), "ne": _DEVANAGARI, "nog": _CYRILLIC, "or": frozenset({"ORIYA"}),
    "pa": frozenset({"GURMUKHI"}), "ru": _CYRILLIC, "sd": _ARABIC, "shn": frozenset({"MYANMAR"}),
    "si": frozenset({"SINHALA"}), "sr": _CYRILLIC, "ta": frozenset({"TAMIL"}), "te": frozenset({"TELUGU"}),
    "th": frozenset({"THAI"}), "ti": frozenset({"ETHIOPIC"}), "tt": _CYRILLIC, "ug": _ARABIC, "uk": _CYRILLIC,
    "ur": _ARABIC, "yue": _HAN, "en-shaw": frozenset({"SHAVIAN"}),
})  # fmt: skip
_COMMON_SCRIPTS = frozenset({"LATIN", "MODIFIER", "MASCULINE", "FEMININE", "KATAKANA-HIRAGANA", "VULGAR"})
_NAMES = MappingProxyType({"CJK": "Chinese"})
MAX_QUOTED_WORDS, MAX_QUOTED_CHARACTERS = 3, 24  # number of words quoted in an error, and characters of each
# Combining marks that distinguish no words in any script: accents, enclosing marks.
_LOOSE_MARKS = re.compile(
    "[\u0300-\u036f\u0483-\u0489\u1ab0-\u1aff\u1dc0-\u1dff\u20d0-\u20ff\ufe00-\ufe0f\ufe20-\ufe2f]"
)
_FOREIGN = re.compile("f[fm]*")
# Scripts whose letters espeak-ng names in every language; for others it speaks a code, as in "Thai letter E 0 1".
NAMED_BY_ESPEAK = frozenset({
    "GREEK", "CYRILLIC", "HEBREW", "ARABIC", "GEORGIAN", "ARMENIAN", "HANGUL", "DEVANAGARI", "BENGALI", "GUJARATI",
    "GURMUKHI", "KANNADA", "MALAYALAM", "TAMIL", "TELUGU", "SINHALA",
})  # fmt: skip
_WORD = re.compile(r"[^\W\d_]+")
_UNICODE_NAME = re.compile(r"(?:LETTER|CHARACTER|SYLLABLE) (?:(?:FINAL|SMALL) )?(.+?)(?: WITH .*)?")
_PREFIX = re.compile(r"^.*?\b(?=(?:LETTER|CHARACTER|SYLLABLE) )")
_VOWELS = MappingProxyType({"a": "ah", "e": "eh", "i": "ee", "o": "oh", "u": "oo"})  # Unicode's names of vowels


def letter_script(letter: str) -> str:
    """First word of a letter's Unicode name (LATIN, CYRILLIC, CJK, ...); empty for a letter without name."""
    return unicodedata.name(letter, "").partition(" ")[0]


def script_name(script: str) -> str:
    """Name of a writing system, by the first word of the Unicode names of its letters."""
    return _NAMES.get(script, script.capitalize() or "unnamed")


def language_scripts(language: str) -> frozenset[str]:
    """Writing systems of a language, including Latin."""
    own = SCRIPTS.get(language, SCRIPTS.get(language.partition("-")[0], frozenset()))
    return own | _COMMON_SCRIPTS


class _LetterKinds(dict[int, str]):
    """Translation of characters to f (foreign letter), m (mark of a letter) or o (other), computed on first use."""

    def __init__(self, language: str) -> None:
        super().__init__()
        self._readable = language_scripts(language)

    def __missing__(self, code: int) -> str:
        self[code] = kind = self._kind(chr(code))
        return kind

    def _kind(self, letter: str) -> str:
        if unicodedata.category(letter)[0] == "M":
            return "o" if _LOOSE_MARKS.match(letter) else "m"
        plain = unicodedata.normalize("NFKC", letter)
        is_foreign = any(unicodedata.category(c)[0] == "L" and letter_script(c) not in self._readable for c in plain)
        return "f" if is_foreign else "o"


@functools.lru_cache(maxsize=16)
def _letter_kinds(language: str) -> _LetterKinds:
    return _LetterKinds(language)


def foreign_runs(text: str, language: str) -> Iterator[tuple[int, int]]:
    """Maximal half-open ranges of letters that a language does not read."""
    if not text.isascii():
        for run in _FOREIGN.finditer(text.translate(_letter_kinds(language))):
            yield run.span()


def check_script(text: str, language: str) -> None:
    """Check that a language can read a text; digits, symbols and single letters with a name are always accepted."""
    if language == "ja" and has_kanji(text):
        load_reader()
    words: dict[str, None] = {}
    for start, end in foreign_runs(text, language):
        run = text[start:end]
        if not run_name(run) and unicodedata.normalize("NFKC", run) not in readings.read_table("units.tsv"):
            words[run] = None
    if words:
        shown = ", ".join(word[:MAX_QUOTED_CHARACTERS] for word in list(words)[:MAX_QUOTED_WORDS])
        scripts = {letter_script(unicodedata.normalize("NFKC", c)[0]) for word in words for c in word if c.isalpha()}
        names = ", ".join(sorted(script_name(script) for script in scripts))
        more = ", ..." if len(words) > MAX_QUOTED_WORDS else ""
        raise InputError(
            f"language {language!r} cannot read {shown}{more} ({names} letters); "
            "use the language of the text, or transliterate it"
        )


def check_readable(text: MarkedText, language: str) -> None:
    """Check that the language of each span can read its words; words with given phones are skipped.

    Raises
    ------
    InputError
        A word cannot be read, or the language does not exist.
    BackendError
        The text is Japanese with Chinese characters, and the library that reads them is not installed.
    """
    unread = blank_given_words(text)
    ends = [*(run.start for run in text.runs[1:]), len(unread)]
    if all(run.language is None for run in text.runs):
        check_script(unread, language)
        return
    for run, end in zip(text.runs, ends, strict=True):
        span_language = run.language or language
        check_language(span_language)
        check_script(unread[run.start : end], span_language)


def blank_given_words(text: MarkedText) -> str:
    """The spoken text with spaces in place of words with given phones."""
    pieces, at = [], 0
    for mark in text.marks:
        if isinstance(mark, PhoneMark):
            pieces += [text.text[at : mark.at], " " * (mark.end - mark.at)]
            at = mark.end
    return "".join([*pieces, text.text[at:]])


def name_foreign_letters(text: str, language: str) -> str:
    """The text with each single foreign letter that espeak-ng cannot name replaced by its name.

    Foreign words are kept; in Japanese, where espeak-ng reads no Latin letters as words, so are letters.
    """
    if text.isascii() or language.partition("-")[0] == "ja":
        return text
    return "".join(_pieces(text, language, NAMED_BY_ESPEAK))


def name_letters_in_words(text: str) -> str:
    """English text with the names of single foreign letters that stand within a word (ΔT), except in units (kΩ)."""
    return text if text.isascii() else _WORD.sub(_name_letters, text)


def _name_letters(match: "re.Match[str]") -> str:
    word = match.group()
    if len(word) == 1 or word.isascii() or word in readings.read_table("units.tsv"):
        return word
    return "".join(_pieces(word, "en", frozenset()))


def _pieces(text: str, language: str, kept: frozenset[str]) -> Iterator[str]:
    at = 0
    for start, end in foreign_runs(text, language):
        name = "" if letter_script(text[start]) in kept else run_name(text[start:end])
        if name:
            yield text[at:start]
            yield " " * text[start - 1 : start].isalnum() + name + " " * text[end : end + 1].isalnum()
            at = end
    yield text[at:]


@functools.lru_cache(maxsize=2000)
def letter_name(letter: str) -> str:
    """Name of a letter from the table of symbols, else from its Unicode name; empty if it has none.

    Chinese characters have none, as each is a word.
    """
    known = readings.read_table("symbols.tsv").get(letter)
    if known:
        return known[0]
    base = unicodedata.normalize("NFD", letter)[:1]
    if base != letter and unicodedata.name(letter, "").startswith("GREEK"):
        return letter_name(base)
    match = _UNICODE_NAME.fullmatch(_PREFIX.sub("", unicodedata.name(letter, ""), count=1))
    name = "" if match is None else match[1].lower().replace(" ", "-")
    return _VOWELS.get(name, name) if name.replace("-", "").isalpha() else ""


def run_name(run: str) -> str:
    """Name of a run that is a single letter; empty for words."""
    letter = unicodedata.normalize("NFKC", run)
    return letter_name(letter) if len(letter) == 1 else ""
