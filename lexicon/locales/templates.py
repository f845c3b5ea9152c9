"""Written forms that a table states itself: rows ``form`` of a pattern and a template of its words.

A pattern is a regular expression with named groups of digits, in which ``#`` stands for a number with decimals and
groups. It is tried at numbers, or at the words and signs that its details name (``at=$|-``). Each field of the template
is a group and how it is read: ``{n:number}``, ``{n:ordinal f genitive}``, the name of a rule of numbers, or of a kind
of rows, where a number is looked up (``{m:month}``; one without a row is a cardinal), or each digit (``{n:phone}``).
"""

import re
from collections.abc import Callable, Iterator, Mapping
from types import MappingProxyType

from lexicon.locales.numbers import Grammar, by_rule, cardinal, digits, has_rule, number, ordinal, year
from lexicon.locales.place import Place, Reader, amount_pattern, read_amount
from lexicon.locales.tables import Locale, Row

_FIELD = re.compile(r"\{([a-z]+):([a-z_ ]+)\}")
_Reader = Callable[[Locale, str, str, Grammar], str]  # of digits, by the name of how they are read
_KIND = "form"
_DIGITS = frozenset("0123456789")  # rows of a kind with all of them are looked up digit by digit


def template_forms(locale: Locale) -> Iterator[tuple[tuple[str, ...], str, Reader]]:
    """The words and signs at which each form is tried (none: at numbers), its pattern and its reader."""
    amount = amount_pattern(locale)
    for written, row in locale.rows(_KIND).items():
        places = tuple(row.details["at"].split("|")) if "at" in row.details else ()
        yield places, written.replace("#", amount), _reader(row)


def _reader(row: Row) -> Reader:
    def read(place: Place) -> str:
        return _FIELD.sub(lambda field: _words(place, place.match[field[1]] or "", field[2]), row.spoken)

    return read


def _words(place: Place, written: str, how: str) -> str:
    """Words of a group of digits; nothing for a group without any."""
    kind, gender, case = (*how.split(" "), "", "")[:3]
    if not written:
        return ""
    read = _READERS.get(kind, _looked_up)
    return read(place.locale, written, kind, Grammar(gender, case or place.grammar(kind).case))


def _number(locale: Locale, written: str, _: str, grammar: Grammar) -> str:
    return number(locale, read_amount(locale, written), grammar)


def _digits(locale: Locale, written: str, _: str, __: Grammar) -> str:
    return digits(locale, written)


def _whole(read: Callable[[Locale, int, Grammar], str]) -> "_Reader":
    return lambda locale, written, _, grammar: read(locale, int(_only_digits(written)), grammar)


def _looked_up(locale: Locale, written: str, kind: str, grammar: Grammar) -> str:
    """Words by a rule of numbers, by a row for the number, or by rows for its digits."""
    plain, rows = _only_digits(written), locale.rows(kind)
    if rows.keys() >= _DIGITS:
        return locale.setting("join", " ").join(rows[digit].spoken for digit in plain)
    if has_rule(locale, kind):
        return by_rule(locale, int(plain), kind, grammar)
    row = rows.get(str(int(plain)))
    return row.forms[0] if row else cardinal(locale, int(plain), grammar)


def _only_digits(written: str) -> str:
    return "".join(filter(str.isdigit, written))


_READERS: Mapping[str, "_Reader"] = MappingProxyType({
    "number": _number, "digits": _digits, "cardinal": _whole(cardinal), "ordinal": _whole(ordinal),
    "year": _whole(year),
})  # fmt: skip
