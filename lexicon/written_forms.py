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
    "INR": ("rupee", "rupees", "paisa", "paise"), "CNY": ("yuan", "yuan", "fen", "fen"),
}  # fmt: skip
MAGNITUDES = {
    "k": "thousand", "K": "thousand", "m": "million", "M": "million", "b": "billion", "B": "billion", "T": "trillion",
    "mn": "million", "bn": "billion", "tn": "trillion",
}  # fmt: skip
_SPELT_OUT = {"etc": "et cetera", "vs": "versus", "approx": "approximately"}
_ADDRESS_SIGNS = {
    ".": "dot", "/": "slash", "-": "dash", "_": "underscore", "@": "at", ":": "colon", "?": "question mark",
    "=": "equals", "&": "and", "#": "hash", "+": "plus", "~": "tilde", "%": "percent",
}  # fmt: skip
_SPELLED_ENDINGS = re.compile("uk|us|de|fr|eu|io|ai|tv|ca|ch|at|au|nz|jp|cn|ru|es|nl|se|pl|be|dk|fi|ie|br|mx|kr")


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
    whole, _, decimals = amount.replace(",", "").partition(".")
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
    singular, many = read_table("units.tsv")[unit]
    return f"{signed_number_words(amount)} {singular if amount.lstrip('+-') == '1' else many}"


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


def telephone_words(written: str) -> str:
    """Digit by digit, with a comma between groups."""
    groups = [digit_words(group) for group in re.findall(r"[0-9]+", written)]
    return ("plus " if written.lstrip().startswith("+") else "") + ", ".join(groups)


def _unambiguous_word(written: str) -> str:
    """A word of an address or tag in an unambiguous form: lower case, or an initialism in capitals."""
    is_initialism = written.isupper() and len(written) > 1 and not re.fullmatch("[IVXLCDM]+", written)
    if is_initialism:
        return written
    small = written.lower()
    return _SPELT_OUT.get(small) or read_table("symbols.tsv").get(small, (small,))[0]


def address_words(written: str) -> str:
    """www.example.com/a is WWW dot example dot com slash a."""
    bare = re.sub(r"^[A-Za-z]{2,8}://", "", written).rstrip("/")
    host = re.match(r"[^/?#]*", bare)
    last_dot = bare.rfind(".", 0, host.end() if host else None)
    words = []
    for piece in re.finditer(r"[^\W\d_]+|[0-9]+|[^\w\s]|_", bare):
        text = piece.group()
        if text[0].isdigit():
            words.append(number_words(text) if len(text) < 5 else digit_words(text))
        elif text.isalpha():
            is_spelled = text == "www" or (piece.start() == last_dot + 1 and _SPELLED_ENDINGS.fullmatch(text))
            words.append(text.upper() if is_spelled else _unambiguous_word(text.lower()))
        elif text in _ADDRESS_SIGNS:
            words.append(_ADDRESS_SIGNS[text])
    return " ".join(words)


def hashtag_words(written: str) -> str:
    """#MachineLearning2024 is machine learning twenty twenty-four."""
    pieces = re.findall(r"[A-Z]{2,}(?![a-z])|[A-Z]?[^\W\d_A-Z]+|[A-Z]|[0-9]+|[^\W\d_]+", written.lstrip("#@"))
    return " ".join(year_or_number_words(piece) if piece[0].isdigit() else _unambiguous_word(piece) for piece in pieces)


def ratio_words(top: str, bottom: str, whole: str = "") -> str:
    """1/2 is one half, 2 1/2 two and a half."""
    part = fraction_words(int(top), int(bottom))
    if not whole:
        return part
    return f"{number_words(whole)} and {'a' + part.removeprefix('one') if part.startswith('one ') else part}"


def decade_words(written: str) -> str:
    """1990s is nineteen nineties."""
    return decade_year_words(int(written))
