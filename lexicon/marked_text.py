"""A text and what is marked in it: styles, speed and loudness run by run, and pauses, nods and names at places.

Places are characters of the text that is said, in which the marks themselves are missing.
"""

from dataclasses import dataclass, replace

from lexicon.errors import InputError
from lexicon.ipa import Segment

RATE_LIMITS = (0.5, 2.0)  # speed of marked words, as of a whole request
VOLUME_LIMITS = (0.0, 2.0)
NOD_SIZE_LIMITS = (0.1, 2.0)
MAX_PAUSE_S = 10.0  # at one place; speech services allow 10 to 20
MAX_NESTING = 16  # marks within marks; nobody reads more


@dataclass(frozen=True, slots=True)
class StyleRun:
    """From a character on, to the next run: styles in force, outermost first, and factors of speed and loudness.

    ``voice`` and ``language`` are those of a span that another voice speaks, or in another language; None elsewhere.
    """

    start: int
    styles: tuple[str, ...] = ()
    rate: float = 1.0
    volume: float = 1.0
    voice: str | None = None
    language: str | None = None


@dataclass(frozen=True, slots=True)
class PauseMark:
    """Silence before a character."""

    at: int
    seconds: float

    def __post_init__(self) -> None:
        """Refuse lengths out of range."""
        _check_range("a pause", self.seconds, (0.0, MAX_PAUSE_S), " s")


@dataclass(frozen=True, slots=True)
class NodMark:
    """The head nods with the word at or behind a character."""

    at: int
    size: float = 1.0

    def __post_init__(self) -> None:
        """Refuse sizes out of range."""
        _check_range("the size of a nod", self.size, NOD_SIZE_LIMITS)


@dataclass(frozen=True, slots=True)
class NameMark:
    """A place whose time is kept."""

    at: int
    name: str


@dataclass(frozen=True, slots=True)
class PhoneMark:
    """A word, from a character up to another, that is said with these phones."""

    at: int
    end: int
    segments: tuple[Segment, ...]


Mark = PauseMark | NodMark | NameMark | PhoneMark


@dataclass(frozen=True, slots=True)
class MarkedText:
    """What is said, and how.

    Parameters
    ----------
    text
        Without any mark.
    runs
        At least one; the first begins at 0, the others each behind the one before.
    marks
        In order of place; of one place in the order in which they were written.
    language
        That the text itself names (SSML), or nothing.
    """

    text: str
    runs: tuple[StyleRun, ...] = (StyleRun(0),)
    marks: tuple[Mark, ...] = ()
    language: str | None = None

    @property
    def has_voice_changes(self) -> bool:
        """A pause, speed, loudness, voice or language is marked: what only a voice that has not spoken yet can do."""
        spoken_alike = all(
            run.rate == run.volume == 1.0 and run.voice is None and run.language is None for run in self.runs
        )
        return not spoken_alike or any(isinstance(mark, PauseMark) for mark in self.marks)


@dataclass(slots=True)
class _OpenSpan:
    """A mark that is not closed yet."""

    kind: str
    shown: str
    start: int
    before: StyleRun


class MarkedTextBuilder:
    """Takes text and marks in order, and becomes a `MarkedText`."""

    def __init__(self) -> None:
        self._pieces: list[str] = []
        self._length = 0
        self._runs = [StyleRun(0)]
        self._marks: list[Mark] = []
        self._open_spans: list[_OpenSpan] = []
        self._last_pause: tuple[int, PauseMark | None] = (0, None)

    @property
    def at(self) -> int:
        """Characters so far."""
        return self._length

    def add_text(self, text: str) -> None:
        """Add words."""
        self._pieces.append(text)
        self._length += len(text)

    def mark(self, mark: Mark) -> None:
        """Add a mark at the present place; pauses at one place add up.

        Raises
        ------
        InputError
            They last too long.
        """
        if isinstance(mark, PauseMark):
            place, earlier = self._last_pause
            if earlier is not None and earlier.at == mark.at:
                mark = PauseMark(mark.at, earlier.seconds + mark.seconds)
                self._marks[place] = mark
                self._last_pause = (place, mark)
                return
            self._last_pause = (len(self._marks), mark)
        self._marks.append(mark)

    def open(self, kind: str, shown: str, *, style: str | None = None, rate: float = 1.0, volume: float = 1.0) -> None:
        """Begin a span that `close` ends; within another, factors multiply and styles add up.

        Raises
        ------
        InputError
            Spans are nested too deep, or together too fast, slow or loud.
        """
        before = self._begin(kind, shown)
        _check_range(f"the speed within {shown}", before.rate * rate, RATE_LIMITS)
        _check_range(f"the loudness within {shown}", before.volume * volume, VOLUME_LIMITS)
        styles = (*before.styles, style) if style is not None else before.styles
        self._start_run(
            replace(before, start=self._length, styles=styles, rate=before.rate * rate, volume=before.volume * volume)
        )

    def open_voice(self, kind: str, shown: str, *, voice: str | None, language: str | None) -> None:
        """Begin a span of another voice or language that `close` ends; None keeps what is in force.

        Raises
        ------
        InputError
            Spans are nested too deep.
        """
        before = self._begin(kind, shown)
        self._start_run(
            replace(before, start=self._length, voice=voice or before.voice, language=language or before.language)
        )

    @property
    def language(self) -> str | None:
        """Language of the span at the present place; None where it is that of the whole text."""
        return self._runs[-1].language

    def close(self, kind: str, shown: str) -> None:
        """End the span that was opened last.

        Raises
        ------
        InputError
            None of this kind is open, another one is, or a style holds nothing that is said.
        """
        if not self._open_spans:
            raise InputError(f"{shown} closes nothing; open it before, or leave it away")
        last = self._open_spans.pop()
        if last.kind != kind:
            raise InputError(f"{shown} stands where {last.shown} must be closed first")
        if self._length == last.start and self._runs[-1].styles != last.before.styles:
            raise InputError(f"{last.shown} holds no word; put what is said between it and its end")
        self._start_run(replace(last.before, start=self._length))

    def done(self, language: str | None = None, *, spoken: str | None = None) -> MarkedText:
        """All that was given; a span in the language that is `spoken` anyway is none of its own.

        Raises
        ------
        InputError
            A span is still open.
        """
        if self._open_spans:
            raise InputError(f"{self._open_spans[-1].shown} is never closed; say where it ends")
        runs: list[StyleRun] = []
        for run in self._runs:
            kept = replace(run, language=None) if run.language == spoken else run
            if not runs or replace(runs[-1], start=run.start) != kept:
                runs.append(kept)
        return MarkedText("".join(self._pieces), tuple(runs), tuple(self._marks), language)

    def _begin(self, kind: str, shown: str) -> StyleRun:
        """Note a span that opens here; the run before it."""
        if len(self._open_spans) >= MAX_NESTING:
            raise InputError(f"{shown} stands within {MAX_NESTING} other marks; nest them less deep")
        before = self._runs[-1]
        self._open_spans.append(_OpenSpan(kind, shown, self._length, before))
        return before

    def _start_run(self, run: StyleRun) -> None:
        if self._runs[-1].start == run.start:
            self._runs.pop()
        last = self._runs[-1] if self._runs else None
        if last is None or replace(last, start=run.start) != run:
            self._runs.append(run)


def _check_range(what: str, value: float, limits: tuple[float, float], unit: str = "") -> None:
    low, high = limits
    if not low <= value <= high:
        raise InputError(f"{what} must lie between {low:g} and {high:g}{unit}, not {value:g}{unit}")
