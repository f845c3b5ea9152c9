"""Distribution over people of how they look at a partner in conversation, and the ``.gaze`` file format.

A person in a state (speaking, listening) is a `GazeHabit`: log-normal distributions of the lengths of looks and
fixations and of how far they go, and shares of directions. People differ several times over, so that the file holds a
normal distribution of the parameters over people. `corpus_tools.shipped.training.gaze` learns it.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Annotated

import numpy as np

from lexicon.errors import DataError
from lexicon.values.checks import free, list_of, text
from tts2face.models.codec import InHeader, Stored, StoredModel, in_64_bits, read_model, stored_arrays, stored_header
from tts2face.numeric.arrays import FloatArray
from tts2face.storage.schema import Contents, Tensor
from tts2face.storage.shipped import find_file
from tts2face.storage.tensors import write_tensors

KIND, VERSION = "gaze", 1
SHIPPED = "conversation"
SPEAKING, LISTENING = STATES = ("speaking", "listening")
FACE_DEG = 5.0  # within which a look is at the partner's face (README of the recordings)
DIRECTIONS = ("side", "up", "down")
# Parameters of a person in a state. Of a log-normal distribution: the logarithm of its median, and that of its spread.
PAIRS = ("face", "away", "beyond", "face_fixation", "away_fixation", "roam")
SINGLE = ("up", "down", "left", "spot")
PARAMETERS = (*(f"{name}{part}" for name in PAIRS for part in ("", "_spread")), *SINGLE)
OF_BOTH_STATES = ("left", "spot")  # places that a person prefers whether speaking or listening (r .56 and .63)
MOST_SPREADS = 2.0  # beyond which no person is drawn: fifteen people tell nothing of rarer ones
MAX_VALUE = 20.0  # of a logarithm
OF_STATES = (len(STATES), len(PARAMETERS))  # shape


@dataclass(frozen=True, slots=True)
class LogNormal:
    """Log-normal distribution with a median and a spread, the standard deviation of its logarithm."""

    median: float
    spread: float

    def draw(self, generator: np.random.Generator) -> float:
        """One number."""
        return self.median * math.exp(self.spread * generator.normal())


@dataclass(frozen=True, slots=True)
class GazeHabit:
    """How one person looks in one state.

    Parameters
    ----------
    face, away
        Seconds of looks at the partner's face and away.
    beyond
        Degrees by which a look away lands beyond `FACE_DEG` from the middle of the face.
    face_fixation, away_fixation
        Seconds of fixations within such looks.
    roam
        Degrees of jumps within a look away.
    directions
        Shares of looks away to the side, up and down, and of those to the side the share to the person's left.
    spot_deg
        Standard deviation of the places that are looked at on the face, on each axis.
    """

    face: LogNormal
    away: LogNormal
    beyond: LogNormal
    face_fixation: LogNormal
    away_fixation: LogNormal
    roam: LogNormal
    directions: tuple[float, float, float]
    left: float
    spot_deg: float

    @classmethod
    def of_parameters(cls, values: FloatArray) -> "GazeHabit":
        """From values (P,) of `PARAMETERS`."""
        # parameters are logarithms: lengths are log-normal (decision 188)
        named = dict(zip(PARAMETERS, np.exp(np.clip(values, -MAX_VALUE, MAX_VALUE)).tolist(), strict=True))
        total = 1.0 + named["up"] + named["down"]
        drawn = {name: LogNormal(named[name], named[f"{name}_spread"]) for name in PAIRS}
        return cls(
            **drawn,
            directions=(1.0 / total, named["up"] / total, named["down"] / total),
            left=named["left"] / (1.0 + named["left"]),
            spot_deg=named["spot"],
        )


@dataclass(frozen=True, slots=True, eq=False)
class GazeModel(StoredModel):
    """Independent normal distributions over people of their parameters.

    Parameters
    ----------
    mean, spread : (2, P)
        Of `STATES` and `PARAMETERS`, in logarithms; ``up`` and ``down`` against ``side``, ``left`` against right.
    metadata
        Source, licence and how it was made.
    """

    mean: Annotated[FloatArray, Stored(Tensor("float32", OF_STATES, -MAX_VALUE, MAX_VALUE), decode=in_64_bits)]
    spread: Annotated[FloatArray, Stored(Tensor("float32", OF_STATES, 0.0, MAX_VALUE), decode=in_64_bits)]
    metadata: Annotated[Mapping[str, object], InHeader(free, encode=dict)]

    @classmethod
    def prepare_check(cls, contents: Contents, prefix: str) -> None:
        """Refuse the file of a version with other states or parameters."""
        header = contents.header
        if (tuple(header["states"]), tuple(header["parameters"])) != (STATES, PARAMETERS):
            raise DataError(f"{contents.path} has other states or parameters than this version; learn it again")

    def draw(self, generator: np.random.Generator) -> Mapping[str, GazeHabit]:
        """Habits of one person by state."""
        drawn = generator.normal(size=self.mean.shape)
        shared = [PARAMETERS.index(name) for name in OF_BOTH_STATES]
        drawn[:, shared] = drawn[0, shared]
        values = self.mean + np.clip(drawn, -MOST_SPREADS, MOST_SPREADS) * self.spread
        return {state: GazeHabit.of_parameters(values[at]) for at, state in enumerate(STATES)}


def write_gaze(path: Path, model: GazeModel) -> None:
    """Write a ``.gaze`` file (docs/file-formats.md)."""
    header = {"states": list(STATES), "parameters": list(PARAMETERS), **stored_header(model)}
    write_tensors(path, KIND, VERSION, stored_arrays(model), header)


@cache
def load_gaze(name: str = SHIPPED) -> GazeModel:
    """The shipped distribution, or one from a ``.gaze`` file.

    Raises
    ------
    InputError
        It does not exist.
    DataError
        The file is damaged, or has other states or parameters.
    """
    names = {"states": list_of(text), "parameters": list_of(text)}
    return read_model(find_file(name, KIND), KIND, VERSION, GazeModel, names)
