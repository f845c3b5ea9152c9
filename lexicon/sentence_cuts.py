"""Where a text with marks may be cut between two sentences, so that both are read as in the whole text."""

from bisect import bisect_left
from dataclasses import dataclass

from lexicon.inline_marks import read_blocks
from lexicon.mark_cues import PlacedCue
from lexicon.mark_parts import Cue, End, Own, Part, Rules, Silent, Text
from lexicon.markdown import BLOCK_START, PARAGRAPH_END, Block
from lexicon.marked_text_builder import MarkedTextBuilder
from lexicon.sentence_length import n_letters
from lexicon.text_marks import PartReader

_AHEAD = 400  # characters behind a sentence that are searched for white space
_UNSPOKEN = "*_~`"  # that may stand behind the end of a sentence


@dataclass(frozen=True, slots=True)
class _Entry:
    """A part of the source, the text that it adds, and its block."""

    part: Part
    said: str
    block: Block

    @property
    def has_words(self) -> bool:
        return any(map(str.isalnum, self.said))

    @property
    def newlines(self) -> int:
        """Line feeds at its end; all of them where it has nothing else."""
        return self.said[len(self.said.rstrip()) :].count("\n")

    @property
    def ends_paragraph(self) -> bool:
        return isinstance(self.part, End) and self.part.said == PARAGRAPH_END


