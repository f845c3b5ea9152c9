"""Tables of languages: nouns of units and currencies, abbreviations, months, grammar of numbers.

Columns are kind, written form, spoken form and details. Several written forms of one row are separated by ``|``, as
are the forms of a noun by the plural categories of the language (setting ``plural``). Details are ``name=value``
pairs with semicolons between them, or words.
============ ====================================================================================================
setting      signs and templates of the language, by the names that `lexicon.locales` reads
rule         rule set of CLDR by kind, gender and case (``cardinal f genitive``)
fix          pattern and replacement in words of numbers that CLDR misspells
ordinal      ordinals that CLDR lacks, in the masculine nominative; ``inflection`` has endings by gender and case
case         gender or case that a word requires of the number behind it; details: of which kind of number; behind a
             plus sign, ending of a plural noun (``one``: of one), and the case that it has
declension   ending of a noun behind two, and those of one and of several in each case; ``adjective``: a noun follows
construct    end of the words of a number before its noun
one          form of the number one, by a pattern of the gender and the noun behind it
gender       endings of nouns, longest first, and whole nouns (with a caret) of a gender; details: ``plural``, the
             gender of plurals with this ending
unit         unit or noun behind a number; ``{}`` is the number where it does not come first; details: ``alone`` (also
             without a number), ``last`` (only where no word follows, because it is itself a word), ``quote`` (not
             where it closes a quotation), ``factor`` (not within a term: 3x + 2), ``si=`` signs of its prefixes
prefix       SI prefix of units
magnitude    thousand, million and so on behind a number
currency     currency; details ``cents=`` have its hundredth part
month        number of a month: its name in dates, and written forms in details
weekday      name of a short one; without a full stop only in a span (Mo-Fr)
abbreviation its words; details: ``number`` (before a number only), ``after`` (behind a number), ``name`` (before a
             capital), ``roman`` (before a Roman number), ``end`` (may end a sentence), or forms: by case, and before
             the name of a king (``ruler``)
ending       abbreviation at the end of a word (str.)
roman        word before or behind a Roman number, and the kind of number that it is (``cardinal``, ``ordinal``)
ruler        names whose Roman numbers are those of rulers
sign         sign that is spoken, by its words
fraction     words of a fraction
word         word of another language, as the language says it (those of `loan_words.tsv`, too)
letter       name of a letter
letter_value number of a letter that is a digit (Greek ΙΘ΄)
initialism   capitals that are read letter by letter (``letters``), or their words
form         written form with a pattern and a template of its own (`lexicon.locales.templates`)
counted      pattern of a number in Chinese characters that is also another word, and the number in digits
kana         Chinese characters of numbers in kana, for Japanese without its reader
numeral      words of numbers of which CLDR has no grammatical forms
============ ====================================================================================================
"""

import functools
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from importlib import resources
from types import MappingProxyType

COLUMNS = 4
_LIKE_NO_WORD = re.compile("[a-zа-я][A-ZА-ЯΩ]|[µμ]|.*/")  # kHz, кВт, mA, Mbit/s, but not mm, MB or Pa
_NO_FORMS = frozenset(
    {"alone", "last", "quote", "factor", "gender", "si"}
)  # details that are no forms of the noun in a case
_BEFORE_NOUN = re.compile(r"=|.*\{\} ?")  # a form that holds its number, or has it before the noun
_NO_ROWS: Mapping[str, "Row"] = MappingProxyType({})


@dataclass(frozen=True, slots=True)
class Row:
    """Spoken form of a row, and its details by name; a detail without a value has itself."""

    spoken: str
    details: Mapping[str, str]

    @property
    def forms(self) -> tuple[str, ...]:
        """Forms of a noun by plural category."""
        return tuple(self.spoken.split("|"))


@dataclass(frozen=True, slots=True, eq=False)
class Locale:
    """Rows of a language by kind and written form."""

    language: str
    kinds: Mapping[str, Mapping[str, Row]]

    def rows(self, kind: str) -> Mapping[str, Row]:
        """Rows of a kind by written form."""
        return self.kinds.get(kind, _NO_ROWS)

    def setting(self, name: str, default: str = "") -> str:
        """Value of a setting."""
        row = self.rows("setting").get(name)
        return default if row is None else row.spoken

    def words(self, name: str) -> frozenset[str]:
        """Words of a setting that is a list."""
        return frozenset(self.setting(name).split())


