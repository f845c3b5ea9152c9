"""Compiled kernels of gestures: search of similar moments, sampling, and low-pass filters of what is sampled."""

from typing import Any

import numpy as np

from tts2face.numeric.kernels import inlined_kernel, kernel

# Default factor by which distances of moments found may exceed the best ones (Ju and Lee 2008 use ANN).
# of bounds of distances: nearly the nearest moments are found, in less time
SEARCH_SLACK = 1.1
MIN_MOMENT_GAP = 10  # default least number of frames between two candidates of one recording


SEARCH_DEPTH = 128  # nodes of the tree that may wait


def search_space(n_candidates: int, n_axes: int) -> tuple[Any, ...]:
    """Arrays of one search: the best moments and their distances, waiting nodes and their bounds, and the query.

    Kernels do not make arrays, which takes the compiler a quarter of a second for each kind.
    """
    best, distance = np.zeros(n_candidates, np.int64), np.zeros(n_candidates)
    return best, distance, np.zeros(SEARCH_DEPTH, np.int64), np.zeros(SEARCH_DEPTH), np.zeros(n_axes, np.float32)


@inlined_kernel
def _clear(best, distance):  # type: ignore[no-untyped-def]
    """Forget the best candidates; assignments of slices take the compiler three seconds."""
    for c in range(len(best)):
        best[c], distance[c] = -1, np.inf


@kernel
def nearest_distances(corpus, tree, axes, history, queries):  # type: ignore[no-untyped-def]
    """Write the distance of each moment from its nearest other moment."""
    values, recorded, _ = corpus
    moments, cost, (best, distance, stack, bounds, query) = queries
    for n in range(len(moments)):
        _clear(best, distance)
        window = (values[moments[n] - history : moments[n]], recorded[moments[n] - history : moments[n]], 0, history)
        _project_window(window, axes, query)
        _search_tree(
            corpus, tree, window, query, (best[:0], best, distance, (MIN_MOMENT_GAP, SEARCH_SLACK), stack, bounds)
        )
        cost[n] = distance[1]


@kernel
def generate_frames(corpus, tree, axes, options, track):  # type: ignore[no-untyped-def]
    """Write the generated frames and their moments.

    The offset after a jump decays as a critically damped spring, so that position and velocity are continuous (Bollo
    2018).
    """
    values, _, starts = corpus
    history, sigma, stride, continuity, stiffness, fade, rule = options
    shown, prosody, moments, offset, recent, moment, n_before, chances, (best, distance, stack, bounds, query) = track
    none = recent[:0]
    for i in range(len(chances)):
        following = moment + 1
        can_continue = moment >= 0 and following < len(values) and starts[following] == starts[moment]
        chosen = following
        if not can_continue or (n_before + i) % stride == 0:
            _clear(best, distance)
            if can_continue:
                cost = continuity * _window_distance(corpus, (shown, prosody, i, history), following, np.inf)
                _insert_moment(following, cost, (starts, none, rule[0]), (best, distance))
            _project_window((shown, prosody, i, history), axes, query)
            _search_tree(
                corpus, tree, (shown, prosody, i, history), query, (recent, best, distance, rule, stack, bounds)
            )
            chosen = _draw_pose(best, distance, sigma, chances[i])
        last = i + history - 1
        for d in range(values.shape[1]):
            if not can_continue or chosen != following:
                offset[0, d] = shown[last, d] - values[chosen - 1, d]
                offset[1, d] = shown[last, d] - shown[last - 1, d] - values[chosen - 1, d] + values[chosen - 2, d]
            pull = offset[1, d] + offset[0, d] * stiffness
            offset[0, d] = (offset[0, d] + pull) * fade
            offset[1, d] = (offset[1, d] - pull * stiffness) * fade
            shown[i + history, d] = values[chosen, d] + offset[0, d]
        if len(recent) and (not can_continue or chosen != following):
            for r in range(1, len(recent)):
                recent[r - 1] = recent[r]
            recent[len(recent) - 1] = chosen
        moment = moments[i] = chosen


