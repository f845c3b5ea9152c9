"""Decide by tables whether a full stop ends a sentence or belongs to an abbreviation.

The rules of ``sentence_ends.tsv`` state, for an abbreviation of a language (``*``: of every language without a table of
its own), what may follow it within a sentence:

========== ===============================================================================================
``never``  anything: the full stop ends no sentence (Dr. Smith)
``number`` a number (Fig. 2)
``start``  anything but a word that sentences begin with (Ph.D. students, but: Ph.D. She left.)
``unless`` one of the words of the row (5 p.m. Monday)
========== ===============================================================================================

An English abbreviation without a row there follows its context in ``abbreviations.tsv``.

Split a long text into sentences, in bounded memory.
"""

import functools
import re
from collections.abc import Iterator
from dataclasses import dataclass
from importlib import resources
from types import MappingProxyType

from lexicon import written_forms as readings
from lexicon.errors import InputError

MARKS = frozenset(".,;:!?")  # of clauses and sentences
_WORD = re.compile(r"""[^\s("'“‘«„\[]*\Z""")
_FIRST_WORD = re.compile(r"""["'“‘«(\[]*([^\W\d_]{1,40})""")
_NUMBER = re.compile(r"""[#("'“‘]?(?:[0-9]|[IVXLC]{2,9}\b|[VX]\b)""")
_DOTTED = re.compile(r"(?:[^\W\d_]\.)+[^\W\d_]")
_ORDINAL = re.compile(r"[0-9]{1,2}")
_MAX_WORD_CHARACTERS = 24  # characters before the full stop that are searched; the longest abbreviation has 8
_OF_CONTEXT = MappingProxyType({
    "title": "never", "number": "number", "doctor": "never", "saint": "start", "after": "start", "any": "number",
})  # fmt: skip


@dataclass(frozen=True, slots=True)
class _StopRule:
    rule: str
    words: frozenset[str] = frozenset()


@functools.cache
def _rule_table() -> dict[str, dict[str, _StopRule]]:
    """Rules by language and abbreviation."""
    found: dict[str, dict[str, _StopRule]] = {}
    lines = resources.files("lexicon").joinpath("sentence_ends.tsv").read_text(encoding="utf-8").splitlines()[1:]
    for line in lines:
        language, written, rule, words = line.split("\t")
        found.setdefault(language, {})[written] = _StopRule(rule, frozenset(words.split()))
    for written, (_, context) in readings.read_table("abbreviations.tsv").items():
        is_lower = written.islower() and context in {"any", "after"}
        found["en"].setdefault(written, _StopRule("number" if is_lower else _OF_CONTEXT[context]))
    return found


@functools.cache
def abbreviations(language: str) -> frozenset[str]:
    """Abbreviations of a language that end with a full stop, without it."""
    table = _rule_table().get(_primary(language), _rule_table()["*"])
    return frozenset(written for written in table if written not in ("*", "#"))


@functools.cache
def _titles(language: str) -> dict[str, _StopRule]:
    """Rules of abbreviations that end no sentence, by their capitals: MR. SMITH in a text of small letters."""
    table = _rule_table().get(language, _rule_table()["*"])
    return {written.upper(): stop for written, stop in table.items() if stop.rule == "never" and len(written) > 1}


@functools.cache
def sentence_starts() -> frozenset[str]:
    """English words that begin sentences and are rarely capitalised within one."""
    return _rule_table()["en"]["*"].words


def starts_sentence(text: str) -> bool:
    """Whether the first word of a text is one that begins English sentences."""
    word = _FIRST_WORD.match(text)
    return word is not None and word[1] in sentence_starts()


def ends_sentence(before: str, after: str, language: str) -> bool:
    """Whether a full stop ends a sentence.

    Parameters
    ----------
    before, after
        The text before the full stop, and after the space that follows it; the last 24 and the first 40 characters
        suffice.
    """
    word = _last_word(before)
    stop = _find_rule(word, language)
    if stop is None:
        is_first = len(word) == len(before.lstrip())
        return _unlisted_ends_sentence(word, after, is_english=_primary(language) == "en", is_first=is_first)
    return _rule_ends_sentence(stop, after)


def is_abbreviated(before: str, after: str, language: str) -> bool:
    """Whether the full stop belongs to an abbreviation of the tables and ends no sentence; see `ends_sentence`."""
    stop = _find_rule(_last_word(before), language)
    return stop is not None and after != "" and not _rule_ends_sentence(stop, after)


def _primary(language: str) -> str:
    return language.partition("-")[0].lower()


def _last_word(before: str) -> str:
    written = _WORD.search(before[-_MAX_WORD_CHARACTERS:])
    return written.group() if written else ""


def _find_rule(word: str, language: str) -> _StopRule | None:
    table = _rule_table().get(_primary(language), _rule_table()["*"])
    found = table.get(word) or (table.get("#") if _ORDINAL.fullmatch(word) else None)
    return found or (_titles(_primary(language)).get(word) if word.isupper() else None)


def _rule_ends_sentence(stop: _StopRule, after: str) -> bool:
    if stop.rule == "number":
        return _NUMBER.match(after) is None
    if stop.rule == "start":
        return starts_sentence(after)
    if stop.rule == "unless":
        following = _FIRST_WORD.match(after)
        return following is None or following[1] not in stop.words
    return False


