"""Gestures of a talker's own face, against a synthetic talker with known blinks."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from lexicon.errors import InputError
from lexicon.sequence import SILENCE, PhoneSequence
from tests.face.gestures import BROWS, neutral, palette
from tests.picture.test_plate import own_talker
from tts2face.face.gestures import LID_LANDMARKS
from tts2face.face.own_face import OwnFaceGestures, build_own_face_gestures
from tts2face.models.landmarks import EYELID_LANDMARKS, INNER_LIP_LOWER, INNER_LIP_UPPER
from tts2face.models.palette import EXPRESSIONS
from tts2face.models.talker import ShapeModel, Talker, Utterance
from tts2face.picture.options import Picture
from tts2face.picture.own_face import draw_video_frame, own_face_renderer
from tts2face.types import Trajectory

N_FRAMES = 400
SHUT_BY = 0.85  # closure of a tracked blink


@cache
def blinker() -> Talker:
    """The starter talker's shape at rest; two modes of speech, one of the upper lids; a blink every 40 frames."""
    talker = own_talker()
    rest = neutral().astype(np.float64)
    basis = np.zeros((3, 478, 3))
    basis[0, INNER_LIP_LOWER, 1], basis[1, 61, 0] = -1, -1
    for upper, lower, *_ in EYELID_LANDMARKS.values():
        basis[2, list(upper)] = rest[list(lower)] - rest[list(upper)]
    sizes = np.linalg.norm(basis.reshape(3, -1), axis=1)
    basis /= sizes[:, None, None]
    model = ShapeModel(
        rest.astype(np.float32), basis.astype(np.float32), np.ones(3, np.float32), 2, np.zeros(3, np.float32)
    )
    share = np.interp(np.arange(N_FRAMES) % 40, [0, 5, 8, 12, 40], [0, 1, 1, 0, 0])
    shape = np.random.default_rng(0).normal(0, 1, (N_FRAMES, 3))
    shape[:, 2] = SHUT_BY * sizes[2] * share
    looks = np.random.default_rng(1).normal(0, 0.1, (N_FRAMES, 4))
    looks[:, 0] += 30 * share
    looks[:, 1] += 50 * share**2
    phones = PhoneSequence([SILENCE], [0.0, N_FRAMES / 25])
    still = np.zeros((N_FRAMES, 6), np.float32)
    speech_motion = Utterance("a", phones, (), shape.astype(np.float32), still, still[:, 0], looks.astype(np.float32))
    assert talker.appearance is not None
    on_plate = np.zeros((4, 3), np.float32)
    on_plate[3, 2] = SHUT_BY * sizes[2]
    plate = replace(talker.appearance.plate, shape=on_plate)
    return replace(talker, model=model, utterances=(speech_motion,), appearance=replace(talker.appearance, plate=plate))


@cache
def gesture_model() -> OwnFaceGestures:
    return build_own_face_gestures(blinker(), palette())


def speech_motion(n_frames: int = 1) -> Trajectory:
    values = np.random.default_rng(2).normal(size=(n_frames, 6))
    return Trajectory(("shape0", "shape1", "face0", "face1", "mouth0", "mouth1"), values, 25.0)


def gesture_channels(**gestures: list[float]) -> np.ndarray:
    """Gesture channels of one frame."""
    values = {name: np.array([value], np.float32) for name, value in gestures.items()}
    return gesture_model().motion(speech_motion(), values).values[0, 6:]


@pytest.mark.parametrize("share", [0.25, 0.5, 1.0])
def test_lids_move_and_change_texture_as_in_recorded_blinks(share: float) -> None:
    moved, looks = gesture_model().displacements(gesture_channels(blink=[share, share]), 0)
    recorded = share * blinker().utterances[0].shape[6, 2] * blinker().model.basis[2, :468]
    assert np.abs(moved - recorded).max() < 0.1  # mm
    assert looks == pytest.approx([30 * share, 50 * share**2], abs=0.5)


def test_lids_that_are_closed_on_the_video_stay_closed() -> None:
    for share in (0.0, 0.5, 1.0):
        moved, looks = gesture_model().displacements(gesture_channels(blink=[share, share]), 3)
        assert np.abs(moved).max() < 0.02
        assert np.abs(looks).max() < 0.2


def test_brows_rise_without_lids_and_lips() -> None:
    moved, looks = gesture_model().displacements(gesture_channels(brows=[4 * np.sqrt(len(BROWS)), 0]), 0)
    assert moved[list(BROWS), 1] == pytest.approx(np.full(len(BROWS), 4.0), abs=0.2)
    assert np.abs(moved[[*LID_LANDMARKS, *INNER_LIP_UPPER, *INNER_LIP_LOWER]]).max() < 1e-4
    assert not looks.any()


@pytest.mark.parametrize("mood", range(len(EXPRESSIONS)))
def test_expressions_do_not_change_the_lip_gap(mood: int) -> None:
    moved, _ = gesture_model().displacements(gesture_channels(expression=np.eye(5)[mood].tolist()), 0)
    assert np.abs(moved).max() > 1
    assert np.abs(moved[INNER_LIP_UPPER, 1] - moved[INNER_LIP_LOWER, 1]).max() < 0.2


def test_only_gestures_change_the_picture() -> None:
    talker, picture = blinker(), Picture(size="96x96")
    plain, renderer = own_face_renderer(talker, picture), own_face_renderer(talker, picture, gesture_model())
    own = speech_motion()
    assert renderer.channels == plain.channels + gesture_model().channels
    still, blink = (gesture_model().motion(own, g).values[0] for g in ({}, {"blink": np.ones((1, 2), np.float32)}))
    assert np.array_equal(draw_video_frame(renderer, still, 1), draw_video_frame(plain, own.values[0], 1))
    assert not np.array_equal(draw_video_frame(renderer, blink, 1), draw_video_frame(plain, own.values[0], 1))


def test_gains_multiply_and_gaze_and_head_have_no_effect() -> None:
    values = {"brows": np.ones((1, 2), np.float32), "head": np.ones((1, 6), np.float32)}
    values |= {"gaze": np.ones((1, 2), np.float32), "blink": np.full((1, 2), 0.4, np.float32)}
    doubled = gesture_model().motion(speech_motion(), values, {"brows": 2.0, "blink": 0.5}).values[0, 6:]
    assert doubled.tolist() == pytest.approx([0, 0, 0, 0, 0, 2, 2, 0, 0, 0.2])


def test_a_talker_without_blinks_gets_no_lid_motion() -> None:
    talker = blinker()
    shape = talker.utterances[0].shape.copy()
    shape[:, 2] = 0
    calm = build_own_face_gestures(replace(talker, utterances=(replace(talker.utterances[0], shape=shape),)), palette())
    assert not calm.lids.any()
    assert not calm.lid_appearance.any()


def test_invalid_gestures_are_refused() -> None:
    with pytest.raises(InputError, match=r"brows must be finite values \(1, 2\), not \(1, 3\)"):
        gesture_model().motion(speech_motion(), {"brows": np.zeros((1, 3), np.float32)})
    with pytest.raises(InputError, match="motion only"):
        build_own_face_gestures(own_talker(has_face=False), palette())
