"""A written form at a place of a text: what stands around it, and amounts in it."""

import functools
import re
from collections.abc import Callable
from dataclasses import dataclass

from lexicon.locales.numbers import Amount, Grammar
from lexicon.locales.tables import Locale

_LAST_WORD = re.compile(r"([^\W\d_]+)[.'’]?\s?[(\"«„“]?\Z")
_NEXT_WORD = re.compile(r"\s?([^\W\d_]+)")
_CONTEXT = 40  # characters around a form that its readers search
_QUOTATION = 300  # characters of a quotation, at most


@dataclass(frozen=True, slots=True)
class Place:
    """A match in a text of a language, and the last word that was said before it."""

    locale: Locale
    text: str
    match: re.Match[str]
    said: str

    @property
    def before(self) -> str:
        """Word directly before the form, as it is written; empty at the start of a sentence."""
        start = self.match.start()
        found = _LAST_WORD.search(self.text[max(start - _CONTEXT, 0) : start])
        return found[1] if found else ""

    @property
    def after(self) -> str:
        """Word directly behind the form, as it is written."""
        found = _NEXT_WORD.match(self.text, self.match.end(), self.match.end() + _CONTEXT)
        return found[1] if found else ""

    @property
    def is_last(self) -> bool:
        """Whether nothing but marks follows."""
        return not self.text[self.match.end() : self.match.end() + _CONTEXT].strip(" \n\"'»”“)")

    def closes_quotation(self, written: str) -> bool:
        """Whether a mark may end a quotation: the last one like it before the form opens one."""
        start = self.match.start()
        mark = self.text.rfind(written, max(start - _QUOTATION, 0), start)
        return mark >= 0 and (mark == 0 or not (self.text[mark - 1].isalnum() or self.text[mark - 1] in ".,!?…"))

    @property
    def _before_series(self) -> str:
        """Word before the first one of a series of ordinals (am 3., 4. und 5. Mai); empty if there is none."""
        series = self.locale.setting("ordinal_series")
        start = self.match.start()
        found = re.search(rf"([^\W\d_]+) {series}\Z", self.text[max(start - _CONTEXT, 0) : start]) if series else None
        return found[1] if found else ""

    @property
    def is_term(self) -> bool:
        """Whether a sign of mathematics follows."""
        return self.text[self.match.end() : self.match.end() + 2].lstrip(" ")[:1] in set("+-=<>≤≥^²³)/")

    def grammar(self, kind: str) -> Grammar:
        """Gender and case that the word before requires of a kind of number."""
        word = (self._before_series or self.said or self.before).lower()
        rows = self.locale.rows("case")
        row = rows.get(f"{kind} {word}") or rows.get(word)
        return Grammar(row.details.get("gender", ""), row.spoken) if row else Grammar()

    @property
    def requires_ordinal(self) -> bool:
        """Whether the word before has an ordinal behind it: godzina 14."""
        row = self.locale.rows("case").get((self.said or self.before).lower())
        return row is not None and "ordinal" in row.details

    @property
    def ends_in_ordinal(self) -> bool:
        """Whether the word before may have an ordinal without a noun behind it: am 3."""
        row = self.locale.rows("case").get(f"ordinal {(self._before_series or self.before).lower()}")
        return row is not None and "end" in row.details

    def amount(self, group: str) -> Amount:
        """The amount of a group of the match."""
        return read_amount(self.locale, self.match[group])


Reader = Callable[[Place], str | None]  # None: the form is none of this kind


@functools.cache
def amount_pattern(locale: Locale) -> str:
    """Pattern of a number without sign: with groups of three digits, and decimals behind the sign of the language."""
    decimal = re.escape(locale.setting("decimal", ","))
    groups = "".join(map(re.escape, locale.setting("groups", ".")))
    other = re.escape("." if locale.setting("decimal", ",") == "," else ",")
    return (
        rf"(?:[0-9]{{1,3}}(?:[{groups} ][0-9]{{3}}){{1,5}}(?![0-9])(?:{decimal}[0-9]{{1,20}})?"
        rf"|[0-9]{{1,3}}(?:{decimal}[0-9]{{3}}){{1,5}}{other}[0-9]{{1,3}}(?![0-9])"
        rf"|[0-9]{{1,2}}(?:,[0-9]{{2}}){{1,5}},[0-9]{{3}}(?![0-9])(?:{decimal}[0-9]{{1,20}})?"  # 1,00,000 in India
        rf"|[0-9]{{1,400}}(?:{decimal}[0-9]{{1,20}})?)"
    )


def read_amount(locale: Locale, written: str) -> Amount:
    """The amount of a written number with or without a sign."""
    sign = written[0] if written[0] in "+-±" else ""
    decimal = locale.setting("decimal", ",")
    bare = written.removeprefix(sign).strip().replace(" ", "")
    if decimal not in bare and re.fullmatch(r"[0-9]+[.,][0-9]{1,2}", bare):
        decimal = "," if "," in bare else "."
    if bare.count(decimal) > 1 or (decimal in bare and re.search(r"[.,'][0-9]+\Z", bare.rpartition(decimal)[2])):
        decimal = "." if decimal == "," else ","  # 1,234.50 in a language that writes 1.234,50
    whole, _, decimals = bare.rpartition(decimal) if decimal in bare else (bare, "", "")
    return Amount(sign, "".join(filter(str.isdigit, whole)) or "0", decimals)
