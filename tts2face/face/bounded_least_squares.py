"""Least squares within limits, one small problem a frame, all with the same matrix."""

import math

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError
from tts2face.compilation import kernel

FloatArray = NDArray[np.float64]

MAX_ROUNDS = 10_000  # of pivoting; a frame of speech takes about four
MAX_STALLED_ROUNDS = 3  # rounds without progress before shapes are moved one at a time
BOUND_TOLERANCE = 1e-12  # a weight further outside its limit than this is outside
SLOPE_TOLERANCE = 1e-9  # of the mean curvature: a slope that pulls a weight off its limit


def bounded_least_squares(curvature: FloatArray, linear: FloatArray, limits: FloatArray) -> FloatArray:
    """(T, k) minimisers of ``w' H w / 2 - f' w`` within limits, one for each row f of `linear`.

    Parameters
    ----------
    curvature : (k, k)
        H, symmetric and positive definite: the answer is unique.
    linear : (T, k)
    limits : (k, 2)

    Raises
    ------
    DataError
        There is no unique answer: H is not positive definite, or a number is not finite.

    Notes
    -----
    Block principal pivoting, exact up to rounding: a few small Cholesky factorisations a frame, O(T k^3). Source:
    Judice and Pires 1994, "A block principal pivoting algorithm for large-scale strictly monotone linear
    complementarity problems"; after rounds without progress its single pivots, which are sure to end.
    """
    low, high = np.ascontiguousarray(limits[:, 0]), np.ascontiguousarray(limits[:, 1])
    solved: FloatArray = np.zeros(linear.shape)
    slack = SLOPE_TOLERANCE * float(np.trace(curvature)) / len(curvature)
    bounds = (low, high, slack)
    try:
        rounds = _solve_all(np.ascontiguousarray(curvature), np.ascontiguousarray(linear), bounds, solved)
    except ZeroDivisionError:  # a pivot of the factor is 0
        rounds = MAX_ROUNDS
    if rounds >= MAX_ROUNDS or not np.isfinite(solved).all():
        raise DataError("the face's shapes cannot be told apart, so their weights are not unique; build the face again")
    return solved


@kernel
def _solve_all(curvature, linear, bounds, weights):  # type: ignore[no-untyped-def]
    """Write the minimisers; returns the most rounds that a frame took. Plain loops: they compile in a second."""
    low, high, _ = bounds
    n_frames, k = linear.shape
    state, belongs = np.zeros(k, np.int8), np.zeros(k, np.int8)  # -1 at the lower limit, 0 free, 1 at the upper limit
    room = np.zeros((k + 1, k))  # the factor, and below it the right side
    free = np.zeros(k, np.int64)
    longest = 0
    for t in range(n_frames):
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
            _solve_free(curvature, linear[t], free[:n_free], room, weights[t])
            n_wrong = _classify_weights(curvature, linear[t], bounds, weights[t], (state, belongs))
            if n_wrong == 0:
                break
            patience = MAX_STALLED_ROUNDS if n_wrong < fewest else patience - 1
            fewest = min(fewest, n_wrong)
            _pivot_states(state, belongs, patience < 0)
        longest = max(longest, rounds)
        if rounds >= MAX_ROUNDS:  # no answer: the other frames have none either
            break
    return longest


@kernel
def _pivot_states(state, belongs, only_last):  # type: ignore[no-untyped-def]
    """Put weights where they belong: all of them, or only the last that is elsewhere."""
    for i in range(len(state) - 1, -1, -1):
        if state[i] != belongs[i]:
            state[i] = belongs[i]
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
    """Write where each weight belongs, as things stand; returns how many are elsewhere."""
    low, high, slack = bounds
    state, belongs = states
    n_wrong = 0
    for i in range(len(weights)):
        if state[i] == 0:
            belongs[i] = (weights[i] > high[i] + BOUND_TOLERANCE) - (weights[i] < low[i] - BOUND_TOLERANCE)
        else:
            slope = _dot(curvature[i], weights) - linear[i]
            belongs[i] = 0 if low[i] < high[i] and state[i] * slope > slack else state[i]
        n_wrong += belongs[i] != state[i]
    return n_wrong


@kernel
def _solve_free(curvature, linear, free, room, weights):  # type: ignore[no-untyped-def]
    """Write the weights that solve the rows `free`, the others staying: Cholesky and two substitutions."""
    n = len(free)
    right = room[-1]
    for a in range(n):
        right[a] = linear[free[a]] - _dot(curvature[free[a]], weights)  # free weights are still 0
    for a in range(n):
        for b in range(a + 1):
            total = curvature[free[a], free[b]]
            for c in range(b):
                total -= room[a, c] * room[b, c]
            room[a, b] = math.sqrt(total) if a == b else total / room[b, b]
        for c in range(a):
            right[a] -= room[a, c] * right[c]
        right[a] /= room[a, a]
    for a in range(n - 1, -1, -1):
        for b in range(a + 1, n):
            right[a] -= room[b, a] * right[b]
        right[a] /= room[a, a]
        weights[free[a]] = right[a]
