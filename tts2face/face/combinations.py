"""Shapes that correct combinations of others: their weights are the products of those.

A combination has the names of its parts, ``combination*browDownLeft*jawOpen``. Nothing else gives it a weight: faces
are linear models, and speech and gestures are fitted without it.
"""

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from tts2face.types import Trajectory

PREFIX, BETWEEN = "combination*", "*"


def combination_name(parts: Iterable[str]) -> str:
    """Name of the shape that corrects a combination of others."""
    return PREFIX + BETWEEN.join(sorted(set(parts)))


def with_combinations(motion: Trajectory) -> Trajectory:
    """Motion in which the shapes of combinations have the products of the weights of their parts."""
    found = {at: name.removeprefix(PREFIX) for at, name in enumerate(motion.channels) if name.startswith(PREFIX)}
    products = {at: name.split(BETWEEN) for at, name in found.items() if set(name.split(BETWEEN)) <= {*motion.channels}}
    if not products:
        return motion
    values = motion.values.copy()
    for at, parts in products.items():
        values[:, at] = np.clip(motion.columns(parts), 0.0, 1.0).prod(axis=1)
    return replace(motion, values=values)
