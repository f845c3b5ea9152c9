"""Haircuts that are grown: locks from the scalp, each a ribbon of strands that falls, waves or curls."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d
from scipy.spatial import cKDTree

from corpus_tools.dense.grids import grid_triangles
from corpus_tools.shipped.head.scalp import EAR, MIDDLE, hair_share
from corpus_tools.shipped.head.skin import HeadSkin, vertex_normals
from corpus_tools.shipped.head.strands import Cards
from tts2face.models.hair import MEAN_RELIEF
from tts2face.numeric.arrays import FloatArray, IntArray, smoothstep, unit_vectors

DOWN = np.array([0.0, -1.0, 0.0])
TORSO = np.array(
    [0.0, -300.0, -75.0]
)  # a point of the axis between the shoulders, from which the shirt's surface faces
FRINGE_WAY = np.array([0.1, -0.4, 1.0])  # of the roots above the forehead
NECK_Y = -115.0  # below it the shirt keeps hair out
# heights, depths and half width that stay free
FACE_Y = (-112.0, 48.0)
FACE_Z = (-40.0, -12.0)
FACE_HALF = 70.0
FACE_MM = 26.0  # over which hair is led beside the face
EAR_REACH, OVER_EAR = 1.3, (1.0, 0.0, 0.001)  # of its ellipsoid: there hair is kept off to the side
PART_MM = 9.0  # by which locks begin beyond a parting
MOST_PUSHED_MM, NEAR_MM = 6.0, 30.0  # off the skin in one step, and from where the skin does not matter
TILT = 0.5  # spread of the turns of curled ribbons about themselves, radians
KEPT = 0.93  # share of locks whose distance from the skin is the usual one
UNEVEN = 0.14  # share by which locks are shorter and longer
SPREAD_TRIES = 6  # candidates for each root, of which the one farthest from the others is taken
LOOSE_MM, CURL_ROOT_MM = 14.0, 22.0  # of a lock, over which it leaves the skull, and over which its curl grows
# The picture of strands: ribbons side by side, and strands in each.
N_RIBBONS = 5
RIBBON_PX = 104
PICTURE_PX = 520
N_STRANDS = 44
STRAND_PX = 1.15
SWAY_PX = 3.0
ROOT_SHARE = 0.04
LIGHTNESS = 0.24


@dataclass(frozen=True, slots=True)
class LockStyle:
    """How locks grow.

    ``length`` is that of a lock, mm; where ``end_y`` is given, locks of the sides and the back end at about that
    height instead. ``lift`` is the share of the skin's normal in the direction of the roots, ``weight`` how soon locks
    fall, ``part_x`` where a parting lies from which they are combed, None for none. Curls have a radius and a length
    along the lock, mm, ``order`` is the share in which neighbours curl alike. ``above`` is the least distance from the
    skin, ``cling`` the share of a step by which locks are drawn to it, ``fringe_y`` the height at which
    a fringe ends, which grows above the forehead only; None for locks of the whole scalp.
    """

    n_locks: int
    length: float
    width: float
    n_steps: int = 14
    end_y: float | None = None
    lift: float = 0.5
    weight: float = 0.25
    part_x: float | None = None
    curl: tuple[float, float] = (0.0, 30.0)
    order: float = 0.0
    above: float = 4.0
    cling: float = 0.0
    fringe_y: float | None = None


GROWN: Mapping[str, tuple[str, LockStyle]] = {
    "curly01": ("short curls", LockStyle(560, 48.0, 13.0, 14, lift=0.7, weight=0.1, curl=(5.0, 25.0), above=3.0)),
    "curly02": (
        "curls to the shoulders",
        LockStyle(420, 0.0, 15.0, 30, -140.0, 0.35, 0.2, 4.0, (7.0, 34.0), order=0.15, above=8.0, cling=0.1),
    ),
    "wavy01": (
        "long and wavy, parted",
        LockStyle(380, 0.0, 25.0, 26, -205.0, 0.2, 0.25, 10.0, (5.0, 62.0), order=0.75, above=10.0, cling=0.2),
    ),
    "wavy02": (
        "chin-length waves, parted at the side",
        LockStyle(330, 0.0, 21.0, 18, -85.0, 0.25, 0.26, 22.0, (5.0, 50.0), order=0.6, above=9.0, cling=0.2),
    ),
}
FRINGE = LockStyle(80, 0.0, 18.0, 14, lift=0.2, weight=0.2, above=7.0, fringe_y=24.0, cling=0.25)


def grow_locks(skin: HeadSkin, head: FloatArray, style: LockStyle, generator: np.random.Generator) -> Cards:
    """Locks on the scalp of a skin, outside of a head with vertices (V, 3), those after the skin's being clothes."""
    normals = vertex_normals(skin.vertices, skin.quads, skin.base)
    clothes = head[(head[:, 1] < NECK_Y) & (np.hypot(head[:, 0], head[:, 2] + 75.0) > 62.0)]
    axis = clothes - TORSO
    axis[:, 0] *= np.clip(1 - 190.0 / np.maximum(np.abs(axis[:, 0]), 190.0), 0.0, 1.0)
    body = cKDTree(np.concatenate([skin.vertices, clothes]))
    ears = np.linalg.norm((np.abs(skin.vertices) * (1, 0, 0) + skin.vertices * (0, 1, 1) - EAR[0]) / EAR[1], axis=1)
    normals = np.where((ears < EAR_REACH)[:, None], unit_vectors(skin.vertices * OVER_EAR), normals)
    outward = np.concatenate([normals, unit_vectors(axis + DOWN * -1e-6)])
    roots = _roots(skin, style, generator)
    places, along = skin.vertices[roots], _combed(skin.vertices[roots], normals[roots], style)
    length = _lengths(places, style, generator)
    step = (length / style.n_steps)[:, None]
    # locks lie upon each other: those that begin higher are the outer ones
    layer = style.above * (0.6 + 0.9 * places[:, 1].argsort().argsort() / len(roots))
    path = [places if style.part_x is None else places - PART_MM * along]
    for number in range(style.n_steps):
        gone = (number + 1) * step
        along = unit_vectors(along + style.weight * smoothstep(gone, 0.0, LOOSE_MM) * DOWN)
        moved = path[-1] + step * along
        distance, nearest = body.query(moved)
        depth = np.einsum("nd,nd->n", moved - body.data[nearest], outward[nearest])
        wanted = layer * smoothstep(gone[:, 0], 0.0, LOOSE_MM)
        lack = np.clip(wanted - depth, -style.cling * step[:, 0], MOST_PUSHED_MM) * (distance < NEAR_MM)
        moved = moved + lack[:, None] * outward[nearest]
        if style.fringe_y is None:
            moved = _beside_face(moved)
        along = unit_vectors(0.35 * along + 0.65 * unit_vectors(moved - path[-1]))
        path.append(moved)
    middle = gaussian_filter1d(np.stack(path, axis=1), 0.8, axis=1, mode="nearest")
    # few locks are thrown off by the ears
    away = np.where(middle[..., 1] > NECK_Y, body.query(middle)[0], 0.0).max(axis=1)
    middle = middle[away < np.quantile(away, KEPT) + 0.5 * style.above]
    return _ribbons(_curled(middle, style, generator), style, generator)


