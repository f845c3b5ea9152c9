"""Score map: what the face tracker reads in a mouth as a function of the parameters that move it.

The tracker's network scores shapes such as jawOpen from landmarks. A score map is a small network that gives the same
scores for the speech parameters of a talker, or for the shape weights of a face, without landmarks and without the
tracker. `corpus_tools.training.score_map` trains both kinds.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError
from tts2face.models.codec import StoredModel, check_model, has_part, model_of
from tts2face.numeric.arrays import FloatArray, make_read_only, ordered_product
from tts2face.storage.schema import Contents, Tensor
from tts2face.types import Trajectory

# Scores that retargeting matches, and the shapes whose scores each of them averages.
SCORE_SHAPES: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "jawOpen": ("jawOpen",),
        "mouthPucker": ("mouthPucker",),
        "mouthFunnel": ("mouthFunnel",),
        "mouthUpperUp": ("mouthUpperUpLeft", "mouthUpperUpRight"),
        "mouthLowerDown": ("mouthLowerDownLeft", "mouthLowerDownRight"),
        "mouthStretch": ("mouthStretchLeft", "mouthStretchRight"),
        "mouthSmile": ("mouthSmileLeft", "mouthSmileRight"),
    }
)
N_SCORES = len(SCORE_SHAPES)
SCORES = "scores"  # name of the map before those of its arrays
# a damaged file must not overflow
MAX_WEIGHT = 1e6


def _weights(*shape: int | str) -> Tensor:
    return Tensor("float32", shape, -MAX_WEIGHT, MAX_WEIGHT)


@dataclass(frozen=True, slots=True, eq=False)
class ScoreMap(StoredModel):
    """Map ``output tanh(hidden x + hidden_bias) + direct x + bias`` from K inputs to the logits of `SCORE_SHAPES`.

    Parameters
    ----------
    inputs : (K,)
        Names of speech parameters or of shapes.
    hidden, hidden_bias : (H, K), (H,)
        Layer of tanh units.
    output, direct, bias : (S, H), (S, K), (S,)
        Layer of logits, which the inputs reach directly as well.
    """

    inputs: tuple[str, ...]
    hidden: Annotated[NDArray[np.float32], _weights("units of scores", "inputs of scores")]
    hidden_bias: Annotated[NDArray[np.float32], _weights("units of scores")]
    output: Annotated[NDArray[np.float32], _weights(N_SCORES, "units of scores")]
    direct: Annotated[NDArray[np.float32], _weights(N_SCORES, "inputs of scores")]
    bias: Annotated[NDArray[np.float32], _weights(N_SCORES)]

    def __post_init__(self) -> None:
        """Check that the shapes of all arrays agree, then make them read-only."""
        n_units, n_inputs = len(self.hidden_bias), len(self.inputs)
        if (
            self.hidden.shape != (n_units, n_inputs)
            or self.output.shape != (N_SCORES, n_units)
            or self.direct.shape != (N_SCORES, n_inputs)
            or self.bias.shape != (N_SCORES,)
        ):
            raise DataError("the arrays of the score map do not fit each other; train it again")
        make_read_only(self)

    def logits(self, values: NDArray[np.floating]) -> FloatArray:
        """Logits (T, S) of the scores for inputs (T, K)."""
        return ordered_product(self._units(values), self.output.T) + ordered_product(values, self.direct.T) + self.bias

    def scores(self, values: NDArray[np.floating]) -> FloatArray:
        """Scores (T, S), 0 to 1, for inputs (T, K)."""
        return logistic(self.logits(values))

    def slopes(self, values: NDArray[np.floating]) -> FloatArray:
        """Derivatives (T, S, K) of the logits by the inputs (T, K)."""
        steep = 1.0 - np.square(self._units(values))
        return ordered_product(self.output * steep[:, None, :], self.hidden) + self.direct

    def _units(self, values: NDArray[np.floating]) -> FloatArray:
        units: FloatArray = np.tanh(ordered_product(values, self.hidden.T) + self.hidden_bias)
        return units


def logistic(logits: FloatArray) -> FloatArray:
    """Scores of logits."""
    scores: FloatArray = 1.0 / (1.0 + np.exp(-logits))
    return scores


def mouth_scores(scores: Trajectory) -> FloatArray:
    """Scores (T, S) of `SCORE_SHAPES` among blendshape scores (T, B) by name."""
    means = [scores.columns(names).mean(axis=1, dtype=np.float64) for names in SCORE_SHAPES.values()]
    return np.stack(means, axis=1)


def check_score_map(contents: Contents, n_inputs: int) -> None:
    """Check the arrays of the score map of a file, if it has any, for a number of inputs."""
    if has_part(contents, SCORES):
        contents.sizes["inputs of scores"] = n_inputs
        check_model(ScoreMap, contents, SCORES)


def score_map_of(contents: Contents, inputs: tuple[str, ...]) -> ScoreMap | None:
    """The score map of a checked file; None without one."""
    return model_of(ScoreMap, contents, SCORES, inputs=inputs) if has_part(contents, SCORES) else None
