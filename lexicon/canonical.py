"""Unicode text to plain characters in canonical form: one kind of quote, dash and space, no invisible characters.

Only characters that are never spoken are removed (marks, quotes, decoration); the others are kept for
`lexicon.normalize`.
"""

import functools
import re
import unicodedata
from collections.abc import Callable

from lexicon.pauses import PAUSES_S

# 3½ is two words: NFKC would make 31/2 of it
_VULGAR = re.compile(r"(?<=[0-9])\s*([¼-¾⅐-⅞↉])")
# (212) 555-1234: brackets become commas otherwise
_AREA_CODE = re.compile(r"\(([0-9]{2,4})\) ?(?=[0-9]{3}[ .-][0-9]{4})")
_SINGLE_QUOTES = "‘’‚‛′`´ʹʻʼʽˈ"
_DOUBLE_QUOTES = '“”„‟«»″‹›"「」『』〈〉《》'
_BRACKETS = "()[]{}"
# powers: NFKC would make 10⁶ the number 106; ² and ³ are in the table of characters
_SUPERSCRIPT = re.compile(r"(?<=[0-9A-Za-z)])(?:⁻[⁰¹²³⁴-⁹]+|[⁰¹²³⁴-⁹]{2,}|[⁰⁴-⁹])|(?<=[0-9])¹")
# ~5 is about 5; other tildes are dropped as markup
_ABOUT = re.compile(r"(?<![\w~])[~≈] ?(?=[0-9])")
# <name> are brackets, < and > elsewhere are words of maths
_ANGLED = re.compile(r"(?<!\w)</?(?=[^\W\d])([^<>\n]{1,80}?)\s?/?>")
_DROPPED_CHARACTERS = "™®*_~|\\•·●○◦▪▫■□★☆◆◇►▶◀»※†‡\u20e3"
_FULL_STOPS = "。｡।॥۔።"
_TRANSLATION = (
    {ord(c): "'" for c in _SINGLE_QUOTES}
    | {ord(c): " " for c in _DOUBLE_QUOTES + _DROPPED_CHARACTERS}
    | {ord(c): ", " for c in _BRACKETS}
    | {ord(c): "-" for c in "‐‑‒"}
    | {ord(c): "–" for c in "–—―"}
    | {ord("−"): "-", ord("⁃"): " ", ord("²"): "^2", ord("³"): "^3", ord("⁄"): "/", ord("№"): "No. ", ord("…"): "..."}
    | {ord(c): ". " for c in _FULL_STOPS}
    | {ord(c): ", " for c in "，、،؛；"}
    | {ord(c): "? " for c in "？؟"}
    | {ord("٫"): ".", ord("٬"): ","}  # between Arabic digits
    | {ord(c): "" for c in "\ufffc\ufffd"}  # of what is lost
    | {ord("！"): "! ", ord("："): ": ", ord("¿"): " ", ord("¡"): " "}
)
_SPOKEN_PUNCTUATION = frozenset(".,;:!?'-–/&@#%‰§¶^")
_MARKS = re.compile("[\u0300-\u036f\u0483-\u0489\u1ab0-\u1aff\u1dc0-\u1dff\u20d0-\u20ff\ufe20-\ufe2f]+")
# Canonical order puts signs of a consonant (shadda; dagesh, shin and sin dot) behind its vowels, where espeak-ng 1.52
# drops the vowel of Arabic (mudarrsa) and spells Persian and Hebrew words ("Hebrew shin dot")
_SIGNS_OF_CONSONANTS = (
    # fathatan is written on the alif or on the letter before it; espeak-ng says its n only there (شكرًا)
    (re.compile("\u064e?([\u0627\u0649])\u064b"), "\u064b\\1"),
    (re.compile("([\u064b-\u0650\u0652\u0656-\u065e\u0670]+)(\u0651)"), r"\2\1"),
    (re.compile("([\u05b0-\u05bb\u05c7]+)([\u05bc\u05c1\u05c2]+)"), r"\2\1"),
)
# Applied in order; each is linear in the text, as no pattern has overlapping repeats.
_STEPS: tuple[tuple[re.Pattern[str], str | Callable[[re.Match[str]], str]], ...] = (
    (re.compile(r"\r"), "\n"),
    (re.compile(r"(?<!\.)\.{2,}+(?= ?\n?[a-z])"), "… "),
    (re.compile(r"\.{2,}"), "."),
    (re.compile(r"[ \n]{2,}|\n"), lambda run: ". " if run.group().count("\n") > 1 else " "),
    # a dash between numbers is a range, elsewhere a pause
    (re.compile(r"(?<=[0-9]) ?– ?(?=[0-9$£€])"), "–"),
    (re.compile(r"–(?![0-9$£€])|(?<![0-9])–|--+|(?<![0-9]) -(?= )|(?<= )-(?= ?[^0-9$£€¥.\s-])"), "— "),
    (re.compile(r"-(?![\w$£€¥.])"), ", "),
    (re.compile(r"-(?=\.(?![0-9]))"), ""),
    (re.compile(r"(?<!\w)-(?=[^\W0-9])"), " "),
    (re.compile(r"(?<!\w)'(?!(?:em|cause|til|[Tt]is|[Tt]was|bout|round|n)\b|[0-9]0s\b)|(?<=[^\W0-9])'(?!\w)"), " "),
    (re.compile(r"'{2,}"), " "),
    (re.compile(r" {2,}"), " "),
    (re.compile(r" +(?=[.,;:!?](?![\w])|[—…])"), ""),
)
_PUNCTUATION_RUN = re.compile(r"[.,;:!?—…](?: ?[.,;:!?—…](?![0-9]))+")
_STRENGTH = "".join(PAUSES_S)


