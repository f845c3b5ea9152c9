"""Blocks of Markdown: headings, lists, quotes, tables, rules, code, and what a model writes for itself.

A text is divided into blocks, and these into runs of characters that are words, are silent, or end a sentence. What
stands within the words is read by `lexicon.inline_marks`.
"""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

from lexicon.latex import ENVIRONMENTS, MAX_FORMULA_CHARACTERS

SENTENCE_END, PARAGRAPH_END = "\u2028", "\n\n"  # as those of `lexicon.ssml.STRETCH_ENDS`
MAX_TABLE_ROWS = 12  # that are spoken, with the heading
MAX_RULE_CHARACTERS = 200
# What a model thinks before it answers, or writes for tools, and comments; without an end, up to the end of the text.
_HIDDEN = re.compile(
    r"<(?P<name>think|thinking|thoughts?|reasoning|reflection|scratchpad|tool_calls?|tool_use|"
    r"tool_results?|tool_response|function_calls?|function_results?)(?:\s[^<>\n]{0,100})?>|<!--",
    re.IGNORECASE,
)
_FENCE = re.compile(r"[ \t]{0,12}(?P<fence>`{3,}|~{3,})[^`\n]*(?:\n|\Z)")
_QUOTE = re.compile(r"[ ]{0,3}(?:>(?=[ \t>\n]|\Z|[^\W_]|[\"'“*_])[ \t]?){1,8}")
_HEADING = re.compile(r"[ ]{0,3}#{1,6}[ \t]+(?=\S)")
_HEADING_END = re.compile(r"[ \t]+#+[ \t]*\Z")
# A formula that goes on in the next lines; a blank line ends it
_FORMULA = re.compile(rf"[ \t]{{0,12}}(?:(\$\$)|(\\\[)|\\begin\{{{ENVIRONMENTS}\}})")
_RULE = re.compile(r"[ ]{0,3}(?:(?:-[ \t]*){3,}|(?:\*[ \t]*){3,}|(?:_[ \t]*){3,}|={3,}[ \t]*)\Z")
_ITEM = re.compile(r"[ \t]{0,16}(?:[-*•‣●○▪◦][ \t]+(?=\S)|\+[ \t]+(?=[^\W\d_]))(?:\[[ xX]\][ \t]+)?")
_NUMBERED = re.compile(r"[ \t]{0,16}\(?[0-9]{1,3}[.)][ \t]+(?=\S)(?:\[[ xX]\][ \t]+)?")
_FIRST = re.compile(r"\s*\(?1[.)]\s")
_DELIMITERS = re.compile(r"[ \t]{0,16}\|?[ \t]*:?-+:?[ \t]*(?:\|[ \t]*:?-+:?[ \t]*)*\|?[ \t]*\Z")
_DEFINITION = re.compile(r"[ ]{0,3}\[[^\[\]\n]{1,80}\]:[ \t]*<?(?:https?:|mailto:|/|#|\.)\S*(?:[ \t]+[\"'(][^\n]*)?\Z")
_CELL_END = re.compile(r"[ \t]*\|[ \t]*")
BLOCK_START = re.compile(
    rf"{_QUOTE.pattern}|{_HEADING.pattern}|{_ITEM.pattern}|{_NUMBERED.pattern}|[ \t]*(?:\||```|~~~)"
)
_ENDED = re.compile(r"[.!?:;…。！？][\"'”’)\]*_]*\s*\Z")


@dataclass(frozen=True, slots=True)
class Run:
    """Characters from `start` to `end`: ``words``, ``silent`` ones, or an ``end`` in whose place `value` stands."""

    start: int
    end: int
    kind: Literal["words", "silent", "end", "insert", "note"]
    value: str = ""


@dataclass(frozen=True, slots=True)
class Block:
    """A block: its range, its runs, and whether it is read as one, and divided nowhere."""

    start: int
    end: int
    runs: tuple[Run, ...]
    is_whole: bool = False
    is_open: bool = False  # its end is not written yet


def split_blocks(text: str) -> Iterator[Block]:
    """Blocks of a text in order, whose runs cover it; in linear time."""
    reader = _BlockReader(text)
    while reader.at < len(text):
        yield reader.next_block()


