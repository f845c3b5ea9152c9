"""Emphasis as people and language models type it: words in capitals, and words between asterisks.

``It is NOT here`` and ``It is *not* here`` stress *not*. In a line without small letters capitals mean nothing; words
that are read letter by letter, acronyms and labels of speakers keep them. What somebody does (``*sighs*``) may stand
between asterisks, too: `lexicon.inline_marks` reads it, and a clause there (``*the door creaks*``) is not emphasised.
"""

import functools
import re
from collections.abc import Iterator
from dataclasses import dataclass

from lexicon.capitals import READ_ACRONYMS, is_word_in_capitals
from lexicon.text_language import common_words

STRONG, MODERATE = 1.0, 0.6  # `lexicon.tones.Tone.emphasis`
MAX_STRONG_WORDS = 3  # of one span: a whole sentence said so has no accent
MIN_FOREIGN_LETTERS = 5  # of a word in capitals in a language whose words are not known: hardly an abbreviation
# A letter or digit of writing with spaces between words, beside which an asterisk is none of emphasis.
SPACED = r"[^\W\u0e00-\u0eff\u1000-\u109f\u1780-\u17ff\u3040-\u30ff\u3400-\u9fff]"
# A word in capitals that is no part of a code, an address or an abbreviation.
_CAPITALS = re.compile(r"(?<![\w.&/\\@#$+='’-])[^\W\d_a-z]{2,}(?:['’][^\W\d_a-z]{1,2})?(?![\w&/\\@#+='’-]|\.\w)")
_SMALL = re.compile(r"[^\W\d_A-Z]{2}")
_ROMAN = re.compile("[IVXLCDM]+")
_WORD = re.compile(r"[^\W\d_]+")
_SENTENCE_START = re.compile(r"(?:\A|[.!?:…]['\"”’)]{0,3}\s)\s*\Z")
_STRETCHED = re.compile(r"(.)\1{2,}")  # SOOO, YESSS, COOOL
_AFTER_NUMBER = re.compile(r"[0-9]\s*\Z")  # 5 AM, 12 IN
_AFTER_TOWN = re.compile(r"[A-Z][a-z]+, \Z")  # Portland, OR 97201
MAX_CODE_LETTERS = 2  # of units, halves of the day and states
_GOES_ON = re.compile(r"\s*[a-z]")
MIN_NARRATED_WORDS = 3
_BEFORE = 24  # characters before a word that hold the word before it


@dataclass(frozen=True, slots=True)
class EmphasisedWords:
    """Words of a written text that are emphasised.

    Parameters
    ----------
    start, end
        Half-open range of characters, with asterisks around the words.
    text
        The words as ordinary writing has them.
    emphasis
        As `lexicon.tones.Tone.emphasis`.
    """

    start: int
    end: int
    text: str
    emphasis: float


@functools.cache
def _starred() -> re.Pattern[str]:
    """Words between asterisks; compiled at its first use, which takes 2 ms."""
    return re.compile(rf"(?<!{SPACED})(?<!\*)(\*{{1,3}})(?![\s*(\[]|\.\w)([^*]{{1,200}})(?<!\s)\1(?!{SPACED}|\*)")


def find_emphases(text: str, language: str) -> Iterator[EmphasisedWords]:
    """Emphasised words of a text in order, none within another; in linear time."""
    start = 0
    for line in text.splitlines(keepends=True):
        has_small_letters, at = _SMALL.search(line) is not None, 0
        for match in _starred().finditer(line) if "*" in line else ():
            if has_small_letters:
                yield from _in_capitals(line, start, (at, match.start()), language)
            at = match.end()
            has_words = any(map(str.isalnum, match[2])) and match[2].count("(") == match[2].count(")")  # else footnotes
            if has_words and not _is_narrated(line, match):
                written = match[2]
                for words in _in_capitals(line, 0, match.span(2), language) if has_small_letters else ():
                    first, last = words.start - match.start(2), words.end - match.start(2)
                    written = written[:first] + words.text + written[last:]
                yield _emphasised(written, start + match.start(), start + at)
        if has_small_letters:
            yield from _in_capitals(line, start, (at, len(line)), language)
        start += len(line)


def _is_narrated(line: str, match: "re.Match[str]") -> bool:
    """Whether a whole clause stands between asterisks: what happens (*the door creaks*), which nobody emphasises."""
    words, before = match[2], line[max(match.start() - _BEFORE, 0) : match.start()]
    is_clause = len(words.split()) >= MIN_NARRATED_WORDS and words[0].islower()
    return is_clause and _SENTENCE_START.search(before) is not None and not _GOES_ON.match(line, match.end())


def _in_capitals(line: str, start: int, span: tuple[int, int], language: str) -> Iterator[EmphasisedWords]:
    """Words in capitals in a part of a line that are emphasised; successive ones are one."""
    waiting: list[re.Match[str]] = []
    for match in _CAPITALS.finditer(line, *span):
        if not _is_emphasised(line, match, language):
            continue
        if waiting and line[waiting[-1].end() : match.start()].strip(" "):
            yield _in_ordinary_writing(line, start, waiting, language)
            waiting = []
        waiting.append(match)
    if waiting:
        yield _in_ordinary_writing(line, start, waiting, language)


def _is_emphasised(line: str, match: "re.Match[str]", language: str) -> bool:
    word, start = match.group(), match.start()
    before = line[max(start - _BEFORE, 0) : start]
    if not word.isupper() or line[match.end() : match.end() + 1] == ":":
        return False  # the second: WARNING:, ANNA: or [EMOTION: calm] names what follows
    if language.partition("-")[0] == "en":
        may_be_code = _AFTER_NUMBER.search(before) or _AFTER_TOWN.search(before)
        if len(word) <= MAX_CODE_LETTERS and may_be_code:
            return False
        words = _WORD.findall(before)
        if word == "AM" and words[-1:] != ["I"]:  # the AM radio
            return False
        spellings = {word, _STRETCHED.sub(r"\1", word), _STRETCHED.sub(r"\1\1", word)}
        return any(len(form) > 1 and is_word_in_capitals(form, words[-1] if words else "") for form in spellings)
    is_long = len(word) >= MIN_FOREIGN_LETTERS and word not in READ_ACRONYMS and _ROMAN.fullmatch(word) is None
    return word.casefold() in common_words(language) or is_long


def _in_ordinary_writing(line: str, start: int, words: "list[re.Match[str]]", language: str) -> EmphasisedWords:
    """Successive words in capitals; in English with small letters, by which they are read as words."""
    first, last = words[0].start(), words[-1].end()
    written = line[first:last]
    if language.partition("-")[0] == "en":
        is_first = _SENTENCE_START.search(line[max(first - _BEFORE, 0) : first]) is not None
        written = (written[0] if is_first else written[0].lower()) + written[1:].lower().replace("i'm", "I'm")
    return _emphasised(written, start + first, start + last)


def _emphasised(words: str, start: int, end: int) -> EmphasisedWords:
    is_short = len(words.split()) <= MAX_STRONG_WORDS
    return EmphasisedWords(start, end, words, STRONG if is_short else MODERATE)
