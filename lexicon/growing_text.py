"""A text that arrives in parts, as a language model writes it, cut into sentences as soon as they are complete.

Sentences between the two ends of a mark or an element stay together, as do those of an item, a heading or a table. A
tag that still applies behind a cut is written before the next sentence, as ``[emotion: sad]``, so that each can be read
alone.
"""

import re
from collections.abc import Sequence

from lexicon.chunks import split_chunks
from lexicon.errors import InputError
from lexicon.mark_parts import Rules
from lexicon.mark_table import MarkTable, shipped_marks
from lexicon.markdown import BLOCK_START
from lexicon.sentence_cuts import SentenceCuts
from lexicon.sentence_length import MAX_SENTENCE_CHARACTERS, n_letters
from lexicon.text_marks import is_ssml
from lexicon.values.files import LARGEST_TEXT_BYTES

_MAY_END = re.compile(r"[.!?…。！？｡।॥؟۔\n]|.{300}", re.DOTALL)
# What is not yet complete at the end of a text: a mark, a tag, words between asterisks, a table, an emoji, an entity.
_OPEN_ENDS = tuple(
    re.compile(rf"(?:{pattern})\Z")
    for pattern in (
        r"\[[^\]\[]{0,300}", r"<(?=[^\W\d]|[/!?|]|\Z)[^<>]{0,1000}", r"(?<![:;='-])\([^()\n]{0,100}",
        r"\][^\s\[\]]{0,300}", r"(?:^|\n)[ \t>]*\|.*",
        r"(?<!\w)(?:\*{1,3}|_{1,2}|~{1,2}(?!\d)|`{1,3})(?=\S|\Z)[^*_~`\n]{0,300}[*_~`]{0,3}", r"&[#\w]{0,32}", r"\\",
        r"(?<![\w.,])[0-9#]\ufe0f?",  # of a key
        # of a formula, not an amount
        r"(?<![\w$\\])\$(?![0-9][0-9.,]*(?![0-9.,])(?!\s*(?:[\\^_+*=<>]|\Z)|[A-Za-z(]))(?=[^\s$]|\Z)[^$\n]{0,300}\$?",
        r"\$\$[^$]{0,500}\$?", r"\\[(\[][^\\]*(?:\\(?![)\]])[^\\]*){0,40}",
        r"(?<![=+\w])(?:==?|\+\+?)(?=[^\s=+]|\Z)[^=+\n]{0,200}(?:==?|\+\+?)?",
        r"(?<!\w)(?:[xX][D'-]?|[oO]_?|[TQ][_.]?|[uU]w?|B-?|D:?)",  # of an emoticon
    )
)  # fmt: skip
_MAX_OPEN_CHARACTERS = 1001  # the longest of them
_SPACES = re.compile(r"\s{2,}")
_STYLE_END = re.compile(r"\[(?P<closing>/?)style\b[^\[\]]*\]")
_ELEMENT_END = re.compile(r"<(?P<closing>/?)[A-Za-z][^<>]*(?<!/)>|<[^<>]*\Z")
_HALF = re.compile("[\ud800-\udfff]")  # of a character in two parts, as JavaScript cuts them
_LONE = re.compile("[\ud800-\udbff](?!\\Z)|[\udc00-\udfff]")  # whose other half cannot follow
MAX_INDENT = 4
SEARCHED_CHARACTERS = 600  # of text without a cut that are read again with each part; more only as it grows
LEAST_GROWTH = 1.25  # as a factor
MAX_HELD_CHARACTERS = 10_000  # that wait for the end of a mark or an element, and are searched with each part


