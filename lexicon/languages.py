"""Convert language names and tags (``EN``, ``en_US``, ``zh-Hans``, ``German``) to codes of espeak-ng.

Writing systems of languages, and checks that a text can be read in its language.

Names of single letters of writing systems that the language of a text does not use (π, Ж, א).

Replace single letters of other writing systems by their names (The value of π, ΔT, the letter Ж).
"""

import difflib
import functools
import re
import unicodedata
from collections.abc import Iterator
from types import MappingProxyType

from lexicon import written_forms as readings
from lexicon.errors import InputError
from lexicon.g2p import DEFAULT_LANGUAGE, check_language, has_kanji, languages, load_reader
from lexicon.marked_text import MarkedText, PhoneMark

# Tags with another code in espeak-ng: languages without region, macrolanguages, withdrawn codes, and regions whose
# speech is closer to one variety of espeak-ng than to another.
CODES_OF_TAGS = MappingProxyType({
    "en": "en-us", "en-ca": "en-us", "en-uk": "en-gb", "en-au": "en-gb", "en-nz": "en-gb", "en-ie": "en-gb",
    "en-za": "en-gb", "en-in": "en-gb", "en-sg": "en-gb", "en-hk": "en-gb", "en-jm": "en-029", "en-tt": "en-029",
    "en-bb": "en-029", "en-scotland": "en-gb-scotland", "fr": "fr-fr", "fr-lu": "fr-be", "pt-pt": "pt",
    **dict.fromkeys(
        ["es-ar", "es-bo", "es-cl", "es-co", "es-cr", "es-cu", "es-do", "es-ec", "es-gt", "es-hn", "es-mx", "es-ni",
         "es-pa", "es-pe", "es-pr", "es-py", "es-sv", "es-us", "es-uy", "es-ve"], "es-419"),
    "zh": "cmn", "zh-hk": "yue", "zh-mo": "yue", "zh-yue": "yue", "zh-hak": "hak", "zh-latn": "cmn-latn-pinyin",
    "chr": "chr-US-Qaaa-x-west", "no": "nb", "nn": "nb", "iw": "he", "in": "id", "mo": "ro",
    "sh": "hr", "jp": "ja", "vi-central": "vi-vn-x-central", "vi-south": "vi-vn-x-south",
})  # fmt: skip
# English names that differ from those of espeak-ng, or that espeak-ng lists for several varieties.
CODES_OF_NAMES = MappingProxyType({
    "english": "en-us", "american english": "en-us", "us english": "en-us", "british english": "en-gb",
    "uk english": "en-gb", "scottish english": "en-gb-scotland", "french": "fr-fr", "belgian french": "fr-be",
    "swiss french": "fr-ch", "latin american spanish": "es-419", "mexican spanish": "es-419", "castilian": "es",
    "brazilian portuguese": "pt-br", "european portuguese": "pt", "brazilian": "pt-br", "chinese": "cmn",
    "mandarin": "cmn", "mandarin chinese": "cmn", "cantonese": "yue", "hakka": "hak", "norwegian": "nb",
    "bokmål": "nb", "irish": "ga", "irish gaelic": "ga", "scottish gaelic": "gd", "ancient greek": "grc",
    "modern greek": "el", "farsi": "fa", "burmese": "my", "flemish": "nl", "maori": "mi", "sinhalese": "si",
    "valencian": "ca-va", "slovene": "sl", "oriya": "or", "odia": "or", "kirghiz": "ky", "uighur": "ug",
})  # fmt: skip
_SUBTAGS = re.compile(r"[a-z]{2,8}(?:-[a-z0-9]{1,8})*")
_LOCALE_END = re.compile(r"[.@].*")  # of a POSIX locale: en_US.UTF-8, de_DE@euro
_SCRIPT = re.compile(r"[a-z]{4}")
MAX_HINTS = 4


