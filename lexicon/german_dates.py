"""Dates of German texts, whose days are ordinal numbers in the case of the date (dritter Mai, am dritten Mai)."""

import re

from lexicon.dictionary import word_set

_MONTH = "Januar|Jänner|Februar|März|April|Mai|Juni|Juli|August|September|Oktober|November|Dezember"
_DATE = re.compile(rf"(?:\b(?P<before>[^\W\d_]+) )?\b(?P<day>[0-9]{{1,2}})\. ?(?=(?:{_MONTH})\b)")
_ORDINALS = (
    "erst", "zweit", "dritt", "viert", "fünft", "sechst", "siebt", "acht", "neunt", "zehnt", "elft", "zwölft",
    "dreizehnt", "vierzehnt", "fünfzehnt", "sechzehnt", "siebzehnt", "achtzehnt", "neunzehnt", "zwanzigst",
    *(f"{digit}undzwanzigst" for digit in ("ein", "zwei", "drei", "vier", "fünf", "sechs", "sieben", "acht", "neun")),
    "dreißigst", "einunddreißigst",
)  # fmt: skip
_DATIVE = word_set("am vom zum dem den im beim ab bis seit des nach vor")


def read_german_dates(text: str) -> str:
    """The text with the days of its dates as words, in the case that the word before requires."""
    return _DATE.sub(_read_day, text)


def _read_day(match: "re.Match[str]") -> str:
    day, before = int(match["day"]), match["before"]
    if not 1 <= day <= len(_ORDINALS):
        return match.group()
    small = (before or "").lower()
    ending = "en" if small in _DATIVE else "e" if small in {"der", "die", "das"} else "er"
    return f"{before} " * bool(before) + f"{_ORDINALS[day - 1]}{ending} "