def _unlisted_ends_sentence(word: str, after: str, *, is_english: bool, is_first: bool) -> bool:
    """Whether an unlisted word ends a sentence: initials (U.S.) only before an English word that begins one."""
    is_initial = len(word) == 1 and word.isupper()
    is_dotted = _DOTTED.fullmatch(word) is not None and word[-1].isupper()
    if not is_initial and not is_dotted:
        return True
    return is_english and not is_first and starts_sentence(after)


# A sentence ends at ., !, ? or … (with closing quotes) before a space that no lower-case letter follows, at an end mark
# of East Asian or Indic writing, or at a blank line. A run of marks is tried once, from its first mark, and as a whole.
_END = re.compile(r"""(?<![.!?…])[.!?…]++["'”’)\]]*+(?=\s++[^a-z])|[。！？｡।॥؟۔]+["'”’」』）]*|\n\s*\n""")
_CLAUSE = re.compile(r"[,;:—–、，；：،؛](?=\s)|[、，；：]")
# Words before which an English phrase may end where a sentence has no clause mark, the better places first.
_PHRASE_BEGINS = (
    "and but or so because which who whose where when while until unless if though although since that",
    "about after against around at before behind between by during for from in into near on over through to under with",
)
_PHRASE_PLACES = tuple(re.compile(rf"(?<!\d)\s(?=(?:{words.replace(' ', '|')})\s(?!\d))") for words in _PHRASE_BEGINS)
_BETWEEN_WORDS = re.compile(r"(?<=[^\W\d_A-Z])\s(?=[^\W\d_A-Z])")
_MIN_PHRASE_CHARACTERS = 20  # of either part; shorter ones sound like words of their own
_MAX_UNDIVIDED_CHARACTERS = 600  # a longer word, as of digits, is divided; addresses are shorter
_CONTEXT_BEFORE, _CONTEXT_AFTER = 24, 40  # characters around a full stop by which an abbreviation is recognised


def split_chunks(text: str, limit: int, language: str = "en-us") -> Iterator[str]:
    """Sentences of a text, none longer than `limit` characters unless a single word is, of up to 600 characters.

    A longer sentence is split after the last clause mark within the limit, else at the last space, and in text without
    either (Chinese, Japanese, a longer word) after `limit` characters. Only white space is dropped. Abbreviations are
    those of the language (`lexicon.sentence_ends`).

    Raises
    ------
    InputError
        `limit` is below 1.
    """
    if limit < 1:
        raise InputError(f"the limit of a chunk must be at least 1 character, not {limit}; increase it")
    begin = 0
    for match in _END.finditer(text):
        if _is_abbreviated(text, begin, match, language):
            continue
        yield from _split_sentence(text[begin : match.end()], limit)
        begin = match.end()
    yield from _split_sentence(text[begin:], limit)


def split_phrase(sentence: str, limit: int) -> tuple[str, str]:
    """First phrase of a sentence that is longer than `limit` characters, and the rest; the rest may be empty.

    The phrase ends at the last clause mark within the limit, else before an English conjunction, else before a
    preposition, else between two words; never beside a number, whose reading depends on its neighbours.
    """
    if len(sentence) <= limit:
        return sentence, ""
    last = min(limit, len(sentence) - _MIN_PHRASE_CHARACTERS)
    clauses = (
        at.end() for at in _CLAUSE.finditer(sentence, 0, last + 1) if not sentence[at.end() :].lstrip()[:1].isdigit()
    )
    others = ((at.start() for at in kind.finditer(sentence, 0, last + 1)) for kind in (*_PHRASE_PLACES, _BETWEEN_WORDS))
    for places in (clauses, *others):
        at = max((place for place in places if _MIN_PHRASE_CHARACTERS <= place <= last), default=0)
        if at:
            return sentence[:at].rstrip(), sentence[at:].lstrip()
    return sentence, ""


def middle_place(text: str) -> int:
    """Index of the space that is nearest to the middle of a text; of the middle in a text without spaces."""
    middle = len(text) // 2
    places = [place for place in (text.rfind(" ", 0, middle), text.find(" ", middle)) if place >= 0]
    return min(places, key=lambda place: abs(place - middle), default=middle)


def _is_abbreviated(text: str, begin: int, end: "re.Match[str]", language: str) -> bool:
    """Whether the full stop of a possible sentence end belongs to an abbreviation."""
    if end.group().rstrip("\"'”’)]") != ".":
        return False
    before = text[max(begin, end.start() - _CONTEXT_BEFORE) : end.start()]
    return not ends_sentence(before, text[end.end() : end.end() + _CONTEXT_AFTER].lstrip(), language)


def _split_sentence(sentence: str, limit: int) -> Iterator[str]:
    text, begin = " ".join(sentence.split()), 0
    while len(text) - begin > limit:
        end = _cut_position(text, begin, limit)
        yield text[begin:end].rstrip()
        begin = end + text.startswith(" ", end)
    if begin < len(text):
        yield text[begin:]


def _cut_position(text: str, begin: int, limit: int) -> int:
    """Index at which a text whose rest from `begin` is longer than the limit is split."""
    end = begin + limit
    clauses = [match.end() for match in _CLAUSE.finditer(text, begin + limit // 3, end)]
    if clauses:
        return clauses[-1]
    space = text.rfind(" ", begin + 1, end + 1)
    if space > 0:
        return space
    if not (text[end - 1].isascii() and text[end].isascii()):
        return end
    longest = begin + max(limit, _MAX_UNDIVIDED_CHARACTERS)
    word_end = text.find(" ", end, longest + 1)
    if word_end > 0:
        return word_end
    return len(text) if len(text) <= longest else end
