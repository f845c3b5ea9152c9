"""From samples to pixels: fragments, their colours in texels, and their mean."""

import numpy as np
import pytest
from scipy.ndimage import map_coordinates

from tts2face.numeric.kernels import BLOCK
from tts2face.picture.baked.modes import LIGHT_STEP, add_modes, pack_change
from tts2face.picture.baked.shading import (
    CHANGE_CODING,
    COLOUR_CODING,
    N_VALUES,
    add_texels,
    compose,
    evaluate,
    fetch,
    find_texels,
    lay_planes,
    list_fragments,
)
from tts2face.picture.baked.visibility import N_COLUMNS, NEAR, U, X, Y, nearest_triangles

SIZE = 16  # pixels


def draw_list(points, triangles, part_of, side):
    table = np.zeros((len(points), N_COLUMNS), np.float32)
    table[:, [X, Y, NEAR]] = points
    nearest, *columns = nearest_triangles(table, np.array(triangles, np.int32), (side * SIZE, side * SIZE))
    n = (side * SIZE) ** 2
    found = (np.zeros(n, np.int32), np.zeros(n, np.float32), np.zeros(n, np.float32), np.zeros(n, np.int32))
    keys = np.zeros((4, side * side), np.int64)
    pixels = np.zeros(SIZE * SIZE + 1, np.int32)
    count = list_fragments(nearest, (side, 0, *columns), np.array(part_of, np.int32), (*found, keys), pixels)
    return table, nearest, [values[:count] for values in found], pixels


@pytest.mark.parametrize("side", [1, 2, 3])
def test_a_pixel_has_one_fragment_for_each_surface_that_it_shows(side: int) -> None:
    last = side * SIZE
    points = [
        [-1, -1, 1e-3],
        [-1, last, 1e-3],
        [last, -1, 1e-3],
        [3, 3, 2e-3],
        [3, last / 2, 2e-3],
        [last / 2, 3, 2e-3],
    ]
    _, nearest, (_, across, down, samples), pixels = draw_list(points, [[0, 1, 2], [3, 4, 5]], [0, 1], side)
    covered = (nearest[:, :-BLOCK] > 0).reshape(SIZE, side, SIZE, side).sum(axis=(1, 3)).ravel()
    of_pixel = np.repeat(np.arange(SIZE * SIZE), np.diff(pixels))
    assert (np.bincount(of_pixel, samples, SIZE * SIZE) == covered).all()
    assert (np.bincount(of_pixel, minlength=SIZE * SIZE) <= 2).all()
    assert {int(n) for n in np.unique(samples)} <= set(range(1, side * side + 1))
    assert (across // side == of_pixel % SIZE).all()
    assert (down // side == of_pixel // SIZE).all()
    whole = samples == side * side
    assert across[whole] % side == pytest.approx((side - 1) / 2)


def test_values_are_linear_over_a_triangle() -> None:
    points = [[-1, -1, 1e-3], [-1, 33, 1e-3], [33, -1, 1e-3]]
    table, _, (triangle, across, down, _), _ = draw_list(points, [[0, 1, 2]], [0], 2)
    gradient = np.array([[0.01, 0.02], [0.03, -0.01], [1.5, 0.0], [0.0, -2.0], [3.0, 1.0]])
    table[:, U:] = table[:, :2] @ gradient.T + 5
    planes, values = np.zeros((1, 3, N_VALUES), np.float32), np.zeros((N_VALUES, len(triangle)), np.float32)
    found = (np.full(len(triangle), -1, np.int32), np.zeros(1, np.int32), np.zeros(1, np.int32))
    lay_planes(triangle, len(triangle), table, np.array([[0, 1, 2]], np.int32), found, planes)
    evaluate(found[0], across, down, len(triangle), planes, values)
    assert values == pytest.approx(gradient @ [across, down] + 5, abs=1e-3)


def test_texels_are_read_between_their_centres() -> None:
    rng = np.random.default_rng(1)
    height, width, n = 12, 20, 300
    texture = rng.integers(0, 256, (height, width, 3))
    change = rng.uniform(-250, 250, (3, height * width)).astype(np.float32)
    change = np.rint(change / LIGHT_STEP) * LIGHT_STEP
    values = np.zeros((N_VALUES, n), np.float32)
    values[:2] = rng.uniform(0.06, 0.94, (2, n))
    packed = np.zeros(height * width, np.int32)
    pack_change(change, packed)
    texels = (texture[..., 0] | texture[..., 1] << 8 | texture[..., 2] << 16).astype(np.int32).ravel()
    texel, share, corners = np.zeros(n, np.int32), np.zeros((2, n), np.float32), np.zeros((4, n), np.int32)
    find_texels(values, n, (width, height), texel, share)
    for source, coding in ((texels, COLOUR_CODING), (packed, CHANGE_CODING)):
        fetch(source, width, texel, n, corners)
        add_texels(corners, share, n, coding, values)
    at = [values[1] * height - 0.5, values[0] * width - 0.5]
    for channel in range(3):
        expected = map_coordinates(texture[..., channel].astype(float), at, order=1)
        expected += map_coordinates(change[channel].reshape(height, width).astype(float), at, order=1)
        assert values[2 + channel] == pytest.approx(expected, abs=0.1)


def test_modes_are_added_by_their_weights() -> None:
    rng = np.random.default_rng(2)
    base, modes = rng.integers(0, 255, 500).astype(np.uint8), rng.integers(-127, 128, (4, 500)).astype(np.int8)
    weights, out = np.array([0.5, 0.0, -0.25, 2.0], np.float32), np.zeros(500, np.float32)
    add_modes(base, modes, weights, out)
    assert out == pytest.approx(base + weights @ modes, abs=1e-3)


@pytest.mark.parametrize("channels", [3, 4])
def test_pixels_are_the_mean_of_what_they_show(channels: int) -> None:
    pixels = np.array([0, 0, 1, 3, 3], np.int32)  # none, a whole one, two, none
    samples, colour = (
        np.array([4, 1, 2], np.int32),
        np.array([[300, 100, 50], [-5, 100, 50], [30, 100, 50]], np.float32),
    )
    picture = np.full((1, 4, channels), 80, np.uint8)
    compose(pixels, samples, 4, colour, picture)
    assert picture[0, 0].tolist() == picture[0, 3].tolist() == [80] * channels
    assert picture[0, 1].tolist() == [255, 0, 30, 255][:channels]
    mixed = (100 + 2 * 50) / 4
    expected = [round(mixed / 0.75)] * 3 + [191] if channels == 4 else [round(mixed + 80 / 4)] * 3
    assert picture[0, 2].tolist() == pytest.approx(expected, abs=1)
