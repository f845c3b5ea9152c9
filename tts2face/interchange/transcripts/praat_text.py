"""Numbers, texts and flags of Praat's text files, in their order.

Only what stands free has a meaning: numbers, texts in quotes and flags in angle brackets; all other words are comments,
and so is the rest of a line behind an exclamation mark (Praat manual, "TextGrid file formats").
"""

import math
import re
from collections.abc import Iterator

Item = str | float
# Melder_atof of Praat: a number may have a percent sign, a fraction bar, and letters behind it
_NUMBER = re.compile(r"[+-]?\d+(?:[.,]\d*)?(?:[eE][+-]?\d+)?(?![eE])")
_ITEM = re.compile(
    r'"(?P<text>(?:[^"]|"")*)"(?!\S)|(?P<open>")|![^\n]*|(?P<flag><[^>\s]*>)|(?P<number>[-\d][^\s;]*|\+[^\s;]+)'
    r'|(?:[^\s\d"!<+-]\S*+\s*+)++|\S+'
)


class DamagedError(ValueError):
    """A file of Praat lacks something, or has it in the wrong place; the message says what and in which line."""


class PraatItems:
    """Items of a text, each read as what is expected next.

    Parameters
    ----------
    text
        Lines that end in line feeds.
    start
        Place of the first item in the text.
    """

    def __init__(self, text: str, start: int = 0) -> None:
        self._text, self._start = text, start
        self._items = self._split()
        self._kept: tuple[str, str] | None = None  # the next item, if `has_number` has taken it
        self._at = 0

    def _split(self) -> Iterator[tuple[str, str]]:
        for match in _ITEM.finditer(self._text, self._start):
            self._at = match.start()
            if match["text"] is not None:
                # Praat doubles quotes within texts
                yield "text", match["text"].replace('""', '"')
            elif match["open"] is not None:
                raise DamagedError(f"line {self.line}: a text has no closing quote, or a quote in it is not doubled")
            elif match["flag"] is not None:
                yield "flag", match["flag"]
            elif match["number"] is not None:
                yield "number", match["number"]

    @property
    def line(self) -> int:
        """Line of the last item."""
        return self._text.count("\n", 0, self._at) + 1

    def _next(self, kind: str) -> str:
        item, self._kept = self._kept or next(self._items, None), None
        if item is None:
            raise DamagedError(f"it ends where a {kind} is expected")
        if item[0] != kind:
            raise DamagedError(f"line {self.line}: {item[1][:40]!r} stands where a {kind} is expected")
        return item[1]

    def text(self) -> str:
        """The next text."""
        return self._next("text")

    def exists(self) -> bool:
        """The next flag."""
        return self._next("flag") == "<exists>"

    def number(self) -> float:
        """The next number."""
        written = self._next("number")
        number = _value(written)
        if number is None:
            raise DamagedError(f"line {self.line}: {written[:40]!r} is no number")
        return number

    def count(self) -> int:
        """The next number, of items."""
        number = self.number()
        if not math.isfinite(number) or number != int(number) or number < 0:
            raise DamagedError(f"line {self.line}: {number} is no number of items")
        return int(number)

    def has_number(self) -> bool:
        """Whether a number follows, anywhere."""
        self._kept = next((item for item in self._items if item[0] == "number"), None)
        return self._kept is not None


def _value(written: str) -> float | None:
    """A number as Praat reads it; a decimal comma, which Praat would take for two numbers, is a point."""
    above, bar, below = written.partition("/")
    match = _NUMBER.match(above)
    if match is None:
        return None
    number = float(match[0].replace(",", "."))
    if bar:
        divisor = _value(below)
        return number / divisor if divisor else None
    return number / 100 if above[match.end() :].startswith("%") else number
