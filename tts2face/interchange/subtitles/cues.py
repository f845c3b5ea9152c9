"""Cues of a subtitle file, as they are written and as they are spoken."""

import re
from dataclasses import dataclass
from pathlib import Path

from tts2face.interchange.subtitles.markup import SUBRIP_MARKUP, Markup

# What a message says about an option: "; --keep signs speaks them", "(--subtitle-fps)", ", or move them with --shift".
_OPTION = re.compile(r"(?:[;,] | (?=\())\(?(?:or [a-z ]+ with |[a-z]+ [a-z' ]+ as )?--[a-z-]+[^;()]*\)?")
_ENCODING = "--encoding"


@dataclass(frozen=True, slots=True)
class WrittenCue:
    """A cue as its file has it.

    Parameters
    ----------
    begin_s, end_s
        Instants in seconds; `end_s` is None if it is missing or unreadable.
    text
        Lines of the cue with their tags.
    line
        Line of the file at which the cue begins, from 1.
    speaker, style
        Name of the speaker and of the style, where the format has them; else empty.
    language
        Language tag of the cue or of the whole file; else None.
    markup
        What its text holds besides words.
    kind
        One of `tts2face.interchange.subtitles.unspoken.KINDS`, where the file says that it is not said; else empty.
    """

    begin_s: float
    end_s: float | None
    text: str
    line: int
    speaker: str = ""
    style: str = ""
    language: str | None = None
    markup: Markup = SUBRIP_MARKUP
    kind: str = ""


@dataclass(frozen=True, slots=True)
class CuePart:
    """Words of one speaker in a cue; the speaker is empty if the cue has no name for them."""

    speaker: str
    text: str


@dataclass(frozen=True, slots=True)
class Cue:
    """Words spoken between two instants.

    Parameters
    ----------
    number
        Position in order of time, from 1.
    begin_s, end_s
        Instants in seconds; the end lies after the start.
    text
        Spoken words on one line, without tags, noises, lyrics and speaker labels; empty for a silent cue.
    line
        Line of the file at which the cue begins, from 1.
    shown
        Text as it is shown, on one line, without tags.
    speaker
        Speaker by label (``JOHN:``), WebVTT voice tag, actor of SubStation Alpha, or TTML agent; else empty.
    style
        Style of SubStation Alpha or TTML, or class of the WebVTT voice tag; else empty.
    language
        Language tag, where the file has one.
    has_estimated_end
        Whether the end is estimated from the length of the text, as the file has none after the start.
    parts
        Words of each speaker in a cue of several; else empty.
    kind
        Why the whole cue is not spoken, as ``signs``; else empty.
    """

    number: int
    begin_s: float
    end_s: float
    text: str
    line: int
    shown: str = ""
    speaker: str = ""
    style: str = ""
    language: str | None = None
    has_estimated_end: bool = False
    parts: tuple[CuePart, ...] = ()
    kind: str = ""

    @property
    def duration_s(self) -> float:
        """Duration in seconds."""
        return self.end_s - self.begin_s


@dataclass(frozen=True, slots=True)
class SubtitleWarning:
    """A defect of a subtitle file and how it was read, or a note of what was found in it."""

    line: int
    message: str


def without_options(message: str) -> str:
    """A message of the reader at a door without its options: what was found, and what to do about the file itself."""
    return _OPTION.sub(lambda match: "; save it as UTF-8" if _ENCODING in match[0] else "", message)


@dataclass(frozen=True, slots=True)
class Subtitles:
    """Cues of a file in order of time, its defects in order of their lines, and what else is worth saying.

    `notes` say what is shown and not spoken, and who speaks.
    """

    path: Path
    cues: tuple[Cue, ...]
    warnings: tuple[SubtitleWarning, ...]
    notes: tuple[SubtitleWarning, ...] = ()
