"""Written forms of a language: their patterns, in the order in which they are tried, and their readers.

Each pattern is bounded and is tried at one place, so that a scan is linear in the length of a text.
"""

import functools
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass

from lexicon.locales import counted, dates, digit_groups, fractions, initialisms, ordinals, roman, words
from lexicon.locales.place import Reader, amount_pattern
from lexicon.locales.tables import Locale, alternatives
from lexicon.locales.templates import template_forms

LETTER = r"[^\W\d_\u00b2\u00b3\u00b9\u00bc-\u00be\u2070-\u209f\u2150-\u218b]"
# Latin letters among others are words of their own (我的iPhone, وWi-Fi); signs of vowels belong to a word (डॉ.).
_LATIN = "A-Za-z\u00aa\u00ba\u00c0-\u00d6\u00d8-\u00f6\u00f8-\u024f\u0300-\u036f\u1e00-\u1eff"
_UNSPACED = "\u2e80"  # the first character of writing without spaces
VOWEL_SIGNS = "\u064b-\u065f\u0670\u0900-\u0903\u093a-\u094f\u0955-\u0957\u0962\u0963"
WORD = rf"(?:[{_LATIN}]+|(?:(?![{_LATIN}]){LETTER}|[{VOWEL_SIGNS}])+)"
PLACE = re.compile(rf"(?P<number>[0-9\u00bc-\u00be\u2150-\u215e])|(?P<word>{WORD})|[^\w\s]|\S")
_LEADING_LETTERS = re.compile(rf"{WORD}?")
_INITIALISM = r"(?P<letters>[A-ZÄÖÜÀ-ÖØ-ÞĄ-ŽА-ЯЁ]{2,8})(?P<ending>s)?(?!{letter})"
# Letters with the sign of numbers; an apostrophe may also be that of a word that lost its vowel (Σ' αγαπώ).
_LETTER_NUMBER = r"(?:(?P<letters>[Α-Ω]{1,3})(?=[΄ʹ′´])|(?P<short>ΣΤ|[ΙΚ]?[Α-Η]|[ΙΚ]Θ|Ι)(?='))(?:[΄ʹ′´']|(?!))(?!\w)"
_LABEL = r"[A-Za-z0-9][A-Za-z0-9-]{0,62}"
_TLD = (
    r"(?:com|org|net|edu|gov|io|ai|app|dev|info|eu|de|fr|es|it|pt|br|nl|be|pl|ru|tr|gr|at|ch|uk|us|mx|cn|jp|kr|in|vn)"
)
_EXTENSION = (
    r"(?:txt|md|pdf|docx?|xlsx?|pptx?|[ct]sv|json|xml|ya?ml|toml|ini|cfg|conf|log|html?|css|js|ts|py|sh|cpp|java|exe"
    r"|zip|gz|tar|jpe?g|png|gif|svg|webp|mp[34]|wav|ogg|avi|mkv|mov)"
)
_PATH = r"(?<![^\s(\"'«„“])(?:~|\.{1,2})?(?:/[\w.-]{0,63}[\w-]){2,20}/?(?![\w/])"
_ADDRESS = (
    rf"[\w.+-]{{1,64}}@{_LABEL}(?:\.{_LABEL}){{1,5}}(?![A-Za-z0-9_])|(?:https?://|www\.)[^\s,;!]{{0,400}}[^\s,;!.:?)]"
    rf"|{_LABEL}(?:\.{_LABEL}){{0,3}}\.{_TLD}(?![A-Za-z0-9_])(?!\.\w)(?:/[^\s,;!]{{0,400}}[^\s,;!.:?)])?"
    rf"|[\w-]{{1,64}}(?:\.[\w-]{{1,64}}){{0,3}}\.{_EXTENSION}(?!\w)|[A-Z]:(?:\\[\w.-]{{0,63}}[\w-]){{1,20}}"
)
_ROMAN = rf"(?P<roman>[IVXLCDM]{{1,15}})(?P<suffix>{{suffix}}\.?)?(?!{LETTER}|['’-]{LETTER})"
_POWER = r"(?<=[\w)])(?:\^(?P<digits>-?[0-9]{1,4})(?!\w)|(?P<raised>⁻?[⁰¹²³⁴⁵⁶⁷⁸⁹]{1,4})(?![⁰¹²³⁴⁵⁶⁷⁸⁹⁻]))"
_PART = re.compile("‹([a-z ]+)›")
_VULGAR = r"[\u00bc-\u00be\u2150-\u215e]"
_FRACTION = rf"(?: ?(?P<vulgar>{_VULGAR})| (?P<top>[0-9]{{1,3}})/(?P<bottom>[0-9]{{1,3}})(?![\w/]))"
_ALONE = rf"(?P<sign>{_VULGAR})|(?P<first>[0-9]{{1,3}})/(?P<second>[0-9]{{1,3}})(?![\w/])"
# Names in angle quotes are parts of `_parts`; a form with a part that the language lacks is left out.
_NUMBER_FORMS: tuple[tuple[str, Reader], ...] = (
    (r"(?P<year>[0-9]{4})(?P<s>-)(?P<month>[0-9]{2})-(?P<day>[0-9]{2})(?![\w-])", dates.read_numeric_date),
    (
        r"(?P<day>[0-9]{1,2})(?P<s>[/.-]) ?(?P<month>[0-9]{1,2})(?P=s) ?(?P<year>[0-9]{4}|[0-9]{2})(?![\w/]|[.,][0-9])"
        r"‹year word›‹tail›",
        dates.read_numeric_date,
    ),
    (
        r"(?P<day>[0-9]{1,2})(?P<ending>‹day ending›)? ?‹of›(?P<month>‹months›)(?!‹letter›)"
        r"(?:,? ‹of›(?P<year>[12][0-9]{3})(?![0-9])‹year word›)?‹tail›",
        dates.read_named_date,
    ),
    (
        r"(?P<day>[0-9]{1,2})(?P<ending>‹day ending›)? ?[-–] ?"
        r"(?=[0-9]{1,2}(?:‹day ending›)? ?‹of›(?:‹months›)(?!‹letter›))",
        ordinals.read_first_day,
    ),
    (r"(?P<day>[0-9]{1,2})\.(?P<month>[0-9]{1,2})\.(?! ?[0-9])", dates.read_short_date),
    (r"(?P<day>[0-9]{1,2})/(?P<month>[0-9]{1,2})(?![0-9/])", dates.read_short_date),
    (
        r"(?P<hour>[0-9]{1,2})(?P<sign>[‹time signs›])(?P<minute>[0-9]{2})(?::(?P<second>[0-9]{2}))?(?![0-9]|\.[0-9])"
        r"(?P<word> ?(?:‹time words›)(?!‹letter›))?(?!‹letter›)‹tail›",
        dates.read_time,
    ),
    (
        r"\+[0-9]{1,3}(?:[ ./-]?\(?[0-9]{1,5}\)?){2,6}(?!\w)"
        r"|0(?![0-9]\.[0-5][0-9](?![0-9.]))[0-9]{1,4}(?:[ ./-][0-9]{2,8}){1,5}(?!\w)"  # but 08.00-17.00
        r"|\(?[0-9]{2,3}\) ?[0-9]{2,5}[ -][0-9]{2,5}(?:[ -][0-9]{2,4})?(?!\w)",
        digit_groups.read_telephone,
    ),
    (
        r"(?P<hour>[0-9]{1,2}) ?(?P<sign>‹hour sign›) ?(?P<minute>[0-9]{2})?(?: ?min)?(?!‹letter›|[0-9])"
        r"(?P<second>(?!))?(?P<word>(?!))?",
        dates.read_time,
    ),
    (r"[0-9]{1,12}(?:[ ./-][0-9]{1,12}){0,6}(?![\w])", digit_groups.read_named_telephone),
    (r"(?P<number>[12][0-9]{3})(?P<suffix>-?‹letter›{1,3})? ?(?P<word>‹year words›)‹end›", dates.read_year),
    (r"(?P<digits>[0-9]{1,4})(?P<suffix>‹suffix›)(?!\w)", ordinals.read_suffixed),
    (
        r"‹signed›(?:,[-–—]{1,2})?(?: ?(?P<magnitude>‹magnitude›))? ?(?P<currency>‹currency›)(?:/(?P<per>‹unit›))?‹end›"
        r"‹tail›",
        counted.read_money,
    ),
    (
        r"(?P<amount>[-+]?[0-9]{1,20}(?:[.,][0-9]{1,20})?)[eE](?P<exponent>[-+]?[0-9]{1,3})(?!\w)",
        digit_groups.read_scientific,
    ),
    (r"(?P<amount>‹amount›)(?:[-–](?=[0-9])| – (?=[0-9]))(?!‹amount›(?:[-–][0-9]| ?=))", counted.read_range),
    (rf"(?P<integer>[0-9]{{1,4}}){_FRACTION} (?P<noun>‹letter›{{3,24}})", fractions.read_divided),
    (
        rf"(?:(?P<integer>[0-9]{{1,4}}){_FRACTION}|{_ALONE})(?: (?P<noun>‹unit›)(?!‹letter›))?‹tail›",
        fractions.read_fraction,
    ),
    (
        r"‹signed›(?: ?(?P<magnitude>‹magnitude›))?(?: ?|-)(?P<unit>‹unit›)(?:/(?P<per>‹unit›))?‹end›‹tail›",
        counted.read_measure,
    ),
    (r"‹signed› ?(?P<magnitude>‹magnitude›)‹end›", counted.read_magnitude),
    (r"(?P<digits>[0-9]{1,4})\.(?=,| ‹letter›|\s*\Z)", ordinals.read_dotted_ordinal),
    (r"(?![0-9]{1,3}(?:\.[0-9]{3})+(?![0-9.]))[0-9]{1,4}(?:\.[0-9]{1,4}){2,6}(?!\w)", digit_groups.read_version),
    (r"[0-9]{1,4}‹other decimal›(?:[0-9]{1,2}|[0-9]{4,20})(?![0-9]|\.[0-9])", digit_groups.read_version),
    (r"(?P<first>[0-9]{1,3}):(?P<second>[0-9]{1,7})(?![0-9:])", digit_groups.read_score),
    (r"‹signed›‹tail›", counted.read_number),
)


