"""A clip as a column of steps: each piece gains speech, then lip motion, gestures, edits and the motion of the body.

The first step makes the pieces: `spoken_pieces` those of a text and of idle animation, `recorded_pieces` those of a
recording. What a step keeps for the next request, and by which key, is its method ``key``.
"""

from collections.abc import Callable, Hashable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, wait
from dataclasses import dataclass, field, replace
from hashlib import blake2b

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import InputError
from lexicon.sequence import PhoneSequence
from tts2face.face.body import Body, phrase_starts
from tts2face.face.gestures import SPEECH_GAINS
from tts2face.gestures.elements import KINDS, ChannelEdit, interpolate_keys
from tts2face.gestures.gaze import microsaccades
from tts2face.gestures.listening import with_responses
from tts2face.gestures.noise import NoiseStream
from tts2face.gestures.stream import GestureFields, GestureStream, GestureValues
from tts2face.gestures.timeline import Timeline
from tts2face.lips.exemplar import ExemplarModel, TokenSelection, select_tokens
from tts2face.lips.explanation import PhoneExplanation, explain_selection
from tts2face.models.palette import Palette
from tts2face.models.talker import Talker
from tts2face.processes.memory import NO_MEMORY, SentenceMemory
from tts2face.request import FIELDS
from tts2face.session.animated_face import AnimatedFace
from tts2face.session.prepared import (
    HEARING_STEPS,
    RECORDING,
    RECORDING_STEPS,
    PreparedRequest,
    correct_phones,
    marked_styles,
)
from tts2face.session.recording import (
    TimedTranscript,
    align_transcript,
    map_audio_to_motion,
    recognise_transcript,
    recording_clips,
    select_audio_map,
)
from tts2face.session.speech import resolve_recording_marks
from tts2face.session.speech_stream import Piece, SpeechModels, spoken_ahead, spoken_pieces
from tts2face.source import FromSound, Recorded
from tts2face.types import HEAD_CHANNELS, Clip, Progress, Trajectory, Waveform, YieldTurn, frame_count, keep_on

Step = Callable[[Piece], Piece]
Explain = Callable[[], tuple[PhoneExplanation, ...]]

TRANSCRIPT_BYTES = 10_000  # of a transcript besides its phones
DEFAULT_STYLE = "neutral"
REACH_S = 2.0  # s around a piece within which elements of the timeline affect it: nods last .6 s, fades .6 s
TURN_REACH_S = 0.6  # before a phrase within which the face listened, where a turn begins
STATE_BYTES = 200_000  # of a stream between two pieces
POLL_S = 0.005  # between turns of other requests, while gestures are drawn
Drawn = tuple[GestureValues, GestureStream | NoiseStream]  # gestures of a piece, and the stream for the piece after it


@dataclass(frozen=True, slots=True, eq=False)
class SynthesisModels:
    """Models from which clips are synthesised: talker, the talker's exemplars, face, and what speaks."""

    talker: Talker
    exemplars: ExemplarModel
    face: AnimatedFace
    speech: SpeechModels


def pieces(
    prepared: PreparedRequest,
    models: SynthesisModels,
    gestures: "GestureLayer | None",
    on_heard: Progress | None = None,
) -> Iterator[Piece]:
    """Synthesise the clip of a request piece by piece.

    Each piece ends on a frame boundary, so that sound and picture stay synchronous at any length, in bounded memory.
    The pieces of a text begin and end with the face at rest.

    Parameters
    ----------
    gestures
        Gestures of this clip; None for lip motion only.
    on_heard
        Called while the phones of a recording are found, before its first piece.
    """
    yield from pieces_from(prepared, models, gestures, on_heard=on_heard)
    if gestures is not None:
        gestures.finish()


