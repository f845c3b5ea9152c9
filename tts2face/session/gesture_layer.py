"""Gestures of a request, added to the speech motion of its clip.

Corrections of finished motion by hand: offsets of single channels through key points.
"""

from collections.abc import Hashable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, replace
from hashlib import blake2b

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import InputError
from tts2face.face.body import Body
from tts2face.face.gestures import SPEECH_GAINS
from tts2face.gestures.elements import KINDS, ChannelEdit, interpolate_keys
from tts2face.gestures.noise import NoiseStream, microsaccades
from tts2face.gestures.stream import GestureFields, GestureStream, GestureValues
from tts2face.gestures.timeline import Timeline
from tts2face.models.palette import Palette
from tts2face.numeric.reuse import NO_MEMORY, SentenceMemory
from tts2face.request import FIELDS
from tts2face.session.animated_face import AnimatedFace, FaceMotion
from tts2face.session.prepared import PreparedRequest, marked_styles
from tts2face.types import HEAD_CHANNELS, Clip, Speech, Trajectory, Waveform, YieldTurn, keep_on


@dataclass(frozen=True, slots=True, eq=False)
class ChannelEdits:
    """Offsets for channels of a face and of its head pose, clipped to the limits of the face's shapes."""

    edits: tuple[ChannelEdit, ...]
    face: AnimatedFace

    def __post_init__(self) -> None:
        """Refuse channels that the face does not have.

        Raises
        ------
        InputError
            There is no such channel.
        """
        known = (*self.face.channels, *HEAD_CHANNELS)
        for edit in self.edits:
            if edit.channel not in known:
                raise InputError(f"this face has no channel {edit.channel!r} to edit; choose one of {', '.join(known)}")

    def apply(self, motion: FaceMotion, first_frame: int) -> FaceMotion:
        """Motion with the offsets added; its first frame is frame `first_frame` of the clip."""
        if not self.edits:
            return motion
        times = (first_frame + np.arange(len(motion.face))) / motion.face.fps
        limits = self.face.limits
        face = _offset(motion.face, self.edits, times)
        clipped = np.clip(face.values, limits[: len(face.channels), 0], limits[: len(face.channels), 1])
        edited = [face.channels.index(edit.channel) for edit in self.edits if edit.channel in face.channels]
        values = face.values.copy()
        values[:, edited] = clipped[:, edited]
        return FaceMotion(replace(face, values=values), _offset(motion.head, self.edits, times))


def _offset(motion: Trajectory, edits: Sequence[ChannelEdit], times: np.ndarray) -> Trajectory:
    values = motion.values.copy()
    for edit in edits:
        if edit.channel in motion.channels:
            values[:, motion.channels.index(edit.channel)] += interpolate_keys(times, edit.keys).astype(np.float32)
    return replace(motion, values=values)


DEFAULT_STYLE = "neutral"
REACH_S = 2.0  # s around a piece within which elements of the timeline affect it: nods last .6 s, fades .6 s
STATE_BYTES = 200_000  # of a stream between two pieces


def default_style(palette: Palette) -> str:
    """Name of the style for requests that choose none: neutral, or the palette's first recorded style."""
    return DEFAULT_STYLE if DEFAULT_STYLE in palette.names else next(iter(palette.styles))


