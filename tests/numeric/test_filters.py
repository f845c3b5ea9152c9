"""Filters, connected pieces and rows of arrays, against SciPy's own."""

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d, minimum_filter1d, uniform_filter1d
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from tts2face.numeric.arrays import append_rows, connected_pieces, zeros_with_room
from tts2face.numeric.filters import gaussian, moving_mean, moving_minimum

SIZES = (1, 2, 3, 7, 50, 2000)
WIDTHS = (1, 3, 5, 121, 243)


@pytest.mark.parametrize("n", SIZES)
@pytest.mark.parametrize("width", WIDTHS)
def test_moving_filters_have_the_bits_of_scipy(n: int, width: int):
    values = np.random.default_rng(n).random(n)
    assert moving_mean(values, width).tobytes() == uniform_filter1d(values, width, mode="nearest").tobytes()
    least = minimum_filter1d(values, width, mode="constant", cval=0.7)
    assert moving_minimum(values, width, 0.7).tobytes() == least.tobytes()


@pytest.mark.parametrize("n", SIZES)
@pytest.mark.parametrize("sigma", [0.3, 1.0, 2.4, 10.0])
def test_the_gaussian_is_that_of_scipy(n: int, sigma: float):
    values = np.random.default_rng(n).normal(size=(n, 20)).astype(np.float32)
    smooth = gaussian(values, sigma)
    expected = gaussian_filter1d(values, sigma, axis=0, mode="nearest")
    assert smooth.dtype == expected.dtype
    np.testing.assert_allclose(smooth, expected, rtol=0, atol=2e-7)  # equal bits where the compiler fuses nothing


def test_pieces_are_numbered_as_by_scipy():
    chance = np.random.default_rng(0)
    for _ in range(100):
        n = int(chance.integers(3, 60))
        corners = chance.integers(0, n, (int(chance.integers(1, 40)), 3))
        ends = np.concatenate([corners[:, :2], corners[:, 1:]]).T
        links = coo_matrix((np.ones(ends.shape[1], np.int8), tuple(ends)), (n, n))
        assert np.array_equal(connected_pieces(corners, n), connected_components(links, directed=False)[1])


def test_rows_are_appended_in_the_room_and_by_one_caller_only():
    rows = zeros_with_room(2, 3, (4, 3))
    more, other = (np.full((2, 4, 3), value, np.float32) for value in (1.0, 2.0))
    extended = append_rows(rows, more)
    again = append_rows(rows, other)
    assert np.shares_memory(extended, rows)
    assert not np.shares_memory(again, rows)
    assert np.array_equal(extended, np.concatenate([rows, more]))
    assert np.array_equal(again, np.concatenate([rows, other]))
    longest = append_rows(extended, other)  # beyond the room
    assert not np.shares_memory(longest, rows)
    assert np.array_equal(longest, np.concatenate([rows, more, other]))


def test_a_part_of_rows_is_not_extended_in_their_memory():
    rows = zeros_with_room(2, 3, (4, 3))
    part = rows[:, :2]
    assert not np.shares_memory(append_rows(part, part), rows)
    assert append_rows(part, part).shape == (4, 2, 3)