def pieces_from(
    prepared: PreparedRequest,
    models: SynthesisModels,
    gestures: "GestureLayer | None",
    first_frame: int = 0,
    on_heard: Progress | None = None,
) -> Iterator[Piece]:
    """Pieces of a recording, or of a text or of idle animation that begins at a frame of a longer clip."""
    lips = Lips(prepared, models)
    steps: tuple[Step, ...] = () if gestures is None else (gestures, gestures.edits, gestures.body)
    source = prepared.request.source
    if isinstance(source, Recorded):
        started = recorded_pieces(prepared, source, lips, on_heard)
    else:
        started, steps = spoken_pieces(prepared, models.speech, first_frame), (lips, *steps)
        if gestures is not None:
            started = spoken_ahead(started, prepared.timeline, models.speech.yield_turn)
    for piece in started:
        if gestures is not None:
            gestures.begin(piece)
        for step in steps:
            models.speech.yield_turn()
            piece = step(piece)  # noqa: PLW2901 - it gains from step to step
        yield piece


@dataclass(frozen=True, slots=True, eq=False)
class Lips:
    """Step: lip motion from recorded tokens of the talker, and its explanation."""

    prepared: PreparedRequest
    models: SynthesisModels

    def __call__(self, piece: Piece) -> Piece:
        """The piece of a text with lip motion."""
        selection, motion = self.motion(piece.speech.phones, len(piece.clip.motion))
        explain = self.explanation(selection, piece.begin)
        return replace(piece, clip=replace(piece.clip, motion=motion), explain=explain)

    def motion(self, phones: PhoneSequence, n_frames: int) -> tuple[TokenSelection, Trajectory]:
        """Selected tokens of phones, and their lip motion (n_frames, K)."""
        return self.models.speech.memory.recall(
            lambda: self.key(phones, n_frames),
            lambda: self._blend(phones, n_frames),
            lambda made: made[1].values.nbytes + made[0].found.tokens.nbytes * 3,
        )

    def key(self, phones: PhoneSequence, n_frames: int) -> Hashable:
        """All on which the motion depends."""
        prepared = self.prepared
        timed = (phones.phones, phones.edges.tobytes(), n_frames, float(prepared.fps))
        return ("lips", timed, prepared.options, prepared.excluded, prepared.request.has_gestures)

    def _blend(self, phones: PhoneSequence, n_frames: int) -> tuple[TokenSelection, Trajectory]:
        models, yield_turn = self.models, self.models.speech.yield_turn
        selection = select_tokens(phones, models.exemplars, self.prepared.options)
        yield_turn()
        fps = float(self.prepared.fps)
        return selection, models.face.motion_of_tokens(selection, fps=fps, n_frames=n_frames, yield_turn=yield_turn)

    def explanation(self, selection: TokenSelection, begin: float) -> Explain:
        """Function that explains a selection in seconds of the whole clip; it is evaluated only when called."""

        def explain() -> tuple[PhoneExplanation, ...]:
            phones = explain_selection(selection, self.models.exemplars)
            return tuple(replace(phone, start=phone.start + begin, end=phone.end + begin) for phone in phones)

        return explain


def recorded_pieces(
    prepared: PreparedRequest, source: Recorded, lips: Lips, on_heard: Progress | None
) -> Iterator[Piece]:
    """First step of a recording: its sound with lip motion, from exemplars if its words are known, else from a map."""
    transcript, motion, explain = _recording_motion(prepared, source, lips, on_heard)
    if prepared.request.has_gestures:
        prepared.timeline.check_duration(len(motion) / float(prepared.fps))
    language = prepared.request.language
    timeline, marks = resolve_recording_marks(prepared.text, transcript.phones, transcript.words, language)
    fps, before = float(prepared.fps), 0
    for clip in recording_clips(source.audio, transcript, motion, volume=source.volume):
        after = before + len(clip.motion)
        begin, end = before / fps, after / fps
        yield Piece(
            clip,
            begin,
            RECORDING_STEPS * after // len(motion)
            - RECORDING_STEPS * before // len(motion)
            + (HEARING_STEPS if before == 0 else 0),
            timeline.restrict(begin, end),
            tuple(mark for mark in marks if begin <= mark.seconds < end),
            explain if before == 0 else tuple,
            tuple(mismatch for mismatch in transcript.mismatches if begin <= mismatch.begin < end),
            transcript=transcript.phones if before == 0 else None,
        )
        before = after


