"""How a subtitle file is read, where its content leaves a choice."""

from dataclasses import dataclass
from pathlib import Path

from lexicon.errors import InputError
from lexicon.g2p import DEFAULT_LANGUAGE
from lexicon.mark_parts import Rules
from lexicon.mark_table import read_marks_table
from lexicon.values.checks import check_limits
from lexicon.values.fields import check_fields
from tts2face.interchange.subtitles.frames import RATE_LIMITS
from tts2face.interchange.subtitles.unspoken import KINDS

MAX_SHIFT_S = 360_000.0  # 100 hours; the time code of a tape begins at up to 24 hours


@dataclass(frozen=True, slots=True, kw_only=True)
class SubtitleOptions:
    """Choices of the reader of subtitles.

    Parameters
    ----------
    language
        Language of the words, where it is known; it decides among encodings, tracks and SAMI classes.
    keep
        Kinds of what is shown and not said that are spoken nevertheless, of `KINDS`.
    speakers
        Whether names before a colon are speakers; else they are words.
    markup
        Of the words, as of a request; tags of cues that are ``ssml`` are kept.
    text_marks
        Table of marks, as of a request.
    fps
        Frames a second of times that are written in frames; None: as the file or its film says.
    track
        Subtitle track of a film, by its number from 1 or its language, or class of a SAMI file.
    shift
        Seconds that are added to all times.
    film_s
        Length of the film in seconds, where it is known; no cue begins after it.

    Raises
    ------
    InputError
        A value is of another type, unknown or out of range.
    """

    language: str | None = None
    keep: tuple[str, ...] = ()
    speakers: bool = True
    markup: str = "auto"
    text_marks: Path | None = None
    fps: float | None = None
    track: str | None = None
    shift: float = 0.0
    film_s: float | None = None

    @property
    def mark_rules(self) -> Rules | None:
        """Rules by which brackets are marks; None where the markup reads none in plain text."""
        if self.markup not in {"auto", "llm"}:
            return None
        return Rules(self.language or DEFAULT_LANGUAGE, read_marks_table(self.text_marks), self.markup == "llm")

    def __post_init__(self) -> None:
        """Refuse values of other types, unknown kinds, and numbers out of range."""
        check_fields(self)
        check_kinds(self.keep)
        if self.fps is not None:
            check_limits("subtitle_fps", self.fps, RATE_LIMITS)
        check_limits("shift", self.shift, (-MAX_SHIFT_S, MAX_SHIFT_S))


def check_kinds(kinds: tuple[str, ...]) -> None:
    """Refuse an unknown kind of what is shown and not said (`InputError`)."""
    for kind in kinds:
        if kind not in KINDS:
            raise InputError(f"keep must be of {', '.join(KINDS)}, not {kind!r}")
