"""Decide by tables whether a full stop ends a sentence or belongs to an abbreviation.

The rules of ``sentence_ends.tsv`` state, for an abbreviation of a language (``*``: of every language without a table of
its own), what may follow it within a sentence; an English one without a row follows its context in
``abbreviations.tsv``, and one of a book in ``scripture.tsv`` goes on before a number:

========== ===============================================================================================
``never``  anything: the full stop ends no sentence (Dr. Smith)
``number`` a number (Fig. 2)
``start``  anything but a word that sentences begin with (Ph.D. students, but: Ph.D. She left.)
``unless`` one of the words of the row (5 p.m. Monday)
========== ===============================================================================================
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
    for written, (spoken,) in readings.read_table("scripture.tsv").items():
        if written != spoken:  # Rom. 8:28
            found["en"].setdefault(written, _StopRule("number"))
    return found


@functools.cache
def _rules(language: str) -> dict[str, _StopRule]:
    """Rules of a language by abbreviation: of its rows, of all languages without rows, and of its own table."""
    table = _rule_table()
    own = dict(table.get(language, table["*"]))
    if language == "en":  # whose rows are in the tables above
        return own
    from lexicon.locales.tables import find_locale

    locale = find_locale(language)
    for written, row in locale.rows("abbreviation").items() if locale else ():
        if written.endswith(".") and not {"end", "after"} & row.details.keys():
            last = written[:-1].rpartition(" ")[2]
            own.setdefault(last, _StopRule("number" if "number" in row.details else "never"))
    return own


@functools.cache
def abbreviations(language: str) -> frozenset[str]:
    """Abbreviations of a language that end with a full stop, without it."""
    return frozenset(written for written in _rules(_primary(language)) if written not in ("*", "#"))


@functools.cache
def _titles(language: str) -> dict[str, _StopRule]:
    """Rules of abbreviations that end no sentence, by their capitals: MR. SMITH in a text of small letters."""
    return {
        written.upper(): stop for written, stop in _rules(language).items() if stop.rule == "never" and len(written) > 1
    }


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
    if after[:1].islower() and not after[:1].isascii():  # т. е. половина
        return False
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
    table = _rules(_primary(language))
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
    # "J. Smith" goes on, "in the U.S. The army" does not; only English has a table of such words
    return is_english and not is_first and starts_sentence(after)