@dataclass(frozen=True, slots=True)
class Form:
    """A written form; its pattern is compiled when it is tried, because most texts have few of some hundred forms."""

    source: str
    reader: Reader
    flags: int = 0

    @property
    def pattern(self) -> re.Pattern[str]:
        """Pattern of the form."""
        return _compiled(self.source, self.flags)


@functools.cache
def _compiled(source: str, flags: int) -> re.Pattern[str]:
    return re.compile(source, flags)


@dataclass(frozen=True, slots=True)
class Scanner:
    """Forms of a language by what they begin with."""

    numbers: tuple[Form, ...]
    by_word: Mapping[str, tuple[Form, ...]]
    by_sign: Mapping[str, tuple[Form, ...]]
    address: Form
    capitals: tuple[Form, ...]
    ending: Form

    def at(self, found: re.Match[str], text: str) -> Iterable[Form]:
        """Forms that may begin at a place, in their order."""
        sign = found.group()
        if found["number"]:
            return self.numbers
        if found["word"]:
            return self._of_word(sign, text, found.end())
        is_before_digit = text[found.end() : found.end() + 2].lstrip(" ")[:1].isdigit()
        before = text[max(found.start() - 1, 0) : found.start()]
        is_behind_word = before.isalnum() and before < _UNSPACED  # 是-5
        if sign in "+-±" and is_before_digit and not is_behind_word:
            return (*self.numbers, *self.by_sign.get(sign, ()))
        return self.by_sign.get(sign, ())

    def _of_word(self, word: str, text: str, end: int) -> Iterator[Form]:
        following = text[end : end + 1]
        if following in {"@", ".", ":", "-", "_"} or following.isdigit():
            yield self.address
        if following == ".":
            yield self.ending
        yield from self.by_word.get(word, ())
        small = word.lower()
        if small != word:
            yield from self.by_word.get(small, ())
        if word.isupper() or word.rstrip("abcdefghijklmnopqrstuvwxyz").isupper():
            yield from self.capitals