def _roots(skin: HeadSkin, style: LockStyle, generator: np.random.Generator) -> IntArray:
    """Vertices of the scalp, spread over it."""
    grown = hair_share(skin.vertices) > 0.5
    scalp = np.flatnonzero(grown & _is_front(skin.vertices) if style.fringe_y is not None else grown)
    chosen = [int(generator.choice(scalp))]
    apart = np.linalg.norm(skin.vertices[scalp] - skin.vertices[chosen[0]], axis=1)
    while len(chosen) < style.n_locks:
        tried = generator.choice(len(scalp), SPREAD_TRIES)
        best = int(tried[apart[tried].argmax()])
        chosen.append(int(scalp[best]))
        apart = np.minimum(apart, np.linalg.norm(skin.vertices[scalp] - skin.vertices[scalp[best]], axis=1))
    return np.array(chosen, np.int64)


def _combed(places: FloatArray, normals: FloatArray, style: LockStyle) -> FloatArray:
    """(N, 3) directions of the roots."""
    if style.fringe_y is not None:
        way = np.broadcast_to(FRINGE_WAY, places.shape)
    elif style.part_x is None:
        way = unit_vectors(0.5 * DOWN + 0.6 * unit_vectors((places - MIDDLE) * (1.0, 0.0, 1.0)))
    else:
        side = np.clip((places[:, 0] - style.part_x) / 12.0, -1.0, 1.0)
        way = unit_vectors(np.column_stack([side, np.full(len(side), -0.25), -0.35 * np.ones(len(side))]))
    flat = way - np.einsum("nd,nd->n", way, normals)[:, None] * normals
    return unit_vectors(style.lift * normals + (1 - style.lift) * unit_vectors(flat))


