"""Motion for avatars: of a text that arrives word by word, or of speech that arrives as sound."""

import itertools
import time
from collections import deque
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import Tts2faceError
from tts2face.gestures.listening import PartnerSound
from tts2face.processes.message import Message
from tts2face.serving.service.messages import Event, Inputs, Step, Wait, Work, check_words
from tts2face.serving.service.scheduler import InterruptedTaskError
from tts2face.types import Chunk, Clip, Trajectory

if TYPE_CHECKING:
    from tts2face.session.live import LiveSpeech
    from tts2face.session.session import Session
    from tts2face.session.speech_stream import Piece


IDLE_S = 0.2  # of idle motion at a time, so that speech can begin soon
MAX_FRAMES = 200  # of an event, whose writing is one step of the server's event loop, of some 5 ms
AHEAD_S = 0.3  # by which idle motion is ahead of the clock


class LiveTask:
    """One live stream: inputs are ``say``, ``listen``, ``heard``, ``cancel`` and ``end``; results are events and sound.

    The text of ``say`` is a sentence; ``said`` with their number ``n`` tells which ones are spoken or forgotten. From
    ``listen`` to the next sentence the face listens; the payload of ``heard`` is 16-bit sound of the partner.

    Parameters
    ----------
    clock
        Monotonic seconds.
    """

    def __init__(self, session: "Session", work: Work, inputs: Inputs, clock: Any = time.monotonic) -> None:
        options = dict(work.request)
        self._has_idle = bool(options.pop("with_idle", True))
        self._speech: LiveSpeech = session.live(**options)
        self._curves = _Curves(session)
        self._inputs, self._clock = inputs, clock
        self._sentences: deque[str] = deque()
        self._is_ended = False
        self._began: float | None = None  # of the stream on the clock
        self._n_cancels = 0
        self._listens = False
        self._partner: PartnerSound | None = None

    def steps(self) -> Iterator[Step]:
        """Yield results until ``end`` and all its text are done."""
        while True:
            yield from self._read_inputs()
            is_alive = self._has_idle or self._listens
            if self._began is None and (self._sentences or is_alive):
                self._began = self._clock() - self._speech.seconds
            if self._sentences:
                self._listens = False
                yield from self._say(self._sentences.popleft())
                yield _said(1)
                continue
            if self._is_ended:
                return
            if not is_alive or self._began is None:
                yield Wait()
                continue
            ahead = self._speech.seconds - (self._clock() - self._began)
            if ahead > AHEAD_S:
                yield Wait(ahead - AHEAD_S)
                continue
            with suppress(InterruptedTaskError):  # by a message that is read next
                for piece in self._silence():
                    yield from self._curves.events(piece.clip, piece.begin)

    def _silence(self) -> "Iterator[Piece]":
        """Idle motion, or that of a listener."""
        if not self._listens:
            return self._speech.idle(IDLE_S)
        return self._speech.listen(IDLE_S, None if self._partner is None else self._partner.new_cues())

    def _say(self, sentence: str) -> Iterator[Event | Chunk]:
        n_cancels = self._n_cancels
        if self._clock() - (self._began or 0.0) > self._speech.seconds:
            self._speech.rest()  # the sentence before it has been heard
        try:
            check_words(sentence)
            for piece in self._speech.say(sentence):
                yield _speech_event(piece)
                yield _sound(piece.clip)
                yield from self._curves.events(piece.clip, piece.begin)
                yield from self._read_inputs()
                if self._n_cancels != n_cancels:
                    return
        except InterruptedTaskError:
            return  # by a message that is read next
        except Tts2faceError as error:  # the stream goes on with the next sentence
            yield Event({"type": "error", "text": sentence, "message": " ".join(str(error).split())})

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
                case "cancel":
                    if self._sentences:
                        yield _said(len(self._sentences))
                        self._sentences.clear()
                    self._n_cancels += 1
                    self._began = self._clock() - self._speech.seconds  # what follows is due now
                    self._speech.rest()
                    after_ms = 1000 * (self._clock() - content["arrived"])
                    cancelled = {"at": round(self._speech.seconds, 4), "after_ms": round(after_ms, 1)}
                    yield Event({"type": "cancelled", **cancelled})

    def _hear(self, given: Message) -> None:
        """Begin to listen, or hear a block of the partner's sound."""
        if given.content["type"] == "heard":
            if self._partner is not None:
                self._partner.add(np.frombuffer(given.payload, "<i2").astype(np.float32) / np.float32(32768))
            return
        self._listens = True
        rate = given.content["rate"]
        self._partner = None if rate is None else PartnerSound(rate)
        if self._began is None or self._clock() - self._began > self._speech.seconds:
            self._began = self._clock() - self._speech.seconds  # it listens from now on


