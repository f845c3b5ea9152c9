"""Lids of a picture that shut: smooth skin without the crease above an open eye, behind what lies before the eye."""

import cv2
import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from tests.photo.pictures import ONE_PROCESS, drawn, found_in, speaking, still
from tts2face.face.landmarks import moved_landmarks
from tts2face.models.landmarks import eye_aperture
from tts2face.photo.found_face import FoundFace
from tts2face.photo.lids import LidFrame
from tts2face.photo.lines import find_lid_lines
from tts2face.photo.photograph import Photograph
from tts2face.picture.options import Picture
from tts2face.picture.renderer import mesh_renderer
from tts2face.types import Trajectory

pytestmark = [pytest.mark.usefixtures("drafted"), ONE_PROCESS]

SIDE, NAME = 400, "head"
CREASE, RIM = 0.045, 0.115  # above the lashes and above the upper margin, of the eye distance
SHUT = {"eyeBlinkLeft": 1.0, "eyeBlinkRight": 1.0}
MIDDLE = slice(8, 17)  # columns of an eye


@pytest.fixture(scope="module")
def found() -> FoundFace:
    return found_in(NAME, SIDE)


@pytest.fixture(scope="module")
def frames(found: FoundFace) -> list[LidFrame]:
    lids = find_lid_lines(still(NAME, SIDE), found.landmarks, found.eye_distance_px)
    return [LidFrame.of(found.landmarks, lids, eye, found.eye_distance_px) for eye in (0, 1)]


def with_lines(frames: list[LidFrame], height: float, wide: float, colour: tuple[int, int, int]) -> np.ndarray:
    """The picture with a line above each eye, at a height over the margin of the eye distance."""
    pixels = still(NAME, SIDE).astype(float)
    share = np.zeros((SIDE, SIDE))
    for frame in frames:
        beside = np.linspace(-wide, wide, 5)[:, None] * (frame.upper[-1] - frame.upper[0])
        line = frame.upper + height * frame.scale * frame.up
        for end in (line[:1] + beside[:2], line, line[-1:] + beside[3:]):
            fine = np.stack([np.interp(np.linspace(0, 1, 400), np.linspace(0, 1, len(end)), one) for one in end.T], 1)
            columns, rows = np.rint(fine).astype(int).T
            share[rows, columns] = share[rows + 1, columns] = 1
    share = gaussian_filter(share, 0.6)[..., None]
    return np.rint(pixels + np.minimum(share * 1.5, 1) * (np.array(colour) - pixels)).astype(np.uint8)


def darkness(pixels: np.ndarray, frame: LidFrame, height: float) -> float:
    """How much darker a picture is along a line above an eye than beside that line, of 255."""
    grey = pixels.astype(float).mean(axis=2)
    rows = []
    for more in (0.0, -0.03, 0.03):
        columns, lines = np.rint(frame.upper[MIDDLE] + (height + more) * frame.scale * frame.up).astype(int).T
        rows.append(float(np.mean([grey[lines + k, columns] for k in (0, 1)])))
    return (rows[1] + rows[2]) / 2 - rows[0]


def shown(pixels: np.ndarray, found: FoundFace, **weights: float) -> np.ndarray:
    return drawn(mesh_renderer(speaking(Photograph(pixels, None, 1.0), found), Picture()), **weights)


def test_the_crease_above_an_open_eye_goes_when_it_shuts(found: FoundFace, frames: list[LidFrame]) -> None:
    height = float(np.median(frames[0].lashes)) / frames[0].scale + CREASE
    pixels = with_lines(frames, height, 0.0, (60, 35, 30))
    for frame in frames:
        assert darkness(pixels, frame, height) > 40
        assert abs(darkness(shown(pixels, found, **SHUT), frame, height)) < 8


def test_what_lies_above_the_lid_stays_where_it_is(found: FoundFace, frames: list[LidFrame]) -> None:
    rim = (RIM * frames[0].scale + frames[0].top.max() / 2) / frames[0].scale
    pixels = with_lines(frames, rim, 0.3, (20, 40, 120))
    shut, half = (shown(pixels, found, **{name: share for name in SHUT}) for share in (1.0, 0.5))
    for frame in frames:
        expected = darkness(pixels, frame, rim)
        assert expected > 40
        for frame_shown in (half, shut):
            assert darkness(frame_shown, frame, rim) == pytest.approx(expected, abs=12)


def test_shut_lids_meet_in_a_dark_line(found: FoundFace, frames: list[LidFrame]) -> None:
    shut = shown(still(NAME, SIDE), found, **SHUT).astype(float).mean(axis=2)
    for frame in frames:
        columns = []
        for place, opening in zip(frame.meeting[MIDDLE], frame.opening[MIDDLE], strict=True):
            down, across = np.rint(place).astype(int)[::-1]
            columns.append(shut[down - round(0.8 * opening) : down + round(0.6 * opening), across])
        for column in columns:
            assert column.min() < 0.88 * np.median(column)
            assert column.max() < 1.25 * np.median(column)  # no white of the eye is left


def test_landmarks_of_the_lids_follow_the_lashes(found: FoundFace) -> None:

    face = speaking(Photograph(still(NAME, SIDE), None, 1.0), found)
    weights = np.zeros((2, len(face.shape_names)), np.float32)
    weights[1, [face.shape_names.index(name) for name in SHUT]] = 1
    landmarks = moved_landmarks(face, Trajectory(face.shape_names, weights, 30.0))
    for side in ("Left", "Right"):
        opened, shut = eye_aperture(landmarks, side)
        assert shut < 0.1 * opened


def test_the_white_of_an_eye_darkens_under_a_lid_that_comes_down(found: FoundFace, frames: list[LidFrame]) -> None:
    pixels = still(NAME, SIDE)
    for frame in frames:
        cv2.fillPoly(pixels, [np.rint(np.concatenate([frame.upper, frame.lower[::-1]])).astype(np.int32)], (255,) * 3)
    opened, nearly = (
        shown(pixels, found, **dict.fromkeys(SHUT, share)).astype(float).mean(axis=2) for share in (0.0, 0.7)
    )
    for frame in frames:
        columns, rows = np.rint((frame.lower + 0.15 * (frame.upper - frame.lower))[MIDDLE]).astype(int).T
        assert np.median(opened[rows, columns]) > 240
        assert np.median(nearly[rows, columns]) < 200
