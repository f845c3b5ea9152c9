"""Words of numbers: cardinals and ordinals by gender and case, decimals, years, digits, from the rules of CLDR."""

import functools
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from lexicon.errors import BackendError
from lexicon.locales.arabic import arabic_number
from lexicon.locales.tables import Locale, Row

if TYPE_CHECKING:
    from unicode_rbnf import RbnfEngine

MAX_DIGITS = 15  # of a number that is read as a whole; the digits of a longer one are read one by one
_MILLION = 10**6


@dataclass(frozen=True, slots=True)
class Amount:
    """A written number: its sign (or none), and digits before and behind the decimal sign."""

    sign: str
    whole: str
    decimals: str = ""

    @property
    def is_one(self) -> bool:
        """Whether it is 1 without decimals."""
        return not self.decimals and self.whole.lstrip("0") == "1"


@dataclass(frozen=True, slots=True)
class Grammar:
    """Gender (m, f, n) and case (genitive, ...) that a number takes; empty for the form that counts."""

    gender: str = ""
    case: str = ""


COUNTING = Grammar()


def cardinal(locale: Locale, n: int, grammar: Grammar = COUNTING) -> str:
    """Words of a whole number."""
    base = locale.setting("hundreds")
    if base and 1100 <= n < 10_000 and n // 100 % 10:  # twaalfhonderdvijftig
        rest = cardinal(locale, n % 100, grammar) if n % 100 else ""
        return f"{cardinal(locale, n // 100)}{base}{rest}"
    return _spelt(locale, n, "cardinal", grammar)


def ordinal(locale: Locale, n: int, grammar: Grammar = COUNTING) -> str:
    """Words of an ordinal number."""
    known = locale.rows("ordinal")
    if str(n) in known:
        return _inflected(locale, known[str(n)].spoken, grammar)
    if _ruleset(locale, "ordinal", grammar):
        said = _spelt(locale, n, "ordinal", grammar)
        has_case = not grammar.case or _ruleset(locale, "ordinal", grammar) != _ruleset(
            locale, "ordinal", Grammar(grammar.gender)
        )
        return said if has_case else " ".join(_inflected(locale, word, grammar) for word in said.split(" "))
    # only tens and units are ordinal: dwa tysiące dwudziesty czwarty
    low = n % 100
    if low == 0:
        return cardinal(locale, n)
    parts = [str(low)] if str(low) in known else [str(low - low % 10), str(low % 10)]
    words = [_inflected(locale, known[part].spoken, grammar) for part in parts if part in known]
    return " ".join([*([cardinal(locale, n - low)] if n > low else []), *words])


