"""Markov random fields over recorded gestures (Ju and Lee 2008, section 5.1).

The next frame is sampled from the recorded frames ("moments") whose preceding motion and sound are most similar to the
frames just generated; the probability of each candidate decreases with its distance.
"""

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError, InputError
from lexicon.values.fields import check_fields
from tts2face.gestures.field_kernels import (
    MIN_MOMENT_GAP,
    SEARCH_SLACK,
    generate_frames,
    nearest_distances,
    search_space,
)
from tts2face.models.palette import GESTURE_FPS
from tts2face.numeric.arrays import Float32Array, principal_axes
from tts2face.numeric.kd_tree import KdTree, build_tree, count_nodes
from tts2face.storage.array_cache import computed_once, holds

N_SEARCH_AXES = 8  # principal axes of the windows in which the search tree is built
AXES_STRIDE = 8  # the axes are computed from every eighth window; all windows give the same axes
CACHE_KIND, CACHE_VERSION = "field", 2  # raised when the index of the same recordings changes
MIN_CACHED_MOMENTS = 5000  # fewer are indexed as fast as a file is read
TREE_ARRAYS = tuple(field.name for field in fields(KdTree))
LEAST_SPREAD = 1e-6  # of a feature of sound that is compared
N_DISTANCE_SAMPLES = 200  # moments from which the median nearest distance is estimated


@dataclass(frozen=True, slots=True, kw_only=True)
class FieldOptions:
    """Sampling options of a field; the defaults were tuned on recordings (decision 175).

    Parameters
    ----------
    history
        Number of preceding frames that are compared; h of the paper.
    candidates
        Number of moments from which one is sampled.
    alpha
        Weight of loudness and pitch relative to the motion, all in units of their variance.
    speech_alpha
        Weights of the `speech_features`, where they are compared.
    sigma
        Distance that lowers the probability of a moment by the factor e, in units of the median distance between a
        recorded moment and its nearest neighbour.
    stride
        Frames between samples; the paper samples every frame.
    continuity
        Factor on the distance of the moment that continues the recording: 1 as in the paper, less for fewer jumps.
    future
        Number of frames that must follow a moment in its recording for a jump to it.
    settle_s
        Time constant in seconds of the spring by which the offset after a jump decays, to a fifth after three time
        constants; 0 for no offset, so that the recorded values are used unchanged.
    memory
        Number of jumps before the same moment can be chosen again; without it, silence ends in a loop.
    apart
        Least number of frames between two candidates of one recording; with 1, every frame is a separate candidate.
    search_error
        Largest factor by which the distance of the candidates found exceeds the best ones; 1 for an exact search.
    """

    history: int = 10
    candidates: int = 3
    alpha: tuple[float, ...] = (10.0, 10.0)
    speech_alpha: tuple[float, ...] = (10.0, 10.0, 10.0, 3.0)
    sigma: float = 0.1
    stride: int = 6
    continuity: float = 0.05
    future: int = 20
    settle_s: float = 0.06
    memory: int = 400
    apart: int = MIN_MOMENT_GAP
    search_error: float = SEARCH_SLACK

    def __post_init__(self) -> None:
        """Refuse values of other types and numbers outside their range."""
        check_fields(self)
        if not 2 <= self.history <= 60 or not 1 <= self.stride <= 60 or not 0 <= self.future <= 600:
            raise InputError("a field's history is 2 to 60 frames, its stride 1 to 60, its future 0 to 600")
        if not 0 <= self.memory <= 1000:
            raise InputError(f"the memory of a field must be 0 to 1000 jumps, not {self.memory}")
        if not 1 <= self.candidates <= 16:
            raise InputError(f"the candidates of a field must be 1 to 16, not {self.candidates}")
        if min((*self.alpha, *self.speech_alpha), default=0.0) < 0 or not self.sigma > 0 or not self.settle_s >= 0:
            raise InputError("a field's alpha and settling time must not be negative, its sigma must be above 0")
        if not 0 <= self.continuity <= 1:
            raise InputError(f"a field's continuity must lie from 0 to 1, not {self.continuity}")
        if not 1 <= self.apart <= 600 or not 1.0 <= self.search_error <= 10.0:
            raise InputError("a field's candidates lie 1 to 600 frames apart, its search error is 1 to 10")