def _recording_motion(
    prepared: PreparedRequest, source: Recorded, lips: Lips, on_heard: Progress | None
) -> tuple[TimedTranscript, Trajectory, Explain]:
    fps, request, models = float(prepared.fps), prepared.request, lips.models
    audio = source.audio
    if isinstance(source.lips, FromSound):
        audio_map = select_audio_map(source.lips.audio_map, models.talker)
        transcript, parameters = map_audio_to_motion(audio, audio_map, models.talker, fps)
        return transcript, models.face.motion_of_parameters(parameters), tuple

    def key() -> Hashable:
        found = audio.stat()
        file = (str(audio.resolve()), found.st_mtime_ns, found.st_size)
        return ("transcript", file, prepared.text.text, request.language, frozenset(prepared.dictionary.items()))

    def find() -> TimedTranscript:
        if not source.text:
            return recognise_transcript(audio, on_heard)
        return align_transcript(prepared.text.text, request.language, audio, prepared.dictionary, on_heard)

    transcript = models.speech.memory.recall(
        key,
        find,
        lambda made: TRANSCRIPT_BYTES + made.phones.edges.nbytes * 8,
    )
    transcript = replace(transcript, phones=correct_phones(transcript.phones, RECORDING, 0, prepared.edges))
    selection, motion = lips.motion(transcript.phones, frame_count(transcript.duration, fps))
    return transcript, motion, lambda: tuple(map(transcript.with_confidence, lips.explanation(selection, 0.0)()))


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
        palette, request = fields.palette, prepared.request
        self._requested.check_styles(palette)
        for style in marked_styles(prepared.text):
            palette.require(style)
        face.check_gains(self._requested.gains.factors)
        self.edits = ChannelEdits(self._requested.edits, face)
        self._body = Body(face.channels, request.seed)
        self._seed, self._options = request.seed, (request.seed, request.gestures, request.pitch)
        self._has_microsaccades = request.gestures == FIELDS  # other methods are as they were published
        kind: type[NoiseStream] | type[GestureStream] = NoiseStream if request.gestures == "noise" else GestureStream
        self._thread = ThreadPoolExecutor(1, "gestures")
        # Building the fields takes 0.5 s, in parallel with loading the voice.
        self._first: Future[GestureStream | NoiseStream] = self._thread.submit(
            kind,
            fields,
            style=default_style(palette),
            seed=request.seed,
            fps=float(prepared.fps),
            seeds=self._requested.seeds,
        )
        self._now = self._next = _Progress()
        self._drawn: Future[tuple[bytes, Timeline, Drawn]] = Future()

    def begin(self, piece: Piece) -> None:
        """Draw the gestures of the next piece in a thread, while its lips are made."""
        self._drawn = self._thread.submit(self._recall, piece)

    def __call__(self, piece: Piece) -> Piece:
        """The piece with gestures, which follow the loudness of its voice and the timelines of request and marks."""
        lips = piece.clip.motion
        while not wait([self._drawn], POLL_S).done:
            self._yield_turn()
        history, timeline, (gestures, stream) = self._drawn.result()
        moved = self._memory.recall(
            lambda: (history, lips.values.tobytes()),
            lambda: self._face.add_gestures(lips, gestures, {name: timeline.gains.of(name) for name in SPEECH_GAINS}),
            lambda made: made.face.values.nbytes + lips.values.nbytes,
        )
        self._next = _Progress(history, stream, self._marked(piece), self._now.seconds + lips.duration)
        return replace(piece, clip=Clip(moved.face, moved.head, piece.speech))

    def _marked(self, piece: Piece) -> Timeline:
        """Gestures of the marks of a piece, and of those before it: a nod of the last piece lasts half a second."""
        return self._now.marked.restrict(self._now.seconds - 1.0, np.inf).merge(piece.timeline)

    def _recall(self, piece: Piece) -> tuple[bytes, Timeline, Drawn]:
        """Gestures of a piece with their key, after those before it, and the timelines of request and marks."""
        sound = piece.speech.waveform if piece.voice_sound is None else piece.voice_sound
        times = self._now.seconds + piece.clip.motion.times
        timeline = self._requested.merge(self._marked(piece))
        timeline = with_responses(timeline, float(times[0]), float(times[-1]), self._seed)
        history = self.key(times, sound, timeline) if self._memory.is_used else self._now.history
        drawn = self._memory.recall(
            lambda: history,
            lambda: self._draw(sound, times, timeline),
            lambda made: STATE_BYTES + sum(values.nbytes for values in made[0].values()),
        )
        return history, timeline, drawn

    def key(self, times: NDArray[np.float64], sound: Waveform, timeline: Timeline) -> bytes:
        """Digest of everything on which the gestures of a piece, after those before it, depend."""
        here = replace(timeline.restrict(times[0] - REACH_S, times[-1] + REACH_S), edits=())  # a later step
        elements = [
            (name, kind.lane(one), interpolate_keys(times, one.keys).tobytes()) if kind.shape == "curve" else one
            for name, kind in KINDS.items()
            for one in getattr(here, name)
        ]
        maps = (dict(here.style), dict(here.gains.factors), sorted(here.seeds.items()))
        found = blake2b(repr((self._now.history, self._options, elements, maps)).encode())
        found.update(times.tobytes())
        found.update(sound.samples.tobytes())
        return found.digest()

    def _draw(self, sound: Waveform, times: NDArray[np.float64], timeline: Timeline) -> Drawn:
        """Gestures of a piece, and the stream for the piece after it."""
        stream = (self._now.stream or self._first.result()).copy()
        gestures = _gaze_relative_to_head(stream.next(sound, len(times), timeline))
        if "gaze" in gestures and self._has_microsaccades:
            seed = self._requested.seeds.get("gaze", self._seed)
            gestures = {**gestures, "gaze": gestures["gaze"] + microsaccades(times, seed).astype(np.float32)}
        return gestures, stream

    def body(self, piece: Piece) -> Piece:
        """The piece with hair, shoulders and pupils that follow its motion; the next piece continues from it."""
        self._now, clip = self._next, piece.clip
        moved = self._body.move(clip.motion, clip.head, clip.speech.phones, self._turns(piece))
        return replace(piece, clip=replace(clip, motion=moved))

    def _turns(self, piece: Piece) -> list[float]:
        """Seconds of a piece at which speech begins after the face has listened."""
        starts = phrase_starts(piece.speech.phones)
        before = np.array(starts) + self._now.seconds - piece.clip.motion.duration - TURN_REACH_S
        listened = self._requested.merge(self._now.marked).is_listening(before)
        return [start for start, was_listening in zip(starts, listened.tolist(), strict=True) if was_listening]

    def finish(self) -> None:
        """Reject requested gestures beyond the end of the clip.

        Raises
        ------
        InputError
            A span or nod of the request begins after the end.
        """
        self._requested.check_duration(self._now.seconds)


