"""Vowels of Arabic and Hebrew text, which is written without them, by the models inside piper-tts (extra ``[piper]``).

espeak-ng reads consonants alone where their marks are missing: عليكم as ʕlikm, with them as ʕalaikum.
"""

import functools
import importlib.util
import os
import re
from collections.abc import Callable, Mapping
from types import MappingProxyType

_ARABIC, _HEBREW = "ar", "he"
PACKAGE = "piper"
# harakat, and niqqud without the points that belong to a letter in some fonts
_MARKS: Mapping[str, re.Pattern[str]] = MappingProxyType({
    _ARABIC: re.compile("[\u064b-\u0652\u0670]"), _HEBREW: re.compile("[\u0591-\u05bd\u05bf\u05c1\u05c2\u05c4-\u05c7]"),
})  # fmt: skip
_LETTER = re.compile("[\u0621-\u064a\u05d0-\u05ea]")
MAX_CHARACTERS = 2000  # of a text for a model
NOTE = (
    "the text is written without vowels, which are guessed letter by letter; pip install 'tts2face[piper]' reads them"
)


def add_vowels(text: str, language: str) -> str:
    """A text with marks of its vowels, where the language is written without them and a model of it is installed.

    The marks of a text stay as they are: a word with marks at half of its letters or more gets no others, one with
    fewer (شكراً) gets those of its other letters. Texts of other languages do not change, and letters never do.
    """
    if not _lacks_vowels(text, language) or len(text) > MAX_CHARACTERS:
        return text
    model = _model(language)
    if model is None:
        return text
    plain = without_vowels(text, language)
    marked = model(plain)
    # the models leave out what they have not learnt
    if without_vowels(marked, language) != plain:
        marked = _by_word(plain, language, model)
    pairs = zip(re.split(r"(\s+)", text), re.split(r"(\s+)", marked), strict=True)
    return "".join(_with_marks(own, other, _MARKS[language]) for own, other in pairs)


def _with_marks(word: str, marked: str, marks: re.Pattern[str]) -> str:
    """A word with the marks of another spelling of it at letters that have none, if most have none, else at its first.

    A prefix that is written without its vowel stands before a word that has some (وخَمْسَة).
    """
    own, other = (re.findall(rf"[^{marks.pattern[1:-1]}]{marks.pattern}*", spelling) for spelling in (word, marked))
    n_filled = len(own) if _is_bare(word, marks) else 1
    return "".join(
        theirs if len(mine) == 1 and at < n_filled else mine
        for at, (mine, theirs) in enumerate(zip(own, other, strict=True))
    )


def without_vowels(text: str, language: str) -> str:
    """A text without the marks of its vowels; another one as it is."""
    marks = _MARKS.get(language)
    return text if marks is None else marks.sub("", text)


def vowel_note(text: str, language: str) -> str:
    """Sentence without its stop for a text whose vowels no model adds; empty for all others."""
    return NOTE if _lacks_vowels(text, language) and _model(language) is None else ""


def _lacks_vowels(text: str, language: str) -> bool:
    marks = _MARKS.get(language)
    return marks is not None and any(_is_bare(word, marks) for word in text.split())


def _is_bare(word: str, marks: re.Pattern[str]) -> bool:
    """Whether fewer than half of the letters of a word have marks."""
    return 2 * len(marks.findall(word)) < len(_LETTER.findall(word))


def _by_word(text: str, language: str, model: Callable[[str], str]) -> str:
    """Each word for itself, as it is where the model changes its letters."""
    words = [(word, model(word) if _LETTER.search(word) else word) for word in re.split(r"(\s+)", text)]
    return "".join(marked if without_vowels(marked, language) == word else word for word, marked in words)


@functools.cache
def _model(language: str) -> Callable[[str], str] | None:
    """Model that adds the marks of a language; None where it is not installed."""
    if importlib.util.find_spec(PACKAGE) is None:
        return None
    os.environ.setdefault("ORT_DISABLE_TELEMETRY", "1")  # it imports onnxruntime, which would send telemetry
    try:
        if language == _ARABIC:
            from piper.tashkeel import TashkeelDiacritizer

            model: Callable[[str], str] = TashkeelDiacritizer().diacritize
        else:
            from piper.hebrew import DEFAULT_MODEL_PATH, NakdimonDiacritizer

            model = NakdimonDiacritizer(DEFAULT_MODEL_PATH).diacritize
    except ImportError:  # Hebrew came with a later version
        return None
    return model
