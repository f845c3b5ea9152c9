"""Training of small networks from phones in a window, by Adam on mini-batches with a fixed order of all sums.

Two hidden layers of rectified linear units. Every sum is accumulated in one order, in single precision, without BLAS
and on one thread, so that the same data and seed give the same bytes on any number of threads. Several speakers share
all weights but the biases of the first layer; each output counts only for the speakers for whom it is known.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tts2face.numeric.arrays import Float32Array
from tts2face.numeric.kernels import kernel

BATCH = 128  # samples per step
LEARNING_RATE = 1e-3  # Kingma and Ba 2015
DECAY_FROM = 0.3  # share of the epochs after which the learning rate falls linearly to `FINAL_RATE` of it
# of the learning rate, in the last epoch
FINAL_RATE = 0.02
MOMENTS = (0.9, 0.999)  # decay of the moments of the gradient (Kingma and Ba 2015)
# Kingma and Ba 2015
EPSILON = 1e-8
POSITION_SPREAD = 0.3  # of the initial weights of the position within the phone: seconds and a share, all below 1
Weights = tuple[Float32Array, Float32Array, Float32Array, Float32Array, Float32Array, Float32Array, Float32Array]
"""First layer of phones (C, K, H), of positions (Q, H), biases by speaker (G, H); second layer; output layer."""


@dataclass(frozen=True, slots=True, eq=False)
class WindowSamples:
    """N samples: phones seen (N, C), position (N, Q), targets (N, D), and the speaker (N,) of each."""

    shown: NDArray[np.int32]
    position: Float32Array
    targets: Float32Array
    speaker: NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class TrainingOptions:
    """Widths of the hidden layers, passes over the samples, and the weight of the squared weights."""

    hidden: tuple[int, int]
    n_epochs: int
    weight_decay: float


def train_network(
    samples: WindowSamples,
    table: Float32Array,
    importance: Float32Array,
    *,
    options: TrainingOptions,
    seed: int,
) -> Weights:
    """Weights of a network trained on the samples.

    Parameters
    ----------
    table : (P, K)
        Code of each phone.
    importance : (G, D)
        Factor of the squared error of each output for each speaker; 0 for an output that a speaker lacks.
    """
    stream = np.random.default_rng(seed)
    weights = _initial_weights(samples, table, importance.shape, options, stream)
    moments = tuple(np.zeros_like(weight) for weight in weights), tuple(np.zeros_like(weight) for weight in weights)
    data = (samples.shown, samples.position, samples.targets, samples.speaker)
    n_steps = 0
    for epoch in range(options.n_epochs):
        order = stream.permutation(len(samples.shown))
        elapsed = epoch / options.n_epochs
        rate = LEARNING_RATE * (1.0 if elapsed < DECAY_FROM else (1 - elapsed) / (1 - DECAY_FROM) + FINAL_RATE)
        rule = (np.float32(rate), np.float32(options.weight_decay), n_steps)
        n_steps = _train_epoch(order, data, (table, importance), weights, moments, rule)
    return weights


def network_outputs(
    weights: Weights, table: Float32Array, shown: NDArray[np.int32], position: Float32Array, speaker: int
) -> Float32Array:
    """Outputs (N, D) for samples of one speaker."""
    phone_rows = phone_layer(weights, table)
    outputs = np.zeros((len(shown), weights[5].shape[1]), np.float32)
    _forward_all(shown, position, speaker, phone_rows, weights, outputs)
    return outputs


def phone_layer(weights: Weights, table: Float32Array) -> Float32Array:
    """(C, P, H) first layer for one-hot codes of the phones."""
    phone_rows = np.zeros((len(weights[0]), len(table), weights[0].shape[2]), np.float32)
    _code_phones(table, weights[0], phone_rows)
    return phone_rows


def _initial_weights(
    samples: WindowSamples,
    table: Float32Array,
    shape: tuple[int, ...],
    options: TrainingOptions,
    stream: np.random.Generator,
) -> Weights:
    n_shown, n_place = samples.shown.shape[1], samples.position.shape[1]
    n_codes, (first, second) = table.shape[1], options.hidden
    fan_in = n_shown * max(1.0, float(np.abs(table).sum(axis=1).mean()))

    def normal(deviation: float, *size: int) -> Float32Array:
        return stream.normal(0.0, deviation, size).astype(np.float32)

    return (
        normal(1 / np.sqrt(fan_in), n_shown, n_codes, first),
        normal(POSITION_SPREAD, n_place, first),
        np.zeros((shape[0], first), np.float32),
        normal(np.sqrt(2 / first), first, second),
        np.zeros(second, np.float32),
        normal(np.sqrt(1 / second), second, shape[1]),
        np.zeros(shape[1], np.float32),
    )


@kernel
def _code_phones(table, weights, phone_rows):  # type: ignore[no-untyped-def]
    """Write the first layer's contribution (C, P, H) of each phone in each column."""
    phone_rows[:] = 0.0
    for c in range(weights.shape[0]):
        for p in range(table.shape[0]):
            for k in range(table.shape[1]):
                if table[p, k] != 0.0:
                    _add_scaled(phone_rows[c, p], table[p, k], weights[c, k])


