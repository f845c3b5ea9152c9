"""Coverage of pixels at the edges of transparent pictures."""

import numpy as np
import pytest

from tests.picture.film.lit_face import lit_tiny_face
from tts2face.picture.baked.coverage import FINE, N_BITS, cover_pixels, refine_edges
from tts2face.picture.baked.visibility import N_COLUMNS, NEAR, X
from tts2face.picture.options import Picture
from tts2face.picture.renderer import mesh_renderer

SIDE = 2  # samples along a pixel's side


def projected(places) -> np.ndarray:
    """Table of vertices at places (N, 2) in pixels."""
    table = np.zeros((len(places), N_COLUMNS), np.float32)
    table[:, X : X + 2], table[:, NEAR] = np.asarray(places) * SIDE - 0.5, 1
    return table


def test_places_in_triangles_are_those_that_geometry_says() -> None:
    rng = np.random.default_rng(2)
    for _ in range(30):
        places = rng.uniform(-2, 10, (3, 2))
        a, b, c = places
        # as the kernels see them, those that face the camera turn clockwise on the screen's axes
        if (b - a)[0] * (c - a)[1] - (b - a)[1] * (c - a)[0] > 0:
            places = places[::-1]
        rows = np.zeros((64, FINE), np.int32)
        triangle = np.array([[0, 1, 2]], np.int32)
        cover_pixels(projected(places), triangle, SIDE, np.arange(64, dtype=np.int32).reshape(8, 8), rows)
        fine = (np.arange(8 * FINE) + 0.5) / FINE
        x, y = np.meshgrid(fine, fine)
        inside = np.ones_like(x, bool)
        for (x0, y0), (x1, y1) in zip(places, np.roll(places, -1, axis=0), strict=True):
            inside &= (x1 - x0) * (y - y0) - (y1 - y0) * (x - x0) <= 0
        wanted = inside.reshape(8, FINE, 8, FINE).sum(axis=(1, 3))
        found = N_BITS[rows].sum(axis=1).reshape(8, 8)
        assert np.abs(found - wanted).sum() <= 2
        back = np.zeros((64, FINE), np.int32)
        cover_pixels(
            projected(places), triangle[:, ::-1].copy(), SIDE, np.arange(64).astype(np.int32).reshape(8, 8), back
        )
        assert not back.any()


def test_a_pixel_that_no_sample_found_takes_the_colour_beside_it() -> None:
    picture = np.zeros((4, 4, 4), np.uint8)
    picture[:2, :, :] = (200, 100, 50, 255)
    square = projected([(0, 0), (0, 2.2), (4, 0), (4, 2.2)])
    refine_edges(square, np.array([[0, 1, 2], [2, 1, 3]], np.int32), SIDE, picture)
    assert (picture[:2, :, 3] == 255).all()
    assert picture[2, :, 3] == pytest.approx(255 * 0.25, abs=40)
    assert (picture[2, :, :3] == (200, 100, 50)).all()
    assert not picture[3].any()


def test_edges_of_a_face_have_many_levels() -> None:
    face = lit_tiny_face()
    weights = np.zeros(len(face.shape_names), np.float32)
    coarse, fine = (
        mesh_renderer(face, Picture(size=f"{size}x{size}", background="transparent")).draw(weights)[..., 3]
        for size in (96, 768)
    )
    exact = fine.reshape(96, 8, 96, 8).mean(axis=(1, 3))
    edge = (exact > 2) & (exact < 253)
    assert len(np.unique(coarse[edge])) > 30
    assert np.abs(coarse[edge] - exact[edge]).mean() < 6
