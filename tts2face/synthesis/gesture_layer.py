"""Gestures of a request, added to the speech motion of its clip."""

from concurrent.futures import Future, ThreadPoolExecutor

import numpy as np

from tts2face.face.gesture_transfer import SPEECH_GAINS
from tts2face.gesture.gesture_stream import GestureFields, GestureStream, GestureValues
from tts2face.gesture.perlin_noise import NoiseStream
from tts2face.gesture.timeline import Timeline
from tts2face.models.palette import Palette
from tts2face.synthesis.animated_face import AnimatedFace
from tts2face.synthesis.mark_styles import marked_styles
from tts2face.synthesis.prepared_request import PreparedRequest
from tts2face.types import Clip, GiveWay, Speech, Trajectory, keep_on

DEFAULT_STYLE = "neutral"


def default_style(palette: Palette) -> str:
    """Name of the style for requests that choose none: neutral, or the palette's first recorded style."""
    return DEFAULT_STYLE if DEFAULT_STYLE in palette.names else next(iter(palette.styles))


class GestureLayer:
    """Gestures of one clip, added piece by piece.

    Parameters
    ----------
    give_way
        Called between the steps of a piece.

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
        give_way: GiveWay = keep_on,
    ) -> None:
        self._requested = Timeline(style=face.default_styles).merge(prepared.timeline)
        self._face, self._give_way = face, give_way
        palette, request = fields.palette, prepared.request
        self._requested.check_styles(palette)
        for style in marked_styles(prepared.text):
            palette.require(style)
        face.check_gains(self._requested.gains.factors)
        kind: type[NoiseStream] | type[GestureStream] = NoiseStream if request.gestures == "noise" else GestureStream
        executor = ThreadPoolExecutor(1)  # building the fields takes 0.5 s, in parallel with loading the voice
        self._first: Future[GestureStream | NoiseStream] = executor.submit(
            kind, fields, style=default_style(palette), seed=request.seed, fps=float(prepared.fps)
        )
        executor.shutdown(wait=False)
        self._stream: GestureStream | NoiseStream | None = None  # after the last piece
        self._marked = Timeline()
        self._seconds = 0.0

    def add(self, speech: Speech, lips: Trajectory, marks: Timeline) -> Clip:
        """Add gestures to the next piece of the clip; after an exception of `give_way`, the next one is the same piece.

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
        stream = (self._stream or self._first.result()).copy()
        gestures = _gaze_relative_to_head(stream.next(speech.waveform, len(lips), timeline, self._give_way))
        gains = {name: timeline.gains.of(name) for name in SPEECH_GAINS}
        moved = self._face.add_gestures(lips, gestures, gains)
        self._stream, self._marked, self._seconds = stream, marked, self._seconds + len(lips) / lips.fps
        return Clip(moved.face, moved.head, speech)

    def finish(self) -> None:
        """Reject requested gestures beyond the end of the clip.

        Raises
        ------
        InputError
            A span or nod of the request begins after the end.
        """
        self._requested.check_duration(self._seconds)


def _gaze_relative_to_head(gestures: GestureValues) -> GestureValues:
    """Convert the gaze from world to head coordinates, so that fixations hold while the head moves."""
    if "gaze" not in gestures or "head" not in gestures:
        return gestures
    return {**gestures, "gaze": gestures["gaze"] - gestures["head"][:, :2]}
