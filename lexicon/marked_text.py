"""A text with its marks: runs of style, rate, volume and tone, and pauses, gestures and names at positions.

Positions are character indices of the spoken text, which does not contain the marks themselves.
"""

from dataclasses import dataclass, replace
from typing import Protocol

from lexicon.errors import InputError
from lexicon.gesture_names import GESTURES
from lexicon.ipa import IpaPhone
from lexicon.tones import EVEN, Tone
from lexicon.values.checks import check_limits

RATE_LIMITS = (0.5, 2.0)  # speaking rate of marked words, as of a whole request
VOLUME_LIMITS = (0.0, 2.0)
PITCH_LIMITS = (-12.0, 12.0)  # semitones: an octave, as SSML services allow
RANGE_LIMITS = (0.0, 2.0)
EMPHASIS_DB = 3.0  # of strong emphasis: accented words are 2-5 dB louder (Krahmer and Swerts 2007)
GESTURE_SIZE_LIMITS = (0.1, 2.0)  # above 12 degrees a nod is a bow
GESTURE_SECONDS_LIMITS = (0.1, 30.0)  # from a quick blink to a long gaze aside
GESTURE_DEG_LIMITS = (-35.0, 35.0)  # farther, people turn the head (Stahl 1999, Experimental Brain Research 126)
MAX_PAUSE_S = 10.0  # s, at one position; speech services allow 10 to 20
MAX_NESTING = 16  # levels of marks within marks
MAX_NOTES = 20  # on one text


@dataclass(frozen=True, slots=True)
class StyleRun:
    """Styles, outermost first, factors of rate and volume, and the tone from a character up to the next run.

    ``voice`` and ``language`` are set in a span of another voice or language, and None elsewhere; ``pace``, seconds a
    letter, in a span whose duration is given, where it replaces the rate.
    """

    start: int
    styles: tuple[str, ...] = ()
    rate: float = 1.0
    volume: float = 1.0
    voice: str | None = None
    language: str | None = None
    tone: Tone = EVEN
    pace: float | None = None

    @property
    def loudness(self) -> float:
        """Factor of the sound: the volume, and the level of the emphasis."""
        return self.volume * float(10.0 ** (EMPHASIS_DB * self.tone.emphasis / 20.0))

    def is_spoken_as(self, other: "StyleRun") -> bool:
        """Whether all but the start is that of another run."""
        return replace(self, start=other.start) == other


@dataclass(frozen=True, slots=True)
class PauseMark:
    """Silence before a character."""

    at: int
    seconds: float

    def __post_init__(self) -> None:
        """Refuse lengths out of range."""
        check_limits("a pause", self.seconds, (0.0, MAX_PAUSE_S), " s")


@dataclass(frozen=True, slots=True)
class GestureMark:
    """A gesture with the word at or after a character; its fields are those of `tts2face.gestures.elements.Gesture`."""

    at: int
    name: str = "nod"
    size: float = 1.0
    seconds: float | None = None
    down_deg: float | None = None
    left_deg: float | None = None

    def __post_init__(self) -> None:
        """Refuse unknown names, and values out of range."""
        check_gesture(self)


class GestureFields(Protocol):
    """Fields of a gesture, wherever it stands."""

    @property
    def name(self) -> str:
        """One of `GESTURES`."""

    @property
    def size(self) -> float:
        """Factor of its movements."""

    @property
    def seconds(self) -> float | None:
        """Its duration; None is its usual one."""

    @property
    def down_deg(self) -> float | None:
        """Degrees down of its direction; None is the usual one."""

    @property
    def left_deg(self) -> float | None:
        """Degrees to the person's own left."""


def check_gesture(gesture: GestureFields) -> None:
    """Refuse unknown gestures, and values out of range.

    Raises
    ------
    InputError
        There is no such gesture, it has no direction, or a value is out of range.
    """
    if gesture.name not in GESTURES:
        raise InputError(f"there is no gesture {gesture.name[:40]!r}; choose {', '.join(GESTURES)}")
    what = gesture.name.replace("_", " ")
    check_limits(f"the size of the gesture {what}", gesture.size, GESTURE_SIZE_LIMITS)
    if gesture.seconds is not None:
        check_limits(f"the duration of the gesture {what}", gesture.seconds, GESTURE_SECONDS_LIMITS, " s")
    for direction, degrees in (("down", gesture.down_deg), ("left", gesture.left_deg)):
        if degrees is None:
            continue
        if GESTURES[gesture.name].directions == "none":
            raise InputError(
                f"the gesture {what} has no direction; remove it, or choose look_at, look_away, tilt or wink"
            )
        check_limits(f"the direction {direction} of the gesture {what} in degrees", degrees, GESTURE_DEG_LIMITS)


@dataclass(frozen=True, slots=True)
class NameMark:
    """A named position whose time is reported."""

    at: int
    name: str


@dataclass(frozen=True, slots=True)
class PhoneMark:
    """A word, as a half-open range of characters, with given phones."""

    at: int
    end: int
    segments: tuple[IpaPhone, ...]


Mark = PauseMark | GestureMark | NameMark | PhoneMark


@dataclass(frozen=True, slots=True)
class MarkedText:
    """Spoken text with runs and marks.

    Parameters
    ----------
    text
        Spoken text, without marks.
    runs
        At least one; the first begins at 0, and starts increase.
    marks
        Ordered by position; at one position in the order of the source.
    language
        Language declared in the text (SSML), or None.
    notes
        What of the source is not followed, each a sentence without its stop.
    foreign_styles
        Names of styles that are none of a speech service that is known, and need be none of the palette.
    """

    text: str
    runs: tuple[StyleRun, ...] = (StyleRun(0),)
    marks: tuple[Mark, ...] = ()
    language: str | None = None
    notes: tuple[str, ...] = ()
    foreign_styles: frozenset[str] = frozenset()

    @property
    def has_voice_changes(self) -> bool:
        """Whether a pause, rate, volume, tone, voice or language is marked, which a recording cannot follow."""
        is_uniform = all(run.is_spoken_as(StyleRun(run.start, run.styles)) for run in self.runs)
        return not is_uniform or any(isinstance(mark, PauseMark) for mark in self.marks)
