"""Moods are seen on faces whose lips smile at rest, and whose brows stand high above their eyes."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from tests.face.gestures import palette
from tts2face.face.gestures import GestureFace, gesture_face, smile_unevenness
from tts2face.face.lip_constraints import CORNER_SHAPE
from tts2face.face.mood_targets import MEASURES, mood_measures, mood_targets
from tts2face.models.face import Face
from tts2face.models.face_loading import load_face
from tts2face.models.palette import EXPRESSIONS
from tts2face.numeric.arrays import FloatArray
from tts2face.types import Trajectory

FACES = ("ada", "noor", "tomas", "head")


@cache
def prepared(name: str) -> GestureFace:
    return gesture_face(load_face(name), palette())


def shown(face: GestureFace, expression: str) -> dict[str, FloatArray]:
    """Each measure, left and right, at weight 1 of an expression."""
    weights = face.expressions[EXPRESSIONS.index(expression)]
    return {name: values[:, 0] + values[:, 1:] @ weights for name, values in mood_measures(face.face).items()}


@pytest.mark.parametrize("name", FACES)
def test_corners_are_where_the_mood_wants_them_whatever_the_rest(name: str) -> None:
    face, targets = prepared(name), mood_targets()
    for expression, measure in (("sad", "corners"), ("angry", "corners"), ("happy", "corners_risen")):
        wanted = targets[measure].values[EXPRESSIONS.index(expression)]
        assert shown(face, expression)[measure].mean() == pytest.approx(wanted, abs=0.02), expression


@pytest.mark.parametrize("name", FACES)
def test_brows_and_lids_show_the_mood(name: str) -> None:
    sad, angry, surprised = (shown(prepared(name), mood) for mood in ("sad", "angry", "surprised"))
    assert (sad["brows_inner"] - sad["brows_outer"]).min() > 0.06  # slanted up to the middle
    assert (angry["brows_inner"] - angry["brows_outer"]).max() < -0.03
    assert min(surprised["brows_inner"].min(), surprised["brows_outer"].min()) > 0.045
    assert surprised["eyes"].min() > 0.15 > angry["eyes"].max() > sad["eyes"].max() - 0.2


@pytest.mark.parametrize("name", FACES)
def test_moods_keep_shut_lips_shut_and_levers_within_their_limits(name: str) -> None:
    face = prepared(name)
    assert np.abs(face.mouth.gaps @ face.expressions.T).max() < 0.25  # mm
    assert (face.expressions >= face.face.limits[:, 0] - 1e-6).all()
    assert (face.expressions <= face.face.limits[:, 1] + 1e-6).all()


def test_a_face_that_smiles_at_rest_is_as_sad_as_one_that_does_not() -> None:
    calm = load_face("tomas")
    smile = sum(calm.shapes[calm.shape_names.index(f"mouthSmile{side}")] for side in ("Left", "Right"))
    smiling: Face = replace(calm, vertices=(calm.vertices + 0.35 * smile).astype(np.float32))
    found = [shown(gesture_face(face, palette()), "sad")["corners"].mean() for face in (calm, smiling)]
    assert found[0] == pytest.approx(found[1], abs=0.02)
    assert mood_measures(gesture_face(smiling, palette()).face)["corners"][:, 0].mean() > 0.09


def test_the_table_names_shapes_that_faces_have() -> None:
    known = {*prepared("head").face.shape_names}
    assert tuple(mood_targets()) == MEASURES
    assert CORNER_SHAPE in known
    for name, target in mood_targets().items():
        assert target.levers <= known, name


def test_smiles_are_a_little_uneven_by_face_and_seed() -> None:
    face = prepared("ada")
    still = Trajectory(face.face.shape_names[: face.n_speech_shapes], np.zeros((3, face.n_speech_shapes)), 25.0)
    happy = {"expression": np.tile(np.eye(1, 5, EXPRESSIONS.index("happy"), dtype=np.float32), (3, 1))}
    uneven = smile_unevenness("ada", 1)
    left, right = face.perform(still, happy, {}, uneven).motion.columns(("mouthSmileLeft", "mouthSmileRight")).T
    assert (left == left[0]).all()
    assert left[0] / right[0] == pytest.approx((1 + uneven) / (1 - uneven), rel=0.04)
    found = [smile_unevenness(name, seed) for name in ("ada", "ben") for seed in range(50)]
    assert len(set(found)) == len(found)
    assert 0.03 <= min(map(abs, found)) <= max(map(abs, found)) <= 0.08
    assert 20 < sum(value > 0 for value in found) < 80
