"""Words of a ``<say-as>`` element: a text read as a number, a date, letters and so on.

All kinds are supported in English, most in languages with a table (`lexicon.locales`). In others, where espeak-ng reads
numbers itself, only kinds that need no words of the language are: letters, digits, telephone and cardinal numbers.
"""

import re
from collections.abc import Callable
from types import MappingProxyType

from lexicon import written_forms as readings
from lexicon.errors import InputError
from lexicon.locales.kinds import KINDS as LOCAL_KINDS
from lexicon.locales.kinds import read_date, read_ordinal
from lexicon.locales.reading import read
from lexicon.locales.tables import Locale, find_locale
from lexicon.normalize import normalize
from lexicon.number_words import cardinal_words, digit_words, number_words, ordinal_words, roman_value

MAX_CHARACTERS = 300  # characters of one element
_SIGNS = MappingProxyType({
    ".": "dot", "-": "dash", "/": "slash", "_": "underscore", ":": "colon", ",": "comma", ";": "semicolon", "*": "star",
    "!": "exclamation mark", "?": "question mark", "'": "apostrophe", '"': "quote", "(": "open parenthesis",
    ")": "close parenthesis", "#": "hash", "$": "dollar sign", "~": "tilde", "|": "bar", "\\": "backslash",
})  # fmt: skip
_NUMBER = re.compile(r"([+-]?)([0-9]{1,3}(?:[ ,\u00a0\u202f][0-9]{3})+(?:\.[0-9]+)?|[0-9]+(?:\.[0-9]+)?|\.[0-9]+)")
_ROMAN = re.compile("[IVXLCDM]+")
_ORDINAL = re.compile(r"([0-9][0-9,]*)(?:st|nd|rd|th|\.)?")
_FRACTION = re.compile(r"(?:([0-9]{1,6})[ +])?([0-9]{1,6})\s*[/⁄]\s*([0-9]{1,6})")
_CLOCK = re.compile(
    r"([0-9]{1,2})[:.h]([0-9]{2})(?:[:.]([0-9]{2}))?\s*([aApP]\.?[mM]\.?)?|([0-9]{1,2})\s*([aApP]\.?[mM]\.?)"
)
_DURATION = re.compile(r"(?:([0-9]{1,3})h ?)?([0-9]{1,3})(?:'|′|m ?)(?:([0-9]{1,2})(?:\"|″|''|s))?")
_CURRENCY_FIRST = re.compile(r"([A-Z]{3})\s*([0-9][0-9,]*(?:\.[0-9]+)?)")
_COMPACT = re.compile("[0-9?]{8}")
_SAME_LETTERS = re.compile(r"([dmy])\1*[-./ ]?")  # yyyymmdd and dd.mm.yyyy are ymd and dmy
_PARTS = re.compile(r"[0-9]+|[^\W\d_]+|\?+")
DATE_FORMATS = ("mdy", "dmy", "ymd", "ydm", "md", "dm", "ym", "my", "y", "m", "d")
Reader = Callable[[str, str], str]


def say_as(kind: str, text: str, written_format: str, language: str) -> str:
    """Words of a text that is read as a given kind.

    Parameters
    ----------
    kind
        ``interpret-as``: one of `KINDS`.
    written_format
        ``format``: of dates one of `DATE_FORMATS`, of times hms12 or hms24, of currencies a code such as USD; or empty.
    """
    if kind not in KINDS:
        raise InputError(f"<say-as> has no kind {kind[:40]!r}; use {', '.join(KINDS)}")
    content = " ".join("".join(str(int(c)) if c.isdecimal() else c for c in text).split())
    if not content or len(content) > MAX_CHARACTERS:
        raise InputError(f"<say-as> needs 1 to {MAX_CHARACTERS} characters, not {len(content)}")
    if language.partition("-")[0] == "en":
        return KINDS[kind](content, written_format.strip())
    if kind in _OTHER_LANGUAGES:
        return _OTHER_LANGUAGES[kind](content)
    locale = find_locale(language)
    if locale is None or kind not in LOCAL_KINDS:
        raise InputError(f"<say-as> does not support {kind} in {language}; write it in words")
    return _of_locale(kind, content, written_format.strip(), locale)


