"""Haircuts of drawn characters beside their own: cut, grown or combed from these, or of curls all over."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from corpus_tools.shipped.drawn.character import Curls, Hairstyle, Lock
from corpus_tools.shipped.drawn.elder import ELDER
from corpus_tools.shipped.drawn.girl import GIRL, PUFFS
from corpus_tools.shipped.drawn.hair import MIDDLE
from corpus_tools.shipped.drawn.man import MAN
from corpus_tools.shipped.drawn.woman import WOMAN
from corpus_tools.shipped.head.build_head import METADATA
from corpus_tools.shipped.head.head import PIVOT
from tts2face.models.baked_light import HairLight
from tts2face.models.face import Face
from tts2face.models.lit_hair import LitHair, swing_shapes

Place = tuple[float, float, float]
HANGS_BELOW_DEG = -50.0  # ends that hang free of the head
ENDS_BELOW_DEG = -30.0  # locks that hang
_BOB, _QUIFF, _BUN, _PUFFS = (item.hair for item in (WOMAN, MAN, ELDER, GIRL))
_LONG_ENDS = ((0, -62, 16), (-2, -84, 34), (-4, -104, 44), (-6, -118, 40))
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
    locks=(*(lock if lock.is_ball else replace(lock, thickness=5.0) for lock in _BUN.locks), *_STRANDS),
)
_SHORT_CURLS = replace(
    _QUIFF,
    name="curls",
    summary="short curls over faded sides",
    locks=(),
    shell_lift=2.0,
    curls=Curls(lift=20, width=13, height=5, sides=0.45),
)
_AFRO = replace(_PUFFS, name="afro", summary="curls all over", locks=(), curls=Curls(lift=40, width=17, height=7))


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


_PARTED = replace(
    _QUIFF, name="parted", summary="the quiff combed flat", locks=tuple(comb(lock, 0.45) for lock in _QUIFF.locks)
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
