"""Nouns behind numbers: their gender, their plural category, and the case that a number requires."""

import re
from collections.abc import Callable, Mapping
from types import MappingProxyType

from lexicon.locales.numbers import Amount, Grammar, is_round_million, number
from lexicon.locales.tables import Locale, Row

_ONE = Amount("", "1")
_WHOLE = "="  # before a form that says its number: كيلومتران is two kilometres
_MAX_ENDING = 7  # letters of the longest ending in a table
_VOWELS = "aeiouyéèêàâîôûh"


def _one_or_other(amount: Amount) -> int:
    return 0 if amount.is_one else 1


def _below_two(amount: Amount) -> int:
    return 0 if len(amount.whole) < 9 and int(amount.whole or 0) < 2 else 1


def _never(_: Amount) -> int:
    return 0


def _polish(amount: Amount) -> int:
    """Categories one, few, many, other (1 kilometr, 2 kilometry, 5 kilometrów, 1,5 kilometra)."""
    if amount.decimals:
        return 3
    if amount.is_one:
        return 0
    return 1 if _ends_with_few(amount.whole) else 2


def _russian(amount: Amount) -> int:
    """Categories one, few, many, other (21 километр, 2 километра, 5 километров, 1,5 километра)."""
    if amount.decimals:
        return 3
    last = int(amount.whole[-2:] or 0)
    if last % 10 == 1 and last != 11:
        return 0
    return 1 if _ends_with_few(amount.whole) else 2


def _ends_with_few(digits: str) -> bool:
    last = int(digits[-2:] or 0)
    return last % 10 in {2, 3, 4} and last not in {12, 13, 14}


def _arabic(amount: Amount) -> int:
    """Categories one, two, few, many, other (كيلومتر، كيلومتران، كيلومترات، كيلومترا، كيلومتر)."""
    last = int(amount.whole[-2:] or 0)
    if amount.decimals or (last < 3 and len(amount.whole) > 2):
        return 4
    return last - 1 if last in {1, 2} else 2 if 3 <= last <= 10 else 3 if last > 10 else 4


# CLDR, plural rules; the number of forms of a noun is that of the categories
PLURALS: Mapping[str, Callable[[Amount], int]] = MappingProxyType({
    "one": _one_or_other, "below_two": _below_two, "never": _never, "polish": _polish, "russian": _russian,
    "arabic": _arabic,
})  # fmt: skip


def noun_form(locale: Locale, row: Row, amount: Amount, case: str = "") -> str:
    """Form of a noun behind a number, in the case that is required where the table has it."""
    forms = row.forms
    category = PLURALS[locale.setting("plural", "one")](amount)
    if case and case in row.details:
        own = row.details[case].split("|")
        return own[min(category, 1, len(own) - 1)]
    if case == "genitive" and len(forms) == 4:  # few is the genitive singular in Russian, other in Polish
        return forms[2] if category else forms[3]
    declined = _declined(locale, forms[1], category, case) if case and len(forms) > 1 and not amount.decimals else ""
    if declined:
        return declined
    return forms[min(category, len(forms) - 1)]


def _declined(locale: Locale, few: str, category: int, case: str) -> str:
    """A noun in a case that its row lacks, by the ending of its form behind two; empty where no rule is stated."""
    words = few.split(" ")
    for at, word in enumerate(words):
        row = _by_ending(locale.rows("declension"), word)
        endings = row.details.get(case, "").split("/") if row else [""]
        ending = endings[min(category, 1, len(endings) - 1)]
        if row is None or not ending:
            return ""
        words[at] = word.removesuffix(row.spoken) + ending
        if "adjective" not in row.details:  # квадратных метрах, but градусах Цельсия
            break
    return " ".join(words)


def is_plural(locale: Locale, amount: Amount) -> bool:
    """Whether the noun behind a number has another form than behind one."""
    return PLURALS[locale.setting("plural", "one")](amount) > 0


def gender_of(locale: Locale, word: str, *, plural: bool = False) -> str:
    """Gender of a noun by its ending, of one or of several; empty where the language does not tell."""
    small = word.lower().split(" ")[0]
    rows = locale.rows("gender")
    row = rows.get("^" + small) or _by_ending(rows, small)
    if row is None:
        return ""
    return row.details.get("plural", row.spoken) if plural else row.spoken


def case_of(locale: Locale, noun: str, *, plural: bool) -> str:
    """Case that the ending of a noun shows (z dwoma kotami, в двух случаях); empty where it does not."""
    row = _by_ending(locale.rows("case"), noun.lower(), "+")
    return row.spoken if row and ("one" in row.details) != plural else ""


def _by_ending(rows: Mapping[str, Row], word: str, mark: str = "") -> Row | None:
    """Row of the longest ending of a word; a mark stands before the endings of the rows."""
    for length in range(min(len(word), _MAX_ENDING), 0, -1):
        row = rows.get(mark + word[-length:])
        if row is not None:
            return row
    return None


def construct(locale: Locale, said: str) -> str:
    """Words of a number directly before its noun: Arabic duals lose their n (مئتا كتاب)."""
    for ending, row in locale.rows("construct").items():
        if said.endswith(ending):
            return said.removesuffix(ending) + row.spoken
    return said


def one_before(locale: Locale, gender: str, noun: str) -> str:
    """Form of one before the first letters of a noun (un'ora, uno zaino); empty where the language has no such form."""
    start = f"{gender} {noun.lower()}"
    return next((row.spoken for pattern, row in locale.rows("one").items() if re.match(pattern, start)), "")


def count(locale: Locale, amount: Amount, row: Row, case: str = "") -> str:
    """A number with its noun: trois kilomètres, un million de kilomètres, yüzde yirmi."""
    gender = row.details.get("gender") or gender_of(locale, row.forms[0]) or locale.setting("default_gender")
    said = one_before(locale, gender, row.forms[0]) if amount == _ONE else ""
    said = said or number(locale, amount, Grammar(gender, case))
    if amount.whole == "2" and not amount.decimals and not amount.sign:
        said = locale.setting("two") or said  # 两公里, but 二
    noun = noun_form(locale, row, amount, case)
    if "{}" in noun:
        return noun.format(said)
    if noun.startswith(_WHOLE):
        sign = locale.setting("minus") if amount.sign == "-" else ""
        if case:
            noun = _oblique(locale, noun)
        return f"{sign} {noun.removeprefix(_WHOLE)}".lstrip()
    return behind(locale, said, noun, links=is_round_million(amount))


def _oblique(locale: Locale, noun: str) -> str:
    """Arabic duals behind a preposition: إلى كيلومترين مربعين."""
    ending, _, other = locale.setting("oblique_dual").partition("=")
    words = noun.split(" ")
    return " ".join(word.removesuffix(ending) + other if ending and word.endswith(ending) else word for word in words)


def behind(locale: Locale, said: str, noun: str, *, links: bool) -> str:
    """A noun behind the words of a number, joined by de in Romance languages where the number is itself a noun."""
    said = construct(locale, said)
    link = locale.setting("of_million") if links else ""
    if link == "de" and locale.setting("elision") and noun[:1].lower() in _VOWELS:
        return f"{said} d'{noun}"
    join = locale.setting("join", " ")
    return join.join(part for part in (said, link, noun) if part)
