"""Motion for avatars: of a text that arrives word by word, or of speech that arrives as sound."""

import itertools
import time
from collections.abc import Iterator
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from lexicon.errors import Tts2faceError
from lexicon.marked_text import GestureMark
from tts2face.processes.message import Message
from tts2face.serving.service.live_motion import Curves
from tts2face.serving.service.messages import Event, Inputs, Line, Step, Wait, Work
from tts2face.serving.service.scheduler import InterruptedTaskError, check_words
from tts2face.session.live.blocks import Block, Note
from tts2face.session.live.joins import Joins
from tts2face.session.live.live_face import LiveFace
from tts2face.storage.wave_files import pcm_bytes, pcm_samples
from tts2face.types import Chunk, Clip

if TYPE_CHECKING:
    from tts2face.session.session import Session
    from tts2face.session.speech_stream import Piece


IDLE_S = 0.4  # of idle motion at a time, so that speech can begin soon
AHEAD_S = 0.1  # by which idle motion is ahead of the clock at least
LEAST_WAIT_S = 1e-3  # a shorter wait is none: of a clock that counts otherwise than the frames
GROWING_S = 0.02  # after which is looked again whether another stream has made more of the idle motion


class LiveTask:
    """One live stream: inputs are ``say``, ``gesture``, ``style``, ``listen``, ``heard``, ``cancel`` and ``end``.

    Results are events and sound. What the face does next are the rules of `tts2face.session.live.live_face.LiveFace`;
    this class gives it inputs, waits for the clock, and writes what it makes.

    The text of ``say`` is a sentence; ``said`` with their number ``n`` names those that are spoken or forgotten. From
    ``listen`` to the next sentence the face listens; the payload of ``heard`` is 16-bit sound of the partner. A
    ``gesture`` is made with the next word that is not made yet, in silence at once; so is a ``style``.

    Parameters
    ----------
    clock
        Monotonic seconds.
    """

    def __init__(self, session: "Session", work: Work, inputs: Inputs, clock: Any = time.monotonic) -> None:
        options = dict(work.request)
        self._has_idle = bool(options.pop("with_idle", True))
        self._face = LiveFace(session.live(sound_rate=None, **options), session.listen)
        self._joins, self._curves = Joins(self._face.speech.fps), Curves(session)
        self._inputs, self._clock = inputs, clock
        self._n_frames = self._n_sentences = 0
        self._is_ended = False
        self._began: float | None = None  # of the stream on the clock
        self._n_cancels = 0

    @property
    def _seconds(self) -> float:
        """Duration of the stream so far."""
        return self._face.speech.seconds_of(self._n_frames)

    def steps(self) -> Iterator[Step]:
        """Yield results until ``end`` and all its text are done."""
        face = self._face
        while True:
            yield from self._read_inputs()
            is_alive = self._has_idle or face.is_moved
            if self._began is None and (face.has_speech or is_alive):
                self._began = self._clock() - self._seconds
            if face.has_speech:
                yield from self._speak()
                yield _said(1)
                continue
            if self._is_ended and not face.speech.has_gestures:
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
        face = self._face
        if face.is_moved:
            for block in face.silence():
                yield from self._written(block)
            return
        n_frames = max(1, round(IDLE_S * face.speech.fps))
        if not face.idle.has(n_frames) and not face.idle.motion.grow():
            yield Wait(GROWING_S)
            return
        face.rest()
        yield from self._written(face.idle.next(n_frames))

    def _written(self, block: Block) -> Iterator[Step]:
        """Events and sound of a block at the end of the stream."""
        begin = self._seconds
        if block.piece is not None:
            yield _speech_event(block.piece, begin)
        for shown in block.shown:
            yield Event({"type": "gesture", "name": shown.name, "at": round(begin + shown.time, 4)})
        if block.piece is not None:
            yield _sound(block.piece.clip)
        self._n_frames += len(block.motion)
        yield from self._curves.of_block(self._joins.add(block), begin)

    def _change_style(self, style: str) -> Event:
        try:
            self._face.change_style(style)
        except Tts2faceError as error:
            return Event({"type": "error", "message": " ".join(str(error).split())})
        return Event({"type": "style", "style": style, "at": round(self._seconds, 4)})

    def _speak(self) -> Iterator[Step]:
        n_cancels = self._n_cancels
        if self._clock() - (self._began or 0.0) > self._seconds:
            self._face.rest()  # the sentence before it has been heard
        text = self._face.next_text
        try:
            for item in self._face.speak():
                if isinstance(item, Note):
                    yield Event({"type": "note", "text": item.text, "message": item.message})
                elif isinstance(item, Block):
                    yield from self._written(item)
                    yield from self._read_inputs()
                    if self._n_cancels != n_cancels:
                        return
        except InterruptedTaskError:
            return  # by a message that is read next
        except Tts2faceError as error:  # the stream goes on with the next sentence
            yield _refused(text, error)

    def _read_inputs(self) -> Iterator[Event]:
        while self._inputs:
            given = self._inputs.popleft()
            content = given.content
            match content["type"]:
                case "listen" | "heard":
                    self._hear(given)
                case "say":
                    yield from self._add(content["text"])
                case "end":
                    self._is_ended = True
                case "gesture":
                    self._face.gesture(GestureMark(**content["gesture"]))
                case "style":
                    yield self._change_style(content["style"])
                case "cancel":
                    yield from self._cancel(content["arrived"])

    def _cancel(self, arrived: float) -> Iterator[Event]:
        if n_waiting := self._face.interrupt():
            yield _said(n_waiting)
        self._n_cancels += 1
        self._began = self._clock() - self._seconds  # what follows is due now
        after_ms = 1000 * (self._clock() - arrived)
        yield Event({"type": "cancelled", "at": round(self._seconds, 4), "after_ms": round(after_ms, 1)})

    def _add(self, text: str) -> Iterator[Event]:
        try:
            check_words(text)
        except Tts2faceError as error:
            yield _refused(text, error)
            yield _said(1)
            return
        self._n_sentences += 1
        self._face.say(self._n_sentences, text)

    def _hear(self, given: Message) -> None:
        """Begin to listen, or hear a block of the partner's sound."""
        if given.content["type"] == "heard":
            self._face.hear(pcm_samples(given.payload))
            return
        self._face.listen(given.content["rate"])
        if self._began is None or self._clock() - self._began > self._seconds:
            self._began = self._clock() - self._seconds  # it listens from now on


def _refused(text: str, error: Tts2faceError) -> Event:
    return Event({"type": "error", "text": text, "message": " ".join(str(error).split())})


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
        samples = pcm_samples(given.payload)
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
    return Chunk(pcm_bytes(clip.speech.waveform.samples), clip.speech.waveform.duration)
