"""Readers of numbers with what they count: measures, money, ranges, fractions, ordinals, telephone numbers."""

import re
import unicodedata

from lexicon.locales.nouns import behind, count, gender_of, noun_form
from lexicon.locales.numbers import Amount, Grammar, cardinal, digits, is_round_million, number, ordinal, whole, year
from lexicon.locales.place import Place, amount_pattern, read_amount
from lexicon.locales.tables import Locale, Row

_MAGNITUDE_DIGITS = "1000000"  # the noun behind a million is that behind its digits


def read_measure(place: Place) -> str:
    """Number with a unit, perhaps per another one (5 km/h), and with an ending of the language (kg'lık)."""
    locale, grammar = place.locale, place.grammar("cardinal")
    row = locale.rows("unit")[place.match["unit"]]
    if place.match["unit"] == "°" and place.after[:1].islower() and place.before.lower() in locale.words("articles"):
        suffix = locale.rows("suffix")["°"]  # al 3° piano
        return ordinal(locale, int(place.amount("amount").whole), Grammar(suffix.details["gender"]))
    said = _magnified(place, row, grammar.case) if place.match["magnitude"] else ""
    said = said or count(locale, place.amount("amount"), row, grammar.case)
    if place.match["per"]:
        per = locale.rows("unit")[place.match["per"]]
        said = f"{said} {locale.setting('per')} {per.forms[0]}"
    return said


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
    return count(place.locale, place.amount("amount"), magnitude, place.grammar("cardinal").case)


def read_money(place: Place) -> str:
    """Money with the currency behind or before the amount, the whole part and the hundredths by their nouns."""
    locale, amount = place.locale, place.amount("amount")
    minus = place.match.groupdict().get("minus")
    if minus:
        amount = Amount(minus, amount.whole, amount.decimals)
    row = locale.rows("currency")[place.match["currency"]]
    case = place.grammar("cardinal").case
    if place.match["magnitude"]:
        return _magnified(place, row, case)
    return money(locale, amount, row, case)


def money(locale: Locale, amount: Amount, row: Row, case: str = "") -> str:
    """Words of an amount of money."""
    cents = row.details.get("cents", "")
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
    first = place.match["amount"]
    said = year_or_number(place.locale, first, Grammar(case=place.grammar("cardinal").case))
    return f"{said} {place.locale.setting('to')}".rstrip() + " "


def read_fraction(place: Place) -> str | None:
    """Fraction of a sign (½) or of two numbers, behind a whole number or alone."""
    locale, match = place.locale, place.match
    if match["vulgar"]:
        top, _, bottom = unicodedata.normalize("NFKC", match["vulgar"]).partition("⁄")
    else:
        top, bottom = match["top"], match["bottom"]
    integer, noun = match["integer"], match["noun"] or ""
    mixed = locale.rows("fraction").get(f"+{top}/{bottom}")
    behind_noun = f" {noun}" if noun else ""
    if integer and mixed:
        gender = gender_of(locale, noun)
        said = whole(locale, integer, Grammar(gender))
        if noun and "behind" in mixed.details:  # deux heures et demie
            return f"{said} {noun} {mixed.details.get(gender, mixed.details['behind'])}"
        return mixed.spoken.format(said) + behind_noun
    part = _part(locale, top, bottom)
    said = locale.setting("mixed", "{} {}").format(whole(locale, integer), part) if integer else part
    return said + behind_noun


def _part(locale: Locale, top: str, bottom: str) -> str:
    known = locale.rows("fraction")
    row = known.get(f"{top}/{bottom}") or known.get(f"/{bottom}")
    return row.spoken.format(whole(locale, top)) if row else _over(locale, top, bottom)


def _over(locale: Locale, top: str, bottom: str) -> str:
    return f"{whole(locale, top)} {locale.setting('over')} {whole(locale, bottom)}"


def read_suffixed(place: Place) -> str:
    """Number with an ending that says how it is read: 1er, 2º, 3-го, 80er."""
    row = place.locale.rows("suffix")[place.match["suffix"]]
    n, grammar = int(place.match["digits"]), place.grammar("ordinal")
    grammar = Grammar(row.details.get("gender", grammar.gender), row.details.get("case", grammar.case))
    if row.spoken == "ordinal":
        return ordinal(place.locale, n, grammar)
    return row.spoken.format(cardinal(place.locale, n, grammar))


