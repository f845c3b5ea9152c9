"""Calls of a session that make live faces, whose modules other clips do not load."""

from functools import partial
from typing import TYPE_CHECKING, Any, Protocol

from tts2face.picture.frame_renderer import FrameRenderer
from tts2face.picture.options import Picture
from tts2face.request import Request
from tts2face.session.animated_face import AnimatedFace
from tts2face.session.live import AHEAD_S
from tts2face.session.prepared import split_picture
from tts2face.session.shared_models import SessionModels
from tts2face.sound.features import FEATURE_RATE
from tts2face.types import SOUND_RATE

if TYPE_CHECKING:
    from tts2face.session.live.lips import LiveLips
    from tts2face.session.live.speech import LiveSpeech
    from tts2face.session.live.stream import FaceStream


class LiveCalls(Protocol):
    """Live faces of a session."""

    _models: SessionModels

    def renderer(self, picture: Picture, *, has_gestures: bool = True) -> FrameRenderer:
        """Renderer of the session's face."""

    def animated_face(self, *, has_gestures: bool = True) -> AnimatedFace:
        """Face whose channels clips use."""

    def live(self, *, sound_rate: int | None = SOUND_RATE, **options: Any) -> "LiveSpeech":
        """A clip without an end, extended by `say`, `idle` and `listen` of the result; options and errors as `clip`.

        All pieces have the sample rate `sound_rate` in Hz; None: that of their voice, in silence `SOUND_RATE`.
        """
        from tts2face.session.live.speech import LiveSpeech

        return LiveSpeech(self._models.seeded(Request(**options)), self._models, sound_rate)

    def face_stream(
        self,
        picture: Picture | None = None,
        *,
        fps: float = 30.0,
        idle: bool = True,
        ahead_s: float = AHEAD_S,
        draws: bool = True,
        **options: Any,
    ) -> "FaceStream":
        """One face on a clock: text or sound goes in, frames come out (docs/live.md); options and errors as `write`.

        Parameters
        ----------
        idle
            Whether it moves between utterances, too.
        ahead_s
            Seconds of frames that are made, and drawn, before they are read.
        draws
            Whether frames have pictures; senders of curves need none.
        """
        from tts2face.session.live.stream import FaceStream

        picture, options = split_picture(picture, options)
        speech = self.live(fps=fps, **options)
        has_gestures, face = speech.request.has_gestures, self.animated_face(has_gestures=speech.request.has_gestures)
        renderer = partial(self.renderer, picture, has_gestures=has_gestures) if draws else None
        return FaceStream(speech, self.listen, renderer, face.channels, idle=idle, ahead_s=ahead_s)

    def listen(self, rate: int = FEATURE_RATE, *, audio_map: str | None = None) -> "LiveLips":
        """Lip motion of speech that is still being spoken; arguments and errors as `LiveLips`."""
        from tts2face.session.live.lips import LiveLips

        return LiveLips(self._models, rate, audio_map)
