"""Measures of two motions, against motions with known differences."""

import numpy as np
import pytest

from lexicon.errors import InputError
from lexicon.sequence import SILENCE, PhoneSequence
from tests.world import World
from tts2face.session.animated_face import AnimatedFace
from tts2face.session.comparison import MotionComparison, MotionPart, compare_motion, map_channels
from tts2face.types import Trajectory

FPS = 30.0
PHONES = PhoneSequence([SILENCE, "b", "ɑ", SILENCE], [0.0, 0.5, 1.0, 2.5, 3.0])


@pytest.fixture(scope="module")
def face(world: World) -> AnimatedFace:
    return world.session(palette=None).face


def motion(face: AnimatedFace, jaw: np.ndarray) -> np.ndarray:
    """Motion of the jaw with a nod as the last column."""
    values = np.zeros((len(jaw), len(face.channels) + 1), np.float32)
    values[:, face.channels.index("jawOpen")] = jaw
    values[:, -1] = np.arange(len(jaw)) / len(jaw)
    return values


def compared(face: AnimatedFace, *parts: MotionPart) -> MotionComparison:
    return compare_motion(parts, face, (*face.channels, "pitch"), FPS, n_face=len(face.channels))


def jaw_motion(n: int = 90, shift: int = 0) -> np.ndarray:
    return 0.2 + 0.2 * np.sin((np.arange(n) - shift) / 6.0)


def test_equal_motion_is_equal(face: AnimatedFace) -> None:
    one = motion(face, jaw_motion())
    found = compared(face, MotionPart(one, one, PHONES))
    opening = found.lips[0]
    assert (opening.name, opening.r, opening.ratio) == ("opening", pytest.approx(1), pytest.approx(1))
    assert found.dtw_cost == pytest.approx(0, abs=1e-9)
    assert {one.name for one in found.channels} == {"jawOpen", "pitch"}  # what is still is not listed
    assert found.seconds == pytest.approx(3.0)


def test_half_the_motion_has_half_the_spread_and_r_1(face: AnimatedFace) -> None:
    found = compared(face, MotionPart(motion(face, jaw_motion()), motion(face, jaw_motion() / 2), PHONES))
    jaw = next(one for one in found.channels if one.name == "jawOpen")
    assert (jaw.r, jaw.ratio) == (pytest.approx(1), pytest.approx(0.5))
    assert found.lips[0].ratio == pytest.approx(0.5, abs=0.02)
    assert found.dtw_cost is not None
    assert found.dtw_cost > 0.3


def test_only_speech_counts_for_the_lips(face: AnimatedFace) -> None:
    one, other = jaw_motion(), jaw_motion()
    other[:10] = 0.8  # before 0.4 s, the margin of the first phone
    found = compared(face, MotionPart(motion(face, one), motion(face, other), PHONES))
    assert found.lips[0].r == pytest.approx(1)
    assert next(each for each in found.channels if each.name == "jawOpen").r < 0.9


def test_other_times_have_no_r_but_a_warping_cost(face: AnimatedFace) -> None:
    slow = motion(face, 0.2 + 0.2 * np.sin(np.arange(180) / 12.0))
    found = compared(face, MotionPart(slow, motion(face, jaw_motion()), PHONES, is_same_time=False))
    assert found.lips[0].r is None
    assert found.lips[0].ratio == pytest.approx(1, abs=0.1)
    assert found.dtw_cost is not None
    assert found.dtw_cost < 0.4
    with pytest.raises(InputError, match="at the same instants or by their sentences"):
        compared(face, MotionPart(slow, slow, PHONES), MotionPart(slow, slow, PHONES, is_same_time=False))


def test_still_lips_have_no_measures(face: AnimatedFace) -> None:
    found = compared(face, MotionPart(motion(face, np.zeros(90)), motion(face, jaw_motion()), PHONES))
    assert (found.lips[0].r, found.lips[0].ratio, found.dtw_cost) == (None, None, None)


def test_channels_are_mapped_by_name() -> None:
    given = Trajectory(("b", "x"), [[1.0, 2.0], [3.0, 4.0]], 2.0)
    assert map_channels(given, ("a", "b")).tolist() == [[0.0, 1.0], [0.0, 3.0]]
    with pytest.raises(InputError, match="no channel in common"):
        map_channels(given, ("a",))
