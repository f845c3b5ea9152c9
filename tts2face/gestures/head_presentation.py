"""Presented head motion: the slow part of the recorded motion, scaled to what viewers see, and that of sentences."""

from copy import copy

import numpy as np
from numpy.typing import NDArray

from tts2face.gestures.phrase_motion import PhraseMotion
from tts2face.gestures.presentation import MAX_SCALE, FrameContext, LowPass, PhraseFollower, slow_spread
from tts2face.models.palette import GESTURE_FPS, Style
from tts2face.numeric.arrays import Float32Array, FloatArray
from tts2face.types import HEAD_CHANNELS

SLOW_HZ = 0.7  # cut-off of the part that is scaled: turns and tilts that last a phrase
RETURN_HZ = 0.12  # cut-off of what is subtracted, so that the head drifts back to the viewer within some 10 s
# Standard deviation in radians to which the slow part is scaled, and the largest angle of it. Speakers who look at a
# listener move by 2 to 5 degrees (yaw) about the direction to the listener.
TARGET_SPREAD = {"pitch": np.radians(1.2), "yaw": np.radians(2.8), "roll": np.radians(1.2)}
LARGEST_RATIO = 2.6  # of the slow part, in units of its target spread; approached smoothly
STILL_S, LISTENING_MOTION = 1.0, 0.4  # listeners turn the head far less than speakers (Hadar et al. 1983)
ONSET_S = 0.3  # transition from and to recorded styles
LOWEST_RAD = np.radians(5.0)  # to which slow part and sentences together turn the head up or down, approached smoothly


class Glide:
    """Share of a state that begins and ends within some seconds; at first at once."""

    def __init__(self, seconds: float) -> None:
        self._change, self._share = 1.0 / (seconds * GESTURE_FPS), -1.0

    def next(self, holds: NDArray[np.bool_]) -> FloatArray:
        """(n,) shares at the next frames, in which the state holds or not."""
        shares = np.zeros(len(holds))
        for at, target in enumerate(holds.astype(np.float64).tolist()):
            change = self._change if self._share >= 0.0 else 2.0
            self._share = min(max(target, self._share - change), self._share + change)
            shares[at] = self._share
        return shares


def slow_scales(style: Style) -> FloatArray:
    """(6,) factors by which the slow part of a style's recorded head motion reaches `TARGET_SPREAD`; 1 or more."""
    targets = np.array([TARGET_SPREAD.get(channel, 0.0) for channel in HEAD_CHANNELS])
    return np.clip(targets / np.maximum(slow_spread(style.motion["head"], SLOW_HZ), 1e-9), 1.0, MAX_SCALE)


class HeadPresentation:
    """Head motion of derived styles: the slow part of the sampled motion turns between phrases; sentences are followed.

    Parameters
    ----------
    middle, scales : (6,)
        Median of the recordings, and factors of the slow part (`slow_scales`).
    motion
        Movements of sentences and words.
    """

    def __init__(self, middle: Float32Array, scales: FloatArray, motion: PhraseMotion) -> None:
        self._middle, self._scales = middle.astype(np.float64), scales
        self._motion = motion
        self._slow, self._lasting = (LowPass(cutoff, np.zeros(len(scales))) for cutoff in (SLOW_HZ, RETURN_HZ))
        self._limits = np.array([LARGEST_RATIO * TARGET_SPREAD.get(channel, 1e9) for channel in HEAD_CHANNELS])
        self._presented, self._still = Glide(ONSET_S), Glide(STILL_S)
        self._follower = PhraseFollower(len(scales))

    def copy(self) -> "HeadPresentation":
        """A presentation that continues as this one, independently of it."""
        new = copy(self)
        new._motion, new._follower = self._motion.copy(), self._follower.copy()
        new._slow, new._lasting = self._slow.copy(), self._lasting.copy()
        new._presented, new._still = copy(self._presented), copy(self._still)
        return new

    def apply(self, values: Float32Array, frames: FrameContext) -> Float32Array:
        """Head poses (n, 6) with the slow part scaled and the movements of sentences."""
        slow = self._slow.filter(values.astype(np.float64) - self._middle)
        slow = slow - self._lasting.filter(slow)
        scaled = self._follower.follow(self._limits * np.tanh(slow * (self._scales - 1.0) / self._limits), frames)
        scaled *= 1.0 - (1.0 - LISTENING_MOTION) * self._still.next(frames.is_listening)[:, None]
        self._motion.add(frames.plan, float(frames.times[0]))
        scaled[:, :3] += np.radians(self._motion.at(frames.times)[:, :3])
        # where the chin is down already, the end of a sentence takes it little farther
        scaled[:, 0] = LOWEST_RAD * np.tanh(scaled[:, 0] / LOWEST_RAD)
        return np.asarray(values + self._presented.next(frames.is_presented)[:, None] * scaled, np.float32)