def reads_kind(kind: str, language: str) -> bool:
    """Whether texts of a language are read as a kind (`say_as`)."""
    if language.partition("-")[0] == "en":
        return kind in KINDS
    return kind in _OTHER_LANGUAGES or (kind in LOCAL_KINDS and find_locale(language) is not None)


def _of_locale(kind: str, text: str, written_format: str, locale: Locale) -> str:
    """Words of a text in a language with a table."""
    try:
        if kind == "ordinal":
            return read_ordinal(locale, text)
        if kind == "date" and written_format:
            order = _SAME_LETTERS.sub(r"\1", written_format.lower())
            return read_date(locale, _date_parts(text, order))
    except (KeyError, ValueError, IndexError) as wrong:
        raise _reading_error(text, f"a {kind}", "12/31/1999 for mdy") from wrong
    is_currency = kind in {"currency", "money"} and written_format
    words = read(f"{text} {written_format.upper()}" if is_currency else text, locale.language)
    if words == text or any(character.isdigit() for character in words):
        raise _reading_error(text, f"a {kind}", "its usual form in the language")
    return words


def _reading_error(text: str, what: str, example: str) -> InputError:
    return InputError(f"cannot read {text[:40]!r} as {what}; write it as in {example}")


def _cardinal(text: str, _: str) -> str:
    match = _NUMBER.fullmatch(text)
    if match:
        return readings.signed_number_words(match[1] + re.sub(r"[ \u00a0\u202f]", "", match[2]))
    if _ROMAN.fullmatch(text) and roman_value(text):
        return cardinal_words(roman_value(text))
    raise _reading_error(text, "a cardinal number", "1,234")


def _ordinal(text: str, _: str) -> str:
    match = _ORDINAL.fullmatch(text)
    if match:
        return ordinal_words(int(match[1].replace(",", "")[:15]))
    if _ROMAN.fullmatch(text) and roman_value(text):
        return ordinal_words(roman_value(text))
    raise _reading_error(text, "an ordinal number", "3 or 3rd")


def _characters(text: str, _: str) -> str:
    return " ".join(_character(character) for character in text if not character.isspace())


def _character(character: str) -> str:
    if character.isdigit():
        return digit_words(character) if character.isascii() else character
    if character.isalpha():
        return character.upper()
    return _SIGNS.get(character) or readings.read_table("symbols.tsv").get(character, (normalize(character),))[0]


def _digits(text: str, _: str) -> str:
    if not re.fullmatch(r"[0-9 .,-]*[0-9][0-9 .,-]*", text):
        raise _reading_error(text, "digits", "4711")
    return digit_words(text)


def _telephone(text: str, _: str) -> str:
    groups = re.findall(r"[0-9]+|[A-Za-z]+", text)
    if not any(group.isdigit() for group in groups):
        raise _reading_error(text, "a telephone number", "+1 555 123 4567")
    words = ", ".join(digit_words(group) if group.isdigit() else _characters(group, "") for group in groups)
    return f"plus {words}" if text.startswith("+") else words


def _fraction(text: str, _: str) -> str:
    match = _FRACTION.fullmatch(text)
    if match is None:
        raise _reading_error(text, "a fraction", "3/4 or 1 1/2")
    return readings.ratio_words(match[2], match[3], match[1] or "")


def _time(text: str, written_format: str) -> str:
    match, duration = _CLOCK.fullmatch(text), _DURATION.fullmatch(text)
    if match and written_format in {"", "hms12", "hms24"}:
        hour, minute = int(match[1] or match[5]), int(match[2] or 0)
        half = match[4] or match[6] or ""
        if hour <= 24 and minute <= 59 and int(match[3] or 0) <= 59:
            return readings.time_words(hour, minute, int(match[3] or 0), half)
    if duration and not written_format:
        named = zip((duration[1], duration[2], duration[3]), ("hour", "minute", "second"), strict=True)
        return " ".join(f"{number_words(n)} {unit}{'' if int(n) == 1 else 's'}" for n, unit in named if n)
    if written_format not in {"", "hms12", "hms24"}:
        raise InputError(f"there is no format {written_format[:20]!r} of times; use hms12 or hms24")
    raise _reading_error(text, "a time", "3:05pm or 1'21\"")


