"""Network that tells to which phone each frame of a sound belongs, and how long phones last.

One hidden layer of rectified linear units over features of a window around each frame: of the spectrum for a voice
(``heart``), also of what a recogniser hears for recordings of anybody (``recordings``).
`corpus_tools.shipped.training.phone_classifier` trains both.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError
from lexicon.values.checks import list_of, text
from tts2face.numeric.arrays import ordered_product
from tts2face.storage.schema import Contents, Tensor
from tts2face.storage.shipped import find_file
from tts2face.storage.tensors import read_tensors, write_tensors

KIND, VERSION = "phones", 1
MAX_VALUE, MAX_DELAY_S = 1e4, 1.0
Floats = NDArray[np.float32]


@dataclass(frozen=True, slots=True, eq=False)
class PhoneClassifier:
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

    inventory: tuple[str, ...]
    mean: Floats
    scale: Floats
    weights: tuple[Floats, Floats]
    biases: tuple[Floats, Floats]
    durations: Floats
    delays: Floats

    def log_probabilities(self, features: Floats) -> NDArray[np.float64]:
        """Log probabilities (T, P) of the phones in frames with features (T, K)."""
        hidden = ordered_product((features - self.mean) * self.scale, self.weights[0]) + self.biases[0]
        logits = ordered_product(np.maximum(hidden, 0.0, dtype=np.float32), self.weights[1]) + self.biases[1]
        logits -= logits.max(axis=1, keepdims=True)
        found: NDArray[np.float64] = logits - np.log(np.exp(logits).sum(axis=1, keepdims=True))
        return found


def write_phone_classifier(path: Path, classifier: PhoneClassifier) -> None:
    """Write a classifier to a file, weights in 16 bits."""
    arrays: dict[str, NDArray[Any]] = {
        "mean": classifier.mean,
        "scale": classifier.scale,
        **{f"weights{at}": layer.astype(np.float16) for at, layer in enumerate(classifier.weights)},
        **{f"biases{at}": layer for at, layer in enumerate(classifier.biases)},
        "durations": classifier.durations,
        "delays": classifier.delays,
    }
    write_tensors(path, KIND, VERSION, arrays, {"inventory": list(classifier.inventory)})


def load_phone_classifier(name: str) -> PhoneClassifier:
    """Load the shipped classifier of a voice by its name, or one from a ``.phones`` file.

    Raises
    ------
    InputError
        It does not exist.
    DataError
        The file is damaged.
    """
    path = find_file(name, KIND)
    arrays, header = read_tensors(path, KIND, VERSION)
    contents = Contents(path, KIND, arrays, header)
    contents.metadata({"inventory": list_of(text)})
    n_phones = len(header["inventory"])
    contents.tensors(
        {
            "mean": Tensor("float32", ("features",), -MAX_VALUE, MAX_VALUE),
            "scale": Tensor("float32", ("features",), 0.0, MAX_VALUE),
            "weights0": Tensor("float16", ("features", "units"), -MAX_VALUE, MAX_VALUE),
            "biases0": Tensor("float32", ("units",), -MAX_VALUE, MAX_VALUE),
            "weights1": Tensor("float16", ("units", n_phones), -MAX_VALUE, MAX_VALUE),
            "biases1": Tensor("float32", (n_phones,), -MAX_VALUE, MAX_VALUE),
            "durations": Tensor("float32", (n_phones, 2), -MAX_VALUE, MAX_VALUE),
            "delays": Tensor("float32", (n_phones,), -MAX_DELAY_S, MAX_DELAY_S),
        }
    )
    contents.only_known()
    if len(set(header["inventory"])) < n_phones:
        raise DataError(f"{path}: a phone is listed twice; train the file again")
    layers = [(arrays[f"weights{at}"].astype(np.float32), arrays[f"biases{at}"]) for at in range(2)]
    weights, biases = zip(*layers, strict=True)
    kept = {name: arrays[name] for name in ("mean", "scale", "durations", "delays")}
    return PhoneClassifier(inventory=tuple(header["inventory"]), weights=weights, biases=biases, **kept)