def _letter(locale: Locale) -> str:
    """Letter that ends no written form when it follows: in writing without spaces those of Latin words only."""
    return f"[{_LATIN}]" if locale.setting("dense") else LETTER


def _parts(locale: Locale) -> dict[str, str]:
    """Parts of patterns by name; empty where a language has none of them."""
    amount, letter = amount_pattern(locale), _letter(locale)
    of, year_words = locale.setting("date_of"), locale.setting("year_words")
    named = {name.replace("_", " "): locale.setting(name) for name in ("hour_sign", "time_words", "day_ending")}
    named |= {kind: alternatives(locale, kind) for kind in ("unit", "currency", "suffix")}
    return named | {
        "magnitude": alternatives(locale, "magnitude") + rf"(?!(?<=[{_LATIN}])[{_LATIN}Ω])",  # 3 MW, 2 MΩ
        "amount": amount,
        "signed": rf"(?P<amount>(?:[-+]|± ?)?{amount})",
        "letter": letter,
        "end": rf"(?!{letter}|[0-9])",
        "tail": rf"(?:['’](?P<tail>{letter}{{1,12}}))?" if locale.setting("suffixes") else r"(?P<tail>(?!))?",
        "months": dates.months_pattern(locale),
        "of": f"(?:(?:{of}) )?" if of else "(?:)",
        "year word": f"(?P<yearword> ?(?:{year_words}))?" if year_words else "(?:)",
        "year words": alternatives(locale, "year_word") if locale.rows("year_word") else "",
        "time signs": re.escape(locale.setting("time_signs", ":.")),
        "time words": named["time words"] or "(?!)",
        "day ending": named["day ending"] or r"\.",
        "other decimal": r"\." if locale.setting("decimal", ",") == "," else "",
    }