@functools.cache
def find_locale(language: str) -> Locale | None:
    """Table of a language, with the rows of its variety in place of others; None if it has none."""
    code = language.lower()
    primary = code.partition("-")[0]
    kinds = _read(primary)
    if kinds is None:
        return None
    for name in dict.fromkeys((code.partition("-x-")[0], code)):
        for kind, rows in (_read(name) or {}).items() if name != primary else ():
            kinds[kind] = {**kinds.get(kind, {}), **rows}
    kinds["unit"] = {**dict(_prefixed_units(kinds)), **kinds.get("unit", {})}
    kinds["word"] = {**_loan_words(primary), **kinds.get("word", {})}
    return Locale(language, MappingProxyType({kind: MappingProxyType(rows) for kind, rows in kinds.items()}))


def _read(name: str) -> dict[str, dict[str, Row]] | None:
    path = resources.files("lexicon.locales").joinpath(f"{name}.tsv")
    if not path.is_file():
        return None
    kinds: dict[str, dict[str, Row]] = {}
    for line in path.read_text(encoding="utf-8").splitlines()[1:]:
        kind, written, spoken, details = (line.split("\t") + [""] * COLUMNS)[:COLUMNS]
        row = Row(spoken, MappingProxyType(dict(_detail(part) for part in details.split(";") if part)))
        for form in [written] if kind in {"fix", "form", "one", "counted"} or len(written) == 1 else written.split("|"):
            kinds.setdefault(kind, {})[form] = row
    return kinds


def _prefixed_units(kinds: Mapping[str, Mapping[str, Row]]) -> Iterator[tuple[str, Row]]:
    """Units with their SI prefixes (kΩ, mA); one that no word looks like is read without a number, too."""
    prefixes = kinds.get("prefix", _NO_ROWS)
    for written, row in kinds.get("unit", _NO_ROWS).items():
        for sign, prefix in prefixes.items():
            if prefix.details.get("sign", sign) in row.details.get("si", ""):
                details = {
                    name: value if name in _NO_FORMS else _with_prefix(prefix.spoken, value)
                    for name, value in row.details.items()
                }
                alone = {"alone": "alone"} if _LIKE_NO_WORD.match(sign + written) else {}
                spoken = _with_prefix(prefix.spoken, row.spoken)
                yield sign + written, Row(spoken, MappingProxyType(details | alone))


def _with_prefix(prefix: str, forms: str) -> str:
    """Forms of a unit behind a prefix; where nouns have capitals, the prefix has it (Kiloohm)."""
    found = []
    for form in forms.split("|"):
        lead = _BEFORE_NOUN.match(form)
        at = lead.end() if lead else 0
        noun = form[at].lower() + form[at + 1 :] if prefix[0].isupper() else form[at:]
        found.append(form[:at] + prefix + noun)
    return "|".join(found)


def _loan_words(language: str) -> dict[str, Row]:
    """International words and names in small letters, as a language says them."""
    path = resources.files("lexicon.locales").joinpath("loan_words.tsv")
    heading, *lines = path.read_text(encoding="utf-8").splitlines()
    columns = heading.split("\t")
    if language not in columns:
        return {}
    at = columns.index(language)
    cells = (line.split("\t") for line in lines)
    return {row[0]: Row(row[at], MappingProxyType({})) for row in cells if len(row) > at and row[at]}


def _detail(part: str) -> tuple[str, str]:
    name, _, value = part.partition("=")
    return name, value or name


@functools.lru_cache(maxsize=256)
def alternatives(locale: Locale, *kinds: str) -> str:
    """Pattern of the written forms of some kinds of rows, the longest first; nothing matches if there are none."""
    forms = sorted({form for kind in kinds for form in locale.rows(kind)}, key=len, reverse=True)
    return "(?:" + ("|".join(map(re.escape, forms)) or r"(?!)") + ")"
