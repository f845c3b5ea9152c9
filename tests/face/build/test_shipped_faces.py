"""Guaranteed properties of the shipped faces."""

import numpy as np
import pytest

from tests.face.people import LIT, REALISTIC
from tests.face.posing import posed_vertices
from tts2face.face.breathing import BREATH_SHAPE
from tts2face.face.pupils import PUPIL_SHAPE
from tts2face.models.face_loading import load_face
from tts2face.models.landmarks import N_LANDMARKS
from tts2face.models.light import Baked
from tts2face.models.lit_hair import SWING_SHAPES
from tts2face.storage.shipped import find_file

UPPER_LID, LOWER_LID = (159, 386), (145, 374)  # right and left eye, in the middle


@pytest.fixture(scope="module", params=[pytest.param("head", marks=pytest.mark.smoke), *LIT])
def face(request):
    return load_face(request.param)


def weights(face, **chosen):
    return np.array([chosen.get(name, 0.0) for name in face.shape_names])


def landmarks(face, vertices):
    return np.einsum("lk,lkd->ld", face.landmark_weights, vertices[face.landmark_vertices])


def test_has_all_shapes_landmarks_and_parts(face):
    names = {part.name for part in face.parts}
    assert face.shape_names[52] == "tongueUp"
    is_lit = isinstance(face.light, Baked)
    assert face.shape_names[53:] == ((BREATH_SHAPE, *SWING_SHAPES, PUPIL_SHAPE) if is_lit else ())
    assert list(face.shape_names[:52]) == sorted(face.shape_names[:52])
    assert face.landmarks.tolist() == list(range(N_LANDMARKS))
    assert {
        "skin",
        "sclera",
        "iris",
        "wet",
        "teeth_upper",
        "teeth_lower",
        "tongue",
        "lashes",
        "shirt",
    } <= names
    assert ("brows" in names) != (face.metadata["name"] in REALISTIC)  # theirs are painted on the skin
    assert face.metadata["licence"] == "CC0-1.0"


def test_is_small_enough(face):
    assert len(face.vertices) < 50_000  # with the hair
    assert find_file(face.metadata["name"], "face").stat().st_size < 8 * 2**20


def test_the_origin_lies_between_the_eyes(face):
    left, right = face.eyes
    assert np.allclose(left.centre + right.centre, 0, atol=0.5)
    assert left.centre[0] > 25


def test_lips_part_with_the_jaw(face):
    opened = landmarks(face, posed_vertices(face, weights(face, jawOpen=1.0)))
    assert opened[13, 1] - opened[14, 1] > 12


def test_closing_the_lips_undoes_an_open_jaw(face):
    shut = landmarks(face, posed_vertices(face, weights(face, jawOpen=1.0, mouthClose=1.0)))
    assert abs(shut[13, 1] - shut[14, 1]) < 2.5


def test_lids_meet_when_the_eyes_blink(face):
    shut = landmarks(face, posed_vertices(face, weights(face, eyeBlinkLeft=1.0, eyeBlinkRight=1.0)))
    for upper, lower in zip(UPPER_LID, LOWER_LID, strict=True):
        assert shut[upper, 1] - shut[lower, 1] < 0.3


def test_the_lower_teeth_and_the_tongue_follow_the_jaw(face):
    moved = posed_vertices(face, weights(face, jawOpen=1.0)) - face.vertices
    part = {part.name: part for part in face.parts}
    down = {name: moved[np.unique(face.triangles[p.first : p.first + p.count]), 1].mean() for name, p in part.items()}
    assert down["teeth_upper"] == 0
    assert down["teeth_lower"] < -8
    assert down["tongue"] < -5
