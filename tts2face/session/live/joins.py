"""Joins between motion of two sources, and after an interruption: nothing jumps."""

from dataclasses import replace

import numpy as np

from tts2face.numeric.arrays import Float32Array, FloatArray
from tts2face.session.live.blocks import Block
from tts2face.types import HEAD_CHANNELS

HEAD_JOIN_S = 0.5  # in which a difference between two head poses is gone: heads turn by 10 degrees in less
FACE_JOIN_S = 0.15  # in which the pose of the face before a join is left: an open mouth closes so fast
LEAST_STEP = 1e-4  # of weights and radians; a smaller difference is none


class Joins:
    """Frames of one face from several sources.

    Weights fade from the last frame before a join within `FACE_JOIN_S`; the head begins as far from the new motion as
    the last pose is, which vanishes within `HEAD_JOIN_S`.

    Attributes
    ----------
    last
        Weights (K,) and head pose (6,) of the last frame; None before the first one.
    """

    def __init__(self, fps: float) -> None:
        self._fps = fps
        self.last: tuple[Float32Array, Float32Array] | None = None
        self._source: str | None = None
        self._from: Float32Array | None = None  # (K,) weights before the join
        self._turned = np.zeros(len(HEAD_CHANNELS), np.float32)  # head pose before the join, less that behind it
        self._n_joined = 0

    def cut(self, last: tuple[Float32Array, Float32Array] | None = None) -> None:
        """The next frames do not follow those before them, of which `last` was shown; None: the last of all."""
        self._source = None
        self.last = self.last if last is None else last

    def add(self, block: Block) -> Block:
        """The next frames; the same block where nothing is joined."""
        weights, head = block.motion.values, block.head.values
        restarts = block.idle is not None and block.idle[1].start == 0
        if (restarts or block.source != self._source) and self.last is not None:
            self._begin(weights[0], head[0])
        self._source = block.source
        if self._from is not None:
            numbers = self._n_joined + np.arange(1.0, len(weights) + 1.0)
            self._n_joined += len(weights)
            weights = weights + _left(numbers, FACE_JOIN_S * self._fps)[:, None] * (self._from - weights)
            head = head + _left(numbers, HEAD_JOIN_S * self._fps)[:, None] * self._turned
            self._from = self._from if self._n_joined < HEAD_JOIN_S * self._fps else None
        self.last = weights[-1], head[-1]
        if weights is block.motion.values:
            return block
        return replace(
            block, motion=replace(block.motion, values=weights), head=replace(block.head, values=head), idle=None
        )

    def _begin(self, weights: Float32Array, head: Float32Array) -> None:
        assert self.last is not None
        self._from, self._n_joined = self.last[0], 0
        self._turned = self.last[1] - head
        if max(np.abs(self._from - weights).max(initial=0.0), np.abs(self._turned).max()) <= LEAST_STEP:
            self._from = None


def _left(numbers: FloatArray, n_frames: float) -> Float32Array:
    """(T,) shares of the pose before a join at T frames after it."""
    at = np.minimum(numbers / (n_frames + 1.0), 1.0)
    return (1.0 - at * at * (3.0 - 2.0 * at)).astype(np.float32)