def language_code(written: str) -> str:
    """The espeak-ng code of a language: from the code itself, a BCP 47 tag, a POSIX locale, or its English name.

    Case is ignored, and ``_`` is read as ``-``. A tag that espeak-ng does not have falls back to a shorter one: without
    its script, then without its last parts (RFC 4647, lookup).

    Examples
    --------
    >>> [language_code(written) for written in ("en_US", "pt-BR", "zh-Hans", "de-AT", "German")]
    ['en-us', 'pt-br', 'cmn', 'de', 'de']

    Raises
    ------
    InputError
        It matches no language of espeak-ng, or several; the message names similar ones.
    """
    if written == DEFAULT_LANGUAGE:  # espeak-ng need not be loaded
        return written
    name = " ".join(written.casefold().split())
    by_code = {code.casefold(): code for code in languages()}
    tag = _LOCALE_END.sub("", name).replace("_", "-")
    if _SUBTAGS.fullmatch(tag):
        for shorter in _fallbacks(tag):
            code = CODES_OF_TAGS.get(shorter, shorter)
            if code.casefold() in by_code:
                return by_code[code.casefold()]
    named = _codes_of_names().get(name, ())
    if len(named) == 1:
        return named[0]
    close = [f"{code} ({languages()[code]})" for code in named or _close_codes(name)]
    hint = f"did you mean {', '.join(close)}?" if close else "`tts2face languages` lists all languages"
    raise InputError(f"there is no language {written[:40]!r}; {hint}")


def _fallbacks(tag: str) -> Iterator[str]:
    """A tag, then shorter ones: without its script, and part by part from its end."""
    subtags = tag.split("-")
    while subtags:
        yield "-".join(subtags)
        if len(subtags) > 2 and _SCRIPT.fullmatch(subtags[1]):
            yield "-".join([subtags[0], *subtags[2:]])
        subtags.pop()


@functools.cache
def _codes_of_names() -> dict[str, tuple[str, ...]]:
    """Codes by English name in lower case: espeak-ng's names, with and without parentheses, and `CODES_OF_NAMES`."""
    known = languages()
    found: dict[str, tuple[str, ...]] = {}
    for code in sorted(known, key=len):
        base = known[code].casefold().partition(" (")[0]
        before = found.get(base, ())
        if not before or len(code) == len(before[0]):  # the variety with the shortest code
            found[base] = (*before, code)
    found |= {name.casefold(): (code,) for code, name in known.items()}
    return found | {name: (code,) for name, code in CODES_OF_NAMES.items() if code in known}


def _close_codes(query: str) -> list[str]:
    """Codes whose spelling or name is similar to `query`."""
    names = _codes_of_names()
    near = [code for name, codes in names.items() if len(query) > 2 and name.startswith(query) for code in codes]
    near += [code for name in difflib.get_close_matches(query, names, n=3, cutoff=0.7) for code in names[name]]
    near += difflib.get_close_matches(query, list(languages()), n=3, cutoff=0.6)
    return list(dict.fromkeys(near))[:MAX_HINTS]


_UNICODE_NAME = re.compile(r"(?:LETTER|CHARACTER|SYLLABLE) (?:(?:FINAL|SMALL) )?(.+?)(?: WITH .*)?")
_PREFIX = re.compile(r"^.*?\b(?=(?:LETTER|CHARACTER|SYLLABLE) )")
_VOWELS = MappingProxyType({"a": "ah", "e": "eh", "i": "ee", "o": "oh", "u": "oo"})  # Unicode's names of vowels


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
    for begin, end in foreign_runs(text, language):
        run = text[begin:end]
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


# Scripts whose letters espeak-ng names in every language; for others it speaks a code, as in "Thai letter E 0 1".
NAMED_BY_ESPEAK = frozenset({
    "GREEK", "CYRILLIC", "HEBREW", "ARABIC", "GEORGIAN", "ARMENIAN", "HANGUL", "DEVANAGARI", "BENGALI", "GUJARATI",
    "GURMUKHI", "KANNADA", "MALAYALAM", "TAMIL", "TELUGU", "SINHALA",
})  # fmt: skip
_WORD = re.compile(r"[^\W\d_]+")


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
    for begin, end in foreign_runs(text, language):
        name = "" if letter_script(text[begin]) in kept else run_name(text[begin:end])
        if name:
            yield text[at:begin]
            yield " " * text[begin - 1 : begin].isalnum() + name + " " * text[end : end + 1].isalnum()
            at = end
    yield text[at:]
