"""Mouths of the shipped faces: closed behind the lips."""

import pytest

from tests.face.people import LIT, load_plain
from tests.picture.mouths import ASIDE, BELOW, FRONT, MouthCamera, mixes


def test_nothing_behind_the_head_is_seen_between_the_lips() -> None:
    face = load_plain("zuri")
    camera = MouthCamera.of(face, FRONT)
    assert [camera.n_holes(weights) for weights in mixes(face, 12)] == [0] * 12


@pytest.mark.nightly
@pytest.mark.parametrize("view", [FRONT, ASIDE, BELOW])
@pytest.mark.parametrize("name", [*LIT, "head"])
def test_no_mix_of_speech_and_mood_shows_what_is_behind_the_head(name: str, view) -> None:
    face = load_plain(name)
    camera = MouthCamera.of(face, view)
    assert sum(camera.n_holes(weights) for weights in mixes(face, 200)) == 0
