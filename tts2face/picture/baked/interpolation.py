"""Interpolation of baked light between turns of the head and between cameras."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tts2face.numeric.arrays import Float32Array, FloatArray

TURN_SCALE_DEG = (10.0, 8.0)  # of yaw and pitch in the distance between turns
TURN_LIMIT_DEG = (23.0, 14.0)  # beyond the baked turns light stays
# of the distance between cameras
CAMERA_SCALE_DEG = 15.0


@dataclass(frozen=True, slots=True, eq=False)
class Cardinal:
    """Interpolation between nodes, the first of which is at rest: weights that are 1 at their node and 0 at others.

    Multiquadrics with a linear part; quadratics in yaw and pitch left one to two of 255 more of error. Source: Hardy
    1971.
    """

    nodes: FloatArray
    scale: FloatArray
    limit: FloatArray
    inverse: FloatArray

    @classmethod
    def between(cls, nodes: NDArray[np.floating], scale: Sequence[float], limit: Sequence[float]) -> "Cardinal":
        """Interpolation between rest and nodes (N, D), which are scaled and bounded in each dimension."""
        sizes = np.array(scale, np.float64)
        every = np.vstack([np.zeros((1, len(scale))), np.asarray(nodes, np.float64)]) / sizes
        linear = np.column_stack([np.ones(len(every)), every])
        corner = np.zeros((linear.shape[1], linear.shape[1]))
        system = np.block([[_multiquadric(every, every), linear], [linear.T, corner]])
        return cls(every, sizes, np.array(limit, np.float64), np.linalg.pinv(system))

    def at(self, place: NDArray[np.floating]) -> Float32Array:
        """(N,) weights of the nodes without that at rest, for a place (D,)."""
        inside = np.clip(np.asarray(place, np.float64), -self.limit, self.limit) / self.scale
        row = np.concatenate([_multiquadric(inside[None], self.nodes)[0], [1.0], inside])
        weights: Float32Array = (row @ self.inverse)[1 : len(self.nodes)].astype(np.float32)
        return weights


def _multiquadric(a: FloatArray, b: FloatArray) -> FloatArray:
    squared = ((a[:, None] - b[None]) ** 2).sum(axis=2)
    root: FloatArray = np.sqrt(squared + 0.25)
    return root


def turn_weights(turns_deg: NDArray[np.floating]) -> Cardinal:
    """Interpolation between turns of the head (T, 2), yaw and pitch."""
    return Cardinal.between(turns_deg, TURN_SCALE_DEG, TURN_LIMIT_DEG)


def camera_weights(yaws_deg: NDArray[np.floating]) -> Cardinal:
    """Interpolation between cameras (Y,)."""
    most = float(np.abs(yaws_deg).max(initial=1.0))
    return Cardinal.between(np.asarray(yaws_deg)[:, None], (CAMERA_SCALE_DEG,), (most,))


def yaw_and_pitch_deg(head: NDArray[np.floating]) -> FloatArray:
    """(2,) of a head pose (6,)."""
    return np.degrees(np.asarray(head, np.float64)[[1, 0]])