def _number_forms(locale: Locale) -> Iterator[Form]:
    """Forms that begin with a digit, a sign before one, or a fraction."""
    parts = _parts(locale)
    for template, reader in _NUMBER_FORMS:
        names = _PART.findall(template)
        if all(parts[name] for name in names):
            yield Form(_PART.sub(lambda part: parts[part[1]], template), reader)


@functools.cache
def scanner(locale: Locale) -> Scanner:
    """Forms of a language."""
    own = (Form(pattern, reader) for places, pattern, reader in template_forms(locale) if not places)
    numbers = (*own, *_number_forms(locale))
    address = Form(_ADDRESS, words.read_address)
    suffix = alternatives(locale, "suffix")
    pattern = _ROMAN.replace("{suffix}", suffix)
    numerals = [
        Form(_INITIALISM.replace("{letter}", _letter(locale)), initialisms.read_initialism),
        Form(pattern, roman.read_roman),
    ]
    if locale.setting("roman_stop"):  # XIV. is an ordinal
        stop = rf"(?P<roman>[IVXLCDM]{{1,15}})\.(?=,| {LETTER})"
        numerals = [Form(stop, roman.read_roman_with_stop), *numerals]
    if locale.rows("letter_value"):
        numerals = [Form(_LETTER_NUMBER, roman.read_letter_number), *numerals]
    endings = locale.rows("ending")
    ending = Form(rf"(?P<stem>{LETTER}{{2,40}}?)(?P<ending>{_any_of(endings) or '(?!)'})", words.read_ending)
    return Scanner(numbers, _forms_by_word(locale), _forms_by_sign(locale), address, tuple(numerals), ending)


def _templates_by_place(locale: Locale) -> dict[str, list[Form]]:
    """Forms of the rows of a table by the word or sign at which they are tried."""
    found: dict[str, list[Form]] = {}
    for places, pattern, reader in template_forms(locale):
        for place in places:
            found.setdefault(place, []).append(Form(pattern, reader))
    return found


def _money_before(locale: Locale, currencies: str) -> str:
    magnitude = alternatives(locale, "magnitude")
    other = r"\." if locale.setting("decimal", ",") == "," else ","  # $5.99
    return (
        rf"(?P<minus>(?!))?(?P<currency>{currencies}) ?"
        rf"(?P<amount>-?(?:[0-9]{{1,7}}{other}[0-9]{{2}}(?![0-9]|{other}[0-9])|{amount_pattern(locale)}))(?:,[-–—]{{1,2}})?"
        rf"(?: ?(?P<magnitude>{magnitude})(?!{LETTER}))?(?P<tail>(?!))?"
    )


def _grouped(written: Iterable[str]) -> dict[str, list[str]]:
    """Written forms by the letters with which they begin, or by their first sign."""
    found: dict[str, list[str]] = {}
    for form in written:
        match = _LEADING_LETTERS.match(form)
        found.setdefault((match.group() if match else "") or form[0], []).append(form)
    return found


def _any_of(written: Iterable[str]) -> str:
    return "|".join(map(re.escape, sorted(written, key=len, reverse=True)))


