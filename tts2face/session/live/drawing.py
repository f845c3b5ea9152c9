"""Pictures of single poses of a face."""

import numpy as np
from numpy.typing import NDArray

from tts2face.numeric.arrays import Float32Array
from tts2face.picture.frame_renderer import FrameRenderer
from tts2face.types import HEAD_CHANNELS, Clip, Speech, Trajectory, Waveform

SILENCE = Speech.without_phones(Waveform(np.zeros(1, np.float32), 1_000_000))  # of one frame at any rate


class PoseDrawer:
    """Draws frames of a live face one by one.

    Parameters
    ----------
    channels : (K,)
        Names of the weights.
    """

    def __init__(self, renderer: FrameRenderer, channels: tuple[str, ...], fps: float) -> None:
        self._renderer = renderer
        self._channels, self._fps = channels, fps

    def draw(self, weights: Float32Array, head: Float32Array, number: int) -> NDArray[np.uint8]:
        """Picture (H, W, 3 or 4) of weights (K,) and a head pose (6,) in a frame of the stream."""
        motion = Trajectory(self._channels, weights[None], self._fps)
        clip = Clip(motion, Trajectory(HEAD_CHANNELS, head[None], self._fps), SILENCE)
        (pixels,) = self._renderer.frames(clip, threads=1, first=number)
        return pixels

    def prepare(self) -> None:
        """Draw a face at rest: kernels compile with the first picture."""
        self.draw(np.zeros(len(self._channels), np.float32), np.zeros(len(HEAD_CHANNELS), np.float32), 0)
