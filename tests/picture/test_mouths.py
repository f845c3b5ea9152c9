"""Mouths of the shipped faces: closed behind the lips."""

import numpy as np
import pytest

from tests.face.masks import lip_mask
from tests.face.people import LIT, load_plain
from tests.picture.mouths import ASIDE, BELOW, FRONT, INNER_LIPS, MouthCamera, mixes
from tts2face.face.mouth_bag import BAG_PART, close_mouth


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


def test_a_mask_that_is_open_at_the_lips_gets_a_bag_behind_them() -> None:
    head = load_plain("head")
    assert close_mouth(head) is head
    mask = lip_mask(head)
    closed = close_mouth(mask)
    assert closed.parts[-1].name == BAG_PART
    assert close_mouth(closed) is closed
    for view in (FRONT, ASIDE, BELOW):
        camera, before = MouthCamera.of(closed, view), MouthCamera.of(mask, view)
        poses = mixes(mask, 6)
        within = [camera.within(weights, INNER_LIPS) for weights in poses]
        holes = [
            [
                int((inside & (one.draw(weights)[:, :, 3] < 255)).sum())
                for weights, inside in zip(poses, within, strict=True)
            ]
            for one in (before, camera)
        ]
        assert sum(holes[0]) > 1000
        assert not np.any(holes[1])
