"""Dynamic time warping of trajectories."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import InputError
from tts2face.compilation import inlined_kernel, kernel

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


def warp_path(cost: NDArray[np.floating], *, band: int | None = None) -> IntArray:
    """Cheapest monotone path through a cost matrix.

    Parameters
    ----------
    cost : (N, M)
        ``cost[i, j]`` is the distance of source frame i from target frame j; finite, not negative.
    band
        Where given, ``|i - j|`` is at most this many frames (Sakoe and Chiba's adjustment window).

    Returns
    -------
    (L, 2)
        Frame pairs from (0, 0) to (N - 1, M - 1), neither index falling.

    Raises
    ------
    InputError
        `cost` is empty, negative or not finite, or the band does not reach the last pair.

    Notes
    -----
    Symmetric steps without slope limit; of equally cheap steps the diagonal one is taken, then the one along the
    source. O(N M) time and memory. Source: Sakoe and Chiba 1978.
    """
    costs = np.ascontiguousarray(cost, dtype=np.float64)
    if costs.ndim != 2 or costs.size == 0:
        raise InputError(f"a warp path needs a cost matrix with frames on both sides, not shape {costs.shape}")
    if not np.isfinite(costs).all() or (costs < 0).any():
        raise InputError("warping costs must be finite and not negative")
    width = max(costs.shape) if band is None else band
    if abs(costs.shape[0] - costs.shape[1]) > width:
        raise InputError(f"a band of {band} frames cannot join {costs.shape[0]} frames to {costs.shape[1]}; widen it")
    space = path_space(*costs.shape)
    path = space[2]
    return np.asarray(path[len(path) - _cheapest_path(costs, width, space) :])


def path_cost(cost: NDArray[np.floating], path: IntArray) -> float:
    """Sum of the costs along a path."""
    return float(cost[path[:, 0], path[:, 1]].sum())


def frame_distances(source: NDArray[np.floating], target: NDArray[np.floating]) -> FloatArray:
    """(N, M) Euclidean distances of (N, D) source frames from (M, D) target frames."""
    apart = source[:, None, :].astype(np.float64) - target[None, :, :]
    return np.asarray(np.sqrt(np.square(apart).sum(-1)))


def path_space(n: int, m: int) -> tuple[NDArray[Any], ...]:
    """Arrays of the search for a path: costs of paths (n, m), their last steps, and the path (n + m - 1, 2)."""
    return np.zeros((n, m)), np.zeros((n, m), np.int8), np.zeros((n + m - 1, 2), np.int64)


def warp_space(n: int) -> tuple[Any, ...]:
    """Arrays of `warp_to_reference` for n samples: distances (n, n), sums and counts (2, n), and `path_space`."""
    return np.zeros((n, n)), np.zeros((2, n)), path_space(n, n)


@inlined_kernel
def _forget(total):  # type: ignore[no-untyped-def]
    for i in range(total.shape[0]):
        for j in range(total.shape[1]):
            total[i, j] = np.inf


@kernel
def _cheapest_path(cost, band, space):  # type: ignore[no-untyped-def]
    """Write the path at the end of the third array of `path_space`; returns its length."""
    n, m = cost.shape
    total, came, path = space  # steps: 0 diagonal, 1 along the source, 2 along the target
    _forget(total)
    for i in range(n):
        for j in range(max(0, i - band), min(m, i + band + 1)):
            if i == 0 and j == 0:
                total[0, 0] = cost[0, 0]
                continue
            step = 0
            best = np.inf
            if i > 0 and j > 0:
                best = total[i - 1, j - 1]
            if i > 0 and total[i - 1, j] < best:
                best, step = total[i - 1, j], 1
            if j > 0 and total[i, j - 1] < best:
                best, step = total[i, j - 1], 2
            total[i, j] = best + cost[i, j]
            came[i, j] = step
    i, j, at = n - 1, m - 1, n + m - 2
    path[at, 0], path[at, 1] = i, j
    while i > 0 or j > 0:
        step = came[i, j]
        i -= step != 2
        j -= step != 1
        at -= 1
        path[at, 0], path[at, 1] = i, j
    return n + m - 1 - at


@kernel
def warp_to_reference(source, reference, scale, band, out, space):  # type: ignore[no-untyped-def]
    """Write (S, D) source into `out`, resampled so that its events coincide with those of an (S, D) reference.

    `scale` (D,) converts the arrays from millimetres to their units; frames are compared in millimetres. The path
    is limited to `band` samples. `space` is that of `warp_space`.
    """
    n, n_dims = source.shape
    cost, (total, count), paths = space
    path = paths[2]
    for i in range(n):
        total[i] = count[i] = 0.0
        for j in range(max(0, i - band), min(n, i + band + 1)):
            cost[i, j] = 0.0
            for k in range(n_dims):
                cost[i, j] += ((source[i, k] - reference[j, k]) / scale[k]) ** 2
    length = _cheapest_path(cost, band, paths)
    for at in range(len(path) - length, len(path)):
        total[path[at, 1]] += path[at, 0]
        count[path[at, 1]] += 1.0
    for j in range(n):
        time = total[j] / count[j] if 0 < j < n - 1 else float(j)
        low = min(int(time), n - 2)
        part = time - low
        for k in range(n_dims):
            out[j, k] = (1.0 - part) * source[low, k] + part * source[low + 1, k]
