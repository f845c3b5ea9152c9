"""Readers of numbers with what they count: measures, money, ranges, fractions, ordinals, telephone numbers."""

import re

from lexicon.locales.nouns import behind, case_of, construct, count, gender_of, is_plural, noun_form, one_before
from lexicon.locales.numbers import Amount, Grammar, is_round_million, number, ordinal, whole, year
from lexicon.locales.place import Place, read_amount
from lexicon.locales.tables import Locale, Row

_RESULT = re.compile(r"[0-9]{1,3}(?![0-9]|[.,:/-][0-9]| ?=)")
_MAGNITUDE_DIGITS = "1000000"  # the noun behind a million is that behind its digits


def read_measure(place: Place) -> str | None:
    """Number with a unit, perhaps per another one (5 km/h), and with an ending of the language (kg'lık).

    None where the unit is rather a word (3 in Berlin), the end of a quotation or an unknown number (3x + 2).
    """
    locale, grammar = place.locale, place.grammar("cardinal")
    written = place.match["unit"]
    row = locale.rows("unit")[written]
    if (
        ("last" in row.details and place.after)
        or ("quote" in row.details and place.closes_quotation(written))
        or ("factor" in row.details and place.is_term)
    ):
        return None
    said = _magnified(place, row, grammar.case) if place.match["magnitude"] else ""
    said = said or count(locale, place.amount("amount"), row, grammar.case)
    if place.match["per"]:
        said = f"{said} {_per_unit(locale, place.match['per'])}"
    return _with_stop(place, said)


def _magnified(place: Place, row: Row, case: str) -> str:
    """A number with its magnitude and a noun: drei Komma fünf Millionen Euro."""
    locale = place.locale
    magnitude = locale.rows("magnitude")[place.match["magnitude"]]
    noun = noun_form(locale, row, Amount("", _MAGNITUDE_DIGITS))
    links = "link" in magnitude.details
    return behind(locale, count(locale, place.amount("amount"), magnitude, case), noun, links=links)


def read_magnitude(place: Place) -> str:
    """Number with a magnitude: 3,5 Mio."""
    magnitude = place.locale.rows("magnitude")[place.match["magnitude"]]
    said = count(place.locale, place.amount("amount"), magnitude, place.grammar("cardinal").case)
    return construct(place.locale, said) if noun_behind(place) else said


def read_money(place: Place) -> str:
    """Money with the currency behind or before the amount, the whole part and the hundredths by their nouns."""
    locale, amount = place.locale, place.amount("amount")
    minus = place.match.groupdict().get("minus")
    if minus:
        amount = Amount(minus, amount.whole, amount.decimals)
    row = locale.rows("currency")[place.match["currency"]]
    case = place.grammar("cardinal").case
    said = _magnified(place, row, case) if place.match["magnitude"] else money(locale, amount, row, case)
    per = place.match.groupdict().get("per")
    return _with_stop(place, f"{said} {_per_unit(locale, per)}" if per else said)


def _with_stop(place: Place, said: str) -> str:
    """Words with the full stop of an abbreviation where it also ends the sentence: 3 млн руб. Цена ..."""
    ends = place.match.group().endswith(".") and place.after[:1].isupper() and not place.locale.setting("capital_nouns")
    return f"{said}." if ends else said


def _per_unit(locale: Locale, written: str) -> str:
    """One unit behind the word for per; forms that hold their number (=) have the noun of hundreds."""
    row = locale.rows("unit")[written]
    noun = noun_form(locale, row, Amount("", "100")) if row.forms[0].startswith("=") else row.forms[0]
    return f"{locale.setting('per')} {noun}"


def money(locale: Locale, amount: Amount, row: Row, case: str = "") -> str:
    """Words of an amount of money."""
    cents = row.details.get("cents", "")
    if not cents:
        amount = Amount(amount.sign, amount.whole, amount.decimals.rstrip("0"))
    if amount.decimals and (len(amount.decimals) != 2 or not cents):
        return count(locale, amount, row, case)
    small = Amount("", amount.decimals.lstrip("0") or "0")
    large = Amount(amount.sign, amount.whole)
    if not int(amount.decimals or 0):
        return count(locale, large, row, case)
    named = count(locale, small, Row(cents.replace("/", "|"), {}), case)
    if not int(amount.whole):
        return f"{locale.setting('minus')} {named}" if amount.sign == "-" else named
    bare = whole(locale, small.whole, Grammar(locale.setting("cents_gender")))
    return locale.setting("money", "{whole} {named}").format(
        whole=count(locale, large, row, case), named=named, bare=bare
    )


def read_range(place: Place) -> str:
    """First number of a range, with the word for to: the second one is read for itself."""
    locale, first = place.locale, place.match["amount"]
    said = year_or_number(locale, first, Grammar(case=place.grammar("cardinal").case))
    second = _RESULT.match(place.text, place.match.end())
    falls = second is not None and first.isdigit() and int(first) >= int(second.group())  # 3-2 is a result
    score = locale.setting("score", locale.setting("against"))
    return f"{said} {score if falls else locale.setting('to')}".rstrip() + " "


def read_number(place: Place) -> str:
    """Number, in the gender of the noun behind it."""
    locale, written = place.locale, place.match["amount"]
    grammar = place.grammar("cardinal")
    if place.requires_ordinal and written.isdigit():
        return ordinal(locale, int(written), grammar)
    amount = place.amount("amount")
    noun = noun_behind(place)
    agrees = noun and (amount.is_one or not locale.setting("only_one_agrees"))
    several = is_plural(locale, amount)
    own = gender_of(locale, noun, plural=several) if agrees else ""
    gender = grammar.gender or own or (locale.setting("default_gender") if agrees else "")
    grammar = Grammar(gender, case_of(locale, noun, plural=several) or grammar.case)
    if written == "1" and noun and (numeral := one_before(locale, gender, noun)):
        said = numeral
    elif amount.sign or amount.decimals or not written.isdigit():
        said = number(locale, amount, grammar)
    else:
        said = year_or_number(locale, written, grammar)
    if noun:
        said = construct(locale, said)
    link = locale.setting("of_million")
    if is_round_million(amount) and noun and link and noun not in {link, link[:1]}:
        return behind(locale, said, place.after, links=True).removesuffix(place.after).rstrip(" ")
    return said


def noun_behind(place: Place) -> str:
    """Word behind a number if it may be a noun, else empty."""
    word = "" if place.before in place.locale.words("uncounted") else place.after
    # Arabic has no capitals
    is_noun = bool(word) and word[0].isupper() == bool(place.locale.setting("capital_nouns"))
    return word if is_noun and word not in place.locale.words("function_words") else ""


def year_or_number(locale: Locale, written: str, grammar: Grammar) -> str:
    """A year for four digits from 1100 to 1999 where years differ from numbers, else a number."""
    if written.isdigit() and len(written) == 4 and written[:1] == "1" and written >= "1100" and locale.setting("years"):
        return year(locale, int(written))
    return number(locale, read_amount(locale, written), grammar)
