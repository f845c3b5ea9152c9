"""Motion for avatars: of a text that arrives word by word, or of speech that arrives as sound."""

import itertools
import time
from collections import deque
from collections.abc import Iterator
from contextlib import suppress
from typing import TYPE_CHECKING, Any

import numpy as np

from lexicon.errors import Tts2faceError
from lexicon.marked_text import GestureMark
from tts2face.gestures.listening import PartnerSound
from tts2face.processes.message import Message
from tts2face.serving.service.live_motion import Curves, idle_motion
from tts2face.serving.service.messages import Event, Inputs, Line, Step, Wait, Work
from tts2face.serving.service.scheduler import InterruptedTaskError, check_words
from tts2face.types import Chunk, Clip

if TYPE_CHECKING:
    from tts2face.session.live import LiveSpeech
    from tts2face.session.session import Session
    from tts2face.session.speech_stream import Piece


IDLE_S = 0.4  # of idle motion at a time, so that speech can begin soon
LISTEN_S = 0.2  # likewise of a listener's
AHEAD_S = 0.1  # by which idle motion is ahead of the clock at least
LEAST_WAIT_S = 1e-3  # a shorter wait is none: of a clock that counts otherwise than the frames
GROWING_S = 0.02  # after which is looked again whether another stream has made more of the idle motion


class LiveTask:
    """One live stream: inputs are ``say``, ``gesture``, ``style``, ``listen``, ``heard``, ``cancel`` and ``end``.

    Results are events and sound.

    The text of ``say`` is a sentence; ``said`` with their number ``n`` names those that are spoken or forgotten. From
    ``listen`` to the next sentence the face listens; the payload of ``heard`` is 16-bit sound of the partner. A
    ``gesture`` is made with the next word that is not made yet, in silence at once; so is a ``style``.

    Parameters
    ----------
    clock
        Monotonic seconds.
    """

    def __init__(self, session: "Session", work: Work, inputs: Inputs, clock: Any = time.monotonic) -> None:
        self._session, self._options = session, dict(work.request)
        self._has_idle = bool(self._options.pop("with_idle", True))
        self._speech: LiveSpeech = session.live(**self._options)
        self._curves = Curves(session)
        self._idle = idle_motion(session, self._options) if self._has_idle else None
        self._idle_at = self._n_idle = 0  # next frame of the idle motion; frames of it that the stream has
        self._inputs, self._clock = inputs, clock
        self._sentences: deque[str] = deque()
        self._is_ended = False
        self._began: float | None = None  # of the stream on the clock
        self._n_cancels = 0
        self._listens = False
        self._partner: PartnerSound | None = None
        self._source = ""  # of the last curves

    @property
    def _seconds(self) -> float:
        """Duration of the stream so far."""
        return self._speech.seconds + self._idle_s

    @property
    def _idle_s(self) -> float:
        """Seconds by which a piece of speech begins later than in a stream without idle motion."""
        return self._speech.seconds_of(self._n_idle)

    def steps(self) -> Iterator[Step]:
        """Yield results until ``end`` and all its text are done."""
        while True:
            yield from self._read_inputs()
            is_alive = self._has_idle or self._listens or self._speech.has_gestures
            if self._began is None and (self._sentences or is_alive):
                self._began = self._clock() - self._seconds
            if self._sentences:
                self._listens = False
                yield from self._say(self._sentences.popleft())
                yield _said(1)
                continue
            if self._is_ended and not self._speech.has_gestures:
                return
            if not is_alive or self._began is None:
                yield Wait()
                continue
            ahead = self._seconds - (self._clock() - self._began)
            if ahead > AHEAD_S + LEAST_WAIT_S:
                yield Wait(ahead - AHEAD_S)
                continue
            with suppress(InterruptedTaskError):  # by a message that is read next
                yield from self._be_silent()

    def _be_silent(self) -> Iterator[Step]:
        if self._listens:
            yield from self._listen()
        elif self._speech.has_gestures:
            yield from self._gesture()
        else:
            yield from self._be_idle()

    def _gesture(self) -> Iterator[Step]:
        """Idle motion of this stream alone, while a gesture is made."""
        self._begin_source("gestures")
        for piece in self._speech.idle(IDLE_S):
            yield from self._shown_gestures()
            yield from self._curves.of_clip(piece.clip, piece.begin + self._idle_s)

    def _shown_gestures(self) -> Iterator[Event]:
        for shown in self._speech.gestures.shown():
            yield Event({"type": "gesture", "name": shown.name, "at": round(shown.time + self._idle_s, 4)})

    def _change_style(self, style: str) -> Event:
        try:
            self._options["style"] = self._speech.change_style(style)
        except Tts2faceError as error:
            return Event({"type": "error", "message": " ".join(str(error).split())})
        if self._has_idle:
            self._idle, self._idle_at = idle_motion(self._session, self._options), 0
        return Event({"type": "style", "style": style, "at": round(self._seconds, 4)})

    def _listen(self) -> Iterator[Line | Event]:
        cues = None if self._partner is None else self._partner.new_cues()
        self._begin_source("listening")
        for piece in self._speech.listen(LISTEN_S, cues):
            yield from self._shown_gestures()
            yield from self._curves.of_clip(piece.clip, piece.begin + self._idle_s)

    def _be_idle(self) -> Iterator[Step]:
        idle, at = self._idle, self._idle_at
        assert idle is not None
        n = max(1, round(IDLE_S * self._speech.fps))
        if not idle.is_whole and at + n > len(idle.frames) and not idle.grow():
            yield Wait(GROWING_S)
            return
        self._speech.rest()
        if at == 0:
            self._source = ""  # it begins again
        self._begin_source("idle")
        part = slice(at, min(at + n, len(idle.frames)))
        begin = self._seconds
        self._n_idle += part.stop - at
        self._idle_at = 0 if idle.is_whole and part.stop == len(idle.frames) else part.stop
        yield self._curves.of_idle(idle, part, begin)

    def _begin_source(self, name: str) -> None:
        if name != self._source:
            self._source = name
            self._curves.begin_source()

    def _say(self, sentence: str) -> Iterator[Step]:
        n_cancels = self._n_cancels
        if self._clock() - (self._began or 0.0) > self._seconds:
            self._speech.rest()  # the sentence before it has been heard
        self._begin_source("speech")
        try:
            check_words(sentence)
            for piece in self._speech.say(sentence):
                begin = piece.begin + self._idle_s
                yield from self._new_notes(sentence)
                yield _speech_event(piece, begin)
                yield from self._shown_gestures()
                yield _sound(piece.clip)
                yield from self._curves.of_clip(piece.clip, begin)
                yield from self._read_inputs()
                if self._n_cancels != n_cancels:
                    return
            yield from self._new_notes(sentence)
        except InterruptedTaskError:
            return  # by a message that is read next
        except Tts2faceError as error:  # the stream goes on with the next sentence
            yield Event({"type": "error", "text": sentence, "message": " ".join(str(error).split())})

    def _new_notes(self, sentence: str) -> Iterator[Event]:
        for note in self._speech.new_notes():
            yield Event({"type": "note", "text": sentence, "message": note})

    def _read_inputs(self) -> Iterator[Event]:
        while self._inputs:
            given = self._inputs.popleft()
            content = given.content
            match content["type"]:
                case "listen" | "heard":
                    self._hear(given)
                case "say":
                    self._sentences.append(content["text"])
                case "end":
                    self._is_ended = True
                case "gesture":
                    self._speech.gesture(GestureMark(**content["gesture"]))
                case "style":
                    yield self._change_style(content["style"])
                case "cancel":
                    yield from self._cancel(content["arrived"])

    def _cancel(self, arrived: float) -> Iterator[Event]:
        if self._sentences:
            yield _said(len(self._sentences))
            self._sentences.clear()
        self._n_cancels += 1
        self._began = self._clock() - self._seconds  # what follows is due now
        self._speech.rest()
        self._speech.gestures.clear()
        after_ms = 1000 * (self._clock() - arrived)
        yield Event({"type": "cancelled", "at": round(self._seconds, 4), "after_ms": round(after_ms, 1)})

    def _hear(self, given: Message) -> None:
        """Begin to listen, or hear a block of the partner's sound."""
        if given.content["type"] == "heard":
            if self._partner is not None:
                self._partner.add(np.frombuffer(given.payload, "<i2").astype(np.float32) / np.float32(32768))
            return
        self._listens = True
        rate = given.content["rate"]
        self._partner = None if rate is None else PartnerSound(rate)
        if self._began is None or self._clock() - self._began > self._seconds:
            self._began = self._clock() - self._seconds  # it listens from now on


