"""Bounded least squares: one small problem per frame, all with the same matrix."""

import math

import numpy as np

from lexicon.errors import DataError
from tts2face.numeric.arrays import FloatArray
from tts2face.numeric.kernels import kernel

MAX_ROUNDS = 10_000  # pivoting rounds; a frame of speech takes about four
MAX_STALLED_ROUNDS = 3  # rounds without progress before single pivoting
BOUND_TOLERANCE = 1e-12  # distance beyond a limit that counts as a violation
SLOPE_TOLERANCE = 1e-9  # share of the mean curvature: least slope that frees a weight from its limit


def bounded_least_squares(curvature: FloatArray, linear: FloatArray, limits: FloatArray) -> FloatArray:
    """Minimisers (T, k) of ``w' H w / 2 - f' w`` within limits, one for each row f of `linear`.

    Parameters
    ----------
    curvature : (k, k) or (T, k, k)
        H, symmetric and positive definite, so that the solution is unique; one for all rows, or one for each.
    linear : (T, k)
        Linear terms f.
    limits : (k, 2)
        Lower and upper limit of each weight.

    Raises
    ------
    DataError
        H is not positive definite, or a number is not finite.

    Notes
    -----
    Block principal pivoting, exact up to rounding: a few small Cholesky factorisations per frame, O(T k^3). Source:
    Judice and Pires 1994, "A block principal pivoting algorithm for large-scale strictly monotone linear
    complementarity problems"; rounds without progress switch to single pivots, which terminate.
    """
    low, high = np.ascontiguousarray(limits[:, 0]), np.ascontiguousarray(limits[:, 1])
    solved: FloatArray = np.zeros(linear.shape)
    matrices = np.ascontiguousarray(np.reshape(curvature, (-1, *curvature.shape[-2:])))
    slack = SLOPE_TOLERANCE * float(np.trace(matrices.mean(axis=0))) / curvature.shape[-1]
    bounds = (low, high, slack)
    k = linear.shape[1]
    states = np.zeros(k, np.int8), np.zeros(k, np.int8)
    work = (*states, np.zeros((k + 1, k)), np.zeros(k, np.int64))
    try:
        rounds = _solve_all(matrices, np.ascontiguousarray(linear), bounds, solved, work)
    except ZeroDivisionError:  # a pivot of the factor is 0
        rounds = MAX_ROUNDS
    if rounds >= MAX_ROUNDS or not np.isfinite(solved).all():
        raise DataError(
            "the face's shapes are linearly dependent, so their weights are not unique; build the face again"
        )
    return solved


@kernel
def _solve_all(matrices, linear, bounds, weights, work):  # type: ignore[no-untyped-def]
    """Write the minimisers; returns the largest number of rounds of a frame. Plain loops compile in a second.

    `work` are states (k,) now and wanted, -1 at the lower limit, 0 free, 1 at the upper limit; a Cholesky factor
    (k + 1, k), whose last row is the right-hand side; and numbers (k,) of free weights.
    """
    low, high, _ = bounds
    n_frames, k = linear.shape
    state, target, factor, free = work
    longest = 0
    for t in range(n_frames):
        curvature = matrices[min(t, len(matrices) - 1)]
        for i in range(k):
            state[i] = 0
        fewest, patience, rounds = k + 1, MAX_STALLED_ROUNDS, 0
        while rounds < MAX_ROUNDS:
            rounds += 1
            n_free = 0
            for i in range(k):
                weights[t, i] = low[i] if state[i] < 0 else high[i] if state[i] > 0 else 0.0
                if state[i] == 0:
                    free[n_free] = i
                    n_free += 1
            _solve_free(curvature, linear[t], free[:n_free], factor, weights[t])
            n_differing = _classify_weights(curvature, linear[t], bounds, weights[t], (state, target))
            if n_differing == 0:
                break
            patience = MAX_STALLED_ROUNDS if n_differing < fewest else patience - 1
            fewest = min(fewest, n_differing)
            _pivot_states(state, target, patience < 0)
        longest = max(longest, rounds)
        if rounds >= MAX_ROUNDS:  # not solvable
            break
    return longest


@kernel
def _pivot_states(state, target, only_last):  # type: ignore[no-untyped-def]
    """Set the states to the targets: all of them, or only the last that differs."""
    for i in range(len(state) - 1, -1, -1):
        if state[i] != target[i]:
            state[i] = target[i]
            if only_last:
                return


@kernel
def _dot(a, b):  # type: ignore[no-untyped-def]
    total = 0.0
    for i in range(len(a)):
        total += a[i] * b[i]
    return total


@kernel
def _classify_weights(curvature, linear, bounds, weights, states):  # type: ignore[no-untyped-def]
    """Write the target state of each weight by its sign conditions; returns the number that differ."""
    low, high, slack = bounds
    state, target = states
    n_differing = 0
    for i in range(len(weights)):
        if state[i] == 0:
            target[i] = (weights[i] > high[i] + BOUND_TOLERANCE) - (weights[i] < low[i] - BOUND_TOLERANCE)
        else:
            slope = _dot(curvature[i], weights) - linear[i]
            target[i] = 0 if low[i] < high[i] and state[i] * slope > slack else state[i]
        n_differing += target[i] != state[i]
    return n_differing


@kernel
def _solve_free(curvature, linear, free, factor, weights):  # type: ignore[no-untyped-def]
    """Write the free weights that solve the rows `free`, the others fixed: Cholesky and two substitutions."""
    n = len(free)
    right = factor[-1]
    for a in range(n):
        right[a] = linear[free[a]] - _dot(curvature[free[a]], weights)  # free weights are still 0
    for a in range(n):
        for b in range(a + 1):
            total = curvature[free[a], free[b]]
            for c in range(b):
                total -= factor[a, c] * factor[b, c]
            factor[a, b] = math.sqrt(total) if a == b else total / factor[b, b]
        for c in range(a):
            right[a] -= factor[a, c] * right[c]
        right[a] /= factor[a, a]
    for a in range(n - 1, -1, -1):
        for b in range(a + 1, n):
            right[a] -= factor[b, a] * right[b]
        right[a] /= factor[a, a]
        weights[free[a]] = right[a]
