"""Frames of a clip in temporary files, for formats that are written when the number of frames is known."""

import numpy as np

from tts2face.interchange.exports.parts import Part
from tts2face.storage.spool import Spool
from tts2face.types import HEAD_CHANNELS, Trajectory


class SpooledFrames:
    """Motion and head of all parts, and where the sound ends."""

    def __init__(self, channels: tuple[str, ...]) -> None:
        self._channels = channels
        self._motion, self._head = Spool(len(channels)), Spool(len(HEAD_CHANNELS))
        self.end_s = 0.0

    @property
    def n_frames(self) -> int:
        """Number of frames that were added."""
        return self._motion.n_rows

    def add(self, part: Part) -> None:
        """Append frames."""
        self.end_s = max(self.end_s, part.end)
        self._motion.add(part.motion)
        self._head.add(part.head)

    def trajectories(self, fps: float) -> tuple[Trajectory, Trajectory]:
        """Motion and head of all frames."""
        motion = Trajectory(self._channels, np.array(self._motion.rows(), np.float32), fps)
        return motion, Trajectory(HEAD_CHANNELS, np.array(self._head.rows(), np.float32), fps)

    def close(self) -> None:
        """Remove the temporary files."""
        self._motion.close()
        self._head.close()
