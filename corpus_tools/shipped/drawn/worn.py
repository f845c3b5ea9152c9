"""Haircuts of drawn characters beside their own: cut, grown or combed from these, or of curls all over.

Clothes of a drawn character: a rolled collar over the shirt, and ear studs.

Round glasses of a drawn character: rims, a bridge and temples of thin wire.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from corpus_tools.shipped.drawn.character import Collar, Colour, Curls, Hairstyle, Lock
from corpus_tools.shipped.drawn.elder import ELDER
from corpus_tools.shipped.drawn.fields import COLLAR, SHIRT, cut_seam, in_tile, smooth_line, wind_outward
from corpus_tools.shipped.drawn.girl import GIRL, PUFFS
from corpus_tools.shipped.drawn.hair import MIDDLE
from corpus_tools.shipped.drawn.man import MAN
from corpus_tools.shipped.drawn.woman import WOMAN
from corpus_tools.shipped.head.build_head import METADATA
from corpus_tools.shipped.head.head import PIVOT
from corpus_tools.shipped.head.mesh import Eyeball, HeadPart, MaterialSpan, grid_triangles
from corpus_tools.shipped.head.skin import HeadSkin
from tts2face.models.baked_light import HairLight
from tts2face.models.face import Face
from tts2face.models.lit_hair import LitHair, swing_shapes
from tts2face.numeric.arrays import smoothstep, unit_vectors

Place = tuple[float, float, float]
HANGS_BELOW_DEG = -50.0  # ends that hang free of the head
ENDS_BELOW_DEG = -30.0  # locks that hang


def cut(lock: Lock, lowest_deg: float) -> Lock:
    """A lock that ends at an elevation, lying close there."""
    path = list(lock.path)
    if path[-1][1] >= lowest_deg:
        return lock
    end = next(at for at, place in enumerate(path) if at and place[1] < lowest_deg)
    before, after = np.array(path[end - 1]), np.array(path[end])
    share = (before[1] - lowest_deg) / (before[1] - after[1])
    azimuth, elevation, lift = (before + share * (after - before)).tolist()
    path = [*path[:end], (azimuth, elevation, min(lift, 5.0))]
    if len(path) > 2 and path[-2][1] - lowest_deg < 8.0:
        del path[-2]
    return replace(lock, path=tuple(path), tip=1.0, bluntness=0.15)


def grow(lock: Lock, *ends: Place) -> Lock:
    """A lock that hangs on: places after its last but one, whose azimuths are turns from there."""
    if lock.path[-1][1] > ENDS_BELOW_DEG:
        return lock
    azimuth = lock.path[-2][0]
    return replace(lock, path=(*lock.path[:-1], *((azimuth + turn, low, lift) for turn, low, lift in ends)))


def comb(lock: Lock, share: float) -> Lock:
    """A lock that stands off the head by a share of its height."""
    return replace(lock, path=tuple((turn, up, min(lift, share * lift)) for turn, up, lift in lock.path))


def lay_closer(lock: Lock, by_mm: float, *, root_mm: float = 0.0, root_deg: float = 0.0) -> Lock:
    """A lock that lies lower on the head; its root lies `root_mm` lower still, and `root_deg` nearer to the face."""
    path = [(turn, up, lift - by_mm * (up > HANGS_BELOW_DEG)) for turn, up, lift in lock.path]
    turn, up, lift = path[0]
    path[0] = (turn, up - root_deg, lift - root_mm)
    return replace(lock, path=tuple(path), clearance=1.0 if root_mm else lock.clearance)


def raise_to(lock: Lock, top_deg: float) -> Lock:
    """A lock that is combed up from where it grows to the crown, flat on the head."""
    turn, low, lift = lock.path[0]
    path = ((share * turn, low + up * (top_deg - low), 4.0) for share, up in ((0.97, 0.35), (0.93, 0.7), (0.9, 0.98)))
    return replace(lock, thickness=4, path=((turn, low, lift), *path))


_BOB, _QUIFF, _BUN, _PUFFS = (one.hair for one in (WOMAN, MAN, ELDER, GIRL))
_LONG_ENDS = ((0, -62, 16), (-2, -84, 34), (-4, -104, 44), (-6, -118, 40))
_LONG = replace(
    _BOB,
    name="long",
    summary="over the shoulders",
    locks=tuple(grow(lock, *_LONG_ENDS) for lock in _BOB.locks),
)
_PIXIE = replace(
    _BOB,
    name="pixie",
    summary="short, swept to a side",
    locks=tuple(cut(lock, -14.0) for lock in _BOB.locks),
    shell_lift=7.0,
)
_STRANDS = tuple(  # loose at the temples
    Lock(
        path=((side * 33, 40, -2), (side * 48, 26, 4), (side * 60, 8, 5), (side * 66, -10, 6), (side * 64, -26, 4)),
        half_width=5.5, thickness=4, clearance=1.5,
    )
    for side in (1, -1)
)  # fmt: skip
_UPDO = replace(
    _BUN,
    summary="tied into a bun, with loose strands at the temples",
    locks=(*(one if one.is_ball else replace(one, thickness=5.0) for one in _BUN.locks), *_STRANDS),
)
_PARTED = replace(
    _QUIFF, name="parted", summary="the quiff combed flat", locks=tuple(comb(lock, 0.45) for lock in _QUIFF.locks)
)
_SHORT_CURLS = replace(
    _QUIFF,
    name="curls",
    summary="short curls over faded sides",
    locks=(),
    shell_lift=2.0,
    curls=Curls(lift=20, width=13, height=5, sides=0.45),
)
_PUFF = replace(
    _PUFFS,
    name="puff",
    summary="one puff of curls on the crown",
    locks=(
        replace(
            PUFFS[0],
            path=((70, 62, 30), (90, 80, 40), (-90, 80, 40), (-70, 62, 30)),
            half_width=54,
            thickness=50,
            clearance=20.0,
        ),
        *(raise_to(lock, 78.0) for lock in _PUFFS.locks if lock not in PUFFS),
    ),
)
_AFRO = replace(_PUFFS, name="afro", summary="curls all over", locks=(), curls=Curls(lift=40, width=17, height=7))
HAIRCUTS: Mapping[str, tuple[Hairstyle, ...]] = {
    "ada": (_LONG, _UPDO),
    "ben": (_PARTED, _SHORT_CURLS),
    "noor": (replace(_BOB, summary="swept to a side, to the jaw"), _PIXIE),
    "zuri": (_PUFF, _AFRO),
}  # of characters by their names, beside their own


def lit_haircut(face: Face, style: Hairstyle, light: HairLight) -> LitHair:
    """The hair of a face that wears it, for faces of the same character."""
    own = face.parts[-1]
    corners = face.triangles[own.first :]
    n = int(corners.min())
    about = {
        **METADATA,
        "name": style.name,
        "summary": style.summary,
        "made_by": "python -m corpus_tools.shipped.make_models",
    }
    moves = {name: shape[n:] for name, shape in zip(face.shape_names, face.shapes, strict=True) if shape[n:].any()}
    middle = (MIDDLE + (face.pivot - PIVOT)).astype(np.float32)
    whole = swing_shapes(face.vertices[n:], np.ones(len(face.vertices) - n, np.float32), middle)
    pairs = [(moves.pop(name, np.zeros_like(shape)), shape) for name, shape in whole.items()]
    along = sum((own * shape).sum(axis=1) for own, shape in pairs)
    loose = along / np.maximum(sum((shape**2).sum(axis=1) for _, shape in pairs), 1e-6)
    uv, tangents = (values[n:] for values in (face.uv, face.tangents) if values is not None)
    return LitHair(
        face=str(face.metadata["name"]),
        n_face_vertices=n,
        n_face_triangles=own.first,
        vertices=face.vertices[n:],
        triangles=corners - np.int32(n),
        uv=uv,
        tangents=tangents,
        colours=face.colours[n:],
        loose=np.rint(255 * np.clip(loose, 0, 1)).astype(np.uint8),
        middle=middle,
        shapes=moves,
        skins=(face.textures[0].pixels,),
        lights=(light,),
        metadata=about,
    )


Floats = NDArray[np.float64]

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


def _roll(collar: Collar) -> tuple[Floats, NDArray[np.int64], Floats]:
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


def breath(vertices: Floats) -> Floats:
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


WIRE_MM, N_RIM_SECTION = 1.5, 8
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
        tubes.append(_tube(rim, is_closed=True))
        outer = rim[np.argmax(sign * rim[:, 0] + 0.4 * rim[:, 1])]
        ear = EAR_MM * [sign, 1, 1]
        bend = 0.5 * (outer + ear) + [sign * 7.0, 2.0, 6.0]
        knots = np.stack([outer, bend, ear, ear - np.array([3.0 * sign, 9.0, 9.0])])
        tubes.append(_tube(smooth_line(knots, N_TEMPLE)))
        inner.append(rim[np.argmax(-sign * rim[:, 0] + 0.3 * rim[:, 1])])
    middle = 0.5 * (inner[0] + inner[1]) + [0.0, 3.5, 2.0]
    tubes.append(_tube(smooth_line((inner[0], middle, inner[1]), N_BRIDGE)))
    counts = np.cumsum([0, *(len(points) for points, _ in tubes)])
    points = np.concatenate([points for points, _ in tubes])
    faces = np.concatenate([faces + count for (_, faces), count in zip(tubes, counts, strict=False)])
    return HeadPart(points, (MaterialSpan("glasses", faces, GLASSES_MATERIAL),), np.tile(colour, (len(points), 1)))


def _tube(path: Floats, *, is_closed: bool = False) -> tuple[Floats, NDArray[np.int64]]:
    """Points and triangles of a wire along a path (N, 3)."""
    around = np.roll(path, -1, axis=0) - np.roll(path, 1, axis=0) if is_closed else np.gradient(path, axis=0)
    along = unit_vectors(around)
    up = unit_vectors(np.cross(along, [0.31, 0.17, 0.93]) + 1e-9)
    side = np.cross(along, up)
    turn = np.linspace(0, 2 * np.pi, N_RIM_SECTION, endpoint=False)
    rings = path[:, None] + WIRE_MM * (
        np.cos(turn)[None, :, None] * up[:, None] + np.sin(turn)[None, :, None] * side[:, None]
    )
    rings = rings[:, np.append(np.arange(N_RIM_SECTION), 0)]
    if is_closed:
        rings = np.concatenate([rings, rings[:1]])
    points, triangles = rings.reshape(-1, 3), grid_triangles(len(rings), N_RIM_SECTION + 1)
    return points, wind_outward(points, triangles, path.mean(axis=0))
