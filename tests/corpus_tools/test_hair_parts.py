"""Edits of haircuts: cards without edges that show, and paint under them."""

from dataclasses import replace

import numpy as np
import pytest

from corpus_tools.shipped.head.haircut import (
    ROOT_MM,
    SUNK_MM,
    border_points,
    finish_curls,
    raise_roots,
    sink_strands,
    thin_roots,
)
from corpus_tools.shipped.head.scalp import LINE_Y, MIDDLE, hair_share
from corpus_tools.shipped.head.strands import Cards, StrandStyle, flat_relief
from tts2face.numeric.arrays import unit_vectors

SIDE = 128


def sheet(bottom: float = 50.0, height: float = 60.0) -> Cards:
    """A square card in front of the forehead, whose texture covers it upside down: v down is y down."""
    corners = np.array([[-30, bottom, 0], [30, bottom, 0], [30, bottom + height, 0], [-30, bottom + height, 0.0]])
    uv = np.array([[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]])
    return Cards(corners, np.array([[0, 1, 2], [0, 2, 3]]), uv, np.arange(4))


def test_borders_are_edges_of_one_triangle():
    points = border_points(sheet())
    on_border = np.isclose(np.abs(points[:, 0]), 30) | np.isclose(points[:, 1], 50) | np.isclose(points[:, 1], 110)
    assert on_border.all()
    assert len(points) == 4 * 41


def test_coverage_grows_from_the_hairline_in_strands():
    alpha, _ = thin_roots(sheet(), np.full((SIDE, SIDE), 255, np.uint8), np.zeros((4, 3)))
    rows_mm = np.arange(SIDE)[::-1] * 60 / SIDE  # above the lower border
    inner = alpha[:, SIDE // 4 : -SIDE // 4]
    at_line, far = inner[rows_mm < 1].mean(), inner[(rows_mm > 2.5 * ROOT_MM) & (rows_mm < 40)].mean()
    assert at_line < 60
    assert far > 240
    middle = inner[(rows_mm > 2) & (rows_mm < 3)]
    assert middle.std() > 40  # strands of different length, not one line


def test_strands_rise_from_the_parting_only():
    across = np.tile([0.0, 0.0, 1.0], (4, 1))
    cards = replace(sheet(), vertices=np.array([[0, 50, 0], [40, 110, 0], [0, 110, 0], [4, 110, 0.0]]))
    tangents = raise_roots(cards, across)
    assert tangents[:2] == pytest.approx(across[:2], abs=1e-6)  # below the parting, and beside it
    inwards = unit_vectors(MIDDLE - cards.vertices[2:])
    assert (np.einsum("nd,nd->n", tangents[2:], inwards) > np.einsum("nd,nd->n", across[2:], inwards) + 0.3).all()


def test_small_cards_lie_below_the_largest_sheet():
    big, small = sheet(60.0, 60.0), sheet(80.0, 10.0)
    both = Cards(
        np.concatenate([big.vertices, [[60.0, 90.0, 0.0]], small.vertices]),
        np.concatenate([big.triangles, [[1, 4, 2]], small.triangles + 5]),
        np.concatenate([big.uv, [[1.0, 0.5]], small.uv]),
        np.arange(9),
    )
    sunk = sink_strands(both)
    assert np.array_equal(sunk.vertices[:5], both.vertices[:5])
    closer = np.linalg.norm(both.vertices[5:] - MIDDLE, axis=1) - np.linalg.norm(sunk.vertices[5:] - MIDDLE, axis=1)
    assert closer == pytest.approx(np.full(4, SUNK_MM), abs=1e-9)


def test_curls_have_no_lower_edge_and_point_outwards():
    cards = sheet()
    alpha, tangents = finish_curls(cards, np.full((SIDE, SIDE), 255, np.uint8), np.zeros((4, 3)))
    assert alpha[-1].mean() <= 8
    assert alpha[: SIDE // 2].min() >= 248
    cosine = np.einsum("nd,nd->n", tangents, unit_vectors(cards.vertices - MIDDLE))
    assert (cosine > 0.8).all()
    assert len(np.unique(cosine.round(3))) == len(cosine)  # each its own way


def test_outlines_of_cards_are_no_lighter_than_the_hair():
    picture = np.zeros((64, 64, 4), np.uint8)
    picture[..., :3] = 250  # a light ground, as of the package's pictures
    picture[16:48, 16:48, :3], picture[16:48, 16:48, 3] = 60, 255
    picture[16:48, [15, 48], 3] = 128  # the outline is half covered, and half as light as the ground
    picture[16:48, [15, 48], :3] = 150
    cover = picture[:, :, 3] / 255.0
    relief = flat_relief(picture, cover, StrandStyle())
    assert relief[20:44, 15].max() <= 1.2 * relief[20:44, 30].mean()


def test_the_hairline_is_soft():
    z = np.full(200, 0.0)
    y = np.linspace(LINE_Y[0] - 25, LINE_Y[0] + 25, 200)
    share = hair_share(np.column_stack([np.zeros(200), y, z]))
    width = y[share > 0.9].min() - y[share < 0.1].max()
    assert 7 < width < 15  # mm
