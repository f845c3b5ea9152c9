"""Gestures laid over speech: what a request asks for, over the whole of its clip."""

from collections.abc import Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from lexicon.errors import InputError
from tts2face.face.gesture_transfer import SPEECH_GAINS, GestureFace
from tts2face.gesture.gesture_stream import Fields, Gestures, GestureStream
from tts2face.gesture.perlin_noise import NoiseStream
from tts2face.gesture.request_timeline import asked
from tts2face.gesture.timeline import Timeline
from tts2face.models.palette import Palette
from tts2face.own_face.gestures import OwnGestures
from tts2face.request import Request
from tts2face.types import HEAD_CHANNELS, Clip, Speech, Trajectory

USUAL_STYLE = "neutral"
STILL = ("gaze", "head", *SPEECH_GAINS)  # of a talker's own face


@dataclass(frozen=True, slots=True, eq=False)
class Living:
    """A palette and a face, or a talker's own one, made ready for each other; serves any number of clips."""

    fields: Fields
    face: GestureFace | OwnGestures


def usual_style(palette: Palette) -> str:
    """The style of a clip for which none was chosen."""
    return USUAL_STYLE if USUAL_STYLE in palette.names else next(iter(palette.styles))


class Life:
    """The gestures of one clip, added piece by piece.

    Raises
    ------
    InputError, DataError
        The request's style, gains, expressions or timeline cannot be read, or the palette lacks a style.
    """

    def __init__(self, request: Request, living: Living, fps: float) -> None:
        self._asked, self._living = asked(request), living
        palette = living.fields.palette
        self._asked.check_styles(palette)
        if isinstance(living.face, OwnGestures):
            _refuse_still(self._asked.gains.factors)
        kind: type[NoiseStream] | type[GestureStream] = NoiseStream if request.noise else GestureStream
        starter = ThreadPoolExecutor(1)  # fields take half a second to make, in which a voice can be loaded and speak
        self._stream: Future[GestureStream | NoiseStream] = starter.submit(
            kind, living.fields, style=usual_style(palette), seed=request.seed, fps=fps
        )
        starter.shutdown(wait=False)
        self._marked = Timeline()
        self._seconds = 0.0

    def added(self, speech: Speech, lips: Trajectory, marks: Timeline) -> Clip:
        """The next piece of the clip.

        Parameters
        ----------
        lips : (T, K)
            Motion of the face without gestures, T frames of it.
        marks
            What the piece's text asks for, on the clock of the whole clip.
        """
        self._marked = self._marked.within(self._seconds - 1.0, np.inf).merged(marks)  # a nod runs on for half a second
        timeline = self._asked.merged(self._marked)
        self._seconds += len(lips) / lips.fps
        gestures = _seen_from_the_head(self._stream.result().next(speech.waveform, len(lips), timeline))
        gains = {name: timeline.gains.of(name) for name in SPEECH_GAINS}
        face = self._living.face
        if isinstance(face, OwnGestures):
            return still(speech, face.motion(lips, gestures, gains))
        shown = face.perform(lips, gestures, gains)
        return Clip(shown.motion, shown.head, speech)

    def finish(self) -> None:
        """Refuse what was asked for beyond the clip's end.

        Raises
        ------
        InputError
            There is such a thing.
        """
        self._asked.check_duration(self._seconds)


def _refuse_still(gains: Mapping[str, float]) -> None:
    for name in gains:
        if name in STILL:
            raise InputError(f"her own face is shown on her video, whose {name} cannot be moved; leave its gain away")


def still(speech: Speech, motion: Trajectory) -> Clip:
    """A clip whose head does not move."""
    head = np.zeros((len(motion), len(HEAD_CHANNELS)), np.float32)
    return Clip(motion, Trajectory(HEAD_CHANNELS, head, motion.fps), speech)


def _seen_from_the_head(gestures: Gestures) -> Gestures:
    """Gestures with the line of sight as the eyes must turn: they hold what they look at while the head moves."""
    if "gaze" not in gestures or "head" not in gestures:
        return gestures
    return {**gestures, "gaze": gestures["gaze"] - gestures["head"][:, :2]}
