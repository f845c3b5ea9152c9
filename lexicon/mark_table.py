"""The table of marks that people and language models write: emoji, emoticons, tags and actions, and what they show.

========== ===========================================================================================
column     holds
========== ===========================================================================================
mark       an emoji or emoticon; a word (``happy``, ``laughter``, ``softly``); a verb, with a word that must
           stand behind it (``shake head``)
kind       ``emoji``, ``emoticon``; ``tag``: a word of moods, sounds and manners; ``action``: a verb of
           directions (*sighs*); ``stage``: a verb that is one at a sentence's beginning only (*walks in*)
style      of what is said with it: a style of the palette, or a mood of ``style_names.tsv``; may be empty
gesture    with the word there, as in square brackets (``wink left``); may be empty
strength   size of the gesture; empty: 1
seconds    duration of the gesture, or of a pause where there is no gesture; empty: the usual one
word       what is said where an emoji stands for a word in a sentence (I ❤️ pizza)
========== ===========================================================================================
"""

import functools
import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from importlib import resources
from pathlib import Path
from types import MappingProxyType

from lexicon.errors import DataError, InputError
from lexicon.gesture_marks import parse_gesture
from lexicon.marked_text import MAX_PAUSE_S, GestureMark
from lexicon.values.files import LARGEST_TEXT_BYTES, read_text

COLUMNS = ("mark", "kind", "style", "gesture", "strength", "seconds", "word")
KINDS = ("emoji", "emoticon", "tag", "action", "stage")
MAX_MARK_CHARACTERS = 40
# signs of ordinary sentences, of which no mark consists but emoticons; a dollar before a number is an amount
PLAIN = re.compile(r"(?:[A-Za-z0-9\s.,!?'\"%/-]++|\$(?=[0-9]))*")
_SAID = frozenset(("emoji", "emoticon"))  # kinds of marks that may stand for a word
_WORD = r"[^\W\d_]+(?:['’-][^\W\d_]+)*"
# How a mark of each kind is spelled; others are never found in a text.
_SPELLINGS = MappingProxyType({
    "emoji": (re.compile(r"(?=.*[^\x00-\x7f])[^A-Za-z]+"), "an emoji"),
    "emoticon": (re.compile(r"\S.*\S|[^\x00-\x7f]"), "two or more characters"),
    "tag": (re.compile(_WORD), "a single word of letters"),
    "action": (re.compile(rf"{_WORD}(?: {_WORD})*"), "a verb, perhaps with words behind it"),
    "stage": (re.compile(rf"{_WORD}(?: {_WORD})*"), "a verb, perhaps with words behind it"),
})  # fmt: skip
_GLYPH_CHOICES = {ord("\ufe0e"): None, ord("\ufe0f"): None}
SKIN_TONES = MappingProxyType(dict.fromkeys(range(0x1F3FB, 0x1F400), ""))


@dataclass(frozen=True, slots=True)
class TextMark:
    """A mark and its meaning: a style, a gesture at 0, seconds of a pause, and the word for which it may stand."""

    mark: str
    kind: str
    style: str = ""
    gesture: GestureMark | None = None
    pause_s: float = 0.0
    word: str = ""


@dataclass(frozen=True, slots=True)
class MarkTable:
    """Marks by kind and spelling; actions and stage directions by the verb's forms.

    `own_styles` and `n_own` are the styles and the number of a user's own rows; `plain_faces` are the emoticons of
    letters and signs of ordinary sentences (XD).
    """

    marks: Mapping[str, Mapping[str, TextMark]]
    verbs: Mapping[str, tuple[TextMark, ...]] = field(default_factory=dict)
    own_styles: frozenset[str] = frozenset()
    n_own: int = 0
    plain_faces: tuple[str, ...] = ()

    def emoji(self, written: str) -> TextMark | None:
        """The mark of an emoji, with or without its skin tones; of joined ones that of the first that is known."""
        plain = written.translate(_GLYPH_CHOICES).translate(SKIN_TONES)
        known = self.marks["emoji"]
        return known.get(plain) or next((known[part] for part in plain.split("\u200d") if part in known), None)

    def emoticon(self, written: str) -> TextMark | None:
        """The mark of an emoticon."""
        return self.marks["emoticon"].get(written)

    def tag(self, word: str) -> TextMark | None:
        """The mark of a word of moods, sounds and manners, in small letters."""
        return self.marks["tag"].get(word)


def verb_forms(verb: str) -> tuple[str, str, str]:
    """The third person of a verb, and its participles with and without a doubled consonant.

    Examples
    --------
    >>> verb_forms("wave"), verb_forms("cry")[0], verb_forms("nod")[2]
    (('waves', 'waving', 'wavving'), 'cries', 'nodding')
    """
    third = verb + "es" if verb.endswith(("sh", "ch", "ss")) else verb + "s"
    third = verb[:-1] + "ies" if verb[-1] == "y" and verb[-2:-1] not in "aeiou" else third
    stem = verb.removesuffix("e")
    return third, stem + "ing", stem + stem[-1:] + "ing"


@functools.cache
def shipped_marks() -> MarkTable:
    """The table of this package, ``text_marks.tsv``."""
    return _table(_shipped_rows())


@functools.lru_cache(maxsize=16)
def _marks_of(path: Path, _: tuple[int, int]) -> MarkTable:
    try:
        lines = read_text(path, LARGEST_TEXT_BYTES).splitlines()
    except OSError as refused:
        raise DataError(f"{path} cannot be read ({refused.strerror}); check the file") from refused
    rows = [line.split("\t") for line in lines]
    own = _checked_rows(rows, str(path))
    styles = frozenset(row.style for row in own if row.style)
    return replace(_table([*_shipped_rows(), *own]), own_styles=styles, n_own=len(own))


