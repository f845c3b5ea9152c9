"""A live face as frameworks of voice agents take one: 16-bit sound in, a picture and its sound each tick out."""

import logging
from collections.abc import AsyncIterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from lexicon.errors import InputError, Tts2faceError
from tts2face.picture.options import parse_size
from tts2face.storage.wave_files import pcm_bytes, pcm_samples

if TYPE_CHECKING:
    from tts2face.session.live.frames import Frame
    from tts2face.session.session import Session

LOG = logging.getLogger("tts2face.agents")
SAMPLE_BYTES = 2
FORMATS = {3: "RGB", 4: "RGBA"}  # by the bytes of a pixel


@dataclass(frozen=True, slots=True)
class Tick:
    """A tick of an agent's face.

    Parameters
    ----------
    picture
        Rows of pixels as `format` says; that of the tick before where this one came too late, None before the first.
    sound
        16-bit samples, one channel at `tts2face.types.SOUND_RATE`; None in silence: frameworks count sound as speech.
    utterance
        Number that `AgentFace.push` returned; 0 in silence.
    ends
        Whether it is the last tick of its utterance.
    epoch
        Number of interruptions before it.
    """

    picture: bytes | None
    format: str
    sound: bytes | None
    utterance: int
    ends: bool
    epoch: int


class AgentFace:
    """A face stream of a session, on a clock of its own: the queues of the frameworks have no end, or a long one.

    Parameters
    ----------
    size, fps, options
        As for `tts2face.Session.face_stream`; `size` as in `tts2face.Picture`.

    Attributes
    ----------
    stream
        The `FaceStream`, for gestures, styles and listening.
    width, height
        Of the pictures.
    """

    def __init__(self, session: "Session", size: str, fps: float, options: dict[str, Any]) -> None:
        self.width, self.height = parse_size(size)
        self.fps = fps
        self.stream = session.face_stream(size=size, fps=fps, **options)
        self._epoch = 0
        self._is_open = False  # whether more of the last utterance is to come
        self._picture: tuple[bytes | None, str] = (None, "RGB")

    def push(self, samples: bytes, rate: int, n_channels: int) -> int:
        """Speak more of a sound until `end`; returns the number of its utterance.

        Parameters
        ----------
        samples
            16 bit, little-endian, channels interleaved.
        """
        if n_channels < 1 or len(samples) % (SAMPLE_BYTES * n_channels):
            raise InputError(
                f"a block of {len(samples)} bytes does not hold whole 16-bit samples of {n_channels} channels"
            )
        rows = pcm_samples(samples).reshape(-1, n_channels)
        number = self.stream.push_sound(rows.mean(axis=1), rate)
        self._is_open = True
        return number

    def push_text(self, part: str) -> int:
        """Speak more of a text, as it is written, until `end`; returns the number of its utterance."""
        number = self.stream.push_text(part)
        self._is_open = True
        return number

    def end(self) -> None:
        """The sound, or the text, that was pushed is complete."""
        if self._is_open:
            self._is_open = False
            self.stream.end_sound()
            self.stream.end_text()

    def interrupt(self) -> float:
        """Forget what is spoken and what waits; returns the seconds of it that were read."""
        self._epoch += 1
        self._is_open = False
        return self.stream.interrupt()

    def is_current(self, tick: Tick) -> bool:
        """Whether there has been no interruption since a tick was made: the rest of an old one must not be sent."""
        return tick.epoch == self._epoch

    async def ticks(self) -> AsyncIterator[Tick]:
        """Ticks on a steady clock until the face is closed; what cannot be spoken is logged, and the rest follows."""
        frames, last = aiter(self.stream), None
        while True:
            try:
                frame = await anext(frames)
            except StopAsyncIteration:
                return
            except Tts2faceError as error:
                if error is last:  # a failure of the stream itself is raised each time
                    raise
                LOG.warning("%s", error)
                frames, last = aiter(self.stream), error
            else:
                yield self._tick(frame)

    def close(self) -> None:
        """End the stream and its threads."""
        self.stream.close()

    def _tick(self, frame: "Frame") -> Tick:
        if frame.pixels is not None:
            height, width, depth = frame.pixels.shape
            # frameworks trust the length: LiveKit reads beyond a shorter buffer
            if (width, height) != (self.width, self.height):
                raise InputError(
                    f"the pictures have {width}x{height} pixels, not {self.width}x{self.height}; give this size"
                )
            self._picture = frame.pixels.tobytes(), FORMATS[depth]
        sound = None
        if frame.utterance:
            sound = pcm_bytes(frame.sound.clip(-1.0, 1.0))
        return Tick(*self._picture, sound, frame.utterance, frame.ends, self._epoch)
