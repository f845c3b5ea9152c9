"""Colours of vertices as a texture: what lies at a vertex and between two is the vertices' own mix."""

import numpy as np

from tts2face.interchange.exports.colour_tiles import colour_tiles
from tts2face.numeric.arrays import decode_srgb, encode_srgb


def _at(pixels, places):
    """Linear light (n, 3), mixed of the four texels around each place."""
    light = decode_srgb(pixels / 255)
    at = places * pixels.shape[0] - 0.5
    low = np.floor(at).astype(int)
    column, row = (at - low).T[:, :, None]
    x, y = low.T
    above = light[y, x] * (1 - column) + light[y, x + 1] * column
    below = light[y + 1, x] * (1 - column) + light[y + 1, x + 1] * column
    return above * (1 - row) + below * row


def test_colours_of_a_plane_and_their_mixes_are_read_back():
    chance = np.random.default_rng(0)
    shades = [chance.uniform(0, 1, (200, 2)) @ chance.uniform(0, 0.5, (2, 3)) for _ in range(5)]
    pixels, places = colour_tiles(shades)
    for colours, at in zip(shades, places, strict=True):
        assert np.abs(_at(pixels, at) - colours).max() < 0.01
        middle = (at[:-1] + at[1:]) / 2
        assert np.abs(_at(pixels, middle) - (colours[:-1] + colours[1:]) / 2).max() < 0.01


def test_one_colour_fills_its_tile():
    grey, red = np.full((3, 3), 0.2), np.tile([0.5, 0.0, 0.0], (1, 1))
    pixels, places = colour_tiles([grey, red])
    assert np.array_equal(encode_srgb(_at(pixels, places[0])), encode_srgb(grey))
    assert np.array_equal(encode_srgb(_at(pixels, places[1])), encode_srgb(red))


def test_colours_beyond_a_plane_are_near_it():
    chance = np.random.default_rng(1)
    cloud = 0.3 + chance.normal(0, [0.1, 0.05, 0.001], (500, 3))
    pixels, places = colour_tiles([np.clip(cloud, 0, 1)])
    assert np.sqrt(((_at(pixels, places[0]) - np.clip(cloud, 0, 1)) ** 2).mean()) < 0.005


def test_no_surface_makes_a_black_tile():
    pixels, places = colour_tiles([])
    assert (pixels.any(), places) == (False, [])
