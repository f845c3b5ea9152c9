"""Whether a full stop ends a sentence or belongs to an abbreviation, by tables.

The rules of ``stops.tsv`` name, for an abbreviation of a language (``*``: of every language without an own table), what
may follow it within a sentence:

========== ===============================================================================================
``never``  anything: the full stop ends no sentence (Dr. Smith)
``number`` a number (Fig. 2)
``start``  anything but a word that sentences begin with (Ph.D. students, but: Ph.D. She left.)
``unless`` one of the words of the row (5 p.m. Monday)
========== ===============================================================================================

An English abbreviation without a row there follows its context in ``abbreviations.tsv``.
"""

import functools
import re
from dataclasses import dataclass
from importlib import resources
from types import MappingProxyType

from lexicon import written_forms as readings

_WORD = re.compile(r"""[^\s("'“‘«„\[]*\Z""")
_FIRST_WORD = re.compile(r"""["'“‘«(\[]*([^\W\d_]{1,40})""")
_NUMBER = re.compile(r"""[#("'“‘]?(?:[0-9]|[IVXLC]{2,9}\b|[VX]\b)""")
_DOTTED = re.compile(r"(?:[^\W\d_]\.)+[^\W\d_]")
_ORDINAL = re.compile(r"[0-9]{1,2}")
_LONGEST_WORD = 24  # characters before the full stop that are looked at; the longest abbreviation has 8
_OF_CONTEXT = MappingProxyType({
    "title": "never", "number": "number", "doctor": "never", "saint": "start", "after": "start", "any": "number",
})  # fmt: skip


@dataclass(frozen=True, slots=True)
class _Stop:
    rule: str
    words: frozenset[str] = frozenset()


@functools.cache
def _table() -> dict[str, dict[str, _Stop]]:
    """Rules by language and abbreviation."""
    found: dict[str, dict[str, _Stop]] = {}
    lines = resources.files("lexicon").joinpath("stops.tsv").read_text(encoding="utf-8").splitlines()[1:]
    for line in lines:
        language, written, rule, words = line.split("\t")
        found.setdefault(language, {})[written] = _Stop(rule, frozenset(words.split()))
    for written, (_, context) in readings.read_table("abbreviations.tsv").items():
        is_lower = written.islower() and context in {"any", "after"}
        found["en"].setdefault(written, _Stop("number" if is_lower else _OF_CONTEXT[context]))
    return found


@functools.cache
def sentence_starts() -> frozenset[str]:
    """English words that begin sentences and seldom stand within one with a capital."""
    return _table()["en"]["*"].words


def starts_sentence(text: str) -> bool:
    """The first word of a text is one that English sentences begin with."""
    word = _FIRST_WORD.match(text)
    return word is not None and word[1] in sentence_starts()


def ends_sentence(before: str, after: str, language: str) -> bool:
    """Whether a full stop ends a sentence.

    Parameters
    ----------
    before, after
        The text up to the full stop, without it, and behind the space that follows it; the last 24 and the first 40
        characters suffice.
    """
    word = _last_word(before)
    stop = _stop(word, language)
    if stop is None:
        is_first = len(word) == len(before.lstrip())
        return _ends_unlisted(word, after, is_english=_primary(language) == "en", is_first=is_first)
    return _ends_by(stop, after)


def is_abbreviated(before: str, after: str, language: str) -> bool:
    """Whether the full stop belongs to an abbreviation of the tables and ends no sentence; see `ends_sentence`."""
    stop = _stop(_last_word(before), language)
    return stop is not None and after != "" and not _ends_by(stop, after)


def _primary(language: str) -> str:
    return language.partition("-")[0].lower()


def _last_word(before: str) -> str:
    written = _WORD.search(before[-_LONGEST_WORD:])
    return written.group() if written else ""


def _stop(word: str, language: str) -> _Stop | None:
    table = _table().get(_primary(language), _table()["*"])
    return table.get(word) or (table.get("#") if _ORDINAL.fullmatch(word) else None)


def _ends_by(stop: _Stop, after: str) -> bool:
    if stop.rule == "number":
        return _NUMBER.match(after) is None
    if stop.rule == "start":
        return starts_sentence(after)
    if stop.rule == "unless":
        following = _FIRST_WORD.match(after)
        return following is None or following[1] not in stop.words
    return False


def _ends_unlisted(word: str, after: str, *, is_english: bool, is_first: bool) -> bool:
    """Initials (J. K. Rowling, U.S.) end an English sentence before a word that begins one; other words always do."""
    is_initial = len(word) == 1 and word.isupper()
    is_dotted = _DOTTED.fullmatch(word) is not None and word[-1].isupper()
    if not is_initial and not is_dotted:
        return True
    return is_english and not is_first and starts_sentence(after)
