"""The line between the lips lies where a picture shows it, nearer than the tracker's landmarks."""

from pathlib import Path

import numpy as np
import pytest

from tests.face.people import DRAWN, REALISTIC
from tests.photo.build.test_found_face import SIDE, found
from tests.photo.pictures import projected, still
from tts2face.models.landmarks import INNER_LIP_LOWER, INNER_LIP_UPPER
from tts2face.photo.found_face import FoundFace
from tts2face.photo.lines import N_LIP, InnerLips, find_lip_line, spline_weights
from tts2face.video.tracking import FaceTracker

CORNERS = 5  # points at each end whose place depends on what one calls a corner
OPEN = 0.35
SPREAD_LINES = spline_weights(len(INNER_LIP_UPPER), N_LIP)


@pytest.fixture(scope="module")
def tracker(face_model: Path) -> FaceTracker:
    return FaceTracker(face_model)


def errors(name: str, tracker: FaceTracker, **weights: float) -> tuple[InnerLips, float, float]:
    """The line of a rendered face, and the mean vertical errors of it and of the tracker, of the eye distance."""
    pixels = still(name, SIDE, **weights)
    face = found(pixels, tracker)
    line = find_lip_line(pixels, face)
    places = projected(name, SIDE, **weights)
    wanted = [SPREAD_LINES @ places[list(numbers), :2] for numbers in (INNER_LIP_UPPER, INNER_LIP_LOWER)]
    tracked = [SPREAD_LINES @ face.landmarks[list(numbers), :2] for numbers in (INNER_LIP_UPPER, INNER_LIP_LOWER)]
    return line, _apart((line.upper, line.lower), wanted, face), _apart(tracked, wanted, face)


def _apart(lines, wanted, face: FoundFace) -> float:
    away = [
        np.abs(line[CORNERS:-CORNERS, 1] - right[CORNERS:-CORNERS, 1])
        for line, right in zip(lines, wanted, strict=True)
    ]
    return float(np.mean(away) / face.eye_distance_px)


def test_closed_lips_meet_in_one_line(tracker: FaceTracker) -> None:
    measured = [errors(name, tracker) for name in (*DRAWN, *REALISTIC, "head")]
    for line, _, _ in measured:
        assert line.is_closed
        np.testing.assert_array_equal(line.upper, line.lower)
    _, own, tracked = zip(*measured, strict=True)
    assert max(own) < 0.01
    assert np.mean(own) < 0.65 * np.mean(tracked)


def test_open_lips_end_where_their_colour_does(tracker: FaceTracker) -> None:
    measured = [errors(name, tracker, jawOpen=OPEN) for name in (*DRAWN, *REALISTIC, "head")]
    for line, _, _ in measured:
        assert not line.is_closed
        assert (line.lower[:, 1] >= line.upper[:, 1]).all()
        np.testing.assert_array_equal(line.upper[[0, -1]], line.lower[[0, -1]])
    _, own, tracked = zip(*measured, strict=True)
    assert max(own) < 0.013
    assert np.mean(own) < 0.85 * np.mean(tracked)
