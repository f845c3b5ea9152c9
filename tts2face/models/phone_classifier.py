"""Network that says to which phone each frame of a sound belongs, and how long phones last.

One hidden layer of rectified linear units over features of a window around each frame: of the spectrum for a voice
(``heart``), also of what a recogniser hears for recordings of anybody (``recordings``).
`corpus_tools.shipped.training.phone_classifier` trains both.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError
from lexicon.values.checks import list_of, text
from tts2face.models.codec import (
    InHeader,
    Numbered,
    Stored,
    StoredModel,
    half,
    read_model,
    stored_arrays,
    stored_header,
)
from tts2face.numeric.arrays import Float32Array, ordered_product
from tts2face.storage.schema import Contents, Tensor
from tts2face.storage.shipped import find_file
from tts2face.storage.tensors import write_tensors

KIND, VERSION = "phones", 1
# of any weight, and of a spike behind its phone
MAX_VALUE, MAX_DELAY_S = 1e4, 1.0
WEIGHTS = (
    half("features", "units", low=-MAX_VALUE, high=MAX_VALUE),
    half("units", "phones", low=-MAX_VALUE, high=MAX_VALUE),
)
BIASES = tuple(Stored(Tensor("float32", (size,), -MAX_VALUE, MAX_VALUE)) for size in ("units", "phones"))


@dataclass(frozen=True, slots=True, eq=False)
class PhoneClassifier(StoredModel):
    """Map from K features of a frame to P phones.

    Parameters
    ----------
    inventory : (P,)
        Labels of the phones.
    mean, scale : (K,)
        Features are used as ``(features - mean) * scale``.
    weights : (K, H), (H, P)
        Of both layers.
    biases : (H,), (P,)
        Of both layers.
    durations : (P, 2)
        Mean and standard deviation of the logarithm of the seconds that phones last.
    delays : (P,)
        Seconds from the middles of phones to the instants at which the recogniser says them.
    """

    inventory: Annotated[tuple[str, ...], InHeader(list_of(text), encode=list, decode=tuple)]
    mean: Annotated[Float32Array, Tensor("float32", ("features",), -MAX_VALUE, MAX_VALUE)]
    scale: Annotated[Float32Array, Tensor("float32", ("features",), 0.0, MAX_VALUE)]
    weights: Annotated[tuple[Float32Array, Float32Array], Numbered(WEIGHTS, 2)]
    biases: Annotated[tuple[Float32Array, Float32Array], Numbered(BIASES, 2)]
    durations: Annotated[Float32Array, Tensor("float32", ("phones", 2), -MAX_VALUE, MAX_VALUE)]
    delays: Annotated[Float32Array, Tensor("float32", ("phones",), -MAX_DELAY_S, MAX_DELAY_S)]

    @classmethod
    def prepare_check(cls, contents: Contents, prefix: str) -> None:
        """The number of phones is that of the inventory."""
        contents.sizes["phones"] = len(contents.header["inventory"])

    @classmethod
    def check_stored(cls, contents: Contents, prefix: str) -> None:
        """Refuse an inventory with a phone that is listed twice."""
        if len(set(contents.header["inventory"])) < contents.sizes["phones"]:
            raise DataError(f"{contents.path}: a phone is listed twice; train the file again")

    def log_probabilities(self, features: Float32Array) -> NDArray[np.float64]:
        """Log probabilities (T, P) of the phones in frames with features (T, K)."""
        hidden = ordered_product((features - self.mean) * self.scale, self.weights[0]) + self.biases[0]
        logits = ordered_product(np.maximum(hidden, 0.0, dtype=np.float32), self.weights[1]) + self.biases[1]
        logits -= logits.max(axis=1, keepdims=True)
        found: NDArray[np.float64] = logits - np.log(np.exp(logits).sum(axis=1, keepdims=True))
        return found


def write_phone_classifier(path: Path, classifier: PhoneClassifier) -> None:
    """Write a classifier to a file, weights in 16 bits."""
    write_tensors(path, KIND, VERSION, stored_arrays(classifier), stored_header(classifier))


def load_phone_classifier(name: str) -> PhoneClassifier:
    """Load the shipped classifier of a voice by its name, or one from a ``.phones`` file.

    Raises
    ------
    InputError
        It does not exist.
    DataError
        The file is damaged.
    """
    return read_model(find_file(name, KIND), KIND, VERSION, PhoneClassifier)
