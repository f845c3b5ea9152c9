"""Texts that are read as a given kind (``<say-as>``) in a language with a table."""

from lexicon.locales.numbers import ordinal, year
from lexicon.locales.reading import read
from lexicon.locales.tables import Locale

KINDS = frozenset({"ordinal", "date", "time", "fraction", "currency", "money", "unit"})


def read_ordinal(locale: Locale, written: str) -> str:
    """Words of an ordinal; its digits may have an ending."""
    return ordinal(locale, int("".join(filter(str.isdigit, written))))


def read_date(locale: Locale, parts: dict[str, str]) -> str:
    """Words of a date of which the numbers of its day, month and year (d, m, y) are known, or some of them."""
    known = {name: int(part) for name, part in parts.items() if part.isdigit()}
    if "m" not in known:
        return year(locale, known["y"]) if "y" in known else ordinal(locale, known["d"])
    month = locale.rows("month")[str(known["m"])].spoken
    if "d" not in known:
        return f"{month} {year(locale, known['y'])}" if "y" in known else month
    if "y" in known:
        return read(f"{full_year(known['y']):04}-{known['m']:02}-{known['d']:02}", locale.language)
    return read(f"{known['d']} {month}", locale.language)


def full_year(number: int) -> int:
    """Year of a number with two digits or four."""
    return number + (2000 if number < 50 else 1900) if number < 100 else number
