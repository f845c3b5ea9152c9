"""The cartoon face: the same head with large eyes, a small jaw and nose, strong flat colours and thick brows."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from corpus_tools.head.cage import Cage
from corpus_tools.head.eyes import EyeStyle
from corpus_tools.head.hair import Cut
from corpus_tools.head.head import Look
from corpus_tools.head.noise import ramp
from corpus_tools.head.texture import Palette

Floats = NDArray[np.float64]

TARGETS = {
    "macrodetails/caucasian-female-young": 0.55, "macrodetails/caucasian-female-child": 0.45,
    "macrodetails/universal-female-young-averagemuscle-averageweight": 0.55,
    "macrodetails/universal-female-child-averagemuscle-averageweight": 0.45,
}  # fmt: skip
LOOK = Look(
    palette=Palette(
        skin=(0.93, 0.715, 0.60), lips=(0.80, 0.40, 0.38), cavity=(0.42, 0.12, 0.14), hair=(0.50, 0.20, 0.11),
        variation=0.35, brow_thickness=2.2,
    ),
    cut=Cut(top=30.0, side=15.0, nape=8.0, n_locks=300),
    eyes=EyeStyle(iris=0.47, pupil=0.22, colour=(0.28, 0.62, 0.50)),
    shirt=(0.95, 0.70, 0.18),
    skin_material={"specular": 0.10, "shininess": 10.0, "wrap": 0.55, "textured": True},
)  # fmt: skip
EYE_GAIN, EYE_REACH_MM = 0.56, 31.0  # eyes grow by this in their middle; growth falls to a third at this distance
NOSE, NOSE_GAIN, NOSE_REACH_MM = np.array([0.0, -38.0, 34.0]), -0.36, 19.0
FALL = 2.5  # exponent of the fall; with these gains no place overtakes another


def cartooned(cage: Cage) -> Cage:
    """A cage with a cartoon's proportions; its shapes follow."""
    eyes = [cage.vertices[cage.group(f"helper-{side}-eye")].mean(axis=0) for side in "lr"]

    def warped(points: Floats) -> Floats:
        return _proportioned(points, eyes)

    rest = warped(cage.vertices)
    units = {name: warped(cage.vertices + moved) - rest for name, moved in cage.units.items()}
    middle = np.mean([rest[cage.group(f"helper-{side}-eye")].mean(axis=0) for side in "lr"], axis=0)
    return replace(cage, vertices=rest - middle, units=units)


def _proportioned(points: Floats, eyes: list[Floats]) -> Floats:
    moved = points.copy()
    for centre in eyes:
        moved = _swollen(moved, centre, EYE_GAIN, EYE_REACH_MM)
    moved = _swollen(moved, NOSE, NOSE_GAIN, NOSE_REACH_MM)
    low = ramp(-moved[:, 1], 25.0, 105.0)[:, None]
    moved *= 1 - low * np.array([0.20, 0.0, 0.0])
    moved[:, 1] += 9.0 * ramp(-moved[:, 1], 45.0, 110.0)
    skull = ramp(moved[:, 1], 5.0, 90.0)[:, None]
    placed: Floats = moved * (1 + skull * np.array([0.07, 0.06, 0.05]))
    return placed


def _swollen(points: Floats, centre: Floats, gain: float, reach: float) -> Floats:
    """Points pushed away from a centre: scaled by 1 + gain there, less and less further away."""
    off = points - centre
    share = np.exp(-((np.linalg.norm(off, axis=1) / reach) ** FALL))
    moved: Floats = centre + off * (1 + gain * share)[:, None]
    return moved