def _said(n_sentences: int) -> Event:
    return Event({"type": "said", "n": n_sentences})


def live(session: "Session", work: Work, inputs: Inputs) -> Iterator[Step]:
    """Events and sound of a live stream."""
    return LiveTask(session, work, inputs).steps()


def listen(session: "Session", work: Work, inputs: Inputs) -> Iterator[Event | Line | Wait]:
    """Curves of sound: inputs are ``audio``, whose payload is 16-bit samples, and ``end``."""
    lips = session.listen(int(work.request.get("rate", 16_000)))
    curves, n_frames = Curves(session), 0
    yield Event({"type": "listening", "fps": lips.fps, "look_ahead_s": round(lips.look_ahead_s, 4)})
    is_ended = False
    while not is_ended:
        if not inputs:
            yield Wait()
            continue
        given = inputs.popleft()
        is_ended = given.content["type"] == "end"
        samples = np.frombuffer(given.payload, "<i2").astype(np.float32) / 32768
        motion = lips.finish() if is_ended else lips.add_samples(samples)
        if motion is not None:
            yield curves.of_motion(motion, n_frames / lips.fps)
            n_frames += len(motion)


def _speech_event(piece: "Piece", begin: float) -> Event:
    speech = piece.clip.speech
    edges = [round(float(edge) + begin, 6) for edge in speech.phones.edges]
    return Event({
        "type": "speech", "text": piece.text, "begin": round(begin, 6),
        "seconds": round(speech.waveform.duration, 6), "rate": speech.waveform.rate,
        "words": [[word.text, edges[word.first], edges[word.last]] for word in speech.words],
        "phones": [[phone, *span] for phone, span in
                   zip(speech.phones.phones, itertools.pairwise(edges), strict=False)],
    })  # fmt: skip


def _sound(clip: Clip) -> Chunk:
    from tts2face.storage.wave_files import pcm_bytes

    return Chunk(pcm_bytes(clip.speech.waveform.samples), clip.speech.waveform.duration)
