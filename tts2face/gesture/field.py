"""Markov random fields over recorded gestures: each frame is drawn from moments like the present one.

Ju and Lee 2008, section 5.1: the next value is that of a recorded moment whose last frames, and the sound in them, are
most like those just shown; one of the few best, drawn with a probability that falls with its distance.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError, InputError
from tts2face.gesture.field_kernels import MIN_MOMENT_GAP, SEARCH_SLACK, generate_frames, nearest_distances
from tts2face.gesture.kd_tree import KdTree, build_tree
from tts2face.models.palette import GESTURE_FPS

N_SEARCH_AXES = 8  # of the search: the windows' principal axes
AXES_STRIDE = 8  # every so many windows tell the axes; all of them tell the same
N_DISTANCE_SAMPLES = 200  # moments whose nearest ones are looked for
Float32Array = NDArray[np.float32]


@dataclass(frozen=True, slots=True, kw_only=True)
class FieldOptions:
    """How a field chooses; the defaults were chosen on recordings (docs/gestures.md).

    Parameters
    ----------
    history
        Frames that are compared; h of the paper.
    candidates
        Moments among which is drawn.
    alpha
        Weight of each sound feature against the motion, both in units of their variance.
    sigma
        A moment that is farther by sigma is e times less likely; in units of how far the recorded moment lies that is
        most like another one (median).
    stride
        Frames from draw to draw; the paper draws every frame.
    continuity
        The moment that goes on from the last one counts as nearer by this factor: 1 as in the paper; less leaps less.
    future
        Frames that must follow a moment in its recording to be leapt to: at a recording's end there is no way on.
    settle_s
        Time constant of the spring that takes what is left of a leap away: after three of it a fifth is left. 0 for
        none: frames are those of the recordings.
    memory
        Leaps after which the same moment may be leapt to again: without it silence ends in a loop.
    apart
        Least number of frames between two candidates of one recording; 1 makes every frame a candidate of its own.
    search_error
        Candidates are at most this factor farther than the best ones; 1 is an exact search.

    Raises
    ------
    InputError
        A number lies outside its range.
    """

    history: int = 10
    candidates: int = 3
    alpha: tuple[float, ...] = (10.0, 1.0)
    sigma: float = 0.1
    stride: int = 6
    continuity: float = 0.05
    future: int = 20
    settle_s: float = 0.06
    memory: int = 400
    apart: int = MIN_MOMENT_GAP
    search_error: float = SEARCH_SLACK

    def __post_init__(self) -> None:
        """Refuse numbers outside their range."""
        if not 2 <= self.history <= 60 or not 1 <= self.stride <= 60 or not 0 <= self.future <= 600:
            raise InputError("a field's history is 2 to 60 frames, its stride 1 to 60, its future 0 to 600")
        if not 0 <= self.memory <= 1000:
            raise InputError(f"a field remembers 0 to 1000 leaps, not {self.memory}")
        if not 1 <= self.candidates <= 16:
            raise InputError(f"a field draws among 1 to 16 candidates, not {self.candidates}")
        if min(self.alpha, default=0.0) < 0 or not self.sigma > 0 or not self.settle_s >= 0:
            raise InputError("a field's alpha and settling time must not be negative, its sigma must be above 0")
        if not 0 <= self.continuity <= 1:
            raise InputError(f"a field's continuity must lie from 0 to 1, not {self.continuity}")
        if not 1 <= self.apart <= 600 or not 1.0 <= self.search_error <= 10.0:
            raise InputError("a field's candidates lie 1 to 600 frames apart, its search error is 1 to 10")


@dataclass(frozen=True, slots=True, eq=False)
class Field:
    """A feature of a style, made ready to be continued.

    Parameters
    ----------
    values : (T, D)
        Recorded motion over `scale`.
    heard : (T, E)
        Recorded sound features times `weights`.
    starts : (T,)
        First frame of the recording that each frame belongs to.
    axes : (p, h (E + D))
        Directions of the search.
    scale, weights : float, (E,)
        What motion is divided by, and sound multiplied by.
    nearness
        Mean squared distance of a moment from the one most like it; median.
    """

    values: Float32Array
    heard: Float32Array
    starts: NDArray[np.int32]
    axes: Float32Array
    tree: KdTree
    scale: float
    weights: Float32Array
    median_distance: float
    options: FieldOptions


@dataclass(frozen=True, slots=True, eq=False)
class FieldState:
    """Where a field stands.

    Parameters
    ----------
    shown, heard : (h, D), (h, E)
        The last frames, scaled and weighted as the field's.
    moment
        The recorded frame that was shown last, -1 for none.
    offset : (2, D)
        What is left of leaps, and its change a frame.
    recent : (m,)
        Moments that were leapt to last, the oldest first.
    n_frames
        Frames shown so far.
    """

    shown: Float32Array
    heard: Float32Array
    moment: int
    offset: Float32Array
    recent_jumps: NDArray[np.int64]
    n_frames: int


@dataclass(frozen=True, slots=True, eq=False)
class FieldSample:
    """Frames (n, D) in the units of the recordings, the recorded moment (n,) of each, and the state behind them."""

    values: Float32Array
    moments: NDArray[np.int64]
    state: FieldState


def build_field(values: Float32Array, heard: Float32Array, lengths: NDArray[np.int32], options: FieldOptions) -> Field:
    """Index recorded motion (T, D) with the sound (T, E) that went with it; recordings of `lengths` (R,) frames.

    Raises
    ------
    InputError
        There are fewer weights `alpha` than sound features.
    DataError
        No recording is long enough.
    """
    if len(options.alpha) < heard.shape[1]:
        raise InputError(f"{heard.shape[1]} sound features need as many weights, not {len(options.alpha)}")
    starts = np.repeat(np.cumsum(lengths) - lengths, lengths).astype(np.int32)
    frames = np.arange(len(values))
    left = starts + np.repeat(lengths, lengths) - frames
    usable = np.flatnonzero((frames - starts >= options.history) & (left > options.future))
    if not len(usable):
        least = options.history + options.future + 1
        raise DataError(
            f"no recording of the style has {least} frames ({least / GESTURE_FPS:.1f} s); record longer ones"
        )
    scale = float(np.sqrt(np.square(values - values.mean(axis=0)).sum(axis=1).mean())) or 1.0
    spread = np.maximum(heard.std(axis=0), 1e-6)
    weights = (np.sqrt(np.array(options.alpha[: heard.shape[1]])) / spread).astype(np.float32)
    scaled = np.ascontiguousarray(values / np.float32(scale), np.float32)
    weighted = np.ascontiguousarray(heard * weights, np.float32)
    axes = _principal_axes(_history_windows(scaled, weighted, usable[::AXES_STRIDE], options.history))
    tree = build_tree(_history_windows(scaled, weighted, usable, options.history) @ axes.T)
    tree.order[:] = usable[tree.order]
    made = Field(scaled, weighted, starts, axes, tree, scale, weights, 1.0, options)
    return replace(made, median_distance=_median_nearest_distance(made, usable))


def _median_nearest_distance(made: Field, usable: NDArray[np.int64]) -> float:
    moments = usable[np.linspace(0, len(usable) - 1, min(N_DISTANCE_SAMPLES, len(usable))).astype(int)]
    away = np.zeros(len(moments))
    nearest_distances(_field_arrays(made), _tree_arrays(made.tree), made.axes, made.options.history, (moments, away))
    return max(float(np.median(away[np.isfinite(away)])) if np.isfinite(away).any() else 1.0, 1e-9)


def _field_arrays(made: Field) -> tuple[Float32Array, Float32Array, NDArray[np.int32]]:
    return made.values, made.heard, made.starts


def _tree_arrays(tree: KdTree) -> tuple[NDArray[Any], ...]:
    return tree.places, tree.order, tree.spans, tree.axes, tree.cuts


def _history_windows(
    values: Float32Array, heard: Float32Array, frames: NDArray[np.int64], history: int
) -> Float32Array:
    """(N, h (E + D)) what was heard and shown before each of N frames."""
    rows = frames[:, None] + np.arange(-history, 0)
    return np.concatenate([heard[rows].reshape(len(rows), -1), values[rows].reshape(len(rows), -1)], axis=1)


def _principal_axes(windows: Float32Array) -> Float32Array:
    away = (windows - windows.mean(axis=0)).astype(np.float64)
    _, vectors = np.linalg.eigh(np.asarray(away.T @ away))
    return np.ascontiguousarray(vectors[:, ::-1][:, :N_SEARCH_AXES].T, np.float32)


def _no_recent_jumps(made: Field) -> NDArray[np.int64]:
    """No leaps to remember; of few recordings fewer, so that some moment is always left."""
    return np.full(min(made.options.memory, len(made.tree.order) // (8 * MIN_MOMENT_GAP)), -MIN_MOMENT_GAP, np.int64)


def _spring(settle_s: float) -> tuple[np.float32, np.float32]:
    """Stiffness of a critically damped spring and what it keeps of a leap in a frame; 0 and 0 for no spring."""
    if settle_s == 0:
        return np.float32(0.0), np.float32(0.0)
    stiffness = np.float32(1.0 / (settle_s * GESTURE_FPS))
    return stiffness, np.exp(-stiffness)


def initial_state(field: Field, chance: float) -> FieldState:
    """The state after the first frames of one of the recordings; `chance` in [0, 1) tells which."""
    history = field.options.history
    first = np.sort(field.tree.order[field.tree.order - field.starts[field.tree.order] == history])
    moment = int(first[int(chance * len(first))])
    rows = slice(moment - history, moment)
    nothing = np.zeros((2, field.values.shape[1]), np.float32)
    return FieldState(
        field.values[rows].copy(), field.heard[rows].copy(), moment - 1, nothing, _no_recent_jumps(field), 0
    )


def transfer_state(state: FieldState, before: Field, after: Field) -> FieldState:
    """The state of one style's field, from which another style's field of the same feature goes on."""
    shown = state.shown * np.float32(before.scale / after.scale)
    heard = state.heard / np.maximum(before.weights, np.float32(1e-9)) * after.weights
    recent = _no_recent_jumps(after)
    return FieldState(shown, heard.astype(np.float32), -1, np.zeros_like(state.offset), recent, state.n_frames)


def sample_field(
    field: Field, state: FieldState, heard: Float32Array, chances: NDArray[np.float64]
) -> tuple[Float32Array, FieldState]:
    """The next n frames (n, D), in the units of the recordings, and the state behind them; in parts as at once.

    Parameters
    ----------
    heard : (n, E)
        Sound features of these frames; each frame is chosen by those before it.
    chances : (n,)
        Uniform in [0, 1), one for each frame.
    """
    made = sample_field_moments(field, state, heard, chances)
    return made.values, made.state


def sample_field_moments(
    field: Field, state: FieldState, heard: Float32Array, chances: NDArray[np.float64]
) -> FieldSample:
    """As `sample_field`, with the recorded moments that were shown."""
    if not len(chances):
        return FieldSample(np.zeros((0, state.offset.shape[1]), np.float32), np.zeros(0, np.int64), state)
    options, history = field.options, field.options.history
    shown = np.concatenate([state.shown, np.zeros((len(chances), state.offset.shape[1]), np.float32)])
    sound = np.concatenate([state.heard, (heard * field.weights).astype(np.float32)])
    moments, offset, recent = np.zeros(len(chances), np.int64), state.offset.copy(), state.recent_jumps.copy()
    stiffness, fade = _spring(options.settle_s)
    generate_frames(
        _field_arrays(field),
        _tree_arrays(field.tree),
        field.axes,
        (
            history,
            options.candidates,
            options.sigma * field.median_distance,
            options.stride,
            options.continuity,
            stiffness,
            fade,
            (options.apart, options.search_error),
        ),
        (shown, sound, moments, offset, recent, state.moment, state.n_frames, chances),
    )
    behind = shown[-history:].copy(), sound[-history:].copy(), int(moments[-1]), offset, recent
    after = FieldState(*behind, state.n_frames + len(chances))
    return FieldSample(shown[history:] * np.float32(field.scale), moments, after)
