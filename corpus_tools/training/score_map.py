"""Score maps: networks trained to give the face tracker's scores for speech parameters or shape weights."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from tts2face.models.score_map import N_SCORES, ScoreMap, logistic, mouth_scores
from tts2face.models.talker import Talker, speech_channels
from tts2face.numeric.arrays import FloatArray
from tts2face.types import Trajectory
from tts2face.video.blendshapes import BLENDSHAPES, BlendshapeReader

# of the hidden layer
N_UNITS = 24
DECAY = 1e-3  # of the weights of both layers: steep maps are hard to invert
N_EPOCHS, BATCH = 40, 128
LEARNING_RATE = 0.004  # of Adam (Kingma and Ba 2015), falling linearly to 0
# decay of the moments of the gradient (Kingma and Ba 2015)
MOMENTS = (0.9, 0.999)
MAX_LOGIT = 6.0  # larger logits are scores of 0 or 1
LOGIT_SHARE = 0.02  # of the squared error of logits in the loss; the other part is that of scores
MAX_FRAMES = 4000  # of a talker's recordings
PX_PER_MM, MIDDLE_PX = 2.0, 300.0  # of the pictures that the landmarks stand for; the network is invariant to both


def add_score_map(talker: Talker, reader: BlendshapeReader) -> Talker:
    """The talker with the scores that the tracker reads in frames of its recordings."""
    n_speech = talker.model.n_speech
    parameters = np.concatenate([utterance.shape[:, :n_speech] for utterance in talker.utterances])
    parameters = parameters[:: len(parameters) // MAX_FRAMES + 1].astype(np.float64)
    read = read_mouth_scores(talker.model.shapes(parameters), reader)
    return replace(talker, scores=fit_score_map(speech_channels(talker.model), parameters, read))


def read_mouth_scores(landmarks: NDArray[np.floating], reader: BlendshapeReader) -> FloatArray:
    """Scores (T, S) as of `mouth_scores` for landmarks (T, 478, 3) in mm without head pose."""
    return mouth_scores(read_scores(landmarks, reader, 1.0))


def read_scores(landmarks: NDArray[np.floating], reader: BlendshapeReader, fps: float) -> Trajectory:
    """Scores (T, 52) of `BLENDSHAPES` for landmarks (T, 478, 3) in mm without head pose.

    On frames of GRID s1 they differ from the scores of the landmarks in pixels by .005 at most on average.
    """
    pixels = (landmarks * [PX_PER_MM, -PX_PER_MM, -PX_PER_MM] + MIDDLE_PX).astype(np.float32)
    return Trajectory(BLENDSHAPES, [reader.blendshape_scores(points) for points in pixels], fps)


def fit_score_map(inputs: tuple[str, ...], values: FloatArray, scores: FloatArray, seed: int = 0) -> ScoreMap:
    """Score map trained on inputs (N, K) with known scores (N, S); the same data and seed give the same map."""
    rng = np.random.default_rng(seed)
    mean, spread = values.mean(axis=0), np.maximum(values.std(axis=0), 1e-6)
    logits = clipped_logits(scores)
    layers = [
        rng.normal(size=(N_UNITS, len(inputs))) / np.sqrt(len(inputs)),
        np.zeros(N_UNITS),
        0.1 * rng.normal(size=(N_SCORES, N_UNITS)),
        np.zeros((N_SCORES, len(inputs))),
        logits.mean(axis=0),
    ]
    moments = [(np.zeros_like(layer), np.zeros_like(layer)) for layer in layers]
    standard = (values - mean) / spread
    for step, rate, rows in _batches(len(values), rng):
        for layer, (first, second), slope in zip(
            layers, moments, _gradients(layers, standard[rows], scores[rows], logits[rows]), strict=True
        ):
            first[...] += (1.0 - MOMENTS[0]) * (slope - first)
            second[...] += (1.0 - MOMENTS[1]) * (slope * slope - second)
            size = first / (1.0 - MOMENTS[0] ** step)
            layer[...] -= rate * size / (np.sqrt(second / (1.0 - MOMENTS[1] ** step)) + 1e-8)
    hidden, hidden_bias, output, direct, bias = layers
    hidden, direct = hidden / spread, direct / spread
    parts = (hidden, hidden_bias - hidden @ mean, output, direct, bias - direct @ mean)
    return ScoreMap(inputs, *(part.astype(np.float32) for part in parts))


def clipped_logits(scores: FloatArray) -> FloatArray:
    """Logits of scores, at most `MAX_LOGIT` from 0."""
    low = 1.0 / (1.0 + np.exp(MAX_LOGIT))
    inside = np.clip(scores, low, 1.0 - low)
    return np.asarray(np.log(inside / (1.0 - inside)), np.float64)


def _batches(n_rows: int, rng: np.random.Generator) -> Iterator[tuple[int, float, NDArray[np.int64]]]:
    """Number from 1, learning rate and rows of each step of the training."""
    starts = range(0, max(n_rows - BATCH, 0) + 1, BATCH)
    n_steps = N_EPOCHS * len(starts)
    step = 0
    for _ in range(N_EPOCHS):
        order = rng.permutation(n_rows)
        for first in starts:
            yield step + 1, LEARNING_RATE * (1.0 - step / n_steps), order[first : first + BATCH]
            step += 1


def _gradients(
    layers: list[FloatArray], values: FloatArray, scores: FloatArray, logits: FloatArray
) -> tuple[FloatArray, ...]:
    """Gradients of the loss by each of the layers."""
    hidden, hidden_bias, output, direct, bias = layers
    units = np.tanh(values @ hidden.T + hidden_bias)
    found = units @ output.T + values @ direct.T + bias
    read = logistic(found)
    by_logits = ((read - scores) * 4.0 * read * (1.0 - read) + LOGIT_SHARE * (found - logits)) / len(values)
    by_units = (by_logits @ output) * (1.0 - units * units)
    return (
        by_units.T @ values + DECAY * hidden,
        by_units.sum(axis=0),
        by_logits.T @ units + DECAY * output,
        by_logits.T @ values + DECAY * direct,
        by_logits.sum(axis=0),
    )
