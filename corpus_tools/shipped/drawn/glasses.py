"""Round glasses of a drawn character: rims, a bridge and temples of thin wire."""

from collections.abc import Sequence

import numpy as np

from corpus_tools.dense.tube import tube
from corpus_tools.shipped.drawn.character import Colour
from corpus_tools.shipped.drawn.fields import smooth_line
from corpus_tools.shipped.head.parts import Eyeball, HeadPart, MaterialSpan

WIRE_MM = 1.5
RIM_MM = np.array([28.5, 26.0])  # half sizes of a rim, which bends back by `WRAP_MM` at its outer side
RIM_OFF_MM = np.array([1.0, -3.5, 9.0])  # of its centre from the front of the eyeball: outwards, up, ahead
WRAP_MM, N_RIM = 5.0, 64
EAR_MM = np.array([76.0, 4.0, -66.0])  # where a temple ends, behind the ear
N_TEMPLE, N_BRIDGE = 24, 14
GLASSES_MATERIAL = {"specular": 0.5, "shininess": 50.0, "wrap": 0.3}


def glasses_piece(balls: Sequence[Eyeball], colour: Colour) -> HeadPart:
    """Glasses before both eyes."""
    tubes, inner = [], []
    for ball in balls:
        sign = float(np.sign(ball.centre[0]))
        centre = ball.centre + RIM_OFF_MM * [sign, 1, 1] + np.array([0, 0, ball.radius])
        turn = np.linspace(0, 2 * np.pi, N_RIM, endpoint=False)
        across = np.cos(turn)
        back = WRAP_MM * np.clip(across, 0, 1) ** 2
        rim = centre + np.column_stack([sign * RIM_MM[0] * across, RIM_MM[1] * np.sin(turn), -back])
        tubes.append(tube(rim, WIRE_MM, is_closed=True))
        outer = rim[np.argmax(sign * rim[:, 0] + 0.4 * rim[:, 1])]
        ear = EAR_MM * [sign, 1, 1]
        bend = 0.5 * (outer + ear) + [sign * 7.0, 2.0, 6.0]
        knots = np.stack([outer, bend, ear, ear - np.array([3.0 * sign, 9.0, 9.0])])
        tubes.append(tube(smooth_line(knots, N_TEMPLE), WIRE_MM))
        inner.append(rim[np.argmax(-sign * rim[:, 0] + 0.3 * rim[:, 1])])
    middle = 0.5 * (inner[0] + inner[1]) + [0.0, 3.5, 2.0]
    tubes.append(tube(smooth_line((inner[0], middle, inner[1]), N_BRIDGE), WIRE_MM))
    counts = np.cumsum([0, *(len(points) for points, _ in tubes)])
    points = np.concatenate([points for points, _ in tubes])
    faces = np.concatenate([faces + count for (_, faces), count in zip(tubes, counts, strict=False)])
    return HeadPart(points, (MaterialSpan("glasses", faces, GLASSES_MATERIAL),), np.tile(colour, (len(points), 1)))