def year(locale: Locale, n: int, grammar: Grammar = COUNTING) -> str:
    """Words of a year."""
    hundreds = locale.setting("year_hundreds")
    if hundreds and 1100 <= n < 2000:  # उन्नीस सौ अट्ठानवे
        rest = [cardinal(locale, n % 100)] if n % 100 else []
        return " ".join([cardinal(locale, n // 100), hundreds, *rest])
    if locale.setting("year") == "digits":  # 二零二四
        return digits(locale, str(n))
    if not locale.setting("year"):
        return cardinal(locale, n)
    return ordinal(locale, n, grammar) if locale.setting("year") == "ordinal" else _spelt(locale, n, "year", grammar)


def digits(locale: Locale, written: str) -> str:
    """Words of each digit."""
    names = locale.rows("digit")
    join = locale.setting("join", " ")
    return join.join(names[d].spoken if d in names else cardinal(locale, int(d)) for d in written if d.isdigit())


def number(locale: Locale, amount: Amount, grammar: Grammar = COUNTING) -> str:
    """Words of a number with its sign and its decimals."""
    join = locale.setting("join", " ")
    sign = {"-": locale.setting("minus"), "+": locale.setting("plus"), "±": locale.setting("plus_minus")}
    before = [sign[amount.sign]] if amount.sign else []
    if not amount.decimals:
        return join.join([*before, whole(locale, amount.whole, grammar)])
    return join.join([*before, _decimal(locale, amount, grammar)])


def whole(locale: Locale, written: str, grammar: Grammar = COUNTING) -> str:
    """Words of digits: of a number, or of each digit where the number is too long or begins with a zero."""
    if len(written) > MAX_DIGITS or (written[0] == "0" and len(written) > 1):
        return digits(locale, written)
    return cardinal(locale, int(written), grammar)


def _decimal(locale: Locale, amount: Amount, grammar: Grammar) -> str:
    if amount.decimals == "5" and int(amount.whole or 0) == 1 and locale.setting("one_and_half"):
        forms = locale.setting("one_and_half").split("|")  # полтора, полторы
        return forms[-1] if grammar.gender == "f" else forms[0]
    if amount.decimals == "5" and locale.setting("half") and int(amount.whole or 0):
        return locale.setting("half").format(whole(locale, amount.whole, grammar))
    named = locale.rows("decimal")
    places = str(len(amount.decimals))
    if places in named:  # три целых двадцать пять сотых
        feminine = Grammar("f")
        parts = [(amount.whole, named["0"]), (amount.decimals.lstrip("0") or "0", named[places])]
        return " ".join(f"{whole(locale, n, feminine)} {_ending_of(n, row)}" for n, row in parts)
    join = locale.setting("join", " ")
    written = amount.decimals
    is_number = len(written) <= int(locale.setting("decimals", "0"))
    rest = written.lstrip("0") if is_number else ""
    zeros = written[: len(written) - len(rest)]
    said = [digits(locale, zeros)] if zeros else []
    said += [whole(locale, rest)] if rest else []
    return join.join([whole(locale, amount.whole or "0"), locale.setting("point"), *said])


def _ending_of(n: str, row: Row) -> str:
    singular, plural = row.forms
    return singular if n.endswith("1") and not n.endswith("11") else plural


def is_round_million(amount: Amount) -> bool:
    """Whether a noun follows the word million: un million de kilomètres."""
    return not amount.decimals and len(amount.whole) <= MAX_DIGITS and _is_multiple(int(amount.whole))


def _is_multiple(n: int) -> bool:
    return n >= _MILLION and n % _MILLION == 0


def _inflected(locale: Locale, word: str, grammar: Grammar) -> str:
    """An ordinal of the table in a gender and case, by the first ending that it has."""
    row = _by_grammar(locale.rows("inflection"), "", grammar)
    for pair in row.spoken.split() if row else ():
        ending, _, other = pair.partition("=")
        if word.endswith(ending):
            return word.removesuffix(ending) + other
    return word


def _ruleset(locale: Locale, kind: str, grammar: Grammar) -> str:
    row = _by_grammar(locale.rows("rule"), kind, grammar)
    return row.spoken if row else ""


def _by_grammar(rows: Mapping[str, Row], kind: str, grammar: Grammar) -> Row | None:
    """The row of a kind, gender and case, else of fewer of them."""
    for parts in ((grammar.gender, grammar.case), (grammar.case,), (grammar.gender,), ()):
        row = rows.get(" ".join(part for part in (kind, *parts) if part))
        if row is not None:
            return row
    return None


def has_rule(locale: Locale, kind: str) -> bool:
    """Whether a language has numbers of a kind of its own (Korean native ones)."""
    return bool(_ruleset(locale, kind, COUNTING))


def by_rule(locale: Locale, n: int, kind: str, grammar: Grammar = COUNTING) -> str:
    """Words of a whole number of a kind."""
    return _spelt(locale, n, kind, grammar)


@functools.lru_cache(maxsize=10_000)
def _spelt(locale: Locale, n: int, kind: str, grammar: Grammar) -> str:
    if locale.rows("numeral"):
        return arabic_number(locale, n, kind, grammar.gender == "f", bool(grammar.case))
    engine = _engine(locale.setting("cldr", locale.language.partition("-")[0]))
    from unicode_rbnf.engine import NoRuleForNumberError

    try:
        said = engine.format_number(n, ruleset_names=[_ruleset(locale, kind, grammar)]).text
    except NoRuleForNumberError:  # CLDR has no Russian ordinals of millions
        return digits(locale, str(n))
    for pattern, row in locale.rows("fix").items():
        own = Grammar(row.details.get("gender", grammar.gender), row.details.get("case", grammar.case))
        if own == grammar:
            said = re.sub(pattern, row.spoken, said)
    return said


@functools.cache
def _engine(code: str) -> "RbnfEngine":
    # it takes 10 to 40 ms a language, and no English text needs it
    try:
        from unicode_rbnf import RbnfEngine
    except ImportError as missing:
        raise BackendError("unicode_rbnf is missing; install it with `pip install tts2face`") from missing
    return RbnfEngine.for_language(code)