def _is_front(places: FloatArray) -> NDArray[np.bool_]:
    """Roots (N, 3) above the forehead."""
    return np.asarray((np.abs(places[:, 0]) < 56.0) & (places[:, 2] > -52.0) & (places[:, 1] > 60.0))


def _lengths(places: FloatArray, style: LockStyle, generator: np.random.Generator) -> FloatArray:
    """(N,) lengths of locks, mm."""
    length = np.full(len(places), style.length)
    if style.fringe_y is not None:
        length = 1.2 * np.hypot(places[:, 1] - style.fringe_y, 0.8 * (24.0 - places[:, 2]))
    elif style.end_y is not None:
        length = 1.06 * (places[:, 1] - style.end_y) + 0.35 * np.abs(places[:, 1] - 30.0)
    uneven: FloatArray = length * (1 - UNEVEN + 2 * UNEVEN * generator.random(len(length)))
    return uneven


def _beside_face(places: FloatArray) -> FloatArray:
    """Places (N, 3), those before the face moved to its sides."""
    x, y, z = places.T
    share = smoothstep(z, *FACE_Z) * smoothstep(y, FACE_Y[0] - FACE_MM, FACE_Y[0]) * (
        1 - smoothstep(y, FACE_Y[1] - FACE_MM, FACE_Y[1] + FACE_MM)
    )  # fmt: skip
    lack = np.clip(FACE_HALF - np.abs(x), 0.0, None) * share
    moved = places.copy()
    moved[:, 0] = x + np.where(x < 0, -lack, lack)
    moved[:, 2] = z - 0.3 * lack
    return moved


def _curled(middle: FloatArray, style: LockStyle, generator: np.random.Generator) -> FloatArray:
    """Paths (N, S, 3) of locks with their curls."""
    radius, turn = style.curl
    if not radius:
        return middle
    step = np.linalg.norm(np.diff(middle, axis=1), axis=2)
    far = np.concatenate([np.zeros((len(middle), 1)), np.cumsum(step, axis=1)], axis=1)
    along = unit_vectors(np.gradient(middle, axis=1))
    out = unit_vectors(middle - MIDDLE)
    out = unit_vectors(out - np.einsum("nsd,nsd->ns", out, along)[..., None] * along)
    aside = np.cross(along, out)
    angle = np.arctan2(middle[:, 0, 0], middle[:, 0, 2] - MIDDLE[2])
    phase = 2 * np.pi * generator.random(len(middle)) * (1 - style.order) + style.order * 1.5 * angle
    turned = phase[:, None] + 2 * np.pi * far / (turn * (0.85 + 0.3 * generator.random(len(middle)))[:, None])
    grown = radius * smoothstep(far, 0.0, CURL_ROOT_MM)
    flat = style.order  # ordered waves lie in the surface of the hair, curls turn about themselves
    curled: FloatArray = middle + grown[..., None] * (
        np.cos(turned)[..., None] * aside + (1 - 0.7 * flat) * (1 + np.sin(turned))[..., None] * out
    )
    return curled


