"""Readers of telephone numbers, versions and results, which are several numbers."""

import re

from lexicon.locales.numbers import Grammar, cardinal, digits, number, whole
from lexicon.locales.place import Place, amount_pattern, read_amount
from lexicon.locales.tables import Locale


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
    """Numbers with points between them: 1.2.3, 192.168.0.1, 3.11; None for a number in groups.

    Of two, the second one is read as decimals are, unless a word for a version is before them.
    """
    locale = place.locale
    if re.fullmatch(amount_pattern(locale), place.match.group()):
        return None
    join = locale.setting("join", " ")
    dot = join + locale.setting("dot", locale.setting("point")) + join
    parts = place.match.group().split(".")
    if len(parts) == 2 and place.before.lower() not in locale.words("version_words"):
        most = int(locale.setting("decimals", "0"))
        return dot.join([whole(locale, parts[0]), (whole if len(parts[1]) <= most else digits)(locale, parts[1])])
    return dot.join(whole(locale, part) for part in parts)


def read_scientific(place: Place) -> str:
    """Number with a power of ten: 1.5e-6."""
    locale = place.locale
    power = locale.setting("power").format(number(locale, read_amount(locale, place.match["exponent"])))
    written = re.sub("[.,]", locale.setting("decimal", ","), place.match["amount"])
    parts = (number(locale, read_amount(locale, written)), locale.rows("sign")["×"].spoken, cardinal(locale, 10), power)
    return locale.setting("join", " ").join(parts)


def read_score(place: Place) -> str:
    """Result of a match, or a proportion: 3:1."""
    locale, against = place.locale, place.locale.setting("against")
    row = locale.rows("case").get(against)
    first = whole(locale, place.match["first"])
    second = whole(locale, place.match["second"], Grammar(case=row.spoken) if row else Grammar())
    return f"{first} {against} {second}".replace("  ", " ")
