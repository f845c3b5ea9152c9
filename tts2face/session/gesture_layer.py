"""Steps that move the face besides its lips: gestures, and the body that follows them.

What a step keeps for the next request, and by which key, is its method ``key``.
"""

from collections.abc import Mapping
from concurrent.futures import Future, ThreadPoolExecutor, wait
from dataclasses import dataclass, field, replace
from hashlib import blake2b
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tts2face.face.body import Body
from tts2face.face.breathing import phrase_starts
from tts2face.face.gestures import SPEECH_GAINS
from tts2face.gestures.elements import StyleSpan, interpolate_keys
from tts2face.gestures.gaze import microsaccades
from tts2face.gestures.kinds import KINDS
from tts2face.gestures.listening import with_responses
from tts2face.gestures.movements import timed
from tts2face.gestures.noise import NoiseStream
from tts2face.gestures.speech_plan import NO_PLAN, SpeechPlan, plan_speech
from tts2face.gestures.stream import GestureFields, GestureStream, GestureValues
from tts2face.gestures.timeline import Timeline, parse_style
from tts2face.models.palette import Palette
from tts2face.request import FIELDS, OPTIONS
from tts2face.session.animated_face import AnimatedFace
from tts2face.session.edits import ChannelEdits
from tts2face.session.gesture_mouth import breath_of_gestures, mouth_gestures
from tts2face.session.prepared import PreparedRequest
from tts2face.session.speech_stream import Piece
from tts2face.source_options import SOURCE_OPTIONS
from tts2face.storage.memory import NO_MEMORY, ResultMemory
from tts2face.types import Clip, Waveform, YieldTurn, keep_on

DEFAULT_STYLE = "neutral"
REACH_S = 2.0  # s around a piece within which elements of the timeline but gestures affect it: fades last .6 s
TURN_REACH_S = 0.6  # before a phrase within which the face listened, where a turn begins
STATE_BYTES = 200_000  # of a stream between two pieces
POLL_S = 0.005  # between turns of other requests, while gestures are drawn
# Options that the key of a piece has by what they change: its sound, its times, its timeline or its lips.
KEYED_OTHERWISE = {
    *SOURCE_OPTIONS, "language", "dictionary", "text_marks", "synthesis", "context", "exemplars", "style", "gain",
    "expression", "timeline", "gaze",
}  # fmt: skip
KEYED = tuple(name for name in OPTIONS if name not in KEYED_OTHERWISE)
Drawn = tuple[GestureValues, GestureStream | NoiseStream]  # gestures of a piece, and the stream for the piece after it


class GestureMethod(NamedTuple):
    """How gestures are made: their stream, the fields from which it draws, and additions to the published method."""

    stream: type[GestureStream] | type[NoiseStream]
    fields: str
    has_presentation: bool
    has_microsaccades: bool


METHODS: Mapping[str, GestureMethod] = MappingProxyType({
    FIELDS: GestureMethod(GestureStream, FIELDS, True, True),
    "ju2008": GestureMethod(GestureStream, "ju2008", False, False),
    "noise": GestureMethod(NoiseStream, FIELDS, True, False),
})  # fmt: skip


def default_style(palette: Palette) -> str:
    """Name of the style for requests that choose none: neutral, or the palette's first recorded style."""
    return DEFAULT_STYLE if DEFAULT_STYLE in palette.names else next(iter(palette.styles))


@dataclass(frozen=True, slots=True, eq=False)
class _Progress:
    """Gestures after a piece: key of the pieces so far, stream, gestures of the marks, and seconds of the clip."""

    history: bytes = b""
    stream: GestureStream | NoiseStream | None = None
    marked: Timeline = field(default_factory=Timeline)
    seconds: float = 0.0


