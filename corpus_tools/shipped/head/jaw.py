"""Motion of the lower jaw by shape, which lower teeth and tongue follow."""

from collections.abc import Mapping
from dataclasses import dataclass

from corpus_tools.shipped.head.cage import Cage, fit_rotation
from tts2face.numeric.arrays import FloatArray

JAW_SHAPES = ("jawOpen", "jawForward", "jawLeft", "jawRight")


@dataclass(frozen=True, slots=True, eq=False)
class Jaw:
    """Rotation (3, 3) and translation (3,) in mm of the lower jaw by shape, at weight 1."""

    motions: Mapping[str, tuple[FloatArray, FloatArray]]

    def shapes(self, points: FloatArray) -> dict[str, FloatArray]:
        """Displacements (N, 3) by shape of points (N, 3) that move with the lower jaw."""
        return {name: points @ turn.T + shift - points for name, (turn, shift) in self.motions.items()}


def fit_jaw(cage: Cage) -> Jaw:
    """Rigid motion of a cage's lower jaw, fitted to MakeHuman's lower teeth."""
    teeth = cage.group("helper-lower-teeth")
    rest = cage.vertices[teeth]
    return Jaw({name: fit_rotation(rest, rest + cage.units[name][teeth]) for name in JAW_SHAPES})
