"""English words of written forms: money, dates, times, measures, telephone numbers, addresses.

The functions take the parts of a written form and return words without digits or symbols.
"""

import functools
import re
from dataclasses import dataclass
from importlib import resources

from lexicon.number_words import (
    cardinal_words,
    decade_year_words,
    digit_words,
    fraction_words,
    number_words,
    ordinal_words,
    year_words,
)

MONTHS = (
    "January", "February", "March", "April", "May", "June", "July", "August", "September", "October", "November",
    "December",
)  # fmt: skip
DAYS = ("Monday", "Tuesday", "Wednesday", "Thursday", "Friday", "Saturday", "Sunday")
CURRENCIES = {
    "$": ("dollar", "dollars", "cent", "cents"), "£": ("pound", "pounds", "penny", "pence"),
    "€": ("euro", "euros", "cent", "cents"), "¥": ("yen", "yen", "sen", "sen"),
    "₹": ("rupee", "rupees", "paisa", "paise"), "₩": ("won", "won", "jeon", "jeon"),
    "₽": ("ruble", "rubles", "kopek", "kopeks"), "₺": ("lira", "lira", "kurush", "kurush"),
    "₿": ("bitcoin", "bitcoins", "satoshi", "satoshis"), "¢": ("cent", "cents", "", ""),
    "USD": ("US dollar", "US dollars", "cent", "cents"), "EUR": ("euro", "euros", "cent", "cents"),
    "GBP": ("pound", "pounds", "penny", "pence"), "JPY": ("yen", "yen", "sen", "sen"),
    "CHF": ("Swiss franc", "Swiss francs", "centime", "centimes"),
    "CAD": ("Canadian dollar", "Canadian dollars", "cent", "cents"),
    "AUD": ("Australian dollar", "Australian dollars", "cent", "cents"),
    "NZD": ("New Zealand dollar", "New Zealand dollars", "cent", "cents"),
    "HKD": ("Hong Kong dollar", "Hong Kong dollars", "cent", "cents"),
    "SGD": ("Singapore dollar", "Singapore dollars", "cent", "cents"),
    "BRL": ("real", "reais", "centavo", "centavos"), "MXN": ("Mexican peso", "Mexican pesos", "centavo", "centavos"),
    "INR": ("rupee", "rupees", "paisa", "paise"), "CNY": ("yuan", "yuan", "fen", "fen"),
}  # fmt: skip
MAGNITUDES = {
    "k": "thousand", "K": "thousand", "m": "million", "M": "million", "b": "billion", "B": "billion", "T": "trillion",
    "mn": "million", "bn": "billion", "tn": "trillion",
}  # fmt: skip
DOLLARS = {
    "US": "USD", "C": "CAD", "CA": "CAD", "A": "AUD", "AU": "AUD", "NZ": "NZD", "HK": "HKD", "S": "SGD", "R": "BRL",
    "MX": "MXN",
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class WrittenForm:
    """A written form and its words; a punctuation mark is kept."""

    source: str
    spoken: str


@functools.cache
def read_table(name: str) -> dict[str, tuple[str, ...]]:
    """Rows of one of this package's tables, by their first cell."""
    lines = resources.files("lexicon").joinpath(name).read_text(encoding="utf-8").splitlines()[1:]
    return {row[0]: tuple(row[1:]) for row in (line.split("\t") for line in lines)}


def signed_number_words(written: str) -> str:
    """A number with its sign."""
    if written[0] in "+-":
        return f"{'minus' if written[0] == '-' else 'plus'} {number_words(written[1:])}"
    return number_words(written)


def money_words(amount: str, currency: str, magnitude: str) -> str:
    """$5.20 is five dollars and twenty cents, $2.5M two point five million dollars."""
    singular, many, cent, cents = CURRENCIES[currency]
    sign = "minus " if amount.startswith("-") else ""
    amount = amount.lstrip("+-")
    whole, _, decimals = amount.replace(",", "").replace("'", "").partition(".")
    if magnitude:
        return f"{sign}{number_words(amount)} {MAGNITUDES.get(magnitude, magnitude)} {many}"
    if decimals and (len(decimals) != 2 or not cent):
        return f"{sign}{number_words(amount)} {many}"
    whole_words = f"{number_words(whole or '0')} {singular if int(whole or 0) == 1 else many}"
    if not int(decimals or 0):
        return sign + whole_words
    small = f"{cardinal_words(int(decimals))} {cent if int(decimals) == 1 else cents}"
    return sign + (f"{whole_words} and {small}" if int(whole or 0) else small)


def measure_words(amount: str, unit: str) -> str:
    """5 km is five kilometers, 1 km one kilometer."""
    return f"{signed_number_words(amount)} {unit_words(unit, is_one=amount.lstrip('+-') == '1')}"


def unit_words(unit: str, *, is_one: bool = False) -> str:
    """Name of a unit: kilometers, of one kilometer; milligrams per deciliter of mg/dL."""
    table = read_table("units.tsv")
    name = table.get(unit)
    if name is None:
        first, _, second = unit.partition("/")
        return f"{table[first][0 if is_one else 1]} per {table[second][0]}"
    return name[0 if is_one else 1]


def year_or_number_words(written: str) -> str:
    """A year for four digits without leading zero, else a number."""
    return year_words(int(written)) if len(written) == 4 and written[0] != "0" else number_words(written)


def date_words(day: int, month: int, year_written: str, *, day_first: bool = False) -> str:
    """March third, twenty twenty-four, or the third of March."""
    spoken = (
        f"the {ordinal_words(day)} of {MONTHS[month - 1]}" if day_first else f"{MONTHS[month - 1]} {ordinal_words(day)}"
    )
    if not year_written:
        return spoken
    full = int(year_written)
    if len(year_written) == 2:
        full += 2000 if full < 50 else 1900
    return f"{spoken}, {year_words(full)}"


def numeric_date_words(first: int, second: int, year_written: str, separator: str) -> str | None:
    """3/15/2024 month first, 15/3/2024 and 15.3.2024 day first; None if it is not a date."""
    day_first = separator == "." or first > 12
    day, month = (first, second) if day_first else (second, first)
    if not (1 <= day <= 31 and 1 <= month <= 12):
        return None
    return date_words(day, month, year_written)


def month_number(name: str) -> int:
    """1 to 12 for a month's name or its first three letters."""
    return next(at for at, month in enumerate(MONTHS, start=1) if month[:3].lower() == name[:3].lower())


def time_words(hour: int, minute: int, second: int, half: str) -> str:
    """3:05 pm is three oh five PM, 15:00 fifteen hundred, 3:00 three o'clock."""
    words = cardinal_words(hour)
    if minute:
        words += f" {'oh ' if minute < 10 else ''}{cardinal_words(minute)}"
    elif not half:
        words += " hundred" if hour > 12 else " o'clock"
    if second:
        words += f" and {cardinal_words(second)} second{'s' if second != 1 else ''}"
    return f"{words} {half.replace('.', '').upper()}" if half else words


def duration_words(hours: int, minutes: int, seconds: int) -> str:
    """1:02:35 is one hour two minutes and thirty-five seconds."""
    parts = [(hours, "hour"), (minutes, "minute"), (seconds, "second")]
    said = [f"{cardinal_words(count)} {name}{'' if count == 1 else 's'}" for count, name in parts if count]
    return " and ".join([" ".join(said[:-1]), said[-1]]) if len(said) > 1 else "".join(said)


def telephone_words(written: str) -> str:
    """Digit by digit, with a comma between groups."""
    groups = [digit_words(group) for group in re.findall(r"[0-9]+", written)]
    return ("plus " if written.lstrip().startswith("+") else "") + ", ".join(groups)


def ratio_words(top: str, bottom: str, whole: str = "") -> str:
    """1/2 is one half, 2 1/2 two and a half."""
    part = fraction_words(int(top), int(bottom))
    if not whole:
        return part
    return f"{number_words(whole)} and {'a' + part.removeprefix('one') if part.startswith('one ') else part}"


def decade_words(written: str) -> str:
    """1990s is nineteen nineties."""
    return decade_year_words(int(written))
