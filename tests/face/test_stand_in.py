"""Faces without landmarks speak by the names of their shapes: the default head stands in for them."""

from dataclasses import replace

import numpy as np
import pytest

from tests.made_face import made_face
from tests.made_models import made_palette, made_talker
from tts2face.face.gestures import gesture_face
from tts2face.face.shape_transfer import default_head
from tts2face.face.stand_in import consonants_beside_vowels, stand_in, viseme_table
from tts2face.interchange.characters.own_weights import _own_values
from tts2face.interchange.exports.arkit import ARKIT_SHAPES, arkit_projection
from tts2face.lips.articulation import build_articulator
from tts2face.lips.retargeting import build_retargeter
from tts2face.models.face import Face
from tts2face.types import Trajectory

VISEMES = ("mouthViseme_aa", "mouthViseme_ou", "mouthViseme_pp", "mouthViseme_ff")


def without_landmarks(*names: str) -> Face:
    """The made face with shapes of these names and without landmarks."""
    face = made_face()
    moved = np.ones((len(names), *face.vertices.shape), np.float32)
    limits = np.tile(np.array([0.0, 1.0], np.float32), (len(names), 1))
    return replace(
        face, shape_names=names, shapes=moved, limits=limits, eyes=(), occlusion=None,
        landmarks=face.landmarks[:0], landmark_vertices=face.landmark_vertices[:0],
        landmark_weights=face.landmark_weights[:0],
    )  # fmt: skip


def test_a_face_with_landmarks_of_its_lips_stands_for_itself() -> None:
    face = made_face()
    assert stand_in(face) is face


def test_it_reads_as_the_default_head() -> None:
    """So that its jaw drops as far; a face without any shape of the mouth has no scores."""
    model, head = stand_in(without_landmarks("wobble", "mouthFunnel", "jawOpen")), default_head()
    assert model.scores is not None
    assert head.scores is not None
    jaw = np.array([[name == "jawOpen" for name in head.scores.inputs]], np.float64)
    np.testing.assert_allclose(model.scores.scores(np.array([[0.0, 0.7]])), head.scores.scores(0.7 * jaw), atol=0.01)
    assert stand_in(without_landmarks("wobble")).scores is None


def test_shapes_of_known_names_are_those_of_the_default_head() -> None:
    head = default_head()
    model = stand_in(without_landmarks("jawOpen", "wobble", "mouthViseme_ou"))
    assert model.shape_names == ("jawOpen", "wobble", "mouthViseme_ou")
    own = dict(zip(head.shape_names, head.shapes, strict=True))
    np.testing.assert_array_equal(model.shapes[0], own["jawOpen"])
    assert not model.shapes[1].any()
    weights = viseme_table()["ou"]
    summed = sum(np.float32(weight) * own[name] for name, weight in weights.items())
    np.testing.assert_allclose(model.shapes[2], summed, atol=1e-4)


def test_visemes_are_sums_of_known_shapes_and_differ_from_each_other() -> None:
    rows = np.array([[parts.get(name, 0.0) for name in ARKIT_SHAPES] for parts in viseme_table().values()])
    assert all({*parts} <= {*ARKIT_SHAPES} for parts in viseme_table().values())
    turned = rows / np.linalg.norm(rows, axis=1, keepdims=True)
    assert (turned @ turned.T - np.eye(len(rows))).max() < 0.99


@pytest.mark.parametrize("names", [VISEMES, ("jawOpen", "mouthPucker", "mouthClose"), (*VISEMES, "jawOpen", "wobble")])
def test_speech_and_gestures_give_weights_by_name(names: tuple[str, ...]) -> None:
    face, talker = without_landmarks(*names), made_talker()
    model = stand_in(face)
    spoken = build_retargeter(talker, model).retarget(talker.speech_trajectory(talker.utterances[0]))
    assert spoken.channels == names
    assert spoken.values[:, 0].max() > 0.05
    build_articulator(model)
    prepared = gesture_face(face, made_palette())
    n = len(names)
    assert prepared.face.shape_names[:n] == names
    assert {"eyeBlinkLeft", "brows0"} <= {*prepared.face.shape_names}
    assert not prepared.face.shapes[n:].any()
    laughing = prepared.perform(spoken, {"mouth": np.full((len(spoken), 1), 5.0, np.float32)}).motion
    assert (laughing.values[:, :n] - spoken.values).mean(axis=0).max() > 0.1  # its jaw, or the vowel that opens most
    np.testing.assert_array_equal(prepared.face.vertices, face.vertices)


def test_arkits_names_and_the_characters_own_get_what_it_says() -> None:
    face = without_landmarks(*VISEMES)
    motion = np.zeros((2, 4), np.float32)
    motion[0, 0] = motion[1, 1] = 0.8
    weights = arkit_projection(VISEMES, face, "a.csv").weights(motion)
    assert weights[0, ARKIT_SHAPES.index("jawOpen")] == pytest.approx(0.48, abs=0.05)
    assert weights[1, ARKIT_SHAPES.index("mouthPucker")] == pytest.approx(0.64, abs=0.1)
    # what gestures add in ARKit's names is carried to the character's own shapes
    smile = Trajectory((*VISEMES, "jawOpen"), np.array([[0.0, 0.0, 0.0, 0.0, 0.3]], np.float32), 30.0)
    assert _own_values(smile, replace(without_landmarks(*smile.channels)), list(VISEMES))[0, 0] > 0.2


@pytest.mark.parametrize(
    ("names", "left_out"),
    [
        (("jawOpen", "mouthViseme_ff", "mouthViseme_ou"), {"mouthViseme_ff"}),
        (("mouthViseme_aa", "mouthViseme_ou", "mouthViseme_oh", "mouthViseme_ss"), {"mouthViseme_ss"}),
        (("mouthViseme_aa", "mouthViseme_ss", "mouthViseme_pp"), set()),
        (("jawOpen", "mouthPucker", "browInnerUp"), set()),
    ],
)
def test_consonants_are_no_terms_of_a_sum_beside_vowels(names: tuple[str, ...], left_out: set[str]) -> None:
    assert consonants_beside_vowels(names) == left_out
    face, talker = stand_in(without_landmarks(*names)), made_talker()
    spoken = build_retargeter(talker, face).retarget(talker.speech_trajectory(talker.utterances[0]))
    for name in left_out:
        assert not spoken.columns([name]).any()
    assert spoken.values.any()
