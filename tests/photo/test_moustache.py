"""Lips under a moustache meet, though a tracker sees an open mouth in it; open mouths below one stay open."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from tests.photo.pictures import ONE_PROCESS, found_in, still
from tts2face.models.landmarks import INNER_LIP_LOWER, INNER_LIP_UPPER, OUTER_LIP_UPPER
from tts2face.photo.found_face import FoundFace
from tts2face.photo.lines import darken_lip_edges
from tts2face.photo.moustache import PRESSED_GAP, find_lips

pytestmark = ONE_PROCESS

SIDE, NAME = 400, "head"
NOSE = 2  # landmark of its base
MISREAD = 0.06  # of the eye distance: how far a tracker's upper line lies within the hair
MIDDLE = slice(8, -8)
HAIR = {"black": (24, 20, 20), "brown": (60, 42, 30), "grey": (120, 118, 116)}


def with_moustache(pixels: np.ndarray, found: FoundFace, colour: tuple[int, int, int]) -> np.ndarray:
    """The picture with strands from the base of the nose over the upper lip."""
    rng, shown = np.random.default_rng(0), pixels.copy()
    lip = found.landmarks[list(INNER_LIP_UPPER), :2]
    top = found.landmarks[list(OUTER_LIP_UPPER), :2].copy()
    top[:, 1] += 0.7 * (found.landmarks[NOSE, 1] - top[len(top) // 2, 1])
    for at in rng.uniform(0, len(lip) - 1, 900):
        first, last = (
            np.array([np.interp(at, np.arange(len(lip)), line[:, k]) for k in (0, 1)]) for line in (top, lip)
        )
        begin = first + rng.uniform(0, 0.7) * (last - first)
        shade = np.clip(np.array(colour) * rng.uniform(0.8, 1.2), 0, 255).tolist()
        cv2.line(shown, np.rint(begin).astype(int).tolist(), np.rint(last).astype(int).tolist(), shade, 2)
    return shown


def misread(found: FoundFace) -> FoundFace:
    """The face whose upper line is taken for that of an open mouth."""
    landmarks = found.landmarks.copy()
    landmarks[list(INNER_LIP_UPPER[1:-1]), 1] -= MISREAD * found.eye_distance_px
    lower = np.array(INNER_LIP_LOWER[1:-1])
    landmarks[lower, 1] += 0.02 * found.eye_distance_px
    return replace(found, landmarks=landmarks)


@pytest.mark.parametrize("colour", HAIR)
def test_lips_under_a_moustache_meet_in_their_line(colour: str) -> None:
    found = found_in(NAME, SIDE)
    shown = with_moustache(still(NAME, SIDE), found, HAIR[colour])
    lips = find_lips(shown, misread(found))
    assert lips.gap == PRESSED_GAP
    wanted = found.landmarks[list(INNER_LIP_UPPER), :2]
    line = np.interp(lips.lower[MIDDLE, 0], wanted[:, 0], wanted[:, 1])
    assert np.abs(lips.lower[MIDDLE, 1] - line).mean() < 0.025 * found.eye_distance_px
    darkened = darken_lip_edges(shown, lips, found.eye_distance_px)
    assert darkened.astype(int).sum() < shown.astype(int).sum()


@pytest.mark.parametrize("colour", [None, *HAIR])
def test_an_open_mouth_stays_open(colour: str | None) -> None:
    found = found_in(NAME, SIDE, jawOpen=0.35)
    shown = still(NAME, SIDE, jawOpen=0.35)
    if colour is not None:
        shown = with_moustache(shown, found, HAIR[colour])
    lips = find_lips(shown, found)
    assert lips.gap > 2 * PRESSED_GAP


def test_closed_lips_without_a_moustache_are_as_they_are_found() -> None:
    found = found_in(NAME, SIDE)
    assert find_lips(still(NAME, SIDE), found).is_closed
    assert find_lips(still(NAME, SIDE), misread(found)).gap > 2 * PRESSED_GAP