class _BlockReader:
    """Reads one block after another."""

    def __init__(self, text: str) -> None:
        self._text, self.at = text, 0
        self._is_line_start = True
        self._goes_on = False  # whether a line of a paragraph stands before
        self._is_list = False  # whether an item does

    def next_block(self) -> Block:
        """The block at the current position."""
        text, at = self._text, self.at
        end = _line_end(text, at)
        hidden = _HIDDEN.search(text, at, end)
        if self._is_line_start:
            fence = _FENCE.match(text, at)
            if fence and not (hidden and hidden.start() < fence.start("fence")):
                return self._fenced(fence)
        if hidden is not None:
            return self._before(hidden) if hidden.start() > at else self._hidden(hidden)
        block = self._of_line(at, end) if self._is_line_start else None
        if block is None:
            block = Block(at, end, (Run(at, end, "words"),))
            line = text[at:end]
            self._goes_on, self._is_list = bool(line.strip()), self._is_list and bool(line.strip())
        self.at, self._is_line_start = block.end, True
        return block

    def _fenced(self, fence: "re.Match[str]") -> Block:
        mark = fence["fence"]
        closing = re.compile(rf"^[ \t]{{0,12}}{re.escape(mark)}{re.escape(mark[0])}*[ \t]*(?:\n|\Z)", re.MULTILINE)
        found = closing.search(self._text, fence.end())
        end = found.end() if found else len(self._text)
        start = self.at
        self.at = end
        self._goes_on = False
        return Block(start, end, (Run(start, end, "end", PARAGRAPH_END),), is_whole=True, is_open=found is None)

    def _before(self, hidden: "re.Match[str]") -> Block:
        """The words of a line before what is hidden in it."""
        start, self.at = self.at, hidden.start()
        self._is_line_start = self._is_line_start and not self._text[start : self.at].strip()
        return Block(start, self.at, (Run(start, self.at, "words"),))

    def _hidden(self, hidden: "re.Match[str]") -> Block:
        closing = re.compile(rf"</{hidden['name']}\s*>" if hidden["name"] else "-->", re.IGNORECASE)
        found = closing.search(self._text, hidden.end())
        start, self.at = self.at, found.end() if found else len(self._text)
        return Block(start, self.at, (Run(start, self.at, "silent"),), is_whole=True, is_open=found is None)

    def _of_line(self, at: int, end: int) -> Block | None:
        """The block that begins with a line; None for a line of a paragraph."""
        text = self._text
        quote = _QUOTE.match(text, at, end)
        first = quote.end() if quote else at
        line = text[first:end].rstrip("\n")
        lead = (Run(at, first, "silent"),) if quote else ()
        block = self._formula(at, end) or (self._table(at, end) if "|" in line else None)
        if block is not None:
            return block
        is_rule = _RULE.match(line) is not None and len(line) <= MAX_RULE_CHARACTERS
        if is_rule or _DEFINITION.match(line):
            return self._block(at, end, [Run(at, end, "end" if is_rule else "silent", PARAGRAPH_END * is_rule)])
        heading = _HEADING.match(line)
        if heading:
            tail = _HEADING_END.search(line)
            stop = first + (tail.start() if tail else len(line))
            start = first + heading.end()
            runs = [Run(at, start, "end", PARAGRAPH_END), Run(start, stop, "words")]
            runs += [Run(stop, end, "end", PARAGRAPH_END)] if text[end - 1] == "\n" else [Run(stop, end, "silent")]
            return self._block(at, end, runs)
        item = self._item(line, at)
        if item is not None:
            return self._listed(at, first, item, end)
        if lead:
            self._goes_on = bool(line.strip())
            return Block(at, end, (*lead, Run(first, end, "words")))
        return None

    def _formula(self, at: int, end: int) -> Block | None:
        """A formula of several lines, which are read as one; None if it ends in its line, or not at all."""
        text = self._text
        formula = _FORMULA.match(text, at, end)
        if formula is None:
            return None
        closing = formula[1] or (formula[2] and r"\]") or r"\end{"
        start = formula.end()
        limit = min(len(text), start + MAX_FORMULA_CHARACTERS)
        blank = text.find("\n\n", start, limit)
        found = text.find(closing, start, limit if blank < 0 else blank)
        is_open = found < 0 and blank < 0 and limit == len(text)
        if 0 <= found < end or (found < 0 and not is_open):
            return None
        stop = len(text) if is_open else _line_end(text, found)
        self._goes_on = True
        return Block(at, stop, (Run(at, stop, "words"),), is_whole=True, is_open=is_open)

    def _block(self, at: int, end: int, runs: Sequence[Run]) -> Block:
        """A block that no paragraph goes on behind."""
        self._goes_on = self._is_list = False
        return Block(at, end, tuple(run for run in runs if run.end > run.start), is_whole=True)

    def _item(self, line: str, at: int) -> int | None:
        """Length of what stands before the words of an item that is silent; None for a line that is no item."""
        if (bullet := _ITEM.match(line)) is not None:
            return bullet.end()
        if _NUMBERED.match(line) is None:
            return None
        # a number at the start of a line within a sentence is none of a list
        before = self._text[max(at - 40, 0) : at]
        is_list = not self._goes_on or self._is_list or _FIRST.match(line) or _ENDED.search(before)
        return 0 if is_list else None

    def _listed(self, at: int, first: int, length: int, end: int) -> Block:
        """An item with the lines that go on with it."""
        text = self._text
        runs = [Run(at, first + length, "end", SENTENCE_END)] if self._goes_on else []
        runs += [] if self._goes_on else [Run(at, first + length, "silent")]
        start, stop = first + length, end
        while stop < len(text) and self._continues(stop):
            runs += [Run(start, stop - 1, "words"), Run(stop - 1, stop, "insert", " ")]
            start, stop = stop, _line_end(text, stop)
        has_break = text[stop - 1] == "\n"
        runs.append(Run(start, stop - has_break, "words"))
        runs += [Run(stop - 1, stop, "end", _end_of_line(text, stop))] if has_break else []
        self._goes_on, self._is_list = False, True
        return Block(at, stop, tuple(run for run in runs if run.end > run.start), is_whole=True)

    def _continues(self, at: int) -> bool:
        """Whether a line goes on with the item before it: it is indented, and no block of its own."""
        end = _line_end(self._text, at)
        line = self._text[at:end].rstrip("\n")
        is_block = BLOCK_START.match(line) or _RULE.match(line[:MAX_RULE_CHARACTERS])
        return line.startswith(("  ", "\t")) and bool(line.strip()) and not is_block and "<" not in line

    def _table(self, at: int, end: int) -> Block | None:
        """The table whose heading a line is; None without a line of delimiters below it."""
        text = self._text
        below = _line_end(text, end)
        line = text[end:below].rstrip("\n")
        if "|" not in line or _DELIMITERS.match(line) is None:
            return None
        runs = [*_row(text, at, end), Run(end, below, "silent")]
        n_rows, start = 1, below
        while start < len(text):
            stop = _line_end(text, start)
            if "|" not in text[start:stop]:
                break
            n_rows += 1
            runs += _row(text, start, stop) if n_rows <= MAX_TABLE_ROWS else [Run(start, stop, "silent")]
            start = stop
        if n_rows > MAX_TABLE_ROWS:
            runs.append(Run(start, start, "note", f"the rows of a table behind the first {MAX_TABLE_ROWS} are silent"))
        self._goes_on = self._is_list = False
        return Block(at, start, tuple(runs), is_whole=True, is_open=start == len(text))


def _row(text: str, start: int, end: int) -> Iterator[Run]:
    """Runs of a row of a table: its cells, with commas between them."""
    stop = end - (text[end - 1] == "\n")
    at, is_first = start, True
    while at < stop:
        mark = _CELL_END.search(text, at, stop)
        last = mark.start() if mark else stop
        if last > at:
            yield Run(at, last, "words")
        if mark:
            is_inner = not is_first or last > at
            yield Run(last, mark.end(), "insert", ", " if is_inner and mark.end() < stop else " ")
        at, is_first = mark.end() if mark else stop, False
    if end > stop:
        yield Run(stop, end, "end", _end_of_line(text, end))


def _end_of_line(text: str, at: int) -> str:
    """End of an item or a row before a position: of a sentence, or of a paragraph before a blank line."""
    return PARAGRAPH_END if text[at : _line_end(text, at)].isspace() else SENTENCE_END


def _line_end(text: str, at: int) -> int:
    """Index behind the line feed of a line, or the end of the text."""
    end = text.find("\n", at)
    return len(text) if end < 0 else end + 1