def read_dotted_ordinal(place: Place) -> str | None:
    """Ordinal with a full stop within a sentence (der 5. Platz, 2. gün); None for the end of a sentence."""
    locale, following = place.locale, place.after
    grammar = place.grammar("ordinal")
    is_known = following.lower() in locale.words("ordinal_nouns")
    is_within = following[:1].islower() and locale.setting("dotted_ordinals") == "small"
    if not (is_known or is_within or (grammar.case and place.before.islower())):
        return None
    gender = gender_of(locale, following)
    case = grammar.case
    own = locale.rows("case").get(f"ordinal {place.before.lower()} {gender}")
    return ordinal(locale, int(place.match["digits"]), Grammar(gender if not case else "", own.spoken if own else case))


def read_telephone(place: Place) -> str:
    """Digits of a telephone number with a comma between groups; pairs where the language reads pairs."""
    locale = place.locale
    written = place.match.group()
    groups = re.findall(r"[0-9]+", written)
    if locale.setting("telephone") == "pairs" and all(len(group) == 2 for group in groups[1:]):
        words = [digits(locale, g) if len(g) > 2 or (g[0] == "0" and len(g) == 1) else _pair(locale, g) for g in groups]
    else:
        words = [digits(locale, group) for group in groups]
    return f"{locale.setting('plus')} " * written.startswith("+") + ", ".join(words)


def _pair(locale: Locale, group: str) -> str:
    return digits(locale, group) if group[0] == "0" else cardinal(locale, int(group))


def read_named_telephone(place: Place) -> str | None:
    """Number behind the word for telephone; None behind another one."""
    if (place.said or place.before).lower() not in place.locale.words("telephone_words"):
        return None
    return read_telephone(place)


def read_version(place: Place) -> str | None:
    """Numbers with points between them: 1.2.3, 192.168.0.1, 3.11; None for a number in groups."""
    locale = place.locale
    if re.fullmatch(amount_pattern(locale), place.match.group()):
        return None
    return f" {locale.setting('dot', locale.setting('point'))} ".join(
        whole(locale, part) for part in place.match.group().split(".")
    )


def read_score(place: Place) -> str:
    """Result of a match, or a proportion: 3:1."""
    first, second = (whole(place.locale, place.match[name]) for name in ("first", "second"))
    return f"{first} {place.locale.setting('against')} {second}".replace("  ", " ")


def read_number(place: Place) -> str:
    """Number, in the gender of the noun behind it."""
    locale, written = place.locale, place.match["amount"]
    grammar = place.grammar("cardinal")
    if place.requires_ordinal and written.isdigit():
        return ordinal(locale, int(written), grammar)
    gender = grammar.gender or _gender_behind(place)
    amount = place.amount("amount")
    if amount.sign or amount.decimals or not written.isdigit():
        said = number(locale, amount, Grammar(gender, grammar.case))
    else:
        said = year_or_number(locale, written, Grammar(gender, grammar.case))
    if is_round_million(amount) and place.after and locale.setting("of_million"):
        return behind(locale, said, place.after, links=True).removesuffix(place.after).rstrip(" ")
    return said


def _gender_behind(place: Place) -> str:
    """Gender of the noun behind a number; empty where no noun follows."""
    locale, word = place.locale, place.after
    is_noun = bool(word) and word[0].isupper() == bool(locale.setting("capital_nouns"))  # Arabic has no capitals
    if not is_noun or word in locale.words("function_words"):
        return ""
    return gender_of(locale, word) or locale.setting("default_gender")


def year_or_number(locale: Locale, written: str, grammar: Grammar) -> str:
    """A year for four digits from 1100 to 1999 where years differ from numbers, else a number."""
    if written.isdigit() and len(written) == 4 and written[:1] == "1" and written >= "1100" and locale.setting("years"):
        return year(locale, int(written))
    return number(locale, read_amount(locale, written), grammar)
