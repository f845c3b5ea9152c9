"""How the lower jaw moves with each shape: rigidly, fitted to MakeHuman's lower teeth."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from corpus_tools.head.cage import Cage, rotation_between

Floats = NDArray[np.float64]

JAW_SHAPES = ("jawOpen", "jawForward", "jawLeft", "jawRight")


@dataclass(frozen=True, slots=True, eq=False)
class Jaw:
    """Rotation (3, 3) and translation (3,) in mm of the lower jaw by shape, at weight 1."""

    motions: Mapping[str, tuple[Floats, Floats]]

    def shapes(self, points: Floats) -> dict[str, Floats]:
        """Displacements (N, 3) by shape of points (N, 3) that are fixed to the lower jaw."""
        return {name: points @ turn.T + shift - points for name, (turn, shift) in self.motions.items()}


def jaw_of(cage: Cage) -> Jaw:
    """The lower jaw of a cage."""
    teeth = cage.group("helper-lower-teeth")
    rest = cage.vertices[teeth]
    return Jaw({name: rotation_between(rest, rest + cage.units[name][teeth]) for name in JAW_SHAPES})
