"""Eyeballs: a sphere with a cornea; iris, pupil and sclera are in a texture."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates

from corpus_tools.shipped.head.cage import Cage, fit_sphere
from corpus_tools.shipped.head.cards import EYE_TEXTURE
from corpus_tools.shipped.head.parts import Eyeball, HeadPart, MaterialSpan
from tts2face.numeric.arrays import FloatArray, smoothstep
from tts2face.picture.baked.eyes import EDGE_RAD

N_AROUND = 44
RECEDE_MM = 1.6  # backward shift of an eyeball whose lids are shut, because blend shapes move lids on straight lines
BACK_RAD = 1.6  # angle from the gaze at which the eyeball ends; the rest is never visible
GAZE_ANGLES = {
    "eyeLookUp": (-1, 0, 20.0),
    "eyeLookDown": (1, 0, 20.0),
    "eyeLookOut": (0, 1, 25.0),
    "eyeLookIn": (0, -1, 25.0),
}
SCLERA, SCLERA_MOST = np.array([0.74, 0.72, 0.695]), 0.80  # warm grey, and the brightest value, sRGB
TEXTURE_SIDE = 512  # pixels
# The eye in the package's picture, pixels: centre, and radii of pupil, iris and the painted part of the ball.
SOURCE_CENTRE, SOURCE_PUPIL_PX, SOURCE_IRIS_PX, SOURCE_BALL_PX = (361.4, 151.1), 17.0, 60.0, 125.0
SOURCE_SCLERA = np.array([0.66, 0.63, 0.60])
LIMBUS, LID_SHADE, IRIS_GAIN = 0.55, 0.42, 1.75


@dataclass(frozen=True, slots=True)
class EyeStyle:
    """Half angles of iris and pupil seen from the centre, radians, the iris' colour, and the cornea's height.

    MakeHuman's eyeballs are a third too large, so a natural iris takes a smaller angle than on a real eye. The colour
    is light, so that a tint can produce any other.
    """

    iris: float = 0.40
    pupil: float = 0.165
    colour: tuple[float, float, float] = (0.50, 0.44, 0.345)
    bulge: float = 0.04  # of the radius


MATERIALS = {
    "sclera": {"specular": 0.55, "shininess": 140.0, "texture": EYE_TEXTURE, "kind": "eye"},
    "iris": {"specular": 0.9, "shininess": 260.0, "texture": EYE_TEXTURE, "kind": "eye"},
}


def fit_eyeballs(cage: Cage, style: EyeStyle | None = None) -> tuple[Eyeball, Eyeball]:
    """Left and right eyeball of a cage."""
    found, style = [], style or EyeStyle()
    for side, word, sign in (("l", "Left", 1.0), ("r", "Right", -1.0)):
        centre, radius = fit_sphere(cage.vertices[cage.group(f"helper-{side}-eye")])
        turns = {}
        for gaze, (about_x, about_y, degrees) in GAZE_ANGLES.items():
            turns[gaze + word] = np.radians(degrees) * np.array([about_x, sign * about_y, 0.0])
        found.append(Eyeball(centre, radius, turns, style.iris, style.pupil, style.bulge))
    return found[0], found[1]


def ball_radius(ball: Eyeball, off: FloatArray) -> FloatArray:
    """Distance of the surface from the centre, mm, at angles from the gaze, radians."""
    return ball.radius * (1.0 + ball.bulge * np.clip(1.0 - (off / (ball.iris * 1.15)) ** 2, 0, None) ** 1.3)


def eyeball_piece(ball: Eyeball, side: str, style: EyeStyle) -> HeadPart:
    """The piece of the eyeball on the side ``Left`` or ``Right``."""
    rings = _ring_angles(style)
    around = np.linspace(0, 2 * np.pi, N_AROUND, endpoint=False)
    off, turn = (grid.ravel() for grid in np.meshgrid(rings, around, indexing="ij"))
    towards = np.stack([np.sin(off) * np.cos(turn), np.sin(off) * np.sin(turn), np.cos(off)], axis=1)
    row, column = np.meshgrid(np.arange(len(rings) - 1), np.arange(N_AROUND), indexing="ij")
    a, b = row * N_AROUND + column, row * N_AROUND + (column + 1) % N_AROUND
    quads = np.stack([a, a + N_AROUND, b + N_AROUND, b], axis=-1).reshape(-1, 4)
    triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    in_disc = off <= style.iris
    in_iris = off[triangles].max(axis=1) <= style.iris + 0.031
    return HeadPart(
        vertices=ball.centre + ball_radius(ball, off)[:, None] * towards,
        spans=(
            MaterialSpan("sclera", triangles[~in_iris], MATERIALS["sclera"]),
            MaterialSpan("iris", triangles[in_iris], MATERIALS["iris"]),
        ),
        colours=np.where(in_disc[:, None], np.array(style.colour), SCLERA),
        shapes={f"eyeBlink{side}": np.tile([0.0, 0.0, -RECEDE_MM], (len(towards), 1))},
        uv=eye_coordinates(off, turn),
    )


def _ring_angles(style: EyeStyle) -> FloatArray:
    """Angles from the gaze at which the eyeball's vertices lie, radians."""
    inner = np.linspace(style.pupil + 0.02, style.iris, 10)
    outer = np.linspace(style.iris + 0.03, style.iris + 0.27, 4)
    return np.concatenate([np.linspace(0, style.pupil, 4), inner, outer, np.linspace(style.iris + 0.4, BACK_RAD, 7)])


