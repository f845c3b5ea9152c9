"""Locks that are grown on a head."""

import numpy as np
import pytest

from corpus_tools.shipped.head.locks import NECK_Y, LockStyle, grow_locks, lock_tangents, paint_ribbons
from corpus_tools.shipped.head.scalp import MIDDLE, hair_share
from corpus_tools.shipped.head.skin import HeadSkin
from tts2face.numeric.arrays import unit_vectors

RADII = np.array([78.0, 96.0, 94.0])
N_AROUND = 48


@pytest.fixture(scope="module")
def skull() -> HeadSkin:
    """An ellipsoid of the size of a skull."""
    up = np.linspace(-0.49, 0.49, N_AROUND) * np.pi
    around = np.linspace(0, 2 * np.pi, N_AROUND, endpoint=False)
    turned, high = np.meshgrid(around, up)
    off = np.stack([np.cos(high) * np.sin(turned), np.sin(high), np.cos(high) * np.cos(turned)], axis=-1)
    index = np.arange(N_AROUND**2).reshape(N_AROUND, N_AROUND)
    quads = np.stack([index[:-1], np.roll(index, -1, 1)[:-1], np.roll(index, -1, 1)[1:], index[1:]], axis=-1)
    vertices = MIDDLE + RADII * off.reshape(-1, 3)
    return HeadSkin(vertices, {}, quads.reshape(-1, 4), np.zeros((len(vertices), 2)), vertices)


def grown(skull: HeadSkin, style: LockStyle) -> tuple[np.ndarray, np.ndarray]:
    """Places (N, S, 3) of the middle of locks, and their tangents."""
    body = np.concatenate([skull.vertices, [[0.0, NECK_Y - 60.0, 0.0]]])
    cards = grow_locks(skull, body, style, np.random.default_rng(3))
    tangents = lock_tangents(cards, style.n_steps).reshape(-1, style.n_steps + 1, 2, 3)
    return cards.vertices.reshape(-1, style.n_steps + 1, 2, 3).mean(axis=2), tangents[:, :, 0]


@pytest.mark.parametrize("style", [
    LockStyle(60, 45.0, 12.0, lift=0.7, curl=(5.0, 25.0)), LockStyle(60, 0.0, 20.0, 20, -150.0, 0.2, 0.3, 5.0),
])  # fmt: skip
def test_locks_begin_on_the_scalp_and_stay_off_the_skull(skull: HeadSkin, style: LockStyle) -> None:
    path, tangents = grown(skull, style)
    off = (path - MIDDLE) / RADII
    assert np.linalg.norm(off[:, 3:], axis=2).min() > 0.99
    assert (hair_share(path[:, 0]) > 0).mean() > 0.9
    along = unit_vectors(np.diff(path, axis=1))
    assert np.einsum("nsd,nsd->ns", along, tangents[:, :-1]).mean() > 0.8


def test_long_locks_end_at_their_height_and_leave_the_face_free(skull: HeadSkin) -> None:
    path, _ = grown(skull, LockStyle(80, 0.0, 20.0, 20, -150.0, 0.2, 0.3, 5.0))
    assert abs(np.median(path[:, -1, 1]) + 150.0) < 40.0
    before = (path[..., 2] > -8) & (path[..., 1] < 15) & (path[..., 1] > -105)
    assert not (before & (np.abs(path[..., 0]) < 55)).any()


def test_curls_turn_and_a_fringe_hangs_over_the_forehead(skull: HeadSkin) -> None:
    straight, curled = (
        grown(skull, LockStyle(60, 60.0, 10.0, 20, lift=0.7, curl=curl))[0] for curl in ((0, 30), (6, 25))
    )
    way = [np.linalg.norm(np.diff(path, axis=1), axis=2).sum(axis=1).mean() for path in (straight, curled)]
    assert way[1] > 1.2 * way[0]
    fringe, _ = grown(skull, LockStyle(30, 0.0, 15.0, lift=0.2, weight=0.2, fringe_y=24.0))
    assert (fringe[:, 0, 2] > -60).all()
    assert 10 < np.median(fringe[:, -1, 1]) < 50


def test_ribbons_thin_out_towards_their_tips() -> None:
    relief, cover = paint_ribbons(np.random.default_rng(1))
    third = len(cover) // 3
    assert cover[third : 2 * third].mean() > 1.3 * cover[-third // 3 :].mean()
    assert abs((relief * (cover > 128)).sum() / (cover > 128).sum() - 128) < 20