@kernel
def low_pass(values, shares, stages):  # type: ignore[no-untyped-def]
    """Replace values (n, k) by those behind stages (s, k) in series, each of which takes a share (n,) of the way."""
    for at in range(len(values)):
        for d in range(values.shape[1]):
            passed = values[at, d]
            for number in range(len(stages)):
                stages[number, d] += shares[at] * (passed - stages[number, d])
                passed = stages[number, d]
            values[at, d] = passed


@kernel
def _draw_pose(best, distance, sigma, chance):  # type: ignore[no-untyped-def]
    """Sample one of the candidates by a uniform random number."""
    total = 0.0
    for c in range(len(best)):
        if best[c] >= 0:
            total += np.exp((distance[0] - distance[c]) / sigma)
    left, chosen = chance * total, best[0]
    for c in range(len(best)):
        if best[c] >= 0:
            chosen = best[c]
            left -= np.exp((distance[0] - distance[c]) / sigma)
            if left < 0.0:
                break
    return chosen


@kernel
def _insert_moment(moment, cost, known, found):  # type: ignore[no-untyped-def]
    """Insert a moment into the best ones if it is nearer than those within `apart` frames and not a recent target."""
    starts, recent, apart = known
    best, distance = found
    at = len(best) - 1
    if cost >= distance[at]:
        return
    for r in range(len(recent)):
        if abs(recent[r] - moment) < MIN_MOMENT_GAP:
            return
    for c in range(len(best)):
        if best[c] >= 0 and starts[best[c]] == starts[moment] and abs(best[c] - moment) < apart:
            if cost >= distance[c]:
                return
            at = c
            break
    while at > 0 and distance[at - 1] > cost:
        best[at], distance[at] = best[at - 1], distance[at - 1]
        at -= 1
    best[at], distance[at] = moment, cost


@kernel
def _window_distance(corpus, window, moment, limit):  # type: ignore[no-untyped-def]
    """Mean squared distance between a window and that before a moment; stops early above `limit`."""
    values, recorded, _ = corpus
    shown, prosody, i, history = window
    total, most = 0.0, limit * history
    for j in range(history):
        row, there = i + history - 1 - j, moment - 1 - j
        for d in range(values.shape[1]):
            gap = shown[row, d] - values[there, d]
            total += gap * gap
        for e in range(recorded.shape[1]):
            gap = prosody[row, e] - recorded[there, e]
            total += gap * gap
        if total > most:
            break
    return total / history


@kernel
def _project_window(window, axes, query):  # type: ignore[no-untyped-def]
    shown, prosody, i, history = window
    n_prosody, n_shown = prosody.shape[1], shown.shape[1]
    for p in range(len(axes)):
        total = 0.0
        for j in range(history):
            for e in range(n_prosody):
                total += axes[p, j * n_prosody + e] * prosody[i + j, e]
            for d in range(n_shown):
                total += axes[p, history * n_prosody + j * n_shown + d] * shown[i + j, d]
        query[p] = total


@kernel
def _search_tree(corpus, tree, window, query, found):  # type: ignore[no-untyped-def]
    """Search the tree for the best moments; the nearer child of each node first.

    Since the axes are orthonormal, projected distances are lower bounds of the distances between windows.
    """
    places, order, spans, axes, cuts = tree
    recent, best, distance, (apart, error), stack, bounds = found
    history = window[3]
    slack = error * error / history
    height = 1
    stack[0], bounds[0] = 0, 0.0
    while height > 0:
        height -= 1
        node, bound = stack[height], bounds[height]
        while bound * slack < distance[-1] and axes[node] >= 0:
            side = query[axes[node]] - cuts[node]
            near = 2 * node + 2 if side > 0 else 2 * node + 1
            stack[height], bounds[height] = 4 * node + 3 - near, max(bound, side * side)
            height += 1
            node = near
        if bound * slack >= distance[-1]:
            continue
        for at in range(spans[node, 0], spans[node, 1]):
            squared = 0.0
            for p in range(len(query)):
                squared += (query[p] - places[at, p]) ** 2
            if squared < distance[-1] * history:
                moment = np.int64(order[at])
                cost = _window_distance(corpus, window, moment, distance[-1])
                _insert_moment(moment, cost, (corpus[2], recent, apart), (best, distance))