@dataclass(frozen=True, slots=True, eq=False)
class Field:
    """Indexed recordings of one feature of a style.

    Parameters
    ----------
    values : (T, D)
        Recorded motion divided by `scale`.
    prosody : (T, E)
        Recorded sound features multiplied by `weights`.
    starts : (T,)
        First frame of each frame's recording.
    axes : (p, h (E + D))
        Orthonormal axes of the search tree.
    tree
        Search tree over the windows projected to `axes`.
    scale, weights : float, (E,)
        Divisor of the motion, and factors of the sound features.
    median_distance
        Median over moments of the mean squared distance to the nearest other moment.
    """

    values: Float32Array
    prosody: Float32Array
    starts: NDArray[np.int32]
    axes: Float32Array
    tree: KdTree
    scale: float
    weights: Float32Array
    median_distance: float
    options: FieldOptions


NO_AXES = np.zeros((0, 0), np.float32)
NO_TREE = KdTree(
    NO_AXES, np.zeros(0, np.int32), np.zeros((0, 2), np.int32), np.zeros(0, np.int32), np.zeros(0, np.float32)
)


@dataclass(frozen=True, slots=True, eq=False)
class FieldState:
    """State of the sampling of a field.

    Parameters
    ----------
    motion, prosody : (h, D), (h, E)
        Motion and sound features of the last h generated frames, scaled and weighted as those of the field.
    moment
        Recorded frame that was used last, -1 for none.
    offset : (2, D)
        Residual offset after a jump and its per-frame velocity.
    recent_jumps : (m,)
        Targets of the last m jumps, the oldest first.
    n_frames
        Number of frames generated so far.
    """

    motion: Float32Array
    prosody: Float32Array
    moment: int
    offset: Float32Array
    recent_jumps: NDArray[np.int64]
    n_frames: int


@dataclass(frozen=True, slots=True, eq=False)
class FieldSample:
    """Generated frames (n, D) in the units of the recordings, the moment (n,) of each, and the state after them."""

    values: Float32Array
    moments: NDArray[np.int64]
    state: FieldState


def build_field(
    values: Float32Array, prosody: Float32Array, lengths: NDArray[np.int32], options: FieldOptions
) -> Field:
    """Index recorded motion (T, D) and its sound features (T, E); `lengths` (R,) are the frames of each recording."""
    if len(options.alpha) < prosody.shape[1]:
        raise InputError(f"{prosody.shape[1]} sound features need as many weights, not {len(options.alpha)}")
    starts = np.repeat(np.cumsum(lengths) - lengths, lengths).astype(np.int32)
    frames = np.arange(len(values))
    left = starts + np.repeat(lengths, lengths) - frames
    usable = np.flatnonzero((frames - starts >= options.history) & (left > options.future))
    if not len(usable):
        least = options.history + options.future + 1
        raise DataError(
            f"no recording of the style has {least} frames ({least / GESTURE_FPS:.1f} s); record longer ones"
        )

    def unindexed(scale: float, weights: Float32Array) -> Field:
        scaled = np.ascontiguousarray(values / np.float32(scale), np.float32)
        weighted = np.ascontiguousarray(prosody * weights, np.float32)
        return Field(scaled, weighted, starts, NO_AXES, NO_TREE, scale, weights, 1.0, options)

    def indexed() -> Field:
        scale = float(np.sqrt(np.square(values - values.mean(axis=0)).sum(axis=1).mean())) or 1.0
        spread = prosody.std(axis=0)
        # recordings without sound have nothing to compare
        alpha = np.where(spread > LEAST_SPREAD, np.array(options.alpha[: prosody.shape[1]]), 0.0)
        weights = (np.sqrt(alpha) / np.maximum(spread, LEAST_SPREAD)).astype(np.float32)
        return _index_field(unindexed(scale, weights), usable)

    if len(usable) < MIN_CACHED_MOMENTS:
        return indexed()
    kept = computed_once(
        CACHE_KIND,
        CACHE_VERSION,
        [values, prosody, lengths, repr(options)],
        lambda: _index_arrays(indexed()),
        lambda found: _is_index(found, values.shape[1], prosody.shape[1], options.history, usable),
    )
    return replace(
        unindexed(float(kept["scale"][0]), np.array(kept["weights"])),
        axes=np.array(kept["axes"]),
        tree=KdTree(*(np.array(kept[f"tree_{name}"]) for name in TREE_ARRAYS)),
        median_distance=float(kept["median_distance"][0]),
    )


