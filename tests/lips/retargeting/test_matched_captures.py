"""Captures in the weights of ARKit on faces that have other shapes: jaw and lips are carried by what is there."""

from dataclasses import replace

import numpy as np
import pytest

from tts2face.lips.performer import match_shapes
from tts2face.models.face import Face
from tts2face.models.face_loading import load_face
from tts2face.types import Trajectory

VOWELS = {"jawOpen": "mouthViseme_aa", "mouthFunnel": "mouthViseme_oh", "mouthPucker": "mouthViseme_ou"}


def with_vowels() -> Face:
    """The shipped head with three vowels alone, each of which is one of ARKit's shapes."""
    head = load_face("head")
    rows = [head.shape_names.index(name) for name in VOWELS]
    return replace(
        head, shape_names=tuple(VOWELS.values()), shapes=head.shapes[rows], limits=head.limits[rows], scores=None,
        occlusion=None, eyes=(), opened_by="mouthViseme_aa",
    )  # fmt: skip


def captured(**weights: float) -> Trajectory:
    values = np.array([np.zeros(len(weights)), list(weights.values())], np.float32)
    return Trajectory(tuple(weights), values, 30.0)


@pytest.mark.parametrize(("own", "weight"), [("jawOpen", 0.5), ("mouthPucker", 0.8), ("mouthFunnel", 0.4)])
def test_vowels_take_the_weights_of_the_shapes_that_they_are(own: str, weight: float) -> None:
    moved = match_shapes(captured(**{own: weight, "browInnerUp": 0.3}), with_vowels())
    assert not moved.values[0].any()
    found = dict(zip(moved.channels, moved.values[1].tolist(), strict=True))
    assert found.pop(VOWELS[own]) == pytest.approx(weight, abs=0.12)
    assert max(found.values()) < 0.17


def test_a_gain_counts_for_what_is_carried() -> None:
    loud, plain = (match_shapes(captured(jawOpen=0.3), with_vowels(), gain=gain).values[1, 0] for gain in (2.0, 1.0))
    assert loud == pytest.approx(2 * plain, rel=0.05)


@pytest.mark.parametrize("name", ["jawLeft", "mouthNarrow", "browInnerUp"])
def test_what_visemes_do_not_show_is_left_out(name: str) -> None:
    assert not match_shapes(captured(**{name: 0.7}), with_vowels()).values.any()


def test_shapes_of_the_same_names_keep_their_weights() -> None:
    head = load_face("head")
    moved = match_shapes(captured(jawOpen=0.4, mouthPucker=0.9, eyeBlinkLeft=1.0, tongueOut=0.2), head)
    for name, weight in (("jawOpen", 0.4), ("mouthPucker", 0.9), ("eyeBlinkLeft", 1.0)):
        assert moved.values[1, head.shape_names.index(name)] == pytest.approx(weight)
    assert np.count_nonzero(moved.values[1]) == 3 + ("tongueOut" in head.shape_names)
