"""Speech for avatars whose text arrives word by word."""

import itertools
import time
from collections import deque
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from lexicon.errors import Tts2faceError
from lexicon.growing_text import GrowingText
from tts2face.service.messages import Event, Wait
from tts2face.service.words import check_words
from tts2face.service.work import Inputs, Work
from tts2face.types import Chunk, Clip

if TYPE_CHECKING:
    from tts2face.session import Session
    from tts2face.synthesis.clip_stream import Piece
    from tts2face.synthesis.live_speech import LiveSpeech

IDLE_S = 0.2  # of idle motion at a time, so that speech can begin soon
LEAD_S = 0.3  # by which idle motion is ahead of the clock


class LiveTask:
    """One live stream: inputs are ``text``, ``flush``, ``cancel`` and ``end``; results are events and sound.

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
        self._text = GrowingText(str(options.get("language", "en-us")))
        self._sentences: deque[str] = deque()
        self._is_ended = False

    def steps(self) -> Iterator[Event | Chunk | Wait]:
        """Yield results until ``end`` and all its text are done."""
        began: float | None = None
        while True:
            yield from self._read_inputs()
            if self._sentences:
                began = self._clock() - self._speech.seconds if began is None else began
                yield from self._say(self._sentences.popleft())
                continue
            if self._is_ended:
                return
            if not self._has_idle:
                yield Wait()
                continue
            began = self._clock() if began is None else began
            lead = self._speech.seconds - (self._clock() - began)
            if lead > LEAD_S:
                yield Wait(lead - LEAD_S)
                continue
            for piece in self._speech.idle(IDLE_S):
                yield self._curves.event(piece.clip, piece.begin)

    def _say(self, sentence: str) -> Iterator[Event | Chunk]:
        try:
            check_words(sentence)
            for piece in self._speech.say(sentence):
                yield _speech_event(piece)
                yield _sound(piece.clip)
                yield self._curves.event(piece.clip, piece.begin)
        except Tts2faceError as error:  # the stream goes on with the next sentence
            yield Event({"type": "error", "text": sentence, "message": " ".join(str(error).split())})

    def _read_inputs(self) -> Iterator[Event]:
        while not self._inputs.empty():
            content = self._inputs.get()
            match content.get("type"):
                case "text":
                    self._sentences += self._text.add(str(content.get("text", "")))
                case "flush":
                    self._sentences += self._text.flush()
                case "end":
                    self._sentences += self._text.flush()
                    self._is_ended = True
                case "cancel":
                    self._sentences.clear()
                    self._text.clear()
                    yield Event({"type": "cancelled", "at": round(self._speech.seconds, 4)})


def live(session: "Session", work: Work, inputs: Inputs) -> Iterator[Event | Chunk | Wait]:
    """Events and sound of a live stream."""
    return LiveTask(session, work, inputs).steps()


class _Curves:
    """ARKit weights of clips of a session."""

    def __init__(self, session: "Session") -> None:
        self._session = session
        self._projection: Any = None

    def event(self, clip: Clip, begin: float) -> Event:
        """Weights and head pose of all frames of a clip."""
        from tts2face.exports.arkit import ARKIT_SHAPES, arkit_projection

        names: dict[str, Any] = {}
        if self._projection is None:
            self._projection = arkit_projection(clip.motion.channels, self._session.mesh, "the stream")
            names = {"names": list(ARKIT_SHAPES), "head_names": list(clip.head.channels)}
        weights = self._projection.weights(clip.motion.values)
        return Event({
            "type": "curves", "begin": round(begin, 4), "fps": clip.fps, **names,
            "weights": [[round(value, 4) for value in row] for row in weights.tolist()],
            "head": [[round(value, 4) for value in row] for row in clip.head.values.tolist()],
        }, 0.0)  # fmt: skip


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
    from tts2face.storage.wave_files import pcm_bytes

    return Chunk(pcm_bytes(clip.speech.waveform.samples), clip.speech.waveform.duration)
