"""Clothes of a drawn character: a rolled collar over the shirt, and ear studs."""

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from corpus_tools.dense.grids import grid_triangles, wind_outward
from corpus_tools.shipped.drawn.character import Collar, Colour
from corpus_tools.shipped.drawn.tiles import COLLAR, SHIRT, cut_seam, in_tile
from corpus_tools.shipped.head.parts import HeadPart, MaterialSpan
from corpus_tools.shipped.head.skin import HeadSkin
from tts2face.numeric.arrays import FloatArray, smoothstep, unit_vectors

MATERIAL = {"specular": 0.02, "shininess": 6.0, "wrap": 0.6}
ROLL_SHADE = 0.97  # of the shirt's colour
N_KNOTS, N_AROUND, N_SECTION = 12, 96, 16
NECK_Z = -66.0  # mm, the depth of the neck's axis
STUD_MM, STUD_COLOUR, STUD_OFF = 3.6, (0.98, 0.80, 0.36), np.array([1.6, 0.0, 1.0])
STUD_MATERIAL = {"specular": 0.6, "shininess": 60.0, "wrap": 0.3}
STUD_GRID = (9, 16)
BREATH_FROM_MM = (105.0, 150.0)  # below the eyes: from the neck to the shoulders
BREATH_MM, BREATH_GAIN = np.array([0.0, 3.0, 1.2]), np.array([0.008, 0.0, 0.0])


def sweater_piece(shirt: HeadPart, collar: Collar | None, colour: Colour) -> HeadPart:
    """A shirt of one colour, with a rolled collar if given; both are cut open at the back, for the texture."""
    off = shirt.vertices - [0.0, 0.0, NECK_Z if collar is None else collar.middle]
    turn = np.arctan2(off[:, 0], off[:, 2]) / (2 * np.pi) + 0.5
    rows, body, turn = cut_seam(shirt.spans[0].triangles, turn)
    radius, height = np.hypot(off[rows, 0], off[rows, 2]), shirt.vertices[rows, 1]
    down = np.hypot(radius - radius.min(), height.max() - height)  # from the collar outwards: around the neck as well
    uv = in_tile(SHIRT, turn / turn.max(), down / down.max())
    if collar is None:
        return HeadPart(
            shirt.vertices[rows], (MaterialSpan("shirt", body, MATERIAL),), np.tile(colour, (len(rows), 1)), uv=uv
        )
    points, triangles, places = _roll(collar)
    faces = np.concatenate([body, triangles + len(rows)])
    colours = np.concatenate([np.ones(len(rows)), np.full(len(points), ROLL_SHADE)])[:, None] * colour
    uv = np.concatenate([uv, in_tile(COLLAR, *places.T)])
    vertices = np.concatenate([shirt.vertices[rows], points])
    return HeadPart(vertices, (MaterialSpan("shirt", faces, MATERIAL),), colours, uv=uv)


def _roll(collar: Collar) -> tuple[FloatArray, NDArray[np.int64], FloatArray]:
    """Points, triangles, and places (N, 2) around the neck and around the roll, of a closed tube around the neck."""
    turn = np.linspace(0, 2 * np.pi, N_KNOTS, endpoint=False)
    forward = np.cos(turn)
    knots = np.column_stack([
        collar.across * np.sin(turn),
        collar.back + (collar.front - collar.back) * (1 + forward) / 2,
        collar.middle + np.where(forward > 0, collar.ahead, collar.behind) * forward,
    ])  # fmt: skip
    closed = np.concatenate([knots, knots[:1]])
    path = CubicSpline(np.arange(N_KNOTS + 1) / N_KNOTS, closed, bc_type="periodic")(np.arange(N_AROUND) / N_AROUND)
    along = unit_vectors(np.roll(path, -1, axis=0) - np.roll(path, 1, axis=0))
    out = unit_vectors((path - path.mean(axis=0)) * [1, 0, 1])
    out = unit_vectors(out - (out * along).sum(axis=1)[:, None] * along)
    up = np.cross(along, out)
    up *= np.sign(up[:, 1:2])
    tilt = np.radians(collar.tilt)
    out, up = out * np.cos(tilt) + up * np.sin(tilt), up * np.cos(tilt) - out * np.sin(tilt)
    section = np.linspace(0, 2 * np.pi, N_SECTION, endpoint=False)
    across = collar.half_width * np.cos(section)[None, :, None] * out[:, None]
    rings = path[:, None] + across + collar.half_height * np.sin(section)[None, :, None] * up[:, None]
    rings = rings[np.append(np.arange(N_AROUND), 0)][:, np.append(np.arange(N_SECTION), 0)]  # cut open both ways
    points, triangles = rings.reshape(-1, 3), grid_triangles(N_AROUND + 1, N_SECTION + 1)
    grid = np.meshgrid(np.linspace(0, 1, N_AROUND + 1), np.linspace(0, 1, N_SECTION + 1), indexing="ij")
    places = np.stack(grid, axis=-1).reshape(-1, 2)
    return points, wind_outward(points, triangles, path.mean(axis=0)), places


def breath(vertices: FloatArray) -> FloatArray:
    """Motion (N, 3) of a full breath: shoulders and chest rise, the neck hardly moves."""
    share = smoothstep(-vertices[:, 1], *BREATH_FROM_MM)[:, None]
    return np.asarray(share * (BREATH_MM + vertices * BREATH_GAIN))


def stud_pieces(skin: HeadSkin) -> tuple[HeadPart, HeadPart]:
    """Round studs on the lobes of both ears."""
    row, column = np.meshgrid(np.arange(STUD_GRID[0]), np.arange(STUD_GRID[1]), indexing="ij")
    down, around = (row / (STUD_GRID[0] - 1) * np.pi).ravel(), (column / STUD_GRID[1] * 2 * np.pi).ravel()
    ball = np.column_stack([np.sin(down) * np.cos(around), np.cos(down), np.sin(down) * np.sin(around)])
    triangles = wind_outward(ball, grid_triangles(*STUD_GRID, is_closed=True))
    pieces = []
    for sign in (1.0, -1.0):
        x, y = sign * skin.vertices[:, 0], skin.vertices[:, 1]
        ear = skin.vertices[(x > 66) & (y < -8) & (y > -60)]
        lobe = ear[ear[:, 1] < ear[:, 1].min() + 9]
        centre = lobe[np.argmax(sign * lobe[:, 0])] + STUD_OFF * [sign, 1, 1]
        span = MaterialSpan("stud", triangles, STUD_MATERIAL)
        pieces.append(HeadPart(centre + STUD_MM * ball, (span,), np.tile(STUD_COLOUR, (len(ball), 1))))
    return pieces[0], pieces[1]
