"""Writing systems of languages, and checks that a text can be read in its language."""

import functools
import re
import unicodedata
from collections.abc import Iterator
from types import MappingProxyType

from lexicon import written_forms as readings
from lexicon.errors import InputError
from lexicon.g2p import check_language
from lexicon.japanese import has_kanji, load_reader
from lexicon.letter_names import run_name
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
    """Check that a language can read a text; digits, symbols and single letters with a name are always accepted.

    Raises
    ------
    InputError
        The text contains words of another script; the message names them, their script and the language.
    BackendError
        The text is Japanese with Chinese characters, and the library that reads them is not installed.
    """
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