def read_marks_table(path: Path | None) -> MarkTable:
    """The table of this package, with the rows of a user's file of the same columns, which replace those of its marks.

    Raises
    ------
    DataError
        The file cannot be read, lacks a column, or has a row that is wrong; the message names its line.
    """
    if path is None:
        return shipped_marks()
    try:
        found = path.stat()
    except OSError as refused:
        raise DataError(f"{path} cannot be read ({refused.strerror}); check the file") from refused
    return _marks_of(path, (found.st_mtime_ns, found.st_size))


def _shipped_rows() -> list[TextMark]:
    lines = resources.files("lexicon").joinpath("text_marks.tsv").read_text(encoding="utf-8").splitlines()
    return _checked_rows([line.split("\t") for line in lines], "text_marks.tsv")


def _checked_rows(rows: Sequence[Sequence[str]], source: str) -> list[TextMark]:
    heading = [cell.strip().lower() for cell in rows[0]] if rows else []
    unknown = [name for name in heading if name not in COLUMNS]
    if unknown or not {"mark", "kind"} <= {*heading}:
        raise DataError(
            f"{source}: the first line must name columns of {', '.join(COLUMNS)}, with mark and kind among them, not "
            f"{', '.join(heading)[:80] or 'nothing'}; correct it, with tabs between the columns"
        )
    if len({*heading}) < len(heading):
        raise DataError(f"{source}: the first line names a column twice; remove one of them")
    found: dict[tuple[str, str], TextMark] = {}
    lines: dict[tuple[str, str], int] = {}
    for line, row in enumerate(rows[1:], 2):
        place = f"{source}, line {line}"
        if any(map(str.strip, row[len(heading) :])):
            raise DataError(f"{place}: {len(row)} cells stand below {len(heading)} columns; correct the tabs")
        cells = {name: cell.strip() for name, cell in zip(heading, row, strict=False)}
        if not any(cells.values()):
            continue
        mark = _mark(cells, place)
        key = mark.kind, mark.mark
        if key in found:
            raise DataError(f"{place}: {cells['mark']!r} stands in line {lines[key]}, too; remove one of them")
        found[key], lines[key] = mark, line
    return [*found.values()]


def _mark(cells: Mapping[str, str], place: str) -> TextMark:
    mark, kind = cells["mark"], cells.get("kind", "")
    if not mark or len(mark) > MAX_MARK_CHARACTERS:
        raise DataError(f"{place}: a mark has 1 to {MAX_MARK_CHARACTERS} characters, not {mark[:20]!r}; correct it")
    if kind not in KINDS:
        raise DataError(f"{place}: there is no kind {kind[:40]!r} of marks; choose {', '.join(KINDS)}")
    pattern, what = _SPELLINGS[kind]
    if not pattern.fullmatch(mark):
        raise DataError(f"{place}: a mark of kind {kind} is {what}, not {mark[:20]!r}; correct it, or the kind")
    gesture, seconds = cells.get("gesture", ""), cells.get("seconds", "")
    _check_columns(cells, kind, place)
    pause_s = _parse_number(seconds, "seconds", place)
    if gesture:
        written = f"{gesture} {cells.get('strength', '')} {seconds + 's' if seconds else ''}"
        try:
            found = parse_gesture(written, 0)
        except InputError as wrong:
            raise DataError(f"{place}: {wrong}") from wrong
        if found is None:
            raise DataError(f"{place}: cannot read the gesture {written.strip()[:40]!r}; write one as wink left")
    else:
        found = None
        if not 0.0 <= pause_s <= MAX_PAUSE_S:
            raise DataError(f"{place}: a pause must lie between 0 and {MAX_PAUSE_S:g} s, not {seconds} s; correct it")
    key = mark.translate(_GLYPH_CHOICES) if kind == "emoji" else mark if kind == "emoticon" else mark.casefold()
    return TextMark(key, kind, cells.get("style", ""), found, 0.0 if gesture else pause_s, cells.get("word", ""))


def _check_columns(cells: Mapping[str, str], kind: str, place: str) -> None:
    """Reject values that have no effect in a row, and a strength that is no number."""
    _parse_number(cells.get("strength", ""), "strength", place)
    if cells.get("strength") and not cells.get("gesture"):
        raise DataError(f"{place}: a strength has no effect without a gesture; name one, or remove the strength")
    if cells.get("word") and kind not in _SAID:
        raise DataError(f"{place}: a word is said for emoji and emoticons only; remove it, or correct the kind")


def _parse_number(written: str, name: str, place: str) -> float:
    """A number of 0 or more, or 0 for an empty cell."""
    try:
        number = float(written or 0)
    except ValueError:
        number = math.nan
    if not 0 <= number < math.inf:
        raise DataError(f"{place}: {name} must be a number of 0 or more, not {written[:20]!r}; correct it")
    return number


def _table(rows: Iterable[TextMark]) -> MarkTable:
    marks: dict[str, dict[str, TextMark]] = {kind: {} for kind in KINDS}
    for row in rows:
        marks[row.kind][row.mark] = row
    verbs: dict[str, list[TextMark]] = {}
    for kind in ("action", "stage"):
        for mark, row in marks[kind].items():
            for form in verb_forms(mark.partition(" ")[0]):
                verbs.setdefault(form, []).append(row)
    return MarkTable(
        MappingProxyType(marks),
        MappingProxyType({form: tuple(sorted(found, key=lambda row: -len(row.mark))) for form, found in verbs.items()}),
        plain_faces=tuple(face for face in (*marks["emoticon"], *marks["emoji"]) if PLAIN.fullmatch(face)),
    )
