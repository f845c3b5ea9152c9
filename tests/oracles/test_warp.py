"""The warping kernel against every path written out, and against another implementation."""

import numpy as np
import pytest

from lexicon.errors import InputError
from tests.packages import package
from tts2face.lips.blending import frame_distances, path_cost, warp_path, warp_space, warp_to_reference


def every_path(n, m):
    """All monotone paths from (0, 0) to (n - 1, m - 1)."""
    if n == 1 and m == 1:
        yield [(0, 0)]
        return
    for i, j in ((n - 1, m), (n, m - 1), (n - 1, m - 1)):
        if i > 0 and j > 0:
            for path in every_path(i, j):
                yield [*path, (n - 1, m - 1)]


@pytest.mark.parametrize("shape", [(1, 1), (1, 4), (3, 1), (3, 4), (5, 4)])
def test_the_path_is_the_cheapest_of_all(shape):
    cost = np.random.default_rng(sum(shape)).uniform(0, 1, shape)
    path = warp_path(cost)
    least = min(sum(cost[pair] for pair in other) for other in every_path(*shape))
    assert path_cost(cost, path) == pytest.approx(least, rel=1e-12)
    assert tuple(path[0]) == (0, 0)
    assert tuple(path[-1]) == (shape[0] - 1, shape[1] - 1)
    assert {tuple(step) for step in np.diff(path, axis=0).tolist()} <= {(0, 1), (1, 0), (1, 1)}


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("band", [1, 2])
def test_a_band_keeps_the_cheapest_path_within_it(band, seed):
    cost = np.random.default_rng(seed).uniform(0, 1, (5, 5))
    inside = [path for path in every_path(5, 5) if all(abs(i - j) <= band for i, j in path)]
    least = min(sum(cost[pair] for pair in path) for path in inside)
    assert path_cost(cost, warp_path(cost, band=band)) == pytest.approx(least, rel=1e-12)


def test_agrees_with_fastdtw_at_a_radius_that_makes_it_exact():
    fastdtw = package("fastdtw")
    stream = np.random.default_rng(8)
    source, target = np.cumsum(stream.normal(size=(40, 3)), axis=0), np.cumsum(stream.normal(size=(33, 3)), axis=0)
    cost = frame_distances(source, target)
    theirs, _ = fastdtw.fastdtw(source, target, radius=50, dist=2)
    assert path_cost(cost, warp_path(cost)) == pytest.approx(theirs, rel=1e-9)


def test_distances_are_euclidean():
    assert frame_distances(np.array([[0.0, 0.0]]), np.array([[3.0, 4.0], [0.0, 1.0]])).tolist() == [[5.0, 1.0]]


def test_equal_motions_map_onto_themselves():
    motion = np.arange(6.0)[:, None]
    path = warp_path(frame_distances(motion, motion))
    assert path.tolist() == [[at, at] for at in range(6)]


def test_a_late_event_is_laid_over_the_reference_s():
    """A peak at knot 6 against one at knot 5: after warping both peak at 5, so that averaging keeps its height."""
    knots = np.arange(12.0)
    reference = np.exp(-((knots - 5) ** 2) / 2)[:, None].astype(np.float32)
    late = np.exp(-((knots - 6) ** 2) / 2)[:, None].astype(np.float32)
    out = np.zeros_like(late)
    warp_to_reference(late, reference, np.ones(1, np.float32), 2, out, warp_space(len(late)))
    assert int(out.argmax()) == 5
    assert np.mean([out[5, 0], reference[5, 0]]) > 0.95 > np.mean([late[5, 0], reference[5, 0]])
    assert out[0] == late[0]
    assert out[-1] == late[-1]


@pytest.mark.parametrize(
    ("cost", "band", "reason"),
    [
        (np.zeros((0, 3)), None, "frames on both sides"),
        (np.array([[0.0, np.nan]]), None, "must be finite"),
        (np.array([[0.0, -1.0]]), None, "not negative"),
        (np.zeros((2, 6)), 3, "widen it"),
    ],
)
def test_refuses_costs_without_a_path(cost, band, reason):
    with pytest.raises(InputError, match=reason):
        warp_path(cost, band=band)
