"""Teeth, gums and tongue in their own colours: the light that was learnt from poses is held in a plausible range.

Where a pose is far from the learnt ones, as with a tongue before the lips or teeth in a narrow gap, that light is black
or grey. What is seen between lips is lit from where it is seen: the less, the deeper it lies behind them.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tts2face.models.face import Face
from tts2face.numeric.arrays import Array, Float32Array
from tts2face.numeric.kernels import UNIT, ZERO, vectorized_kernel
from tts2face.picture.kernels.tables import NORMAL

LIT = np.float32(0.95)  # least light at the lips, as displayed, of that of the surface's own colour
REACH = np.float32(0.5)  # widths of the mouth behind the lips over which it falls to half
AMBIENT = np.float32(0.75)  # of the light of what faces it
LIGHT_FROM = (np.float32(0.1), np.float32(0.45), np.float32(0.89))
DEEP_TINT = (np.float32(0.80), np.float32(0.74))  # of green and blue where no light is left: flesh reflects red
OWN_HUE = np.float32(0.7)  # share of the colour that has the surface's own hue


@dataclass(frozen=True, slots=True, eq=False)
class MouthColours:
    """Vertices (M,) of a mouth, their own colours (3, M), and the width of the opening of the lips at rest, mm."""

    rows: NDArray[np.int32]
    own: Float32Array
    width: np.float32

    @classmethod
    def of(cls, face: Face, rows: NDArray[np.int32], ring: Float32Array) -> "MouthColours":
        """Colours of vertices (M,) of a face, whose lips have a ring (L, 3) at rest."""
        return cls(rows, np.ascontiguousarray(face.colours[rows].T, np.float32), np.float32(np.ptp(ring[:, 0])))

    def hold(self, points: Float32Array, ring: Float32Array, table: Float32Array, light: Float32Array) -> None:
        """Hold the light (3, M) of vertices of a deformed face (V, 3) with a ring of lips (L, 3)."""
        hold_colours(points, self.rows, table, (ring[:, 2].mean(), 1 / self.width), self.own, light)


@vectorized_kernel
def hold_colours(points: Array, rows: Array, table: Array, opening: tuple[Any, Any], own: Array, light: Array) -> None:
    """Hold the light (3, M) of vertices of a mouth above what its own colours (3, M) have there, and near their hue.

    `opening`: z of the opening of the lips, and 1 over its width.
    """
    front, per_width = opening
    green_deep, blue_deep = DEEP_TINT
    right, up, forward = LIGHT_FROM
    for i in range(len(rows)):
        ahead = (points[rows[i], 2] - front) * per_width
        depth = min(ahead, ZERO) / REACH
        near = UNIT / (UNIT + depth * depth)
        facing = table[i, NORMAL] * right + table[i, NORMAL + 1] * up + table[i, NORMAL + 2] * forward
        share = LIT * near * (AMBIENT + (UNIT - AMBIENT) * max(facing, ZERO))
        red = own[0, i]
        green = own[1, i] * (green_deep + (UNIT - green_deep) * near)
        blue = own[2, i] * (blue_deep + (UNIT - blue_deep) * near)
        shown = (light[0, i] + light[1, i] + light[2, i]) / max(red + green + blue, UNIT)
        hue = OWN_HUE * max(shown, share)
        rest = UNIT - OWN_HUE
        light[0, i] = rest * max(light[0, i], share * red) + hue * red
        light[1, i] = rest * max(light[1, i], share * green) + hue * green
        light[2, i] = rest * max(light[2, i], share * blue) + hue * blue
