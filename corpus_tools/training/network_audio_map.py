"""The network drive: three layers, few hidden units, frames of context either side (T07, section 3.2.2)."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from corpus_tools.training.linear_audio_map import (
    TrainingData,
    TrainingUtterance,
    build_training_data,
    standardised_windows,
)
from lexicon.errors import InputError
from tts2face.models.audio_map import AudioMap

VALIDATION_SHARE = 0.1  # of the utterances: they end the training before it learns the others by heart
PATIENCE = 30  # steps without a better error on them
MAX_STEPS = 600
Layers = tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]


@dataclass(frozen=True, slots=True)
class NetworkMapOptions:
    """Shape and training of a network.

    ``decay`` is the weight of the mean square of the weights against the error; ``emphasis`` the power of a
    parameter's spread by which it counts: 0 makes all count alike, 1 as many millimetres as they move. Least squares
    move the face too little; ``articulation`` is the share of what is missing (0 nothing, 1 all, as logarithm) that one
    gain about the mean gives back.
    """

    n_hidden: int = 10
    before: int = 5
    after: int = 5
    weight_decay: float = 1e-4
    spread_exponent: float = 0.5
    articulation: float = 0.5
    seed: int = 0

    def __post_init__(self) -> None:
        """Refuse a network that cannot be."""
        if self.n_hidden < 1 or min(self.before, self.after) < 0 or self.weight_decay < 0.0:
            raise InputError(f"a network needs a hidden unit, and no negative context or decay: not {self}")


def learn_network_map(lessons: Sequence[TrainingUtterance], *, feature: str, options: NetworkMapOptions) -> AudioMap:
    """The network that drives best on utterances set aside; the same lessons and seed give the same network.

    Raises
    ------
    InputError
        There are fewer than two utterances.
    """
    if len(lessons) < 2:
        raise InputError(f"a network needs at least 2 utterances, one to check itself by, not {len(lessons)}")
    rng = np.random.default_rng(options.seed)
    order = rng.permutation(len(lessons))
    n_aside = max(1, round(VALIDATION_SHARE * len(lessons)))
    material = build_training_data([lessons[i] for i in order[n_aside:]], options.before, options.after)
    aside = [lessons[i] for i in order[:n_aside]]
    standard = (material.mean, material.spread)
    heard = np.concatenate(
        [standardised_windows(one.features, standard, options.before, options.after) for one in aside]
    )
    centre = material.targets.mean(axis=0, dtype=np.float64)
    spread = np.maximum(material.targets.std(axis=0, dtype=np.float64), 1e-9)
    weight = spread**options.spread_exponent / np.sqrt(np.mean(spread ** (2 * options.spread_exponent)))
    seen, seen_aside = (
        ((one - centre) / spread * weight).astype(np.float32)
        for one in (material.targets, np.concatenate([one.parameters for one in aside]))
    )
    checked = TrainingData(heard, seen_aside, material.mean, material.spread)
    layers = _train_layers(TrainingData(material.features, seen, material.mean, material.spread), checked, options, rng)
    inner, bias, outer, offset = layers
    moved = np.tanh(heard @ inner.T + bias) @ outer.T
    gain = float(np.sqrt(seen_aside.var(axis=0).sum() / moved.var(axis=0).sum())) ** options.articulation
    outer, offset = gain * outer, gain * offset
    back = spread / weight
    return AudioMap(
        feature,
        options.before,
        options.after,
        material.mean,
        material.spread,
        inner.astype(np.float32),
        bias.astype(np.float32),
        (outer * back[:, None]).astype(np.float32),
        (offset * back + centre).astype(np.float32),
        is_nonlinear=True,
    )


def _train_layers(
    material: TrainingData, checked: TrainingData, options: NetworkMapOptions, rng: np.random.Generator
) -> Layers:
    """Layers with the least error on what is checked, along the way of L-BFGS."""
    import scipy.optimize

    minimize: Any = scipy.optimize.minimize  # its stubs know no gradient that comes with the value

    n_inputs, n_outputs = material.features.shape[1], material.targets.shape[1]
    shapes = ((options.n_hidden, n_inputs), (options.n_hidden,), (n_outputs, options.n_hidden), (n_outputs,))
    start = [
        rng.normal(0.0, 1.0 / np.sqrt(n_inputs), shapes[0]),
        np.zeros(shapes[1]),
        rng.normal(0.0, 1.0 / np.sqrt(options.n_hidden), shapes[2]),
        np.zeros(shapes[3]),
    ]
    best = _EarlyStopping(checked)

    def step(weights: NDArray[np.float64]) -> None:
        if best.should_stop(weights, unpack_layers(weights, shapes)):
            raise StopIteration

    first = np.concatenate([layer.ravel() for layer in start])

    def error(weights: NDArray[np.float64]) -> tuple[float, NDArray[np.float64]]:
        return loss_and_gradient(
            unpack_layers(weights, shapes), material.features, material.targets, options.weight_decay
        )

    minimize(
        error,
        first,
        jac=True,
        method="L-BFGS-B",
        callback=step,
        options={"maxiter": MAX_STEPS, "maxcor": 20},
    )
    return unpack_layers(best.weights, shapes)


class _EarlyStopping:
    """The best weights so far by the error on utterances set aside."""

    def __init__(self, checked: TrainingData) -> None:
        self._validation = checked
        self._error = np.inf
        self._n_stalled = 0
        self.weights: NDArray[np.float64] = np.zeros(0)

    def should_stop(self, weights: NDArray[np.float64], layers: Layers) -> bool:
        """Look at new weights; true when none was better for `PATIENCE` steps."""
        error = loss_and_gradient(layers, self._validation.features, self._validation.targets, 0.0)[0]
        self._n_stalled += 1
        if error < self._error:
            self._error, self._n_stalled, self.weights = error, 0, weights.copy()
        return self._n_stalled >= PATIENCE


def unpack_layers(weights: NDArray[np.float64], shapes: Sequence[tuple[int, ...]]) -> Layers:
    """The four layers that lie end to end in one vector."""
    ends = np.cumsum([int(np.prod(shape)) for shape in shapes])
    parts = np.split(weights, ends[:-1])
    inner, bias, outer, offset = (part.reshape(shape) for part, shape in zip(parts, shapes, strict=True))
    return inner, bias, outer, offset


def loss_and_gradient(
    layers: Layers, heard: NDArray[np.floating], seen: NDArray[np.floating], decay: float
) -> tuple[float, NDArray[np.float64]]:
    """Mean square error of a network with weight decay, and its gradient by back-propagation, as one vector.

    Parameters
    ----------
    layers
        (H, W), (H,), (S, H), (S,).
    heard, seen : (N, W), (N, S)
    """
    inner, bias, outer, offset = (layer.astype(heard.dtype) for layer in layers)
    units = np.tanh(heard @ inner.T + bias)
    miss = units @ outer.T + offset - seen
    n = miss.size
    error = float(np.einsum("ij,ij->", miss, miss, dtype=np.float64)) / n
    error += decay * (float(np.square(layers[0]).sum()) + float(np.square(layers[2]).sum()))
    back = (miss @ outer) * (1.0 - units * units)
    slopes = (
        (2.0 / n) * (back.T @ heard) + 2.0 * decay * inner,
        (2.0 / n) * back.sum(axis=0),
        (2.0 / n) * (miss.T @ units) + 2.0 * decay * outer,
        (2.0 / n) * miss.sum(axis=0),
    )
    return error, np.concatenate([slope.ravel() for slope in slopes]).astype(np.float64)
