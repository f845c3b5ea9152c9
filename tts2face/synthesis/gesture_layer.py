"""Gestures laid over speech: what a request asks for, over the whole of its clip."""

from concurrent.futures import Future, ThreadPoolExecutor

import numpy as np

from tts2face.face.gesture_transfer import SPEECH_GAINS
from tts2face.gesture.gesture_stream import GestureFields, GestureStream, GestureValues
from tts2face.gesture.perlin_noise import NoiseStream
from tts2face.gesture.timeline import Timeline
from tts2face.models.palette import Palette
from tts2face.synthesis.animated_face import AnimatedFace
from tts2face.synthesis.marked_speech import marked_styles
from tts2face.synthesis.prepared_request import PreparedRequest
from tts2face.types import Clip, Speech, Trajectory

DEFAULT_STYLE = "neutral"


def default_style(palette: Palette) -> str:
    """The style of a clip for which none was chosen."""
    return DEFAULT_STYLE if DEFAULT_STYLE in palette.names else next(iter(palette.styles))


class GestureLayer:
    """The gestures of one clip, added piece by piece.

    Raises
    ------
    InputError, DataError
        The palette lacks a style that the request names, or the face cannot move what a gain asks for.
    """

    def __init__(self, prepared: PreparedRequest, fields: GestureFields, face: AnimatedFace) -> None:
        self._requested, self._face = prepared.timeline, face
        palette, request = fields.palette, prepared.request
        self._requested.check_styles(palette)
        for style in marked_styles(prepared.text):
            palette.require(style)
        face.check_gains(self._requested.gains.factors)
        kind: type[NoiseStream] | type[GestureStream] = NoiseStream if request.gestures == "noise" else GestureStream
        starter = ThreadPoolExecutor(1)  # fields take half a second to make, in which a voice can be loaded and speak
        self._stream: Future[GestureStream | NoiseStream] = starter.submit(
            kind, fields, style=default_style(palette), seed=request.seed, fps=float(prepared.fps)
        )
        starter.shutdown(wait=False)
        self._marked = Timeline()
        self._seconds = 0.0

    def add(self, speech: Speech, lips: Trajectory, marks: Timeline) -> Clip:
        """The next piece of the clip.

        Parameters
        ----------
        lips : (T, K)
            Motion of the face without gestures, T frames of it.
        marks
            What the piece's text asks for, on the clock of the whole clip.
        """
        self._marked = self._marked.restrict(self._seconds - 1.0, np.inf).merge(
            marks
        )  # a nod runs on for half a second
        timeline = self._requested.merge(self._marked)
        self._seconds += len(lips) / lips.fps
        gestures = _gaze_relative_to_head(self._stream.result().next(speech.waveform, len(lips), timeline))
        gains = {name: timeline.gains.of(name) for name in SPEECH_GAINS}
        moved = self._face.add_gestures(lips, gestures, gains)
        return Clip(moved.face, moved.head, speech)

    def finish(self) -> None:
        """Refuse what was asked for beyond the clip's end.

        Raises
        ------
        InputError
            There is such a thing.
        """
        self._requested.check_duration(self._seconds)


def _gaze_relative_to_head(gestures: GestureValues) -> GestureValues:
    """Gestures with the line of sight as the eyes must turn: they hold what they look at while the head moves."""
    if "gaze" not in gestures or "head" not in gestures:
        return gestures
    return {**gestures, "gaze": gestures["gaze"] - gestures["head"][:, :2]}