def _replacement(code: int) -> int | str:
    """Replacement of a character: itself, a space, a newline, an ASCII digit, or an empty string."""
    category = unicodedata.category(chr(code))
    if code in {10, 13, 0x2028, 0x2029}:
        return "\n"
    is_mute = (category[0] == "P" or category == "Sk") and chr(code) not in _SPOKEN_PUNCTUATION
    if code == 9 or category[0] == "Z" or is_mute:
        # skin tones of emoji are no words of their own
        return " " if not 0x1F3FB <= code <= 0x1F3FF else ""
    if category[0] in "CM":
        # FE00 to FE0F choose a glyph, as of an emoji
        return "" if category[0] == "C" or 0xFE00 <= code <= 0xFE0F else code
    if category == "No" and unicodedata.normalize("NFKC", chr(code)) == chr(code):
        value = unicodedata.numeric(chr(code))
        return f" {value:.0f} " if value.is_integer() else code  # circled and other digits
    return str(unicodedata.digit(chr(code))) if category == "Nd" and code > 127 else code


class _TranslationTable(dict[int, int | str | None]):
    """Translation table that computes the entry of a character on first use."""

    def __missing__(self, code: int) -> int | str:
        self[code] = replacement = _replacement(code)
        return replacement


@functools.cache
def _translation_table() -> _TranslationTable:
    return _TranslationTable(_TRANSLATION)


def _strongest_mark(run: re.Match[str]) -> str:
    return max(run.group(), key=_STRENGTH.find) + (" " if run.group()[-1] == " " else "")


def signs_before_vowels(text: str) -> str:
    """A text in which the shadda of Arabic and the points of Hebrew consonants stand before the vowels of a letter."""
    if text.isascii():
        return text
    for pattern, order in _SIGNS_OF_CONSONANTS:
        text = pattern.sub(order, text)
    return text


def canonical_text(text: str, *, keep_marks: bool = False) -> str:
    """The text in canonical characters: NFKC, ASCII digits, plain quotes, single spaces, no adjacent marks.

    Loose combining marks are removed unless `keep_marks` is set, for scripts that are written with them, in the order
    of `signs_before_vowels`.
    """
    text = _ANGLED.sub(r" \1 ", _ABOUT.sub("about ", _AREA_CODE.sub(r"\1-", text)))
    text = text.translate(_translation_table()) if text.isascii() else _canonical_letters(text, keep_marks=keep_marks)
    for pattern, replacement in _STEPS:
        text = pattern.sub(replacement, text)
    return _PUNCTUATION_RUN.sub(_strongest_mark, text).strip(" ,;:—").lstrip("… ")


def _canonical_letters(text: str, *, keep_marks: bool) -> str:
    """A text whose characters are canonical one by one: NFKC, and the table; of ASCII only the table is needed."""
    text = _SUPERSCRIPT.sub(lambda run: "^" + unicodedata.normalize("NFKC", run.group()).replace("−", "-"), text)
    text = _VULGAR.sub(r" \1", text).translate(_translation_table())
    # translated before and after: NFKC itself makes characters of the table, and would lose superscripts
    text = unicodedata.normalize("NFKC", text).translate(_translation_table())
    if keep_marks:
        return signs_before_vowels(text)
    return unicodedata.normalize("NFKC", _MARKS.sub("", text)).translate(_translation_table())
