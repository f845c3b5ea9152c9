"""Catchlights: where they lie in an iris, and that pictures of faces have them."""

from dataclasses import replace

import numpy as np
import pytest

from tests.picture.film.lit_face import lit_tiny_face
from tests.picture.posed_eyes import FACES, gazing, irises
from tests.picture.tiny_face import tiny_face
from tts2face.face.deformation import REST_HEAD
from tts2face.models.face_loading import load_face
from tts2face.picture.catchlights import PLACE_RIGHT, PLACE_UP, SCALE, STRENGTH, catchlight_sizes, place_catchlight
from tts2face.picture.options import Picture
from tts2face.picture.renderer import mesh_renderer

IRIS, SIZE = 0.87, 0.2
RADIUS = np.sqrt(1 - IRIS**2)
CENTRE = np.array([15.0, 0.0, 800.0])  # in camera space, where y is down


def lids(upper, lower):
    """(2, 9, 3) lids that meet at the corners."""
    across = np.linspace(-0.8, 0.8, 9)
    bow = 1 - (across / 0.8) ** 2
    return np.stack([np.column_stack([across, -height * bow, np.zeros(9)]) for height in (upper, lower)])


def gaze(right, up):
    return np.array([np.sin(right), -np.sin(up), -np.sqrt(1 - np.sin(right) ** 2 - np.sin(up) ** 2)])


def test_a_catchlight_lies_in_the_upper_third_of_what_is_seen_of_the_iris() -> None:
    rng = np.random.default_rng(0)
    sight = CENTRE / np.linalg.norm(CENTRE)
    for _ in range(300):
        towards = gaze(*rng.uniform(-0.35, 0.35, 2))
        opening = lids(rng.uniform(0.25, 0.6), -rng.uniform(0.25, 0.6))
        row = place_catchlight(CENTRE, towards, opening, (IRIS, SIZE), -1.0)
        right, up, size = row[PLACE_RIGHT], row[PLACE_UP], 1 / row[SCALE]
        ends = np.linspace(-1, 1, 2001)
        # the iris as it is seen: points of the ball nearer to the gaze than its edge
        ball = right * row[:3] + ends[:, None] * row[3:6]
        ahead = -np.sqrt(np.maximum(1 - (ball**2).sum(axis=1), 0))[:, None] * sight
        bow = 1 - (right / 0.8) ** 2
        inside = ((ball + ahead) @ towards > IRIS) & ((ball**2).sum(axis=1) < 1)
        inside &= (ends < -opening[0, 4, 1] * bow) & (ends > -opening[1, 4, 1] * bow)
        low, top = ends[inside].min(), ends[inside].max()
        assert 2 / 3 - 0.05 < (up - low) / (top - low) < 0.85
        assert up + 0.9 * size < top
        assert row[STRENGTH] > 0.5


def test_it_is_on_the_same_side_in_both_eyes_and_moves_without_jumps() -> None:
    rng = np.random.default_rng(1)
    for _ in range(40):
        towards, opening = gaze(*rng.uniform(-0.3, 0.3, 2)), lids(0.4, -0.4)
        rows = [place_catchlight(at, towards, opening, (IRIS, SIZE), -1.0) for at in (CENTRE, CENTRE * [-1, 1, 1])]
        assert rows[0][PLACE_RIGHT : SCALE + 1] == pytest.approx(rows[1][PLACE_RIGHT : SCALE + 1], abs=0.06, rel=0.1)
    path = [
        place_catchlight(CENTRE, gaze(0.6 * t - 0.3, 0.2 * t), lids(0.5 - 0.5 * t, -0.4 * (1 - t)), (IRIS, SIZE), -1.0)
        for t in np.linspace(0, 1, 2001)
    ]
    places, strength = np.array(path)[:, PLACE_RIGHT : PLACE_UP + 1], np.array(path)[:, STRENGTH]
    shown = strength[1:] > 0.02
    assert np.abs(np.diff(places, axis=0))[shown].max() < 0.004
    assert np.abs(np.diff(strength)).max() < 0.02


def test_it_shrinks_under_narrow_lids_and_goes_when_they_shut() -> None:
    rows = [
        place_catchlight(CENTRE, gaze(0, 0), lids(open_by, -open_by), (IRIS, SIZE), 1.0) for open_by in (0.5, 0.2, 0.1)
    ]
    sizes = [1 / row[SCALE] for row in rows]
    assert sizes[0] > 1.2 * sizes[1] > 1.2 * sizes[2]
    assert place_catchlight(CENTRE, gaze(0, 0), lids(0.0, 0.0), (IRIS, SIZE), 1.0)[STRENGTH] == 0
    assert place_catchlight(CENTRE, -gaze(0, 0), lids(0.5, -0.5), (IRIS, SIZE), 1.0)[STRENGTH] == 0
    assert place_catchlight(CENTRE, gaze(0, 0), None, (IRIS, SIZE), 1.0)[STRENGTH] == 1


def test_eyes_that_are_large_in_the_face_have_large_ones() -> None:
    centres = np.array([[-32, 0, 0], [32, 0, 0]])
    people, drawn = (catchlight_sizes(centres, np.full(2, radius)) for radius in (12.0, 30.0))
    assert (people < 0.8 * drawn).all()
    assert catchlight_sizes(centres[:1], np.full(1, 12.0)).shape == (1,)


@pytest.mark.parametrize("name", FACES)
def test_both_eyes_of_a_face_shine_at_any_gaze(name: str) -> None:
    face = load_face(name)
    renderer = mesh_renderer(face, Picture(size="512x512"))
    for right, up, yaw in [(0, 0, 0), (0.7, 0, -0.2), (-0.7, 0.3, 0.2), (0, -0.6, 0), (0.3, 0.6, 0.35)]:
        weights, head = gazing(face, right, up), REST_HEAD + np.float32([0, yaw, 0, 0, 0, 0])
        for light in irises(renderer, weights, head):
            assert light.max() > 180, (right, up, yaw)
            assert light.max() - np.median(light) > 70, (right, up, yaw)
            assert (light > light.max() - 40).mean() < 0.2, (right, up, yaw)  # a point, no plane


def test_a_picture_without_lamps_keeps_the_light_that_it_has() -> None:
    face = lit_tiny_face()
    renderer = mesh_renderer(face, Picture(size="128x128"))
    picture = renderer.draw(np.zeros(len(face.shape_names), np.float32))
    assert picture.max() < 230


def test_faces_without_eyes_or_landmarks_of_lids_are_drawn() -> None:
    for face in (tiny_face(), replace(tiny_face(), eyes=())):
        picture = mesh_renderer(face, Picture(size="64x64", quality="draft")).draw(np.zeros(len(face.shape_names)))
        assert picture.std() > 5
    lit = lit_tiny_face()
    lamp = np.zeros((1, 17), np.float32)
    lamp[0, 2], lamp[0, 14:] = 500, 5
    for eyes in (lit.eyes, ()):
        shown = replace(lit, eyes=eyes, light=lit.light.changed(lambda light: replace(light, lamps=lamp)))
        assert mesh_renderer(shown, Picture(size="64x64")).draw(np.zeros(len(lit.shape_names))).std() > 5
