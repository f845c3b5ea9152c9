"""Guess the language of a text from its writing system, and from common words and letters where that is Latin."""

import re
from collections import Counter
from functools import cache
from types import MappingProxyType

from lexicon.g2p import DEFAULT_LANGUAGE
from lexicon.scripts import letter_script
from lexicon.written_forms import read_table

READ_CHARACTERS = 2000  # of a text, which name its language well enough
MAX_LETTERS = 2  # points of letters that one language alone has; a word of it is a point
SHORT_WORDS = 3  # number of words up to which one common word decides
# The language with most speakers of those that espeak-ng speaks, and languages that have letters of their own.
LANGUAGE_OF_SCRIPT = MappingProxyType({
    "CYRILLIC": "ru", "ARABIC": "ar", "CJK": "cmn", "HIRAGANA": "ja", "KATAKANA": "ja", "HANGUL": "ko", "GREEK": "el",
    "HEBREW": "he", "DEVANAGARI": "hi", "BENGALI": "bn", "GUJARATI": "gu", "GURMUKHI": "pa", "TAMIL": "ta",
    "TELUGU": "te", "KANNADA": "kn", "MALAYALAM": "ml", "SINHALA": "si", "ORIYA": "or", "THAI": "th", "MYANMAR": "my",
    "ETHIOPIC": "am", "GEORGIAN": "ka", "ARMENIAN": "hy",
})  # fmt: skip
OWN_LETTERS = MappingProxyType(
    {
        "ru": (("uk", "іїєґ"), ("be", "ў"), ("kk", "қғңұһ"), ("mk", "ѓќ"), ("sr", "ђћџ")),
        "ar": (("ur", "ٹڈڑںے"), ("fa", "پچژگ")),
    }
)
DENSE = MappingProxyType(dict.fromkeys(("CJK", "HIRAGANA", "KATAKANA", "HANGUL"), 3))  # Latin letters that one replaces
_MARKUP = re.compile(r"<[^<>]{0,200}>|\[[^\[\]]{0,200}\]")
_WORD = re.compile(r"[^\W\d_]+(?:['’][^\W\d_]+)?")


def guess_language(text: str, default: str = DEFAULT_LANGUAGE) -> str:
    """The espeak-ng code of the language of a text; `default` where nothing points to another one.

    The writing system of most letters decides, then letters that few languages have. A text in Latin letters needs
    more common words of a language than of English and of the others, two at least unless it is very short; it is
    judged only where `default` is English.

    Examples
    --------
    >>> [guess_language(text) for text in ("Hello.", "Das ist gut.", "Привет, мир", "こんにちは、世界", "مرحبا")]
    ['en-us', 'de', 'ru', 'ja', 'ar']
    """
    plain = _MARKUP.sub(" ", text[:READ_CHARACTERS]).lower()
    scripts: Counter[str] = Counter()
    for letter in plain:
        if letter.isalpha():
            script = letter_script(letter)
            scripts[script] += DENSE.get(script, 1)
    known = Counter({script: number for script, number in scripts.items() if script in LANGUAGE_OF_SCRIPT})
    if known.total() > scripts["LATIN"]:
        return _of_script(plain, known)
    return _of_words(plain, default) if default.startswith("en") else default


def _of_script(text: str, scripts: "Counter[str]") -> str:
    # Japanese has more Chinese characters than kana, Chinese no kana
    if scripts["HIRAGANA"] or scripts["KATAKANA"]:
        return "ja"
    language = LANGUAGE_OF_SCRIPT[scripts.most_common(1)[0][0]]
    return next((own for own, letters in OWN_LETTERS.get(language, ()) if set(letters) & set(text)), language)


def _of_words(text: str, default: str) -> str:
    words = _WORD.findall(text.replace("’", "'"))
    points: Counter[str] = Counter()
    for language, (known, letters) in _tables().items():
        points[language] = sum(word in known for word in words)
        points[language] += min(MAX_LETTERS, sum(text.count(letter) for letter in letters))
    english = points.pop("en")
    language, most = max(points.items(), key=lambda counted: counted[1])
    is_clear = most > english and (most > 1 or (len(words) <= SHORT_WORDS and not english))
    return language if is_clear else default


def common_words(language: str) -> frozenset[str]:
    """Frequent words of a language in Latin letters, by its code or that of its variety; empty if none are known."""
    base = language.partition("-")[0]
    return next((words for known, (words, _) in _tables().items() if known.partition("-")[0] == base), frozenset())


@cache
def _tables() -> dict[str, tuple[frozenset[str], str]]:
    """Common words, and letters of its own, of each language."""
    rows = read_table("stop_words.tsv").items()
    return {language: (frozenset(words.split()), letters) for language, (words, letters) in rows}
