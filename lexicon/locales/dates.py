"""Readers of dates, times and years."""

import re

from lexicon.locales.nouns import noun_form
from lexicon.locales.numbers import Amount, Grammar, cardinal, digits, ordinal, year
from lexicon.locales.place import Place
from lexicon.locales.tables import Locale, Row

_DAYS, _MONTHS = 31, 12
# Both times of a span have four digits (08.00-17.00): other numbers with a full stop are amounts.
_DOTTED_TIME = re.compile(r"[0-2][0-9]\.[0-5][0-9](?![0-9.])")
_DOTTED_SPAN = re.compile(rf"{_DOTTED_TIME.pattern} ?[-–] ?{_DOTTED_TIME.pattern}")
_SPAN_BEFORE = re.compile(r"(?<![0-9.])[0-2][0-9]\.[0-5][0-9] ?[-–] ?\Z")
_SPAN = 10  # characters of a time and its dash, at most


def read_numeric_date(place: Place) -> str | None:
    """3/5/2024, 3.5.2024 and 2024-05-03 as a day of a month, 12/25/2024 by its day; None for other numbers."""
    match, locale = place.match, place.locale
    day, month = int(match["day"]), int(match["month"])
    if _MONTHS < month <= _DAYS and match["s"] == "/":
        day, month = month, day
    if not (1 <= day <= _DAYS and 1 <= month <= _MONTHS):
        return None
    return _date(place, day, _month(locale, month), match["year"])


def _month(locale: Locale, number: int) -> str:
    """Name of a month, or its number where months have numbers."""
    row = locale.rows("month").get(str(number))
    return cardinal(locale, number) if row is None else row.spoken


def read_short_date(place: Place) -> str | None:
    """5/3 and 5.3. without a year, behind a word that dates have before them; 12/08 anywhere."""
    is_listed = place.text[max(place.match.start() - 2, 0) : place.match.start()] == ", "  # Fr., 13.12.
    is_dotted = place.match.group().endswith(".") and (is_listed or not place.is_last)
    has_zero = "/0" in place.match.group()
    if not (is_dotted or has_zero or place.before.lower() in place.locale.words("date_before")):
        return None
    day, month = int(place.match["day"]), int(place.match["month"])
    if not (1 <= day <= _DAYS and 1 <= month <= _MONTHS):
        return None
    return _date(place, day, _month(place.locale, month), "")


def read_named_date(place: Place) -> str | None:
    """Day and name of a month, perhaps with a year."""
    day = int(place.match["day"])
    if not 1 <= day <= _DAYS:
        return None
    return _date(place, day, _month_name(place.locale, place.match["month"]), place.match["year"] or "")


def read_month_year(place: Place) -> str | None:
    """Name of a month with a year."""
    name = _month_name(place.locale, place.match["month"])
    written = _year(place, place.match["year"])
    return place.locale.setting("month_year", "{month} {year}").format(month=name, year=written)


def _month_name(locale: Locale, written: str) -> str:
    for row in locale.rows("month").values():
        if written.lower() == row.spoken.lower() or written.lower().removesuffix(".") in row.details:
            return row.spoken
    return written


def months_pattern(locale: Locale) -> str:
    """Pattern of the names of months; short ones may have a full stop."""
    full = {row.spoken for row in locale.rows("month").values()}
    names = month_names(locale)
    return "|".join(re.escape(name) + ("" if name in full else r"\.?") for name in names)


def month_names(locale: Locale) -> list[str]:
    """Written names of months, the longest first; none where months have numbers."""
    if locale.setting("numbered_months"):
        return []
    names = [name for row in locale.rows("month").values() for name in (row.spoken, *row.details)]
    return sorted({*names, *(name[:1].upper() + name[1:] for name in names)}, key=len, reverse=True)


def _date(place: Place, day: int, month: str, written: str) -> str:
    locale = place.locale
    said = day_words(place, day)
    if not written:
        return locale.setting("date_short", "{day} {month}").format(day=said, month=month)
    return locale.setting("date", "{day} {month} {year}").format(day=said, month=month, year=_year(place, written))


