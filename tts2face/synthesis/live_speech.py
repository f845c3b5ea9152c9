"""Speech that is extended sentence by sentence while it plays, with idle motion between: one continuous clip."""

from collections.abc import Iterator
from dataclasses import replace

from lexicon.errors import InputError
from tts2face.clock import exact_rate
from tts2face.request import Request
from tts2face.synthesis.clip_stream import pieces_from
from tts2face.synthesis.prepared_request import prepare
from tts2face.synthesis.session_models import SessionModels
from tts2face.synthesis.speech_stream import Piece

UNUSED_IDLE_S = 1.0  # of the request from which the gestures of the whole are made


class LiveSpeech:
    """A clip without an end: `say` appends speech, `idle` appends silence with a living face.

    Gestures continue from piece to piece. Not thread-safe.

    Parameters
    ----------
    request
        Options of all pieces; without text, recording and idle time.

    Raises
    ------
    InputError, DataError
        The request has a text, recording or timeline, or an option is invalid.
    """

    def __init__(self, request: Request, models: SessionModels) -> None:
        if request.text or request.audio is not None or request.idle is not None or request.timeline is not None:
            raise InputError("a live request has options only; send its text in parts")
        self._request, self._models = request, models
        self._layer = models.gesture_layer(prepare(_idle_request(request, UNUSED_IDLE_S)))
        self._n_frames = 0

    @property
    def seconds(self) -> float:
        """Duration of all pieces so far."""
        return float(self._n_frames / exact_rate(self._request.fps))

    def say(self, text: str) -> Iterator[Piece]:
        """Append the sentences of a text; errors as `Session.stream`."""
        yield from self._append(replace(self._request, text=text))

    def idle(self, seconds: float) -> Iterator[Piece]:
        """Append silence."""
        yield from self._append(_idle_request(self._request, seconds))

    def _append(self, request: Request) -> Iterator[Piece]:
        prepared = prepare(request)
        for piece in pieces_from(prepared, self._models.for_request(prepared), self._layer, self._n_frames):
            self._n_frames += len(piece.clip.motion)
            yield piece


def _idle_request(request: Request, seconds: float) -> Request:
    """The request with idle animation, which has no voice."""
    return replace(request, idle=seconds, voice=None, rate=1.0, volume=1.0, dictionary=None)
