"""A text with marks, built from its words and marks in order."""

from dataclasses import dataclass, replace

from lexicon.errors import InputError
from lexicon.marked_text import (
    MAX_NESTING,
    MAX_NOTES,
    MAX_PAUSE_S,
    PITCH_LIMITS,
    RANGE_LIMITS,
    RATE_LIMITS,
    VOLUME_LIMITS,
    Mark,
    MarkedText,
    PauseMark,
    StyleRun,
)
from lexicon.tones import EVEN, Tone

LEAST_CUT = 1e-6  # by which a value is beyond its limit, rather than rounded


@dataclass(slots=True)
class _OpenSpan:
    """A mark that is not yet closed."""

    kind: str
    shown: str
    start: int
    before: StyleRun
    first_letter: int = 0
    seconds: float | None = None


class MarkedTextBuilder:
    """Builds a `MarkedText` from text and marks in order."""

    def __init__(self) -> None:
        self._pieces: list[str] = []
        self._length = self._n_letters = 0
        self._runs = [StyleRun(0)]
        self._marks: list[Mark] = []
        self._open_spans: list[_OpenSpan] = []
        self._last_pause: tuple[int, PauseMark | None] = (0, None)
        self._silent_s = 0.0  # of the pauses since the last letter
        self._notes: dict[str, int | None] = {}  # with the line of the first
        self._foreign_styles: set[str] = set()

    @property
    def at(self) -> int:
        """Number of characters so far."""
        return self._length

    def add_text(self, text: str) -> None:
        """Append text."""
        self._pieces += [text] if text else []
        self._length += len(text)
        n_letters = len("".join(text.split()))
        self._n_letters += n_letters
        self._silent_s = 0.0 if n_letters else self._silent_s

    def note(self, text: str, line: int | None = None) -> None:
        """Note what is not followed, once; with its line in SSML."""
        self._notes.setdefault(text, line)

    def add_pause(self, seconds: float, line: int | None = None) -> None:
        """Add silence at the current position, as far as `MAX_PAUSE_S` reaches, with a note on the rest."""
        room = MAX_PAUSE_S - self._silent_s
        if seconds > room + LEAST_CUT:
            self.note(
                f"silence at one place is {MAX_PAUSE_S:g} s, the limit, not {seconds - room + MAX_PAUSE_S:g}", line
            )
        if min(seconds, room) > 0:
            self._silent_s += min(seconds, room)
            self.add_mark(PauseMark(self._length, min(seconds, room)))

    def add_mark(self, mark: Mark) -> None:
        """Add a mark at the current position; pauses at one position are added up."""
        if isinstance(mark, PauseMark):
            index, earlier = self._last_pause
            if earlier is not None and earlier.at == mark.at:
                mark = PauseMark(mark.at, earlier.seconds + mark.seconds)
                self._marks[index] = mark
                self._last_pause = (index, mark)
                return
            self._last_pause = (len(self._marks), mark)
        self._marks.append(mark)

    def open_style(self, kind: str, shown: str, style: str, *, is_foreign: bool = False) -> None:
        """Begin a span of a style that `close` ends; nested styles accumulate; a foreign one may not exist."""
        self._foreign_styles |= {style} if is_foreign else set()
        before = self._begin(kind, shown)
        self._start_run(replace(before, start=self._length, styles=(*before.styles, style)))

    def open_prosody(
        self,
        shown: str,
        line: int,
        *,
        rate: float = 1.0,
        volume: float = 1.0,
        tone: Tone = EVEN,
        seconds: float | None = None,
    ) -> None:
        """Begin a span of another prosody that `close` ends; in nested spans factors multiply and pitches add up.

        What is beyond the limits lies on them, with a note (SSML 1.1, 3.2.4).

        Parameters
        ----------
        line
            Of the source.
        tone
            Its emphasis and contour replace those around it.
        seconds
            In which the words of the span are spoken, whatever the rate.
        """
        before = self._begin("prosody", shown, seconds)

        def limited(what: str, value: float, limits: tuple[float, float], unit: str = "") -> float:
            kept = min(max(value, limits[0]), limits[1])
            if abs(kept - value) > LEAST_CUT:
                self.note(f"{what} within {shown} is {kept:g}{unit}, the limit, not {value:.4g}", line)
            return kept

        whole = Tone(
            before.tone.emphasis,
            limited("the pitch", before.tone.pitch + tone.pitch, PITCH_LIMITS, " semitones"),
            limited("the range", before.tone.range * tone.range, RANGE_LIMITS),
            tone.contour or before.tone.contour,
        )
        rate = limited("the speaking rate", before.rate * rate, RATE_LIMITS)
        volume = limited("the volume", before.volume * volume, VOLUME_LIMITS)
        run = replace(before, start=self._length, rate=rate, volume=volume, tone=whole)
        self._start_run(run, is_own=seconds is not None)

    def open_emphasis(self, shown: str, emphasis: float) -> None:
        """Begin a span of another emphasis (`Tone.emphasis`) that `close` ends; the innermost applies."""
        before = self._begin("emphasis", shown)
        self._start_run(replace(before, start=self._length, tone=replace(before.tone, emphasis=emphasis)))

    def open_voice(self, kind: str, shown: str, *, voice: str | None, language: str | None) -> None:
        """Begin a span of another voice or language that `close` ends; None keeps the current one."""
        before = self._begin(kind, shown)
        self._start_run(
            replace(before, start=self._length, voice=voice or before.voice, language=language or before.language)
        )

    @property
    def run(self) -> StyleRun:
        """The run at the current position."""
        return self._runs[-1]

    @property
    def last_character(self) -> str:
        """The last character so far; empty at the beginning."""
        return self._pieces[-1][-1:] if self._pieces else ""

    @property
    def last_visible(self) -> str:
        """The last character so far that is no white space; empty without one."""
        return next((piece.rstrip()[-1:] for piece in reversed(self._pieces) if not piece.isspace()), "")

    def text_from(self, at: int) -> str:
        """The text from a position on."""
        pieces: list[str] = []
        start = self._length
        for piece in reversed(self._pieces):
            if start <= at:
                break
            start -= len(piece)
            pieces.append(piece[max(at - start, 0) :])
        return "".join(reversed(pieces))

    def close_open(self) -> None:
        """End the innermost open span; one without words has no effect."""
        last = self._open_spans.pop()
        self._start_run(replace(last.before, start=self._length))

    @property
    def open_span(self) -> str:
        """How the innermost open span is written; empty without one."""
        return self._open_spans[-1].shown if self._open_spans else ""

    def close(self, kind: str, shown: str) -> None:
        """End the innermost open span.

        Raises
        ------
        InputError
            No span is open, the innermost one is of another kind, or a style span contains no text.
        """
        if not self._open_spans:
            raise InputError(f"{shown} has no opening mark; add one, or remove it")
        last = self._open_spans[-1]
        if last.kind == kind:
            self._open_spans.pop()
        else:
            raise InputError(f"{shown} comes before the end of {last.shown}; close {last.shown} first")
        if self._length == last.start and self._runs[-1].styles != last.before.styles:
            self._start_run(replace(last.before, start=self._length))
            raise InputError(f"{last.shown[:200]} contains no text; add words before its end")
        if last.seconds is not None and self._n_letters > last.first_letter:
            pace = last.seconds / (self._n_letters - last.first_letter)
            at = len(self._runs)
            while at and self._runs[at - 1].start >= last.start:
                at -= 1
                self._runs[at] = replace(self._runs[at], pace=self._runs[at].pace or pace)
        self._start_run(replace(last.before, start=self._length))

    def build(self, language: str | None = None, *, base_language: str | None = None) -> MarkedText:
        """The marked text; spans in the base language `base_language` get no language of their own.

        Raises
        ------
        InputError
            A span is still open.
        """
        if self._open_spans:
            raise InputError(f"{self._open_spans[-1].shown} is not closed; add its end")
        runs: list[StyleRun] = []
        for run in self._runs:
            merged = replace(run, language=None) if run.language and run.language == base_language else run
            if not runs or not runs[-1].is_spoken_as(merged):
                runs.append(merged)
        notes = [
            text if line is None else f"SSML, line {line}: {text}" for text, line in [*self._notes.items()][:MAX_NOTES]
        ]
        styles = frozenset(self._foreign_styles)
        return MarkedText("".join(self._pieces), tuple(runs), tuple(self._marks), language, tuple(notes), styles)

    def _begin(self, kind: str, shown: str, seconds: float | None = None) -> StyleRun:
        """Open a span at the current position; the run before it."""
        if len(self._open_spans) >= MAX_NESTING:
            raise InputError(f"{shown} is nested in {MAX_NESTING} other marks; reduce the nesting")
        before = self._runs[-1]
        self._open_spans.append(_OpenSpan(kind, shown, self._length, before, self._n_letters, seconds))
        return before

    def _start_run(self, run: StyleRun, *, is_own: bool = False) -> None:
        """Begin a run; one that changes nothing yet only if it is one of its own."""
        if self._runs[-1].start == run.start:
            self._runs.pop()
        last = self._runs[-1] if self._runs else None
        if last is None or is_own or not last.is_spoken_as(run):
            self._runs.append(run)
