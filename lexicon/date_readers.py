"""Readers of dates and times: days, months, years, decades, hours, laps; each says the words of a matched form."""

import re

from lexicon import written_forms as readings
from lexicon.form_readers import keep_full_stop, text_before
from lexicon.number_words import cardinal_words, digit_words, number_words, ordinal_words, year_words

_NOON = re.compile(r" (?:noon|midnight)\b")
_LASTED = re.compile(r"\b(?:took|takes|lasted|lasts|last|in|of|ran|runs|time|record|duration|for|after|finished) \Z")


def read_numeric_date(m: re.Match[str], _: str) -> str:
    """3/15/2024 is March fifteenth; 13/13/13 is not a date and is read number by number."""
    first = m["nd1"]
    separator = m["ndsep"]
    second = m["nd2"]
    last = m["ndy"]
    words = readings.numeric_date_words(int(first), int(second), last, separator)
    sign = {"/": "slash", ".": "point", "-": "dash"}[separator]
    return words or f" {sign} ".join(number_words(part) for part in (first, second, last))


def read_iso_date(m: re.Match[str], _: str) -> str:
    """2024-03-15 is March fifteenth, twenty twenty-four."""
    month, day = int(m["isom"]), int(m["isod"])
    if 1 <= month <= 12 and 1 <= day <= 31:
        return readings.date_words(day, month, m["isoy"])
    return " dash ".join(number_words(m[part]) for part in ("isoy", "isom", "isod"))


def read_month_first(m: re.Match[str], _: str) -> str:
    """March 3, 2024 is March third, twenty twenty-four."""
    month = readings.month_number(m["mf"])
    day = int(m["mfd"])
    last = m["mfy"] or ""
    if m["mfto"] and day < int(m["mfto"]) <= 31:
        year = f", {year_words(int(last))}" if last else ""
        return f"{readings.date_words(day, month, '')} to {ordinal_words(int(m['mfto']))}{year}"
    if 1 <= day <= 31 and not m["mfto"]:
        return readings.date_words(day, month, last)
    words = f"{readings.MONTHS[month - 1]} {number_words(m['mfd'])}"
    words += f" to {number_words(m['mfto'])}" if m["mfto"] else ""
    return words + (f", {year_words(int(last))}" if last else "")


def read_month_year(m: re.Match[str], _: str) -> str:
    """March 2024 is March twenty twenty-four."""
    return f"{readings.MONTHS[readings.month_number(m['my']) - 1]} {year_words(int(m['myy']))}"


def read_day_first(m: re.Match[str], previous: str) -> str:
    """3 March 2024 is the third of March, twenty twenty-four."""
    month = readings.month_number(m["df"])
    day = int(m["dfd"])
    last = m["dfy"] or ""
    if not 1 <= day <= 31:
        return f"{number_words(m['dfd'])} {readings.MONTHS[month - 1]}" + (f" {year_words(int(last))}" if last else "")
    words = readings.date_words(day, month, last, day_first=True)
    return words.removeprefix("the ") if previous.lower() == "the" else words


def read_clock(m: re.Match[str], _: str) -> str:
    """3:05 pm is three oh five PM; 26:70 is not a time and is read as twenty-six to seventy."""
    hour, minute = m["hh"] or m["hh2"] or m["hh3"], m["mm"] or m["mm3"] or "0"
    half = m["half"] or m["half2"] or m["half3"] or ""
    if int(hour) > 24 or int(minute) > 59:
        after = f" {half.replace('.', '').upper()}".rstrip()
        return " to ".join(cardinal_words(int(part)) for part in (hour, minute, m["ss"]) if part) + after
    # 1:23:45 hours says itself what it is
    if m["ss"] and _LASTED.search(text_before(m)) and not m.string.startswith(" hour", m.end()):
        return readings.duration_words(int(hour), int(minute), int(m["ss"]))
    if int(hour) == 12 and int(minute) == 0 and _NOON.match(m.string, m.end()):
        return "twelve"
    return keep_full_stop(readings.time_words(int(hour), int(minute), int(m["ss"] or 0), half), m)


def read_proportion(m: re.Match[str], _: str) -> str:
    """3:1 is three to one."""
    return f"{cardinal_words(int(m['ra']))} to {cardinal_words(int(m['rb']))}"


def read_decade(m: re.Match[str], _: str) -> str:
    """1990s is nineteen nineties."""
    return readings.decade_words(m["decade"])


def read_short_name(m: re.Match[str], _: str) -> str:
    """The days and months of Mon–Fri, the day of Thu 9:30."""
    return keep_full_stop(_full_name(m["dayone"] or m["daytwo"] or m["daythree"]), m)


def _full_name(written: str) -> str:
    """Name of a weekday or month by its first three letters."""
    return next(name for name in (*readings.DAYS, *readings.MONTHS) if name.startswith(written[:3]))


def read_short_date(m: re.Match[str], _: str) -> str:
    """Thu 4/18 is Thursday, April eighteenth; on 4/18 on April eighteenth."""
    first, second = m["sd1"] or m["sd3"], m["sd2"] or m["sd4"]
    day = f"{_full_name(m['weekday'])}, " if m["weekday"] else ""
    said = readings.numeric_date_words(int(first), int(second), "", "/") or readings.ratio_words(first, second)
    return f"{day}{said}"


def read_lasting(m: re.Match[str], _: str) -> str:
    """3h 12m is three hours twelve minutes."""
    parts = ((m["lasth"], "hr"), (m["lastm"], "min"), (m["lasts"], "sec"))
    return " ".join(readings.measure_words(amount, unit) for amount, unit in parts if amount)


def read_lap(m: re.Match[str], _: str) -> str:
    """3:42.7 is three forty-two point seven."""
    return f"{readings.time_words(int(m['lapm']), int(m['laps']), 0, '')} point {digit_words(m['lapf'])}"


def read_season(m: re.Match[str], _: str) -> str:
    """2023/24 is twenty twenty-three twenty-four."""
    year, following = int(m["year"]), int(m["next"])
    is_next = following == (year + 1) % 100
    return f"{year_words(year)}{' ' if is_next else ' over '}{cardinal_words(following)}"
