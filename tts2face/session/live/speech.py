"""A clip that is made while it plays: sentences, with idle motion and listening between them."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial

from lexicon.errors import InputError
from lexicon.mark_table import MarkTable, read_marks_table
from lexicon.marked_text import GestureMark
from lexicon.pauses import pause_behind
from lexicon.sequence import PhoneSequence
from tts2face.gestures.elements import ListeningSpan
from tts2face.gestures.listening import LASTS_S, responses
from tts2face.gestures.speech_plan import SpeechPlan
from tts2face.gestures.timeline import Timeline
from tts2face.request import Idle, Listening, Request, Spoken
from tts2face.session.joining import END_S, JOIN_LEAD_S
from tts2face.session.live.waiting_gestures import ShownGesture, WaitingGestures
from tts2face.session.marked_styles import palette_style
from tts2face.session.prepared import PreparedRequest, prepare
from tts2face.session.shared_models import SessionModels
from tts2face.session.speech_stream import Piece, after_listening
from tts2face.session.steps import moved_pieces, pieces_from
from tts2face.source_options import is_auto
from tts2face.types import SOUND_RATE, Clip, Speech, Trajectory, Waveform, exact_rate

UNUSED_IDLE_S = 1.0  # of the request from which the gestures of the whole are made


class LiveSpeech:
    """A clip without an end: `say` appends speech, `idle` and `listen` silence with a living face.

    Gestures continue from piece to piece. Not thread-safe.

    Parameters
    ----------
    request
        Options of all pieces; without text, recording and idle time.
    sound_rate
        Sample rate of all pieces in Hz; None: that of the voice, in silence `SOUND_RATE`.

    Attributes
    ----------
    models
        Of the session.
    """

    def __init__(self, request: Request, models: SessionModels, sound_rate: int | None = SOUND_RATE) -> None:
        if not isinstance(request.source, Spoken) or request.source.text or request.timeline is not None:
            raise InputError("a live request has options only; send its text in parts")
        self._request, self.models = request, models
        self._sound_rate = sound_rate
        self._spoken = request.source
        self._silent = replace(request, source=Idle(UNUSED_IDLE_S), dictionary=None)
        self._layer = models.gesture_layer(prepare(self._silent))
        self._n_frames = 0
        self._pause_s: float | None = None  # behind the sentence before, while the face speaks
        self._has_listened = False
        self._rate = exact_rate(request.fps)
        self._cues: list[float] = []  # seconds of the clip at which the face responds
        self.gestures = WaitingGestures()
        self._notes: list[str] = []

    @property
    def request(self) -> Request:
        """Options of what is appended next."""
        return self._request

    def without_pieces(self) -> "LiveSpeech":
        """Another clip with the options of this one."""
        return LiveSpeech(self._request, self.models, self._sound_rate)

    @property
    def seconds(self) -> float:
        """Duration of all pieces so far."""
        return self.seconds_of(self._n_frames)

    @property
    def language(self) -> str:
        """Language of the text."""
        return self._request.language

    @property
    def markup(self) -> str:
        """How the text is read."""
        return self._request.markup

    @property
    def marks(self) -> MarkTable:
        """Marks of people and language models in the text."""
        return read_marks_table(self._request.text_marks)

    @property
    def fps(self) -> float:
        """Frames per second."""
        return self._request.fps

    def seconds_of(self, n_frames: int) -> float:
        """Duration of a number of frames."""
        return float(n_frames / self._rate)

    def say(self, text: str) -> Iterator[Piece]:
        """Append the sentences of a text; errors as `Session.stream`.

        Gestures of a text without words are those of the next piece. What is not followed is in `new_notes`.
        """
        spoken = replace(self._spoken, text=text)
        spoken = after_listening(spoken) if self._has_listened else spoken
        if self._pause_s is not None:
            spoken = replace(spoken, lead=max(self._pause_s / spoken.rate - END_S, JOIN_LEAD_S))
        prepared = prepare(replace(self._request, source=spoken), self.models.person)
        self._notes += prepared.notes
        if not isinstance(prepared.request.source, Spoken):
            return self.gesture(*(mark for mark in prepared.text.marks if isinstance(mark, GestureMark)))
        self._has_listened = False
        n_known = len(prepared.notes)
        prepared = self.models.with_own_styles(prepared)
        self._notes += prepared.notes[n_known:]
        yield from self._append(prepared, is_speech=True)
        self._pause_s = pause_behind(text)

    def new_notes(self) -> list[str]:
        """Notes on texts since the last call: parts that are spoken or shown otherwise than a reader may expect."""
        notes, self._notes = self._notes, []
        return notes

    def idle(self, seconds: float) -> Iterator[Piece]:
        """Append silence."""
        self.rest()
        yield from self._append(prepare(replace(self._silent, source=Idle(seconds))))

    def listen(self, seconds: float, cues: Sequence[float] | None = None) -> Iterator[Piece]:
        """Append silence in which the face listens.

        Parameters
        ----------
        cues
            Seconds from now at which it responds to what it hears; None where it hears nothing, and responds at
            intervals.
        """
        self.rest()
        start = self.seconds
        self._cues = [cue for cue in self._cues if cue > start - LASTS_S] + [start + cue for cue in cues or ()]
        responding = responses(self._cues, self._request.known_seed).restrict(start, start + seconds).shift(-start)
        listened = Timeline(listens=(ListeningSpan(0.0, seconds, reacts=cues is None),))
        yield from self._append(prepare(replace(self._silent, source=Listening(seconds))), responding.merge(listened))
        self._has_listened = True

    def follow(self, sound: Waveform, lips: Trajectory, plan: SpeechPlan, followed: Waveform) -> Piece:
        """Append the sound of whole frames, which is spoken already, with its lip motion (T, K).

        Parameters
        ----------
        plan
            Its sentences and accents, in seconds of the piece.
        followed
            The sound, and what is known behind it.
        """
        self.rest()
        made, fps = self.gestures.waiting, lips.fps
        piece = Piece(
            Clip.at_rest(len(lips), fps, Speech.without_phones(sound)), self.seconds, 0,
            self.gestures.now().shift(self.seconds), plan=plan, voice_sound=followed,
        )  # fmt: skip
        (piece,) = moved_pieces([piece], partial(_with_lips, lips), self._layer, self.models.voices.yield_turn)
        self._n_frames += len(lips)
        self.gestures.note(piece, made)
        return piece

    def gesture(self, *gestures: GestureMark) -> None:
        """Make gestures with the next word of `say`, or at the beginning of the next `idle` or `listen`.

        Of two with one name that wait, the later one is made.
        """
        self.gestures.add(gestures)

    @property
    def has_gestures(self) -> bool:
        """Whether a gesture waits or is being made."""
        return self.gestures.move_at(self.seconds)

    def shown(self, start: float) -> tuple[ShownGesture, ...]:
        """Gestures that are made since the last call, in seconds after `start` of the clip."""
        return tuple(replace(gesture, time=gesture.time - start) for gesture in self.gestures.shown())

    def change_style(self, style: str) -> str:
        """From the next word or the next silence on, the face and its voice have another style, whose name is returned.

        Names of styles of speech services stand for the nearest ones, as in marks; ``auto`` follows the words.

        Raises
        ------
        InputError
            There is no such style.
        """
        names = self.models.palette.names if self.models.palette is not None else ()
        style = palette_style(names, style)
        if self._layer is not None:
            self._layer.change_style(None if is_auto(style) else style)
        self._request, self._silent = (replace(request, style=style) for request in (self._request, self._silent))
        return style

    def rest(self) -> None:
        """The next text begins with the ``lead`` of the request, without a pause after the sentence before it."""
        self._pause_s = None

    def _append(
        self, prepared: PreparedRequest, listening: Timeline | None = None, *, is_speech: bool = False
    ) -> Iterator[Piece]:
        gestures, waiting = self.gestures, self.gestures.waiting
        prepared = gestures.in_speech(prepared) if is_speech else gestures.in_silence(prepared, listening)
        models = self.models.for_request(prepared)
        for piece in pieces_from(prepared, models, self._layer, self._n_frames, ends_on_frame=True):
            self._n_frames += len(piece.clip.motion)
            gestures.note(piece, waiting)
            waiting = ()
            yield piece if self._sound_rate is None else _at_rate(piece, self._sound_rate)


def _with_lips(lips: Trajectory, piece: Piece) -> Piece:
    return replace(piece, clip=replace(piece.clip, motion=lips))


def _at_rate(piece: Piece, rate: int) -> Piece:
    """A piece with sound at another rate. Silence is at both ends of a piece, so that each is resampled alone."""
    speech = piece.clip.speech
    if speech.waveform.rate == rate:
        return piece
    sound = speech.waveform.resampled(rate)
    edges = speech.phones.edges.copy()
    edges[-1] = sound.duration
    speech = replace(speech, waveform=sound, phones=PhoneSequence(speech.phones.phones, edges))
    return replace(piece, clip=replace(piece.clip, speech=speech))
