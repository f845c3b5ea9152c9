"""Codes of phones for networks: articulatory features, or one-hot."""

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from lexicon.phones import phone_features


def feature_table(inventory: Iterable[str]) -> NDArray[np.float32]:
    """(P, K) articulatory features of P phones, for their first and their second half."""
    return np.array([[*first, *last] for first, last in map(phone_features, inventory)], np.float32)