def _ribbons(path: FloatArray, style: LockStyle, generator: np.random.Generator) -> Cards:
    """Ribbons along paths (N, S, 3), facing outwards, with the strands of `paint_ribbons`."""
    n, steps = path.shape[:2]
    along = unit_vectors(np.gradient(path, axis=1))
    out = unit_vectors(path - MIDDLE * (1.0, 1.0, 1.0))
    out[..., 1] *= smoothstep(path[..., 1], -20.0, 60.0)  # below the crown ribbons face to the sides
    across = unit_vectors(np.cross(along, unit_vectors(out)))
    # straight ribbons that are turned cut through each other
    tilt = TILT * (1 - style.order) * (style.curl[0] > 0) * generator.standard_normal((n, 1, 1))
    across = unit_vectors(across + tilt * np.cross(along, across))
    share = np.linspace(0.0, 1.0, steps)
    half = 0.5 * style.width * (0.7 + 0.6 * generator.random((n, 1))) * (1 - 0.65 * share**3) * (0.6 + 0.4 * share**0.3)
    corners = np.stack([path - half[..., None] * across, path + half[..., None] * across], axis=2)
    number = np.asarray(generator.integers(N_RIBBONS, size=n), np.float64)
    left = (number[:, None] + np.array([0.04, 0.96])) / N_RIBBONS
    uv = np.stack(np.broadcast_arrays(left[:, None, :], share[None, :, None]), axis=-1)
    ribbon = grid_triangles(steps, 2)
    triangles = ribbon[None] + (2 * steps * np.arange(n))[:, None, None]
    count = 2 * n * steps
    return Cards(corners.reshape(-1, 3), triangles.reshape(-1, 3), uv.reshape(-1, 2), np.arange(count))


def lock_tangents(cards: Cards, n_steps: int) -> FloatArray:
    """(N, 3) unit vectors along the locks of `grow_locks`, from root to tip."""
    corners = cards.vertices.reshape(-1, n_steps + 1, 2, 3)
    return unit_vectors(np.repeat(np.gradient(corners.mean(axis=2), axis=1)[:, :, None], 2, axis=2).reshape(-1, 3))


def paint_ribbons(generator: np.random.Generator) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
    """Relief and coverage (`PICTURE_PX`, `PICTURE_PX`), 0-255, of ribbons of strands that end one after the other."""
    down = np.linspace(0, 1, PICTURE_PX)
    across = np.arange(RIBBON_PX) + 0.5
    reliefs, covers = [], []
    for _ in range(N_RIBBONS):
        root = RIBBON_PX * (0.12 + 0.76 * generator.random(N_STRANDS))
        sway = gaussian_filter1d(generator.standard_normal((N_STRANDS, PICTURE_PX)), PICTURE_PX / 9, axis=1)
        sway *= SWAY_PX / np.maximum(sway.std(axis=1, keepdims=True), 1e-9)
        gather = 1 - 0.25 * down**2  # towards the tip
        x = RIBBON_PX / 2 + (root[:, None] - RIBBON_PX / 2) * gather + sway * down
        end = 0.72 + 0.28 * generator.random(N_STRANDS)
        width = (
            STRAND_PX
            * (0.8 + generator.random(N_STRANDS))[:, None]
            * np.sqrt(np.clip((end[:, None] - down) / 0.25, 0, 1))
        )
        light = np.exp(LIGHTNESS * generator.standard_normal(N_STRANDS))
        near = np.exp(-0.5 * ((across - x[..., None]) / np.maximum(width, 0.3)[..., None]) ** 2)
        near *= np.clip(width / 0.5, 0, 1)[..., None]
        cover = 1 - np.prod(1 - 0.97 * near, axis=0)
        weight = near**2 + 1e-9
        reliefs.append((weight * light[:, None, None]).sum(axis=0) / weight.sum(axis=0))
        covers.append(cover * smoothstep(down, 0.0, ROOT_SHARE)[:, None])
    relief, cover = np.concatenate(reliefs, axis=1), np.concatenate(covers, axis=1)
    relief = relief / ((relief * cover).sum() / cover.sum())
    return (
        np.rint(np.clip(MEAN_RELIEF * relief, 0, 255)).astype(np.uint8),
        (np.rint(cover * 31) * (255 / 31)).astype(np.uint8),
    )