def _date(text: str, written_format: str) -> str:
    if not written_format:
        words = normalize(text)
        if words == text or not any(character.isdigit() for character in text):
            raise _reading_error(text, "a date", '2024-03-15, with format="ymd" if it is ambiguous')
        return words
    order = _SAME_LETTERS.sub(r"\1", written_format.lower())
    if order not in DATE_FORMATS:
        raise InputError(f"there is no format {written_format[:20]!r} of dates; use {', '.join(DATE_FORMATS)}")
    try:
        return _date_words(_date_parts(text, order))
    except (ValueError, IndexError, StopIteration) as wrong:
        raise _reading_error(text, f"a date of the format {written_format}", "12/31/1999 for mdy") from wrong


def _date_parts(text: str, written_format: str) -> dict[str, str]:
    parts = _PARTS.findall(text)
    if _COMPACT.fullmatch(text) and len(written_format) == 3:
        lengths = [4 if letter == "y" else 2 for letter in written_format]
        starts = [sum(lengths[:at]) for at in range(3)]
        parts = [text[start : start + length] for start, length in zip(starts, lengths, strict=True)]
    return dict(zip(written_format, parts, strict=True))


def _date_words(found: dict[str, str]) -> str:
    known = {letter: part for letter, part in found.items() if part.strip("?")}
    year = known.get("y", "")
    if "m" not in known:
        return ordinal_words(int(known["d"])) if "d" in known else readings.year_or_number_words(year)
    month = int(known["m"]) if known["m"].isdigit() else readings.month_number(known["m"])
    day = int(re.sub(r"\D", "", known["d"])) if "d" in known else 0
    if not 1 <= month <= 12 or day > 31 or ("d" in known and day < 1):
        raise ValueError(month, day)
    if day:
        return readings.date_words(day, month, year)
    return (
        f"{readings.MONTHS[month - 1]} {readings.year_or_number_words(year)}".rstrip()
        if year
        else readings.MONTHS[month - 1]
    )


def _currency(text: str, code: str) -> str:
    match = _CURRENCY_FIRST.fullmatch(text)
    if match is None and code and _NUMBER.fullmatch(text):
        match = _CURRENCY_FIRST.fullmatch(f"{code.upper()} {text}")
    if match:
        if match[1] not in readings.CURRENCIES:
            raise InputError(f"the currency {match[1]!r} is not supported; write it in words")
        return readings.money_words(match[2], match[1], "")
    words = normalize(text)
    if words == text or not any(character.isdigit() for character in text):
        raise _reading_error(text, "money", "$12.50 or 12 EUR")
    return words


def _unit(text: str, _: str) -> str:
    words = normalize(text)
    if not words or any(character.isdigit() for character in words):
        raise _reading_error(text, "a measure", "5 km")
    return words


def _bleep(_text: str, _: str) -> str:
    return "bleep"


KINDS: MappingProxyType[str, Reader] = MappingProxyType({
    "cardinal": _cardinal, "number": _cardinal, "ordinal": _ordinal, "characters": _characters,
    "spell-out": _characters, "verbatim": _characters, "digits": _digits, "number_digit": _digits, "date": _date,
    "time": _time, "telephone": _telephone, "fraction": _fraction, "currency": _currency, "money": _currency,
    "unit": _unit, "address": _unit, "expletive": _bleep, "bleep": _bleep,
})  # fmt: skip


def _spell(text: str) -> str:
    return " ".join("".join(text.split()))


def _spell_groups(text: str) -> str:
    groups = re.findall(r"[^\W_]+", text)
    if not groups:
        raise _reading_error(text, "a telephone number", "+1 555 123 4567")
    return ", ".join(_spell(group) for group in groups)


def _plain_number(text: str) -> str:
    if not re.fullmatch(r"[+-]?[\d ,.\u00a0\u202f']*\d", text):
        raise _reading_error(text, "a cardinal number", "1234")
    return re.sub(r"[ \u00a0\u202f']", "", text)


_OTHER_LANGUAGES: MappingProxyType[str, Callable[[str], str]] = MappingProxyType({
    "cardinal": _plain_number, "number": _plain_number, "characters": _spell, "spell-out": _spell, "verbatim": _spell,
    "digits": _spell, "telephone": _spell_groups,
})  # fmt: skip
