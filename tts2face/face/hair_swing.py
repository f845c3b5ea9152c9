"""Hair that lags behind the head: a damped spring about each axis of the head's rotation.

A face has it if it has the shapes `SWING_SHAPES`; their weights are the angles in radians by which the loose ends lag.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from tts2face.models.lit_hair import SWING_SHAPES
from tts2face.numeric.arrays import FloatArray
from tts2face.types import Trajectory

FREQUENCY_HZ, DAMPING = 1.9, 0.32  # of loose ends: they come to rest in about half a second
LIMIT_RAD = 0.15  # of a lag, towards which larger ones bend


@dataclass(frozen=True, slots=True, eq=False)
class Swing:
    """Hair after a frame: angles (3,) and their rates (3,) of the head, and the state (2, 3) of the springs."""

    angles: FloatArray
    rates: FloatArray
    springs: FloatArray


@dataclass(frozen=True, slots=True)
class HairSwing:
    """Columns of the swinging shapes among the channels of a face."""

    columns: tuple[int, ...]

    @classmethod
    def of_channels(cls, channels: Sequence[str]) -> "HairSwing | None":
        """None for a face whose hair does not swing."""
        found = [channels.index(name) for name in SWING_SHAPES if name in channels]
        return cls(tuple(found)) if len(found) == len(SWING_SHAPES) else None

    def apply(self, face: Trajectory, head: Trajectory, before: Swing | None) -> tuple[Trajectory, Swing]:
        """Motion (T, K) with hair that follows a head (T, 6), after `before`; None begins at rest.

        The spring is solved exactly between frames, at which the head's rate jumps.
        """
        angles = head.values[:, :3].astype(np.float64)
        if before is None:
            # at the first frame hair hangs at rest
            before = Swing(angles[0], np.zeros(3), np.zeros((2, 3)))
        rates = np.diff(angles, axis=0, prepend=before.angles[None]) * head.fps
        pushes = -np.diff(rates, axis=0, prepend=before.rates[None])
        angular, step = 2 * math.pi * FREQUENCY_HZ, 1.0 / head.fps
        damped = angular * math.sqrt(1 - DAMPING**2)
        decay = math.exp(-DAMPING * angular * step)
        gain = decay * math.sin(damped * step) / damped
        turn = 2 * decay * math.cos(damped * step)
        lags = np.empty_like(pushes)
        now, later = before.springs
        for lag, push in zip(lags, pushes, strict=True):  # a recursion of two poles; scipy.signal takes long to import
            lag[:] = gain * push + now
            now, later = turn * lag + later, -(decay**2) * lag
        springs = np.stack([now, later])
        weights = face.values.copy()
        weights[:, self.columns] += (LIMIT_RAD * np.tanh(lags / LIMIT_RAD)).astype(weights.dtype)
        return replace(face, values=weights), Swing(angles[-1], rates[-1], springs)