def _said(n_sentences: int) -> Event:
    return Event({"type": "said", "n": n_sentences})


def live(session: "Session", work: Work, inputs: Inputs) -> Iterator[Step]:
    """Events and sound of a live stream."""
    return LiveTask(session, work, inputs).steps()


def listen(session: "Session", work: Work, inputs: Inputs) -> Iterator[Event | Wait]:
    """Curves of sound: inputs are ``audio``, whose payload is 16-bit samples, and ``end``."""
    lips = session.listen(int(work.request.get("rate", 16_000)))
    curves, n_frames = _Curves(session), 0
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


class _Curves:
    """ARKit weights of clips of a session."""

    def __init__(self, session: "Session") -> None:
        self._session = session
        self._projection: Any = None

    def events(self, clip: Clip, begin: float) -> Iterator[Event]:
        """Weights and head pose of all frames of a clip, at most `MAX_FRAMES` in an event."""
        motion, head = clip.motion, clip.head
        for at in range(0, len(motion), MAX_FRAMES):
            part = slice(at, at + MAX_FRAMES)
            some, turned = replace(motion, values=motion.values[part]), replace(head, values=head.values[part])
            yield self.of_motion(some, begin + at / motion.fps, turned)

    def of_motion(self, motion: Trajectory, begin: float, head: Trajectory | None = None) -> Event:
        """Weights of all frames of a motion, and the head pose if there is one."""
        from tts2face.interchange.exports.curves import ARKIT_SHAPES, arkit_projection

        content: dict[str, Any] = {"type": "curves", "begin": round(begin, 4), "fps": motion.fps}
        if self._projection is None:
            self._projection = arkit_projection(motion.channels, self._session.mesh, "the stream")
            content["names"] = list(ARKIT_SHAPES)
            if head is not None:
                content["head_names"] = list(head.channels)
        content["weights"] = _rounded(self._projection.weights(motion.values))
        if head is not None:
            content["head"] = _rounded(head.values)
        return Event(content, 0.0 if head is not None else motion.duration)


def _rounded(values: NDArray[np.floating]) -> list[list[float]]:
    return [[round(value, 4) for value in row] for row in values.tolist()]


def _speech_event(piece: "Piece") -> Event:
    speech, begin = piece.clip.speech, piece.begin
    edges = [round(float(edge) + begin, 6) for edge in speech.phones.edges]
    return Event({
        "type": "speech", "text": piece.text, "begin": round(begin, 6),
        "seconds": round(speech.waveform.duration, 6), "rate": speech.waveform.rate,
        "words": [[word.text, edges[word.first], edges[word.last]] for word in speech.words],
        "phones": [[phone, *span] for phone, span in
                   zip(speech.phones.phones, itertools.pairwise(edges), strict=False)],
    })  # fmt: skip


def _sound(clip: Clip) -> Chunk:
    from tts2face.storage.media_files import pcm_bytes

    return Chunk(pcm_bytes(clip.speech.waveform.samples), clip.speech.waveform.duration)