class GrowingText:
    """Sentences of a text that arrives in parts, with the markup of the request (`lexicon.text_marks.MARKUPS`).

    A sentence is complete when a word of the next one is there, since only that distinguishes its end from an
    abbreviation, and a mark behind it from one that begins the next one.

    Parameters
    ----------
    table
        Marks of people and language models; None: those of this package.

    Raises
    ------
    InputError
        More text waits than a request may have.
    """

    def __init__(self, language: str, markup: str = "auto", table: MarkTable | None = None) -> None:
        self._language, self._markup = language, markup
        self._rules = Rules(language, table or shipped_marks(), markup == "llm")
        self._text, self._style = "", ""  # what waits, and the style of the tag that applies at its beginning
        self._is_held = False  # whether the first sentence waits for the end of a mark
        self._read_to = -1  # up to where what waits has been read

    def add(self, part: str) -> list[str]:
        """Append text; the sentences that are complete now."""
        part = _joined(self._text[-1:], part)
        kept = (self._text[:-1] if _HALF.match(self._text[-1:]) else self._text).rstrip()
        self._text = kept + _SPACES.sub(_shortened, _HALF.sub("", self._text[len(kept) :]) + part)
        if len(self._text) > LARGEST_TEXT_BYTES:
            raise InputError("the text is too long; end it, or send sentences")
        if not _MAY_END.search(self._text):
            return []
        if self._reads_marks:
            return self._marked(is_ended=False)
        end = _open_end(self._text, _OPEN_ENDS[:2])
        if self._is_held and self._is_open(self._text[:end]):
            return []
        # the last one may go on: the next part may bring small letters or an abbreviation
        return self._taken(list(split_chunks(self._text[:end], MAX_SENTENCE_CHARACTERS, self._language))[:-1])

    def flush(self) -> list[str]:
        """All sentences that are left."""
        self._text = _HALF.sub("", self._text)
        if self._reads_marks:
            sentences = self._marked(is_ended=True)
            rest = _with_style(self._text.strip(), self._style)
        else:
            sentences = self._taken(list(split_chunks(self._text, MAX_SENTENCE_CHARACTERS, self._language)))
            rest = self._text.strip()
        has_rest = bool(self._text.strip())
        self.clear()
        return [*sentences, rest] if has_rest else sentences

    def clear(self) -> None:
        """Forget the text that waits."""
        self._text = self._style = ""
        self._is_held, self._read_to = False, -1

    @property
    def _reads_marks(self) -> bool:
        return self._markup in {"auto", "llm"} and not is_ssml(self._text)

    def _marked(self, *, is_ended: bool) -> list[str]:
        """Complete sentences of a text with marks, taken from its beginning."""
        text = self._text
        limit = len(text) if is_ended else _open_end(text, _OPEN_ENDS)
        if not is_ended and (self._waits_on(limit) or (self._is_held and self._is_open(text[:limit]))):
            return []
        cuts = SentenceCuts(text[:limit], self._rules, self._style)
        chunks = list(split_chunks(cuts.spoken, MAX_SENTENCE_CHARACTERS, self._language))
        n_complete = len(chunks)
        if not (is_ended or cuts.ends_block):  # the last one with words may go on
            n_complete = next((n for n in range(n_complete - 1, 0, -1) if any(map(str.isalnum, chunks[n]))), 0)
        found: list[str] = []
        start = letters = 0
        for number, chunk in enumerate(chunks[: max(n_complete, 0)]):
            letters += n_letters(chunk)
            is_last = is_ended and number == len(chunks) - 1
            cut = len(text) if is_last else cuts.cut_after(letters)
            if cut is None and letters and len(text) - start > MAX_HELD_CHARACTERS:
                cut = _after_letters(text, letters)
            if cut is None or (not is_last and self._is_open(text[start:cut])):
                continue
            sentence = _trimmed(text[start:cut])
            sentence += "\n\n" if cuts.is_paragraph_end(cut) and not sentence.endswith("\n") else ""
            found.append(_with_style(sentence, self._style))
            self._style, start = cuts.style_at(cut), cut
        self._is_held = n_complete > 0 and not found
        self._text = text[start:]
        self._read_to = limit - start
        return found

    def _waits_on(self, limit: int) -> bool:
        """Whether a text up to a place has been read before, or too little is new in a long one without a cut."""
        is_long = limit > SEARCHED_CHARACTERS and limit < self._read_to * LEAST_GROWTH
        return limit == self._read_to or (is_long and self._read_to >= 0)

    def _taken(self, chunks: Sequence[str]) -> list[str]:
        """Remove sentences from the beginning, each with the blank line behind it; those in an open mark stay."""
        found: list[str] = []
        letters, n_held = 0, 0
        for chunk in chunks:
            letters, n_held = letters + n_letters(chunk), n_held + 1
            end = _after_letters(self._text, letters)
            if self._is_open(self._text[:end]):
                continue
            found.append(chunk if n_held == 1 else self._text[:end].strip())
            self._text = self._text[end:]
            found[-1] += "\n\n" if self._text[:2] == "\n\n" else ""
            letters = n_held = 0
        self._is_held = n_held > 0
        return found

    def _is_open(self, text: str) -> bool:
        """Whether a mark or an element of a text has begun and not ended."""
        if self._markup == "plain" or len(text) > MAX_HELD_CHARACTERS:
            return False
        ends = _ELEMENT_END if self._markup == "ssml" or is_ssml(text) else _STYLE_END
        return sum(-1 if match["closing"] else 1 for match in ends.finditer(text)) > 0


def _joined(last: str, part: str) -> str:
    """A part with the pair of the half of a character that arrived before it; other halves are left out at the end."""
    joined = (last if _HALF.match(last) else "") + part
    if not _HALF.search(joined):
        return part
    return _LONE.sub("", joined.encode("utf-16", "surrogatepass").decode("utf-16", "surrogatepass"))


def _open_end(text: str, patterns: Sequence["re.Pattern[str]"]) -> int:
    """Where what is not yet complete at the end of a text begins; its length without such a thing."""
    start = max(len(text) - _MAX_OPEN_CHARACTERS, 0)
    return min((found.start() for pattern in patterns if (found := pattern.search(text, start))), default=len(text))


def _trimmed(sentence: str) -> str:
    """A sentence without the space around it, but for what ends its paragraph, or its item."""
    kept = sentence.rstrip()
    n_lines = sentence[len(kept) :].count("\n")
    is_block = n_lines == 1 and BLOCK_START.match(kept[kept.rfind("\n") + 1 :]) is not None
    return kept.lstrip() + "\n" * (2 if n_lines > 1 else is_block)


def _with_style(sentence: str, style: str) -> str:
    return f"[emotion: {style}]\n{sentence}" if style else sentence


def _after_letters(text: str, letters: int) -> int:
    """Place after so many letters."""
    at = 0
    while letters and at < len(text):
        letters -= not text[at].isspace()
        at += 1
    return at


def _shortened(spaces: "re.Match[str]") -> str:
    """White space with the same meaning in few characters, so that waiting text does not grow by it."""
    lines = spaces.group().rpartition("\n")
    return "\n" * min(spaces.group().count("\n"), 2) + lines[2][:MAX_INDENT] if lines[1] else " "
