"""One instant of a live face as targets get it, and its weights as ARKit's."""

from dataclasses import dataclass
from fractions import Fraction
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray

from tts2face.interchange.exports.arkit import ArkitProjection, arkit_projection
from tts2face.interchange.exports.livelink import EYES, eye_angles
from tts2face.numeric.arrays import Float32Array
from tts2face.types import SOUND_RATE

if TYPE_CHECKING:
    from tts2face.models.face import Face


class LiveFrame(Protocol):
    """A frame of a live face, as far as it is sent; `tts2face.session` makes them.

    Attributes
    ----------
    number
        On the clock of the stream: the time of picture and sound is number / fps.
    pixels : (H, W, 3)
        None where the picture before it stays.
    sound : (n,)
        All samples of the frame at `SOUND_RATE`.
    weights, head : (K,), (6,)
        Of the face's channels, and of `tts2face.types.HEAD_CHANNELS`.
    """

    @property
    def number(self) -> int: ...  # noqa: D102 - above
    @property
    def pixels(self) -> NDArray[np.uint8] | None: ...  # noqa: D102
    @property
    def sound(self) -> Float32Array: ...  # noqa: D102
    @property
    def weights(self) -> Float32Array: ...  # noqa: D102
    @property
    def head(self) -> Float32Array: ...  # noqa: D102


@dataclass(frozen=True, slots=True)
class LiveFormat:
    """Frame rate, and width and height of pictures (0 where none are drawn)."""

    fps: Fraction
    width: int = 0
    height: int = 0

    def sample(self, number: int) -> int:
        """First sample of a frame at `SOUND_RATE`."""
        return round(number * SOUND_RATE / self.fps)


@dataclass(frozen=True, slots=True, eq=False)
class Tick:
    """A frame for all targets.

    Parameters
    ----------
    seconds
        On the clock of the stream.
    weights, eyes : (52,), (6,)
        ARKit's, and yaw, pitch and roll of the left and of the right eye; None where no target has curves.
    """

    number: int
    seconds: float
    pixels: NDArray[np.uint8] | None
    sound: Float32Array
    motion: Float32Array
    head: Float32Array
    weights: Float32Array | None = None
    eyes: Float32Array | None = None


class TickMaker:
    """Makes the ticks of frames: weights are projected once for all targets.

    Parameters
    ----------
    channels
        Of the frames' weights.
    face
        Whose shapes they are; None where no target has curves. One without ARKit's is refused (`InputError`).
    """

    def __init__(self, format: LiveFormat, channels: tuple[str, ...], face: "Face | None") -> None:
        self._format = format
        self._projection: ArkitProjection | None = None
        if face is not None:
            self._projection = arkit_projection(channels, face, "a live target with curves")

    def make(self, frame: LiveFrame) -> Tick:
        """The tick of a frame."""
        weights = eyes = None
        if self._projection is not None:
            rows = self._projection.weights(frame.weights[None])
            weights, eyes = rows[0], np.concatenate([eye_angles(rows, side)[0] for side in EYES])
        seconds = float(frame.number / self._format.fps)
        return Tick(
            frame.number, seconds, frame.pixels, frame.sound, frame.weights, frame.head, weights, eyes
        )  # fmt: skip