class GestureLayer:
    """Gestures of one clip, added piece by piece.

    Parameters
    ----------
    yield_turn
        Called between the steps of a piece.
    memory
        Keeps the motion of pieces, so that a changed timeline repeats only the pieces from the change on.

    Raises
    ------
    InputError, DataError
        The palette lacks a style of the request, or the face cannot move a feature for which a gain is given.
    """

    def __init__(
        self,
        prepared: PreparedRequest,
        fields: GestureFields,
        face: AnimatedFace,
        yield_turn: YieldTurn = keep_on,
        memory: SentenceMemory = NO_MEMORY,
    ) -> None:
        self._requested = Timeline(style=face.default_styles).merge(prepared.timeline)
        self._face, self._yield_turn, self._memory = face, yield_turn, memory
        self._history: Hashable = ("gestures", prepared.request.seed, prepared.request.gestures, prepared.request.pitch)
        palette, request = fields.palette, prepared.request
        self._requested.check_styles(palette)
        for style in marked_styles(prepared.text):
            palette.require(style)
        face.check_gains(self._requested.gains.factors)
        self._edits = ChannelEdits(self._requested.edits, face)
        self._body = Body(face.channels, request.seed)
        self._seed = request.seed
        self._has_microsaccades = request.gestures == FIELDS  # other methods are as they were published
        kind: type[NoiseStream] | type[GestureStream] = NoiseStream if request.gestures == "noise" else GestureStream
        executor = ThreadPoolExecutor(1)  # building the fields takes 0.5 s, in parallel with loading the voice
        self._first: Future[GestureStream | NoiseStream] = executor.submit(
            kind,
            fields,
            style=default_style(palette),
            seed=request.seed,
            fps=float(prepared.fps),
            seeds=self._requested.seeds,
        )
        executor.shutdown(wait=False)
        self._stream: GestureStream | NoiseStream | None = None  # after the last piece
        self._marked = Timeline()
        self._seconds = 0.0

    def add(self, speech: Speech, lips: Trajectory, marks: Timeline) -> Clip:
        """Add gestures to the next piece of the clip; after an exception of `yield_turn`, the next is the same piece.

        Parameters
        ----------
        speech
            Speech of the piece, whose loudness the gestures follow.
        lips : (T, K)
            Speech motion of the piece.
        marks
            Gestures requested by the marks of the piece's text, in seconds of the whole clip.
        """
        recent = self._marked.restrict(self._seconds - 1.0, np.inf)  # a nod of the last piece lasts half a second
        marked = recent.merge(marks)
        timeline = self._requested.merge(marked)
        times = self._seconds + lips.times
        if self._memory.is_used:
            self._history = _digest(self._history, times, speech.waveform, timeline)
        gestures, stream = self._memory.recall(
            lambda: self._history,
            lambda: self._next(speech.waveform, times, timeline),
            lambda made: STATE_BYTES + sum(values.nbytes for values in made[0].values()),
        )
        moved = self._memory.recall(
            lambda: (self._history, lips.values.tobytes()),
            lambda: self._face.add_gestures(lips, gestures, {name: timeline.gains.of(name) for name in SPEECH_GAINS}),
            lambda made: made.face.values.nbytes + lips.values.nbytes,
        )
        moved = self._edits.apply(moved, round(self._seconds * lips.fps))
        self._stream, self._marked, self._seconds = stream, marked, self._seconds + lips.duration
        return Clip(self._body.move(moved.face, moved.head, speech.phones), moved.head, speech)

    def _next(
        self, sound: Waveform, times: NDArray[np.float64], timeline: Timeline
    ) -> tuple[GestureValues, GestureStream | NoiseStream]:
        """Gestures of the next piece, and the stream for the piece after it."""
        stream = (self._stream or self._first.result()).copy()
        gestures = _gaze_relative_to_head(stream.next(sound, len(times), timeline, self._yield_turn))
        if "gaze" in gestures and self._has_microsaccades:
            seed = self._requested.seeds.get("gaze", self._seed)
            gestures = {**gestures, "gaze": gestures["gaze"] + microsaccades(times, seed).astype(np.float32)}
        return gestures, stream

    def finish(self) -> None:
        """Reject requested gestures beyond the end of the clip.

        Raises
        ------
        InputError
            A span or nod of the request begins after the end.
        """
        self._requested.check_duration(self._seconds)


def _digest(history: Hashable, times: NDArray[np.float64], sound: Waveform, timeline: Timeline) -> bytes:
    """Digest of everything on which the gestures of a piece, after those before it, depend."""
    here = replace(timeline.restrict(times[0] - REACH_S, times[-1] + REACH_S), edits=())  # which are added to gestures
    elements = [
        (name, kind.lane(one), interpolate_keys(times, one.keys).tobytes()) if kind.shape == "curve" else one
        for name, kind in KINDS.items()
        for one in getattr(here, name)
    ]
    maps = (dict(here.style), dict(here.gains.factors), sorted(here.seeds.items()))
    found = blake2b(repr((history, elements, maps)).encode())
    found.update(times.tobytes())
    found.update(sound.samples.tobytes())
    return found.digest()


def _gaze_relative_to_head(gestures: GestureValues) -> GestureValues:
    """Convert the gaze from world to head coordinates, so that fixations hold while the head moves."""
    if "gaze" not in gestures or "head" not in gestures:
        return gestures
    return {**gestures, "gaze": gestures["gaze"] - gestures["head"][:, :2]}