def eye_coordinates(off: FloatArray, turn: FloatArray) -> FloatArray:
    """(N, 2) texture coordinates by the angle from the gaze and the angle around it, v down."""
    far = 0.5 * off / EDGE_RAD
    placed: FloatArray = 0.5 + np.column_stack([far * np.cos(turn), -far * np.sin(turn)])
    return placed


def eye_texture(picture: NDArray[np.uint8], style: EyeStyle) -> NDArray[np.uint8]:
    """(SIDE, SIDE, 3) texture of an eyeball from the package's picture (H, W, 4), with the upper lid's shadow.

    Iris and pupil get the angles of `style`, and the iris its colour.
    """
    grid = (np.arange(TEXTURE_SIDE) + 0.5) / TEXTURE_SIDE - 0.5
    across, up = np.meshgrid(grid, -grid)
    off, turn = 2 * EDGE_RAD * np.hypot(across, up), np.arctan2(up, across)
    radius = np.interp(
        off, [0, style.pupil, style.iris, EDGE_RAD * 1.45], [0, SOURCE_PUPIL_PX, SOURCE_IRIS_PX, SOURCE_BALL_PX]
    )
    column, row = SOURCE_CENTRE[0] + radius * np.cos(turn), SOURCE_CENTRE[1] - radius * np.sin(turn)
    source = picture[:, :, :3] / 255.0
    colour = np.stack([map_coordinates(source[:, :, k], [row, column], order=1) for k in range(3)], axis=-1)
    light = colour.mean(axis=2)
    share = np.clip((style.iris + 0.03 - off) / 0.04, 0, 1)[:, :, None]
    depth = np.clip((off - style.pupil) / (style.iris - style.pupil), 0, 1)
    iris = IRIS_GAIN * light[:, :, None] * np.array(style.colour)
    frill = np.exp(-(((depth - 0.15) / 0.2) ** 2))[:, :, None]
    iris *= 1 - 0.35 * frill * np.array([0.0, 0.25, 0.6])
    iris *= (1 - LIMBUS * np.clip((depth - 0.80) / 0.20, 0, 1) ** 1.5)[:, :, None]
    iris = np.where((off < style.pupil)[:, :, None], 0.5 * colour * np.array([0.4, 0.35, 0.3]), iris)
    white = np.clip(colour * SCLERA / SOURCE_SCLERA, 0, SCLERA_MOST)
    pink = np.clip((off - style.iris - 0.12) / 0.75, 0, 1)[:, :, None]
    white *= 1 - pink * np.array([0.13, 0.24, 0.25])
    mixed = white + share * (iris - white)
    height = np.sin(off) * np.sin(turn)
    shade = 1 - LID_SHADE * smoothstep(height, -0.02, 0.40)
    painted: NDArray[np.uint8] = np.rint(255 * np.clip(mixed * shade[:, :, None], 0, 1)).astype(np.uint8)
    return painted