def day_words(place: Place, day: int) -> str:
    """Words of a day of a month."""
    locale = place.locale
    if place.match.groupdict().get("ending") and locale.setting("marked_day"):  # 25η Μαρτίου
        return ordinal(locale, day, Grammar(locale.setting("day_gender"), place.grammar("ordinal").case))
    if day == 1 and locale.setting("first_day"):
        return locale.setting("first_day")
    gender = locale.setting("day_gender")
    if locale.setting("day") != "ordinal":
        return cardinal(locale, day, Grammar(gender))
    return ordinal(locale, day, Grammar(gender, place.grammar("ordinal").case or locale.setting("day_case")))


def _year(place: Place, written: str) -> str:
    """Words of a year in a date, with the word for year that is written behind it."""
    locale, number = place.locale, int(written)
    if len(written) == 2:
        number += 2000 if number < 50 else 1900
    said = year(locale, number, Grammar(locale.setting("year_gender"), locale.setting("year_case")))
    return f"{said} {locale.setting('year_word')}" if place.match.groupdict().get("yearword") else said


def read_weekdays(place: Place) -> str | None:
    """Name of a weekday, or a span of them: Mo.-Fr.; None for a word at the end of a sentence."""
    if not place.match["last"] and place.after[:1].isupper():
        return None
    rows = place.locale.rows("weekday")
    first, last = place.match["first"], place.match["last"]
    if not last:
        return rows[first].spoken
    end = rows[last].details.get("genitive", rows[last].spoken)
    return " ".join(part for part in (rows[first].spoken, place.locale.setting("to"), end) if part)


def read_year(place: Place) -> str | None:
    """A year with the word for it, which says its case: в 2024 году, w 2024 r."""
    locale = place.locale
    row = locale.rows("year_word")[place.match["word"]]
    if (place.match["suffix"] or "").endswith("х"):  # 1990-х гг.
        row = locale.rows("year_word")["годов"]
    case = row.details.get(place.before.lower()) or row.details.get("case", "")
    grammar = Grammar(row.details.get("gender", ""), case)
    word = row.details.get(f"word {case}") or row.spoken
    n = int(place.match["number"])
    return f"{year(locale, n, grammar)} {word}"


def read_time(place: Place) -> str | None:
    """Hours and minutes, with the word for hours that is written, perhaps behind them; None for other numbers."""
    locale, match = place.locale, place.match
    hour, minute = int(match["hour"]), int(match["minute"] or 0)
    is_dotted = match["sign"] == "."
    if hour > 24 or minute > 59 or (is_dotted and not (match["word"] or match["tail"] or _is_after_time_word(place))):
        return None
    if match["minute"] and len(match["minute"]) != 2:
        return None
    said = time_words(locale, hour, minute, place.grammar("hour").case)
    if match["second"]:
        said = f"{said} {locale.setting('and')} {cardinal(locale, int(match['second']))} {locale.setting('seconds')}"
    is_named = match["word"] or match["sign"] == "h"
    hours = noun_form(locale, Row(locale.setting("hour_word"), {}), Amount("", str(hour)))
    if is_named and hours and hours not in said:
        said = f"{said} {hours}"
    return said


def _is_after_time_word(place: Place) -> bool:
    start = place.match.start()
    is_span = _DOTTED_SPAN.match(place.text, start) or (
        _DOTTED_TIME.match(place.text, start) and _SPAN_BEFORE.search(place.text[max(start - _SPAN, 0) : start])
    )
    return bool(is_span) or place.before.lower() in place.locale.words("time_before")


def time_words(locale: Locale, hour: int, minute: int, case: str = "") -> str:
    """Words of a time of day by the template of the language."""
    agrees = hour == 1 or not locale.setting("only_one_agrees")  # l'una, but le ventuno
    grammar = Grammar(locale.setting("hour_gender") if agrees else "", case)
    said = ordinal(locale, hour, grammar) if locale.setting("hour") == "ordinal" else cardinal(locale, hour, grammar)
    unit = locale.rows("unit").get("h", Row("", {}))
    hours = noun_form(locale, unit, Amount("", str(hour)), case)
    if not minute:
        return locale.setting("time_full", "{h}").format(h=said, hours=hours)
    minutes = cardinal(locale, minute, Grammar(locale.setting("minute_gender")))
    if minute < 10 and locale.setting("minute_zero"):
        minutes = f"{digits(locale, '0')} {minutes}"
    return locale.setting("time", "{h} {m}").format(h=said, hours=hours, m=minutes)
