"""TextGrids in each form that Praat writes: long, short and chronological text, collections, and binary."""

import math
import struct
from collections.abc import Iterator
from pathlib import Path

from lexicon.errors import DataError
from lexicon.values.files import check_regular_file
from tts2face.interchange.transcripts.file_text import MAX_BYTES, read_text
from tts2face.interchange.transcripts.praat_text import DamagedError, PraatItems
from tts2face.interchange.transcripts.spoken import SpokenCue, Tier

TEXT_MARK = "ooTextFile"
CHRONOLOGICAL_MARK = "Praat chronological TextGrid text file"
BINARY_MARK = b"ooBinaryFile"
INTERVALS, POINTS = "IntervalTier", "TextTier"
ROUNDING_S = 1e-6  # by which programs write the end of an empty interval before its start
LONG_TEXT = 0xFFFF  # length of a text that holds more than ASCII (Praat, abcio.cpp, binputw16)


def is_textgrid(text: str) -> bool:
    """Whether a text is that of a TextGrid or of another object of Praat."""
    head = text.lstrip()[:200].split("\n", 1)[0]
    return TEXT_MARK in head or CHRONOLOGICAL_MARK in head


def read_textgrid(path: Path) -> list[Tier]:
    """Tiers of a TextGrid in any form, with empty intervals."""
    check_regular_file(path)
    try:
        binary = _read_binary(path)
        return _tiers_of_text(path) if binary is None else _tiers_of_bytes(path, binary)
    except (DamagedError, struct.error) as broken:
        reason = "it ends early" if isinstance(broken, struct.error) else broken
        raise DataError(f"{path} is a damaged TextGrid: {reason}; save it with Praat again") from broken


def _tiers_of_text(path: Path) -> list[Tier]:
    text = read_text(path)
    if not is_textgrid(text):
        raise DataError(f"{path} is not a TextGrid; save it with Praat as text")
    text = text.replace("\r\n", "\n").replace("\r", "\n").lstrip("\ufeff \n\t")
    head, _, _ = text.partition("\n")
    items = PraatItems(text, len(head))
    if CHRONOLOGICAL_MARK in head:
        return _read_chronological(items)
    return list(_read_object(path, items.text(), items))


def _read_object(path: Path, kind: str, items: PraatItems) -> Iterator[Tier]:
    """Tiers of an object, whose class was read."""
    # "TextGrid 2" would be a later version of the class
    name = kind.split(" ", maxsplit=1)[0]
    if name == "Collection":
        for _ in range(items.count()):
            kind, _ = items.text(), items.text()
            yield from _read_object(path, kind, items)
    elif name in {INTERVALS, POINTS}:
        yield _read_tier(items, name, "")
    elif name == "TextGrid":
        items.number()
        items.number()
        for _ in range(items.count() if items.exists() else 0):
            kind, title = items.text(), items.text()
            yield _read_tier(items, kind, title)
    else:
        raise DataError(f"{path} holds a {name} of Praat and no TextGrid; save the TextGrid")


def _read_tier(items: PraatItems, kind: str, name: str) -> Tier:
    if kind not in {INTERVALS, POINTS}:
        raise DamagedError(f"line {items.line}: there is no tier of class {kind[:40]!r}")
    items.number()
    items.number()
    labels = []
    for _ in range(items.count()):
        start = items.number()
        end = items.number() if kind == INTERVALS else start
        labels.append(_label(start, end, items.text()))
    return Tier(name, tuple(labels), kind == POINTS)


def _label(start: float, end: float, text: str) -> SpokenCue:
    if not (math.isfinite(start) and math.isfinite(end)) or start > end + ROUNDING_S:
        raise DamagedError(f"the label {text[:40]!r} lies from {start} s to {end} s")
    return SpokenCue(start, max(start, end), text.strip())


def _read_chronological(items: PraatItems) -> list[Tier]:
    """Tiers of a file that lists the labels of all tiers by time."""
    items.number()
    items.number()
    heads: list[tuple[str, str]] = []
    for _ in range(items.count()):
        heads.append((items.text(), items.text()))
        items.number()
        items.number()
    labels: list[list[SpokenCue]] = [[] for _ in heads]
    while items.has_number():
        at = items.count() - 1
        if not 0 <= at < len(heads):
            raise DamagedError(f"line {items.line}: there is no tier {at + 1}")
        start = items.number()
        end = items.number() if heads[at][0] == INTERVALS else start
        labels[at].append(_label(start, end, items.text()))
    return [Tier(name, tuple(found), kind == POINTS) for (kind, name), found in zip(heads, labels, strict=True)]


def _read_binary(path: Path) -> bytes | None:
    """Content of a binary file of Praat behind its mark; None for other files."""
    try:
        with path.open("rb") as file:
            if file.read(len(BINARY_MARK)) != BINARY_MARK:
                return None
            content = file.read(MAX_BYTES + 1)
    except OSError as refused:
        raise DataError(f"{path} cannot be read ({refused.strerror}); check the file") from refused
    if len(content) > MAX_BYTES:
        raise DataError(f"{path} is larger than {MAX_BYTES >> 20} MiB; divide it")
    return content


class _Bytes:
    """Big-endian numbers and texts in their order."""

    def __init__(self, content: bytes) -> None:
        self._content, self._at = content, 0

    def take(self, form: str) -> float:
        (number,) = struct.unpack_from(f">{form}", self._content, self._at)
        self._at += struct.calcsize(form)
        return float(number)

    def text(self, form: str = "H") -> str:
        """A text of Latin-1 behind its length, or of UTF-16 behind `LONG_TEXT` and its length."""
        length = int(self.take(form))
        if form == "H" and length == LONG_TEXT:
            return self._wide_text(int(self.take("H")))
        found = self._content[self._at : self._at + length]
        if len(found) < length:
            raise DamagedError("it ends early")
        self._at += length
        return found.decode("latin-1")

    def _wide_text(self, length: int) -> str:
        units: list[int] = []
        for _ in range(length):
            units.append(int(self.take("H")))
            # the length counts characters, and a character beyond 16 bits has two units
            if 0xD800 <= units[-1] < 0xDC00:
                units.append(int(self.take("H")))
        return struct.pack(f">{len(units)}H", *units).decode("utf-16-be", errors="replace")


def _tiers_of_bytes(path: Path, content: bytes) -> list[Tier]:
    items = _Bytes(content)
    kind = items.text("B")
    if kind != "TextGrid":
        raise DataError(f"{path} holds a {kind[:40]} of Praat and no TextGrid; save the TextGrid")
    items.take("d")
    items.take("d")
    tiers = []
    for _ in range(int(items.take("i")) if items.take("B") else 0):
        kind, name = items.text("B"), items.text()
        if kind not in {INTERVALS, POINTS}:
            raise DamagedError(f"there is no tier of class {kind[:40]!r}")
        items.take("d")
        items.take("d")
        labels = []
        for _ in range(int(items.take("i"))):
            start = items.take("d")
            end = items.take("d") if kind == INTERVALS else start
            labels.append(_label(start, end, items.text()))
        tiers.append(Tier(name, tuple(labels), kind == POINTS))
    return tiers
