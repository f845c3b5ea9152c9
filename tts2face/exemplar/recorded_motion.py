"""Interpolation of recorded motion at any time."""

import numpy as np
from numpy.typing import NDArray

from tts2face.compilation import kernel

Float32Array = NDArray[np.float32]


@kernel
def read_motion(frames: Float32Array, first: int, last: int, at: float, out: Float32Array) -> None:
    """Write into `out` (D,) the value of rows [first, last) at frame position `at`, counted from `first`.

    Catmull-Rom cubic through the frames (Catmull and Rom 1974): it passes through each of them and, unlike linear
    interpolation, preserves extrema between frames. Constant beyond the ends.
    """
    n = last - first
    at = min(max(at, 0.0), n - 1.0)
    i = min(int(at), max(n - 2, 0))
    u = at - i
    a, b = first + max(i - 1, 0), first + i
    c, d = first + min(i + 1, n - 1), first + min(i + 2, n - 1)
    wa = u * (-0.5 + u * (1.0 - 0.5 * u))
    wb = 1.0 + u * u * (-2.5 + 1.5 * u)
    wc = u * (0.5 + u * (2.0 - 1.5 * u))
    wd = u * u * (-0.5 + 0.5 * u)
    for k in range(frames.shape[1]):
        out[k] = wa * frames[a, k] + wb * frames[b, k] + wc * frames[c, k] + wd * frames[d, k]


@kernel
def sample_tokens(
    frames: Float32Array, bounds: NDArray[np.int64], positions: NDArray[np.float64]
) -> NDArray[np.float32]:
    """(N, S, D) recorded motion of N tokens at S frame positions each.

    Parameters
    ----------
    frames : (F, D)
    bounds : (N, 2)
        First row of the token's utterance and the row behind its last.
    positions : (N, S)
        Frames from the utterance's first.
    """
    out = np.zeros((positions.shape[0], positions.shape[1], frames.shape[1]), np.float32)
    for n in range(positions.shape[0]):
        for s in range(positions.shape[1]):
            read_motion(frames, bounds[n, 0], bounds[n, 1], positions[n, s], out[n, s])
    return out