@kernel
def _add_scaled(total, factor, values):  # type: ignore[no-untyped-def]
    for j in range(len(total)):
        total[j] += factor * values[j]


@kernel
def _add_products(total, inputs, rows):  # type: ignore[no-untyped-def]
    """Add inputs (K,) times rows (K, J) to the total (J,), in the order of the inputs."""
    for k in range(len(inputs)):
        if inputs[k] != 0.0:
            _add_scaled(total, inputs[k], rows[k])


@kernel
def _rectify(values):  # type: ignore[no-untyped-def]
    for j in range(len(values)):
        if not values[j] > 0.0:
            values[j] = 0.0


@kernel
def _forward(shown, position, speaker, phone_rows, weights, layers):  # type: ignore[no-untyped-def]
    first, second, output = layers
    first[:] = weights[2][speaker]
    for c in range(len(shown)):
        _add_scaled(first, np.float32(1.0), phone_rows[c, shown[c]])
    _add_products(first, position, weights[1])
    _rectify(first)
    second[:] = weights[4]
    _add_products(second, first, weights[3])
    _rectify(second)
    output[:] = weights[6]
    _add_products(output, second, weights[5])


@kernel
def _forward_all(shown, position, speaker, phone_rows, weights, outputs):  # type: ignore[no-untyped-def]
    first = np.zeros(weights[3].shape[0], np.float32)
    second = np.zeros(weights[3].shape[1], np.float32)
    for n in range(len(shown)):
        _forward(shown[n], position[n], speaker, phone_rows, weights, (first, second, outputs[n]))


@kernel
def _backward(sample, transposed, gradients, layers, errors):  # type: ignore[no-untyped-def]
    """Add one sample's gradients; `errors` holds that of the output, and receives those of the hidden layers."""
    shown, position, speaker = sample
    first, second, output_error = layers
    first_error, second_error = errors
    rows, place, biases, inner, inner_biases, outer, outer_biases = gradients
    second_error[:] = 0.0
    _add_products(second_error, output_error, transposed[1])
    _add_scaled(outer_biases, np.float32(1.0), output_error)
    for k in range(len(second)):
        if second[k] != 0.0:
            _add_scaled(outer[k], second[k], output_error)
        else:
            second_error[k] = 0.0
    _add_scaled(inner_biases, np.float32(1.0), second_error)
    first_error[:] = 0.0
    _add_products(first_error, second_error, transposed[0])
    for k in range(len(first)):
        if first[k] != 0.0:
            _add_scaled(inner[k], first[k], second_error)
        else:
            first_error[k] = 0.0
    _add_scaled(biases[speaker], np.float32(1.0), first_error)
    for k in range(len(position)):
        _add_scaled(place[k], position[k], first_error)
    for c in range(len(shown)):
        _add_scaled(rows[c, shown[c]], np.float32(1.0), first_error)


