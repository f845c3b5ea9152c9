"""Eyeballs: a sphere with a cornea, an iris with fibres and a dark rim, a pupil and a sclera."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from corpus_tools.head.cage import Cage, fit_sphere
from corpus_tools.head.piece import Eyeball, MaterialSpan, Piece

Floats = NDArray[np.float64]

N_AROUND = 44
RECEDE_MM = 1.6  # backward shift of an eyeball whose lids are shut, because blend shapes move lids on straight lines
BULGE = 0.04  # of the radius, height of the cornea at its top
BACK_RAD = 1.6  # angle from the gaze at which the eyeball ends; the rest is never visible
GAZE_ANGLES = {
    "eyeLookUp": (-1, 0, 20.0),
    "eyeLookDown": (1, 0, 20.0),
    "eyeLookOut": (0, 1, 25.0),
    "eyeLookIn": (0, -1, 25.0),
}
SCLERA = np.array([0.90, 0.875, 0.855])


@dataclass(frozen=True, slots=True)
class EyeStyle:
    """Half angles of iris and pupil seen from the centre, radians, and the iris' colour.

    MakeHuman's eyeballs are a third too large, so a natural iris takes a smaller angle than on a real eye. The colour
    is light, so that a tint can produce any other.
    """

    iris: float = 0.385
    pupil: float = 0.15
    colour: tuple[float, float, float] = (0.44, 0.50, 0.46)


MATERIALS = {"sclera": {"specular": 0.55, "shininess": 140.0}, "iris": {"specular": 0.9, "shininess": 260.0}}


def fit_eyeballs(cage: Cage, style: EyeStyle | None = None) -> tuple[Eyeball, Eyeball]:
    """Left and right eyeball of a cage."""
    found, style = [], style or EyeStyle()
    for side, word, sign in (("l", "Left", 1.0), ("r", "Right", -1.0)):
        centre, radius = fit_sphere(cage.vertices[cage.group(f"helper-{side}-eye")])
        turns = {}
        for gaze, (about_x, about_y, degrees) in GAZE_ANGLES.items():
            turns[gaze + word] = np.radians(degrees) * np.array([about_x, sign * about_y, 0.0])
        found.append(Eyeball(centre, radius, turns, style.iris, style.pupil))
    return found[0], found[1]


def ball_radius(ball: Eyeball, off: Floats) -> Floats:
    """Distance of the surface from the centre, mm, at angles from the gaze, radians."""
    return ball.radius * (1.0 + BULGE * np.clip(1.0 - (off / (ball.iris * 1.15)) ** 2, 0, None) ** 1.3)


def eyeball_piece(ball: Eyeball, side: str, style: EyeStyle, generator: np.random.Generator) -> Piece:
    """The piece of the eyeball on the side ``Left`` or ``Right``."""
    rings = _ring_angles(style)
    around = np.linspace(0, 2 * np.pi, N_AROUND, endpoint=False)
    off, turn = (grid.ravel() for grid in np.meshgrid(rings, around, indexing="ij"))
    towards = np.stack([np.sin(off) * np.cos(turn), np.sin(off) * np.sin(turn), np.cos(off)], axis=1)
    row, column = np.meshgrid(np.arange(len(rings) - 1), np.arange(N_AROUND), indexing="ij")
    a, b = row * N_AROUND + column, row * N_AROUND + (column + 1) % N_AROUND
    quads = np.stack([a, a + N_AROUND, b + N_AROUND, b], axis=-1).reshape(-1, 4)
    triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    in_iris = off[triangles].max(axis=1) <= style.iris + 0.031
    return Piece(
        vertices=ball.centre + ball_radius(ball, off)[:, None] * towards,
        spans=(
            MaterialSpan("sclera", triangles[~in_iris], MATERIALS["sclera"]),
            MaterialSpan("iris", triangles[in_iris], MATERIALS["iris"]),
        ),
        colours=_eye_colours((off, turn, towards[:, 1]), style, generator),
        shapes={f"eyeBlink{side}": np.tile([0.0, 0.0, -RECEDE_MM], (len(towards), 1))},
    )


def _ring_angles(style: EyeStyle) -> Floats:
    """Angles from the gaze at which the eyeball's vertices lie, radians."""
    inner = np.linspace(style.pupil + 0.02, style.iris, 10)
    outer = np.linspace(style.iris + 0.03, style.iris + 0.27, 4)
    return np.concatenate([np.linspace(0, style.pupil, 4), inner, outer, np.linspace(style.iris + 0.4, BACK_RAD, 7)])


def _eye_colours(at: tuple[Floats, Floats, Floats], style: EyeStyle, generator: np.random.Generator) -> Floats:
    """(N, 3) colours by the angle from the gaze, the angle around it and the height on the ball."""
    off, turn, up = at
    fibres = np.zeros_like(turn)
    for waves in (5, 9, 14, 23, 31):
        fibres += np.sin(waves * turn + generator.uniform(0, 2 * np.pi) + 3.0 * off) / 5
    depth = np.clip((off - style.pupil) / (style.iris - style.pupil), 0, 1)
    warm = np.exp(-(((depth - 0.12) / 0.22) ** 2))[:, None]  # the lighter frill about the pupil
    base = np.array(style.colour)
    iris = base * (0.72 + 0.30 * fibres + 0.28 * depth)[:, None]
    iris = iris * (1 - 0.5 * warm) + 0.5 * warm * np.array([0.50, 0.40, 0.24]) * (0.9 + 0.3 * fibres)[:, None]
    iris *= (1.0 - 0.72 * np.clip((depth - 0.78) / 0.22, 0, 1) ** 1.5)[:, None]
    pink = np.clip((off - style.iris - 0.24) / 0.7, 0, 1)[:, None]
    sclera = SCLERA * (1 - pink * np.array([0.06, 0.20, 0.20]))
    veins = np.clip(np.sin(11 * turn + 2.5 * np.sin(9 * off)) - 0.86, 0, 1)[:, None] * pink
    sclera *= 1 - 1.4 * veins * np.array([0.1, 0.9, 0.9])
    edge = np.clip((off - style.iris) / 0.07, 0, 1)[:, None]
    colours = np.where(off[:, None] <= style.pupil + 1e-9, 0.015, iris)
    colours = np.where(off[:, None] > style.iris + 1e-9, (1 - edge) * base * 0.35 + edge * sclera, colours)
    shade = 1.0 - 0.5 * np.clip((up - 0.04) / 0.34, 0, 1)  # the upper lid's shadow
    return colours * shade[:, None]
