"""Gestures that are asked for while a clip grows: they wait for the next word or the next silence."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from lexicon.marked_text import GestureMark
from tts2face.gestures.movements import gesture_end
from tts2face.gestures.timeline import Timeline
from tts2face.session.prepared import PreparedRequest, gesture_of
from tts2face.session.speech_stream import Piece


@dataclass(frozen=True, slots=True)
class ShownGesture:
    """A gesture that was asked for while a clip grows, and the second of the clip at which it starts."""

    name: str
    time: float


class WaitingGestures:
    """Gestures of one growing clip, of which at most one of each name waits."""

    def __init__(self) -> None:
        self.waiting: tuple[GestureMark, ...] = ()
        self._shown: list[ShownGesture] = []
        self._until = 0.0  # seconds of the clip at which the last gesture ends

    def add(self, gestures: Sequence[GestureMark]) -> None:
        """Let gestures wait; each replaces another of its name."""
        for gesture in gestures:
            others = [other for other in self.waiting if other.name != gesture.name]
            self.waiting = (*others, replace(gesture, at=0))

    def clear(self) -> None:
        """Make none of the gestures that wait."""
        self.waiting = ()

    def move_at(self, second: float) -> bool:
        """Whether a gesture waits, or still moves the face at a second of the clip."""
        return bool(self.waiting) or self._until > second

    def shown(self) -> list[ShownGesture]:
        """Gestures that are made since the last call, with the second of the clip at which each starts."""
        shown, self._shown = self._shown, []
        return shown

    def in_speech(self, prepared: PreparedRequest) -> PreparedRequest:
        """A text with the gestures that wait, at its first word."""
        return replace(prepared, text=replace(prepared.text, marks=(*self.waiting, *prepared.text.marks)))

    def in_silence(self, prepared: PreparedRequest, listening: Timeline | None) -> PreparedRequest:
        """A silence with the gestures that wait, at its start, and what the face does while it listens."""
        now = self.now()
        return replace(prepared, listening=now if listening is None else now.merge(listening))

    def now(self) -> Timeline:
        """The gestures that wait, at 0 s."""
        return Timeline(gestures=tuple(gesture_of(mark, 0.0) for mark in self.waiting))

    def note(self, piece: Piece, made: Sequence[GestureMark]) -> None:
        """Note that a piece has gestures, those which waited among them: they wait no longer."""
        self.waiting = tuple(mark for mark in self.waiting if mark not in made)
        for gesture in piece.timeline.gestures:
            self._until = max(self._until, gesture_end(gesture))
        for mark in made:
            times = [gesture.time for gesture in piece.timeline.gestures if gesture.name == mark.name]
            self._shown.append(ShownGesture(mark.name, min(times, default=piece.begin)))
