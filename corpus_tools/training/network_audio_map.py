"""The network audio map: three layers, few hidden units, context frames on both sides (T07, section 3.2.2)."""

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
from lexicon.values.fields import check_fields
from tts2face.models.audio_map import AudioMap

VALIDATION_SHARE = 0.1  # of the utterances, for early stopping
PATIENCE = 30  # steps without a lower validation error
# of the optimiser; early stopping ends it sooner
MAX_STEPS = 600
Layers = tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]


@dataclass(frozen=True, slots=True)
class NetworkMapOptions:
    """Shape and training of a network.

    ``weight_decay`` multiplies the sum of squared weights in the loss. ``spread_exponent`` is the power of a standard
    deviation that weights the error of its parameter: 0 weights all equally, 1 in millimetres. Least squares reduce the
    range of motion; ``articulation`` is the share of the loss of range (0 none, 1 all, as logarithm) that a gain about
    the mean restores.
    """

    n_hidden: int = 10
    before: int = 5
    after: int = 5
    weight_decay: float = 1e-4
    spread_exponent: float = 0.5
    articulation: float = 0.5
    seed: int = 0

    def __post_init__(self) -> None:
        """Check the options and their types."""
        check_fields(self)
        if self.n_hidden < 1 or min(self.before, self.after) < 0 or self.weight_decay < 0.0:
            raise InputError(
                f"a network needs at least one hidden unit, and context and weight decay from 0 up, not {self}"
            )


def learn_network_map(utterances: Sequence[TrainingUtterance], *, feature: str, options: NetworkMapOptions) -> AudioMap:
    """The network with the lowest validation error; equal utterances and seed give an equal network."""
    if len(utterances) < 2:
        raise InputError(f"a network needs at least 2 utterances, one of them for validation, not {len(utterances)}")
    rng = np.random.default_rng(options.seed)
    order = rng.permutation(len(utterances))
    n_validation = max(1, round(VALIDATION_SHARE * len(utterances)))
    data = build_training_data([utterances[i] for i in order[n_validation:]], options.before, options.after)
    validation_utterances = [utterances[i] for i in order[:n_validation]]
    standard = (data.mean, data.spread)
    features = np.concatenate(
        [
            standardised_windows(validation_utterance.features, standard, options.before, options.after)
            for validation_utterance in validation_utterances
        ]
    )
    centre = data.targets.mean(axis=0, dtype=np.float64)
    spread = np.maximum(data.targets.std(axis=0, dtype=np.float64), 1e-9)
    weight = spread**options.spread_exponent / np.sqrt(np.mean(spread ** (2 * options.spread_exponent)))
    targets, validation_targets = (
        ((item - centre) / spread * weight).astype(np.float32)
        for item in (
            data.targets,
            np.concatenate([validation_utterance.parameters for validation_utterance in validation_utterances]),
        )
    )
    validation = TrainingData(features, validation_targets, data.mean, data.spread)
    layers = _train_layers(TrainingData(data.features, targets, data.mean, data.spread), validation, options, rng)
    inner, bias, outer, offset = layers
    moved = np.tanh(features @ inner.T + bias) @ outer.T
    gain = float(np.sqrt(validation_targets.var(axis=0).sum() / moved.var(axis=0).sum())) ** options.articulation
    outer, offset = gain * outer, gain * offset
    back = spread / weight
    return AudioMap(
        feature,
        options.before,
        options.after,
        data.mean,
        data.spread,
        (inner.astype(np.float32), (outer * back[:, None]).astype(np.float32)),
        (bias.astype(np.float32), (offset * back + centre).astype(np.float32)),
        "tanh",
    )


def _train_layers(
    data: TrainingData, validation: TrainingData, options: NetworkMapOptions, rng: np.random.Generator
) -> Layers:
    """Layers with the lowest validation error over the iterations of L-BFGS."""
    import scipy.optimize

    minimize: Any = scipy.optimize.minimize  # the stubs lack objectives that return value and gradient

    n_inputs, n_outputs = data.features.shape[1], data.targets.shape[1]
    shapes = ((options.n_hidden, n_inputs), (options.n_hidden,), (n_outputs, options.n_hidden), (n_outputs,))
    start = [
        rng.normal(0.0, 1.0 / np.sqrt(n_inputs), shapes[0]),
        np.zeros(shapes[1]),
        rng.normal(0.0, 1.0 / np.sqrt(options.n_hidden), shapes[2]),
        np.zeros(shapes[3]),
    ]
    best = _EarlyStopping(validation)

    def step(weights: NDArray[np.float64]) -> None:
        if best.should_stop(weights, unpack_layers(weights, shapes)):
            raise StopIteration

    first = np.concatenate([layer.ravel() for layer in start])

    def error(weights: NDArray[np.float64]) -> tuple[float, NDArray[np.float64]]:
        return loss_and_gradient(unpack_layers(weights, shapes), data.features, data.targets, options.weight_decay)

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
    """The weights with the lowest validation error so far."""

    def __init__(self, validation: TrainingData) -> None:
        self._validation = validation
        self._error = np.inf
        self._n_stalled = 0
        self.weights: NDArray[np.float64] = np.zeros(0)

    def should_stop(self, weights: NDArray[np.float64], layers: Layers) -> bool:
        """Evaluate new weights; true after `PATIENCE` steps without a lower error."""
        error = loss_and_gradient(layers, self._validation.features, self._validation.targets, 0.0)[0]
        self._n_stalled += 1
        if error < self._error:
            self._error, self._n_stalled, self.weights = error, 0, weights.copy()
        return self._n_stalled >= PATIENCE


def unpack_layers(weights: NDArray[np.float64], shapes: Sequence[tuple[int, ...]]) -> Layers:
    """The four layers that are concatenated in one vector."""
    ends = np.cumsum([int(np.prod(shape)) for shape in shapes])
    parts = np.split(weights, ends[:-1])
    inner, bias, outer, offset = (part.reshape(shape) for part, shape in zip(parts, shapes, strict=True))
    return inner, bias, outer, offset


def loss_and_gradient(
    layers: Layers, features: NDArray[np.floating], targets: NDArray[np.floating], decay: float
) -> tuple[float, NDArray[np.float64]]:
    """Mean square error of a network with weight decay, and its gradient by back-propagation, as one vector.

    Parameters
    ----------
    layers
        (H, W), (H,), (S, H), (S,).
    features, targets : (N, W), (N, S)
    """
    inner, bias, outer, offset = (layer.astype(features.dtype) for layer in layers)
    units = np.tanh(features @ inner.T + bias)
    residual = units @ outer.T + offset - targets
    n = residual.size
    error = float(np.einsum("ij,ij->", residual, residual, dtype=np.float64)) / n
    error += decay * (float(np.square(layers[0]).sum()) + float(np.square(layers[2]).sum()))
    back = (residual @ outer) * (1.0 - units * units)
    slopes = (
        (2.0 / n) * (back.T @ features) + 2.0 * decay * inner,
        (2.0 / n) * back.sum(axis=0),
        (2.0 / n) * (residual.T @ units) + 2.0 * decay * outer,
        (2.0 / n) * residual.sum(axis=0),
    )
    return error, np.concatenate([slope.ravel() for slope in slopes]).astype(np.float64)