@kernel
def _train_epoch(order, data, codes, weights, moments, rule):  # type: ignore[no-untyped-def]
    """Update the weights with every full batch of the order; the number of steps so far."""
    shown, position, targets, speaker = data
    table, importance = codes
    rate, decay, n_steps = rule
    n_first = weights[0].shape[2]
    phone_rows = np.zeros((weights[0].shape[0], table.shape[0], n_first), np.float32)
    row_gradients = np.zeros_like(phone_rows)
    code_gradients = np.zeros_like(weights[0])
    place, biases, inner = np.zeros_like(weights[1]), np.zeros_like(weights[2]), np.zeros_like(weights[3])
    inner_biases, outer, outer_biases = np.zeros_like(weights[4]), np.zeros_like(weights[5]), np.zeros_like(weights[6])
    layers = (np.zeros(n_first, np.float32), np.zeros_like(weights[4]), np.zeros_like(weights[6]))
    errors = (np.zeros(n_first, np.float32), np.zeros_like(weights[4]))
    gradients = (row_gradients, place, biases, inner, inner_biases, outer, outer_biases)
    for start in range(0, len(order) - BATCH + 1, BATCH):
        _code_phones(table, weights[0], phone_rows)
        for part in (row_gradients, code_gradients):
            part[:] = 0.0
        for part in (place, biases, inner, outer):
            part[:] = 0.0
        inner_biases[:] = 0.0
        outer_biases[:] = 0.0
        transposed = (np.ascontiguousarray(weights[3].T), np.ascontiguousarray(weights[5].T))
        for n in order[start : start + BATCH]:
            _forward(shown[n], position[n], speaker[n], phone_rows, weights, layers)
            for d in range(len(layers[2])):
                layers[2][d] = (layers[2][d] - targets[n, d]) * importance[speaker[n], d] / np.float32(BATCH)
            _backward((shown[n], position[n], speaker[n]), transposed, gradients, layers, errors)
        _collect_codes(table, row_gradients, code_gradients)
        n_steps += 1
        step = (rate, n_steps)
        _adam_step(weights[0], code_gradients, moments[0][0], moments[1][0], decay, step)
        _adam_step(weights[1], place, moments[0][1], moments[1][1], decay, step)
        _adam_step(weights[2], biases, moments[0][2], moments[1][2], np.float32(0.0), step)
        _adam_step(weights[3], inner, moments[0][3], moments[1][3], decay, step)
        _adam_step(weights[4], inner_biases, moments[0][4], moments[1][4], np.float32(0.0), step)
        _adam_step(weights[5], outer, moments[0][5], moments[1][5], decay, step)
        _adam_step(weights[6], outer_biases, moments[0][6], moments[1][6], np.float32(0.0), step)
    return n_steps


@kernel
def _collect_codes(table, row_gradients, code_gradients):  # type: ignore[no-untyped-def]
    """Add the gradients (C, P, H) of phones to those (C, K, H) of their codes."""
    for c in range(row_gradients.shape[0]):
        for p in range(table.shape[0]):
            for k in range(table.shape[1]):
                if table[p, k] != 0.0:
                    _add_scaled(code_gradients[c, k], table[p, k], row_gradients[c, p])


@kernel
def _adam_step(values, gradient, mean, square, decay, step):  # type: ignore[no-untyped-def]
    rate, n_steps = step
    flat, slope, first, second = values.reshape(-1), gradient.reshape(-1), mean.reshape(-1), square.reshape(-1)
    keep_mean, keep_square = np.float32(MOMENTS[0]), np.float32(MOMENTS[1])
    mean_scale = np.float32(1.0 / (1.0 - MOMENTS[0] ** n_steps))
    square_scale = np.float32(1.0 / (1.0 - MOMENTS[1] ** n_steps))
    for i in range(len(flat)):
        g = slope[i] + decay * flat[i]
        first[i] = keep_mean * first[i] + (np.float32(1.0) - keep_mean) * g
        second[i] = keep_square * second[i] + (np.float32(1.0) - keep_square) * g * g
        flat[i] -= rate * (first[i] * mean_scale) / (np.sqrt(second[i] * square_scale) + np.float32(EPSILON))