class SentenceCuts:
    """Reads a text with marks, and finds the places between its sentences, which are asked for in order.

    Parameters
    ----------
    style
        Of the tag that applies at its beginning.
    """

    def __init__(self, text: str, rules: Rules, style: str = "") -> None:
        self._text = text
        builder = MarkedTextBuilder()
        reader = PartReader(text, rules, builder)
        self._entries: list[_Entry] = []
        self._letters: list[int] = []  # up to the end of each entry
        total = 0
        for block, parts in read_blocks(text, rules):
            for part in parts:
                at = builder.at
                reader.read(part)
                said = builder.text_from(at)
                total += n_letters(said)
                self._entries.append(_Entry(part, said, block))
                self._letters.append(total)
        self.spoken = builder.text_from(0)
        self._walked = (-1, 0, 0, 0)  # an entry, and its letters, characters and source up to the last cut
        # of `style_at`
        self._at = 0
        self._style = style
        self._has_words = False
        self._newlines = 0

    @property
    def ends_block(self) -> bool:
        """Whether the last sentence is complete, since a block has ended behind it."""
        return bool(self._entries) and self._entries[-1].ends_paragraph and bool(self.spoken.strip())

    def cut_after(self, letters: int) -> int | None:
        """Index of the source behind the sentence that ends after so many letters; None within a block that is whole.

        Emoji, and closing tags, belong to the sentence before; opening ones to the sentence behind, unless a paragraph
        ends before it.
        """
        number = bisect_left(self._letters, letters)
        before = self._letters[number - 1] if number else 0
        cut = self._behind(number, self._source_place(number, letters - before))
        while number < len(self._entries) and (block := self._entries[number].block).start < cut:
            if block.is_whole and cut < block.end:
                return None
            number += 1
        line = self._text[max(cut - _AHEAD, 0) : cut].rstrip(" \t")
        is_mid_line = 0 < cut < len(self._text) and not line.endswith("\n")
        is_block = is_mid_line and BLOCK_START.match(self._text[cut : cut + _AHEAD].lstrip(" \t"))
        return None if is_block else cut

    def _behind(self, number: int, place: int) -> int:
        """The cut behind a letter, over the marks that belong to it."""
        cut, newlines = place, 0
        is_adjacent = True
        has_break = self._has_break_ahead(number, place)
        for at in range(number, len(self._entries)):
            entry = self._entries[at]
            if entry.block.is_open and entry.block.start >= place:
                return cut
            if not isinstance(entry.part, Text):
                end, is_done = _over_mark(entry, place, has_break=has_break, is_adjacent=is_adjacent)
                cut = cut if end is None else end
                if is_done:
                    return cut
                continue
            first, rest = self._ahead(entry.part, place)
            closing = len(rest) - len(rest.lstrip(_UNSPOKEN)) if at == number else 0
            spaces = len(rest) - closing - len(rest[closing:].lstrip())
            newlines += rest[closing : closing + spaces].count("\n")
            if newlines > has_break:
                return first + closing + spaces
            cut = max(cut, first + closing) if closing else cut
            if closing + spaces < len(rest):
                return cut
            is_adjacent = is_adjacent and spaces == 0
        return cut

    def _ahead(self, part: Text, place: int) -> tuple[int, str]:
        """Where a part goes on behind a place, and its first characters from there."""
        first = max(place, part.start)
        return first, self._text[first : min(part.end, first + _AHEAD)]

    def _has_break_ahead(self, number: int, place: int) -> bool:
        """Whether a paragraph ends before the next word."""
        newlines = 0
        for at in range(number, len(self._entries)):
            entry = self._entries[at]
            if entry.ends_paragraph:
                return True
            if isinstance(entry.part, Text):
                ahead = self._ahead(entry.part, place)[1].lstrip(_UNSPOKEN)
                newlines += ahead[: len(ahead) - len(ahead.lstrip())].count("\n")
                if newlines > 1 or ahead.strip():
                    return newlines > 1
            elif at > number and entry.has_words:
                return False
        return False

    def style_at(self, cut: int) -> str:
        """The style of the tag that applies at a cut, unless another one, or a paragraph, begins there."""
        self._follow_to(cut)
        style = self._style
        has_words, newlines = self._has_words, self._newlines
        for at in range(self._at, len(self._entries)):
            entry = self._entries[at]
            if _begins_style(entry.part):
                return ""
            if isinstance(entry.part, Text):
                first, ahead = self._ahead(entry.part, cut)
                if first > entry.part.start:
                    has_words, newlines = True, 0
                newlines += ahead[: len(ahead) - len(ahead.lstrip())].count("\n")
                if newlines > 1 and has_words:
                    return ""
                if ahead.strip():
                    return style
            elif entry.ends_paragraph and has_words:
                return ""
        return style

    def _follow_to(self, cut: int) -> None:
        while self._at < len(self._entries) and self._entries[self._at].part.end <= cut:
            self._follow(self._entries[self._at])
            self._at += 1

    def _follow(self, entry: _Entry) -> None:
        part = entry.part
        if _begins_style(part):
            assert isinstance(part, Cue)
            self._style = "" if part.ends_style else PlacedCue(0, part).style
        if entry.has_words:
            self._has_words, self._newlines = True, 0
        elif entry.said.strip():
            self._newlines = 0
        self._newlines += 2 if entry.ends_paragraph else entry.newlines
        if self._newlines > 1 and self._has_words:
            self._style, self._has_words = "", False

    def is_paragraph_end(self, cut: int) -> bool:
        """Whether what stands at a cut ends a paragraph."""
        rest = self._text[cut : cut + _AHEAD]
        at = cut + len(rest) - len(rest.lstrip())
        number = bisect_left(self._entries, at, key=lambda entry: entry.part.start)
        return number < len(self._entries) and self._entries[number].ends_paragraph

    def _source_place(self, number: int, letters: int) -> int:
        """Index of the source behind so many letters of what an entry says."""
        entry = self._entries[number]
        part, said = entry.part, entry.said
        if not isinstance(part, Text) or part.said != self._text[part.start : part.end]:
            return part.end
        known, done, at, place = self._walked
        if known != number or done > letters:
            done = at = 0
            place = part.start
        while done < letters and at < len(said):
            character = said[at].casefold()
            at += 1
            if character.isspace():
                continue
            # asterisks of emphasis are not said, and capitals may be small letters
            while place < part.end and self._text[place].casefold() != character:
                place += 1
            place, done = place + 1, done + 1
        self._walked = (number, done, at, place)
        return min(place, part.end)


def _begins_style(part: Part) -> bool:
    return isinstance(part, Cue) and not part.is_within and (part.ends_style or bool(PlacedCue(0, part).style))


def _over_mark(entry: _Entry, place: int, *, has_break: bool, is_adjacent: bool) -> tuple[int | None, bool]:
    """The cut behind a mark, None where it does not move, and whether nothing behind it moves it further."""
    part = entry.part
    if isinstance(part, End):
        return (part.end, True) if entry.ends_paragraph or not has_break else (None, False)
    if part.start < place:
        return None, False
    return (part.end, False) if has_break or _belongs_before(part, is_adjacent=is_adjacent) else (None, True)


def _belongs_before(part: Part, *, is_adjacent: bool) -> bool:
    """Whether a mark behind a sentence belongs to it."""
    match part:
        case Cue():
            return part.is_within or part.ends_style
        case Own():
            return bool(part.match["name"] == "/style")
        case Silent():
            return is_adjacent
        case _:
            return False