def _gaze_relative_to_head(gestures: GestureValues) -> GestureValues:
    """Convert the gaze from world to head coordinates, so that fixations hold while the head moves."""
    if "gaze" not in gestures or "head" not in gestures:
        return gestures
    return {**gestures, "gaze": gestures["gaze"] - gestures["head"][:, :2]}


@dataclass(frozen=True, slots=True, eq=False)
class ChannelEdits:
    """Step: offsets for channels of a face and of its head pose, clipped to the limits of the face's shapes."""

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

    def __call__(self, piece: Piece) -> Piece:
        """The piece with the offsets added."""
        if not self.edits:
            return piece
        clip, limits = piece.clip, self.face.limits
        times = (round(piece.begin * clip.fps) + np.arange(len(clip.motion))) / clip.fps
        face, head = (_offset(motion, self.edits, times) for motion in (clip.motion, clip.head))
        clipped = np.clip(face.values, limits[: len(face.channels), 0], limits[: len(face.channels), 1])
        edited = [face.channels.index(edit.channel) for edit in self.edits if edit.channel in face.channels]
        values = face.values.copy()
        values[:, edited] = clipped[:, edited]
        return replace(piece, clip=replace(clip, motion=replace(face, values=values), head=head))


def _offset(motion: Trajectory, edits: Sequence[ChannelEdit], times: NDArray[np.float64]) -> Trajectory:
    values = motion.values.copy()
    for edit in edits:
        if edit.channel in motion.channels:
            values[:, motion.channels.index(edit.channel)] += interpolate_keys(times, edit.keys).astype(np.float32)
    return replace(motion, values=values)