def _forms_by_word(locale: Locale) -> dict[str, tuple[Form, ...]]:
    found, letter = _templates_by_place(locale), _letter(locale)

    def add(written: Iterable[str], template: str, reader: Reader, flags: int = 0) -> None:
        for first, forms in _grouped(written).items():
            pattern = template.replace("{}", _any_of(forms))
            found.setdefault(first.lower() if flags else first, []).append(Form(pattern, reader, flags))

    end = rf"(?!{letter}|[0-9])"
    for first, forms in _grouped(locale.rows("currency")).items():
        pattern = _money_before(locale, _any_of(forms))
        found.setdefault(first, []).append(Form(pattern, counted.read_money))
    short = locale.rows("abbreviation")
    letters = {*short, *(form[:1].upper() + form[1:] for form in short)}
    add(letters, rf"(?:{{}})(?!{LETTER}|(?<={LETTER})[0-9])", words.read_abbreviation)
    days = _any_of(locale.rows("weekday")) or "(?!)"
    span = rf"(?P<first>{{}})(?:\.? ?[-–] ?(?P<last>{days})(?!{LETTER})(?:\.(?= ?[0-9]))?|\.(?=,| ))"
    add(locale.rows("weekday"), span, dates.read_weekdays)
    months = dates.month_names(locale)
    of = locale.setting("date_of")
    link = f"(?:(?:{of}) )?" if of else ""
    add(months, rf"(?P<month>{{}})\.?(?:/| {link})(?P<year>[12][0-9]{{3}})(?![0-9])", dates.read_month_year)
    add((word.lower() for word in locale.rows("word")), rf"(?:{{}}){end}(?!-{letter})", words.read_word, re.IGNORECASE)
    add((sign for sign in locale.rows("sign") if sign.isalpha()), "{}", words.read_sign)  # π
    add(
        (unit for unit in locale.rows("unit") if "alone" in locale.rows("unit")[unit].details),
        rf"(?P<unit>{{}})(?!{letter})",
        words.read_unit_alone,
    )
    return {first: tuple(forms) for first, forms in found.items()}


def _forms_by_sign(locale: Locale) -> dict[str, tuple[Form, ...]]:
    found = _templates_by_place(locale)
    for first, forms in _grouped(locale.rows("currency")).items():
        if not first.isalpha():
            pattern = _money_before(locale, _any_of(forms))
            found.setdefault(first, []).append(Form(pattern, counted.read_money))
            minus = _money_before(locale, _any_of(forms)).replace("(?P<minus>(?!))?", "(?P<minus>-)", 1)
            found.setdefault("-", []).append(Form(minus, counted.read_money))
    if locale.setting("percent_first"):
        percent = rf"(?P<unit>%) ?(?P<amount>{amount_pattern(locale)})(?P<magnitude>(?!))?(?P<per>(?!))?"
        percent += rf"(?:['’](?P<tail>{LETTER}{{1,12}}))?"
        found.setdefault("%", []).append(Form(percent, counted.read_measure))
    for first, forms in _grouped(locale.rows("abbreviation")).items():
        if not first.isalpha():
            found.setdefault(first, []).append(Form(_any_of(forms), words.read_abbreviation))
    for first, form in (*_forms_of_signs(locale), *_units_alone(locale)):
        found.setdefault(first, []).append(form)
    return {first: tuple(forms) for first, forms in found.items()}


def _units_alone(locale: Locale) -> Iterator[tuple[str, Form]]:
    """Signs of units and currencies without a number, with the sign at which each is tried."""
    units = {unit for unit, row in locale.rows("unit").items() if "quote" not in row.details}
    for first, written in _grouped({*units, *locale.rows("currency")}).items():
        if not first[0].isalpha():
            yield first, Form(f"(?P<unit>{_any_of(written)})", words.read_unit_alone)


def _forms_of_signs(locale: Locale) -> Iterator[tuple[str, Form]]:
    """Powers, dashes and signs with words of their own, with the character at which each is tried."""
    yield from ((first, Form(_PATH, words.read_address)) for first in "/~.")
    yield from ((first, Form(_POWER, words.read_power)) for first in "^⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
    yield from ((dash, Form(rf"{dash}(?=[0-9])", words.read_dash)) for dash in "-–")
    for first, written in _grouped(locale.rows("sign")).items():
        yield first, Form(_any_of(written), words.read_sign)
