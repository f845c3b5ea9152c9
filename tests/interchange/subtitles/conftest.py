"""Subtitle files that a test writes and reads."""

from collections.abc import Callable
from pathlib import Path

import pytest

from tts2face.interchange.subtitles.cues import Subtitles
from tts2face.interchange.subtitles.options import SubtitleOptions
from tts2face.interchange.subtitles.reader import read_subtitles

EVENTS = "[Script Info]\n\n[Events]\nFormat: Layer, Start, End, Style, Name, MarginL, MarginR, MarginV, Effect, Text\n"
ReadText = Callable[..., Subtitles]


@pytest.fixture
def read(tmp_path: Path) -> ReadText:
    """Subtitles of a text in a file with an ending, read with choices by name."""

    def read_text(
        content: str | bytes, suffix: str = ".srt", encoding: str | None = None, **choices: object
    ) -> Subtitles:
        path = tmp_path / f"a{suffix}"
        path.write_bytes(content if isinstance(content, bytes) else content.encode("utf-8"))
        return read_subtitles(path, encoding, SubtitleOptions(**choices))  # type: ignore[arg-type]

    return read_text


def srt(*cues: tuple[float, float, str]) -> str:
    """SubRip of cues: start and end in seconds, and text."""
    return "".join(
        f"{number}\n{stamp(begin)} --> {stamp(end)}\n{text}\n\n"
        for number, (begin, end, text) in enumerate(cues, start=1)
    )


def vtt(*cues: tuple[float, float, str]) -> str:
    """WebVTT of cues."""
    return "WEBVTT\n\n" + "".join(
        f"{stamp(begin).replace(',', '.')} --> {stamp(end).replace(',', '.')} align:start\n{text}\n\n"
        for begin, end, text in cues
    )


def ass(*lines: tuple[float, float, str, str]) -> str:
    """SubStation Alpha of lines: start, end, style and text."""
    return EVENTS + "".join(
        f"Dialogue: 0,{short_stamp(begin)},{short_stamp(end)},{style},,0,0,0,,{text}\n"
        for begin, end, style, text in lines
    )


def short_stamp(seconds: float) -> str:
    """An instant as SubStation Alpha writes it."""
    return stamp(seconds)[1:-1].replace(",", ".")


def stamp(seconds: float) -> str:
    """An instant as SubRip writes it."""
    whole = round(seconds * 1000)
    return f"{whole // 3_600_000:02d}:{whole // 60_000 % 60:02d}:{whole // 1000 % 60:02d},{whole % 1000:03d}"