def _index_field(field: Field, usable: NDArray[np.int64]) -> Field:
    """A field with the search tree of its usable moments."""
    history = field.options.history
    windows = _history_windows(field.values, field.prosody, usable[::AXES_STRIDE], history)
    away = (windows - windows.mean(axis=0)).astype(np.float64)
    # projected distances only bound those of windows, which decide (decision 072)
    axes = np.ascontiguousarray(principal_axes(away.T @ away, N_SEARCH_AXES)[1], np.float32)
    tree = build_tree(_history_windows(field.values, field.prosody, usable, history) @ axes.T)
    tree.order[:] = usable[tree.order]
    made = replace(field, axes=axes, tree=tree)
    return replace(made, median_distance=_median_nearest_distance(made, usable))


def _index_arrays(field: Field) -> dict[str, NDArray[Any]]:
    tree = {f"tree_{name}": getattr(field.tree, name) for name in TREE_ARRAYS}
    return tree | {
        "axes": field.axes,
        "scale": np.array([field.scale]),
        "weights": field.weights,
        "median_distance": np.array([field.median_distance]),
    }


def _is_index(
    kept: Mapping[str, NDArray[Any]], n_values: int, n_sounds: int, history: int, usable: NDArray[np.int64]
) -> bool:
    """Whether arrays of a file are an index of the usable moments, which the kernels read without checks."""
    width = history * (n_values + n_sounds)
    n_axes, n_nodes = min(N_SEARCH_AXES, width), count_nodes(len(usable))
    wanted = {
        "scale": ("<f8", (1,)),
        "weights": ("<f4", (n_sounds,)),
        "axes": ("<f4", (n_axes, width)),
        "median_distance": ("<f8", (1,)),
        "tree_places": ("<f4", (len(usable), n_axes)),
        "tree_order": ("<i4", (len(usable),)),
        "tree_spans": ("<i4", (n_nodes, 2)),
        "tree_axes": ("<i4", (n_nodes,)),
        "tree_cuts": ("<f4", (n_nodes,)),
    }
    if not holds(kept, wanted):
        return False
    spans, axes = kept["tree_spans"], kept["tree_axes"]
    return bool(
        # kernels read the index without checks: a damaged one would read outside the arrays
        np.array_equal(np.sort(kept["tree_order"]), usable)
        and 0 <= spans.min() <= spans.max() <= len(usable)
        and -1 <= axes.min() <= axes.max() < n_axes
        and (axes[len(axes) // 2 :] == -1).all()
    )


def _median_nearest_distance(field: Field, usable: NDArray[np.int64]) -> float:
    moments = usable[np.linspace(0, len(usable) - 1, min(N_DISTANCE_SAMPLES, len(usable))).astype(int)]
    queries = moments, np.zeros(len(moments)), search_space(2, len(field.axes))
    nearest_distances(_field_arrays(field), _tree_arrays(field.tree), field.axes, field.options.history, queries)
    distances = queries[1][np.isfinite(queries[1])]
    return max(float(np.median(distances)) if len(distances) else 1.0, 1e-9)


def _field_arrays(field: Field) -> tuple[Float32Array, Float32Array, NDArray[np.int32]]:
    return field.values, field.prosody, field.starts


def _tree_arrays(tree: KdTree) -> tuple[NDArray[Any], ...]:
    return tree.places, tree.order, tree.spans, tree.axes, tree.cuts


def _history_windows(
    values: Float32Array, prosody: Float32Array, frames: NDArray[np.int64], history: int
) -> Float32Array:
    """(N, h (E + D)) sound features and motion of the h frames before each of N frames."""
    rows = frames[:, None] + np.arange(-history, 0)
    return np.concatenate([prosody[rows].reshape(len(rows), -1), values[rows].reshape(len(rows), -1)], axis=1)


def _no_recent_jumps(made: Field) -> NDArray[np.int64]:
    """Empty list of jump targets; shorter for short recordings, so that some moment can always be chosen."""
    # without memory the head repeated 13 s in silence (decision 175)
    return np.full(min(made.options.memory, len(made.tree.order) // (8 * MIN_MOMENT_GAP)), -MIN_MOMENT_GAP, np.int64)


def _spring(settle_s: float) -> tuple[np.float32, np.float32]:
    """Stiffness of a critically damped spring and its decay per frame; 0 and 0 for no spring."""
    if settle_s == 0:
        return np.float32(0.0), np.float32(0.0)
    stiffness = np.float32(1.0 / (settle_s * GESTURE_FPS))
    return stiffness, np.exp(-stiffness)


def initial_state(field: Field, chance: float) -> FieldState:
    """State after the first frames of a recording, which the uniform number `chance` in [0, 1) selects."""
    history = field.options.history
    first = np.sort(field.tree.order[field.tree.order - field.starts[field.tree.order] == history])
    moment = int(first[int(chance * len(first))])
    rows = slice(moment - history, moment)
    nothing = np.zeros((2, field.values.shape[1]), np.float32)
    return FieldState(
        field.values[rows].copy(), field.prosody[rows].copy(), moment - 1, nothing, _no_recent_jumps(field), 0
    )


def transfer_state(state: FieldState, before: Field, after: Field) -> FieldState:
    """Convert the state of a field to the scale of another style's field of the same feature."""
    motion = state.motion * np.float32(before.scale / after.scale)
    prosody = state.prosody / np.maximum(before.weights, np.float32(1e-9)) * after.weights
    recent = _no_recent_jumps(after)
    return FieldState(motion, prosody.astype(np.float32), -1, np.zeros_like(state.offset), recent, state.n_frames)


def sample_field(
    field: Field, state: FieldState, prosody: Float32Array, chances: NDArray[np.float64]
) -> tuple[Float32Array, FieldState]:
    """Sample the next frames (n, D), in the units of the recordings, and the state after them.

    The result is independent of the division of the n frames into calls.

    Parameters
    ----------
    prosody : (n, E)
        Sound features of these frames; each frame depends on those before it.
    chances : (n,)
        Uniform random numbers in [0, 1), one for each frame.
    """
    sample = sample_field_moments(field, state, prosody, chances)
    return sample.values, sample.state


def sample_field_moments(
    field: Field, state: FieldState, prosody: Float32Array, chances: NDArray[np.float64]
) -> FieldSample:
    """As `sample_field`, with the recorded moment of each frame."""
    if not len(chances):
        return FieldSample(np.zeros((0, state.offset.shape[1]), np.float32), np.zeros(0, np.int64), state)
    options, history = field.options, field.options.history
    motion = np.concatenate([state.motion, np.zeros((len(chances), state.offset.shape[1]), np.float32)])
    sound = np.concatenate([state.prosody, (prosody * field.weights).astype(np.float32)])
    moments = np.zeros(len(chances), np.int64)
    offset = state.offset.copy()
    recent = state.recent_jumps.copy()
    stiffness, fade = _spring(options.settle_s)
    generate_frames(
        _field_arrays(field),
        _tree_arrays(field.tree),
        field.axes,
        (
            history,
            options.sigma * field.median_distance,
            options.stride,
            options.continuity,
            stiffness,
            fade,
            (options.apart, options.search_error),
        ),
        (
            motion,
            sound,
            moments,
            offset,
            recent,
            state.moment,
            state.n_frames,
            chances,
            search_space(options.candidates, len(field.axes)),
        ),
    )
    behind = motion[-history:].copy(), sound[-history:].copy(), int(moments[-1]), offset, recent
    after = FieldState(*behind, state.n_frames + len(chances))
    return FieldSample(motion[history:] * np.float32(field.scale), moments, after)