class GestureLayer:
    """Steps that move the face of one clip besides its lips: gestures, `edits` by hand, then the `body`.

    Only the last step goes on to the next piece: after an exception between steps, the next is the same piece.

    Parameters
    ----------
    yield_turn
        Called while gestures are waited for.
    memory
        Keeps the motion of pieces, so that a changed timeline repeats only the pieces from the change on.
    """

    def __init__(
        self,
        prepared: PreparedRequest,
        method: GestureMethod,
        fields: GestureFields,
        face: AnimatedFace,
        yield_turn: YieldTurn = keep_on,
        memory: ResultMemory = NO_MEMORY,
    ) -> None:
        self._requested = Timeline(style=face.default_styles).merge(prepared.timeline)
        self._face = face
        self._yield_turn = yield_turn
        self._memory = memory
        palette, request = fields.palette, prepared.request
        self._palette = palette
        self._requested.check_styles(palette)
        face.check_gains(self._requested.gains.factors)
        self.edits = ChannelEdits(self._requested.edits, face)
        self._body = Body(face.channels, request.known_seed)
        self._seed, self._options = request.known_seed, [getattr(request, name) for name in KEYED]
        self._language, self._has_microsaccades = request.language, method.has_microsaccades
        self._thread = ThreadPoolExecutor(1, "gestures")
        # Building the fields takes 0.5 s, in parallel with loading the voice.
        self._first: Future[GestureStream | NoiseStream] = self._thread.submit(
            method.stream,
            fields,
            style=default_style(palette),
            seed=request.known_seed,
            fps=float(prepared.fps),
            seeds=self._requested.seeds,
        )
        self._now = self._next = _Progress()

    def draw(self, piece: Piece) -> Piece:
        """The piece whose gestures are drawn in a thread, while its lips are made."""
        return replace(piece, drawn=self._thread.submit(self._recall, piece))

    def __call__(self, piece: Piece) -> Piece:
        """The piece with gestures, which follow the loudness of its voice and the timelines of request and marks."""
        lips, drawn = piece.clip.motion, piece.drawn
        assert drawn is not None
        # other requests of this process have turns meanwhile (decision 097)
        while not wait([drawn], POLL_S).done:
            self._yield_turn()
        history, timeline, (gestures, stream) = drawn.result()
        seed = self._requested.seeds.get("expression", self._seed)
        gestures = {**gestures, **mouth_gestures(timeline, self._now.seconds + lips.times, piece.speech.phones)}
        moved = self._memory.recall(
            lambda: (history, lips.values.tobytes()),
            lambda: self._face.add_gestures(
                lips, gestures, {name: timeline.gains.of(name) for name in SPEECH_GAINS}, seed
            ),
            lambda made: made.face.values.nbytes + lips.values.nbytes,
        )
        self._next = _Progress(history, stream, self._marked(piece), self._now.seconds + lips.duration)
        return replace(piece, clip=Clip(moved.face, moved.head, piece.speech), drawn=None)

    def _marked(self, piece: Piece) -> Timeline:
        """Gestures of the marks of a piece, and of those before it that still last."""
        return self._now.marked.lasting(self._now.seconds - 1.0).merge(piece.timeline)

    def _recall(self, piece: Piece) -> tuple[bytes, Timeline, Drawn]:
        """Gestures of a piece with their key, after those before it, and the timelines of request and marks."""
        sound = piece.followed_sound
        times = self._now.seconds + piece.clip.motion.times
        timeline = self._requested.merge(self._marked(piece))
        timeline = with_responses(timeline, float(times[0]), float(times[-1]), self._seed)
        plan = piece.plan
        if plan is None:
            said = replace(piece.speech, waveform=sound)
            plan = plan_speech(said, piece.script, self._language, is_last=piece.is_last)
        history = self.key(times, sound, timeline, plan) if self._memory.is_used else self._now.history
        drawn = self._memory.recall(
            lambda: history,
            lambda: self._draw(sound, times, timeline, plan),
            lambda made: STATE_BYTES + sum(values.nbytes for values in made[0].values()),
        )
        return history, timeline, drawn

    def key(self, times: NDArray[np.float64], sound: Waveform, timeline: Timeline, plan: SpeechPlan = NO_PLAN) -> bytes:
        """Digest of everything on which the gestures of a piece, after those before it, depend."""
        here = timeline.restrict(times[0] - REACH_S, times[-1] + REACH_S)
        gestures = tuple(moving.gesture for moving in timed(timeline.gestures, times))
        here = replace(here, gestures=gestures, edits=())  # edits are a later step
        elements = [
            (name, kind.lane(part), interpolate_keys(times, part.keys).tobytes()) if kind.shape == "curve" else part
            for name, kind in KINDS.items()
            for part in getattr(here, name)
        ]
        maps = (dict(here.style), dict(here.gains.factors), sorted(here.seeds.items()))
        found = blake2b(repr((self._now.history, self._options, elements, maps, plan)).encode())
        found.update(times.tobytes())
        found.update(sound.samples.tobytes())
        return found.digest()

    def _draw(self, sound: Waveform, times: NDArray[np.float64], timeline: Timeline, plan: SpeechPlan) -> Drawn:
        """Gestures of a piece, and the stream for the piece after it."""
        # a stream is used up by drawing; the copy keeps the state before the piece
        stream = (self._now.stream or self._first.result()).copy()
        gestures = _gaze_relative_to_head(stream.next(sound, len(times), timeline, plan))
        if "gaze" in gestures and self._has_microsaccades:
            seed = self._requested.seeds.get("gaze", self._seed)
            gestures = {**gestures, "gaze": gestures["gaze"] + microsaccades(times, seed).astype(np.float32)}
        return gestures, stream

    def body(self, piece: Piece) -> Piece:
        """The piece with hair, shoulders and pupils that follow its motion; the next piece continues from it."""
        self._now, clip = self._next, piece.clip
        timeline = self._requested.merge(self._now.marked)
        times = self._now.seconds - clip.motion.duration + clip.motion.times
        breath = breath_of_gestures(timeline, times)
        moved = self._body.move(clip.motion, clip.head, clip.speech.phones, self._turns(piece, timeline), breath)
        return replace(piece, clip=replace(clip, motion=moved))

    def _turns(self, piece: Piece, timeline: Timeline) -> list[float]:
        """Seconds of a piece at which speech begins after the face has listened."""
        starts = phrase_starts(piece.speech.phones)
        before = np.array(starts) + self._now.seconds - piece.clip.motion.duration - TURN_REACH_S
        listened = timeline.is_listening(before)
        return [start for start, was_listening in zip(starts, listened.tolist(), strict=True) if was_listening]

    def change_style(self, style: str | None) -> None:
        """From the next piece on, the face has another style, written as ``--style`` takes it; None is the default one.

        Raises
        ------
        InputError
            The palette has no such style.
        """
        now, chosen = self._now.seconds, parse_style(style or default_style(self._palette))
        spans = tuple(StyleSpan(feature, name, now) for feature, name in chosen.items())
        Timeline(spans=spans).check_styles(self._palette)
        # what has ended is forgotten, since a stream has no end
        self._requested = self._requested.lasting(max(now - REACH_S, 0.0)).merge(Timeline(spans=spans))

    def finish(self) -> None:
        """Reject requested gestures beyond the end of the clip.

        Raises
        ------
        InputError
            A span or gesture of the request begins after the end.
        """
        self._requested.check_duration(self._now.seconds)


def _gaze_relative_to_head(gestures: GestureValues) -> GestureValues:
    """Convert the gaze from world to head coordinates, so that fixations hold while the head moves."""
    if "gaze" not in gestures or "head" not in gestures:
        return gestures
    return {**gestures, "gaze": gestures["gaze"] - gestures["head"][:, :2]}
