"""Gestures on the shipped faces: lip contact, eyelid closure, and local regions."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.spatial import KDTree

from lexicon.errors import DataError, InputError
from tests.face.gestures import BROWS, CHEEKS, palette, posed_landmarks
from tts2face.face.deformation import build_rig
from tts2face.face.expressions import add_expression_shapes, expression_landmarks, expression_table
from tts2face.face.gestures import LID_LANDMARKS, GestureFace, gesture_face
from tts2face.face.landmarks import landmark_positions
from tts2face.face.shape_transfer import eye_distance
from tts2face.models.face import Face
from tts2face.models.face_loading import load_face
from tts2face.models.landmarks import (
    INNER_LIP_LOWER,
    INNER_LIP_UPPER,
    LIP_LANDMARKS,
    MOUTH_CORNER_LEFT,
    MOUTH_CORNER_RIGHT,
)
from tts2face.models.palette import EXPRESSIONS
from tts2face.models.talker_file import load_talker
from tts2face.request import Request
from tts2face.session.session import Session
from tts2face.types import HEAD_CHANNELS, Trajectory

FACES = ("head", "ada")
BILABIALS = "Bob may bump my pump; Pam probably maps a big bamboo bomb to Mum. You choose two blue shoes."
CONTACT_MM = 0.3  # gaps up to this are closed lips: half a pixel of a face that fills 512 of them
KEPT_MM = 0.08  # tolerance of lip contact: a sixth of a pixel
UPPER_LIDS, LOWER_LIDS = (386, 159), (374, 145)
MASK = {name: i for i, name in enumerate(EXPRESSIONS)}


@cache
def prepared_face(name: str) -> GestureFace:
    return gesture_face(load_face(name), palette())


@cache
def speech_motion(name: str, articulation: str = "natural") -> Trajectory:
    session = Session(load_talker("grid_s1"), load_face(name))
    return session.clip(Request(text=BILABIALS, gestures="none", articulation=articulation)).motion


@cache
def spoken_weights(name: str, articulation: str = "natural") -> np.ndarray:
    """Shape weights (T, K) of speech without gestures."""
    return prepared_face(name).perform(speech_motion(name, articulation), {}).motion.values


def silence(face: Face, n_frames: int = 1) -> Trajectory:
    return Trajectory(face.shape_names, np.zeros((n_frames, len(face.shape_names))), 25.0)


def expression_gestures(n_frames: int, **weights: float) -> dict[str, np.ndarray]:
    """Constant weights of basis expressions for all frames."""
    values = np.zeros((n_frames, len(EXPRESSIONS)), np.float32)
    for name, weight in weights.items():
        values[:, MASK[name]] = weight
    return {"expression": values}


def at(face: Face, landmarks: tuple[int, ...]) -> list[int]:
    rows = {int(landmark): row for row, landmark in enumerate(face.landmarks)}
    return [rows[landmark] for landmark in landmarks]


def gaps(face: Face, weights: np.ndarray) -> np.ndarray:
    """(T, P) heights of facing inner lip points over each other, beyond those of the face at rest, mm."""
    posed = posed_landmarks(face, weights)[:, :, 1] - landmark_positions(face)[:, 1]
    return posed[:, at(face, INNER_LIP_UPPER)] - posed[:, at(face, INNER_LIP_LOWER)]


def width(face: Face, weights: np.ndarray) -> np.ndarray:
    left, right = at(face, (MOUTH_CORNER_LEFT, MOUTH_CORNER_RIGHT))
    posed = posed_landmarks(face, weights)
    return posed[:, left, 0] - posed[:, right, 0]


def lid_openings(face: Face, weights: np.ndarray) -> np.ndarray:
    posed = posed_landmarks(face, weights)[:, :, 1]
    return posed[:, at(face, UPPER_LIDS)] - posed[:, at(face, LOWER_LIDS)]


@pytest.mark.parametrize("name", FACES)
@pytest.mark.parametrize(
    ("weights", "gains"),
    [
        ({"happy": 1, "surprised": 1}, {"jaw": 1.5}),
        ({"sad": 1}, {}),
        ({"afraid": 1}, {"lips": 1.5}),
        ({"angry": 1.2}, {}),
        ({}, {"jaw": 2.0}),
    ],
)
def test_an_expression_never_opens_closed_lips(name: str, weights: dict[str, float], gains: dict[str, float]) -> None:
    """The case that the paper warns about (section 7), on speech with many /p b m/."""
    face, speech = prepared_face(name), speech_motion(name)
    plain = gaps(face.face, spoken_weights(name))
    moved = gaps(face.face, face.perform(speech, expression_gestures(len(speech), **weights), gains).motion.values)
    closed = plain <= CONTACT_MM
    assert closed[:, 5].sum() > 20
    assert (moved - plain)[closed].max() < KEPT_MM
    assert (moved - np.minimum(plain, 0)).min() > -KEPT_MM


@pytest.mark.parametrize("name", FACES)
def test_lips_that_close_in_clear_articulation_stay_closed(name: str) -> None:
    """Corners of a rounded mouth touch while its middle is open; here the middle counts."""
    face, speech = prepared_face(name), speech_motion(name, "clear")
    plain = gaps(face.face, spoken_weights(name, "clear"))
    gestures = expression_gestures(len(speech), happy=1.0, surprised=1.0)
    moved = gaps(face.face, face.perform(speech, gestures, {"jaw": 1.5}).motion.values)
    closed = plain[:, 5] <= CONTACT_MM
    assert closed.sum() > 20
    assert (moved - plain)[closed, 5].max() < KEPT_MM


@pytest.mark.parametrize("name", FACES)
def test_neutral_gestures_do_not_change_speech(name: str) -> None:
    face, speech = prepared_face(name), speech_motion(name)
    calm = expression_gestures(len(speech), sad=0.05, happy=0.15, afraid=0.02, angry=0.05, surprised=0.1)
    calm |= {"blink": np.zeros((len(speech), 2), np.float32), "cheeks": np.full((len(speech), 2), 0.5, np.float32)}
    plain, moved = spoken_weights(name), face.perform(speech, calm).motion.values
    for measured in (lambda weights: gaps(face.face, weights)[:, 5], lambda weights: width(face.face, weights)):
        assert np.corrcoef(measured(plain), measured(moved))[0, 1] > 0.99


def test_a_smile_keeps_rounded_lips_round() -> None:
    face, speech = prepared_face("head"), speech_motion("head")
    gestures = expression_gestures(len(speech), happy=1)
    plain, smiling = (
        width(face.face, weights) for weights in (spoken_weights("head"), face.perform(speech, gestures).motion.values)
    )
    roundest = plain.argmin()
    rest = width(face.face, np.zeros((1, len(face.face.shape_names))))[0]
    smile = width(face.face, face.perform(silence(load_face("head")), expression_gestures(1, happy=1)).motion.values)[0]
    assert plain[roundest] < rest - 3
    assert smiling[roundest] < smile - 6


@pytest.mark.parametrize("name", FACES)
def test_a_smile_lasts_while_lips_close_and_round(name: str) -> None:
    face, speech = prepared_face(name), speech_motion(name, "clear")
    smiles = [face.face.shape_names.index(shape) for shape in ("mouthSmileLeft", "mouthSmileRight")]
    spoken = spoken_weights(name, "clear")
    moved = face.perform(speech, expression_gestures(len(speech), happy=1)).motion.values
    alone = face.perform(silence(load_face(name)), expression_gestures(1, happy=1)).motion.values[0, smiles].mean()
    smile = moved[:, smiles].mean(axis=1)
    assert smile.min() > 0.7 * alone
    assert smile.max() < alone + 0.5 * spoken[:, smiles].mean(axis=1).max() + 0.05
    mouth = face.mouth.moving
    assert np.abs(np.diff(moved[:, mouth], axis=0)).max() < 1.15 * np.abs(np.diff(spoken[:, mouth], axis=0)).max()


@pytest.mark.parametrize("name", FACES)
def test_without_gestures_speech_passes_unchanged(name: str) -> None:
    face, speech = prepared_face(name), speech_motion(name)
    performed = face.perform(speech, {})
    assert np.array_equal(performed.motion.values[:, : face.n_speech_shapes], speech.values)
    assert not performed.motion.values[:, face.n_speech_shapes :].any()
    assert performed.head.channels == HEAD_CHANNELS
    assert not performed.head.values.any()


def test_a_louder_jaw_opens_wider() -> None:
    face, speech = prepared_face("head"), speech_motion("head")
    plain, loud, low = (gaps(face.face, face.perform(speech, {}, {"jaw": g}).motion.values)[:, 5] for g in (1, 1.5, 0))
    assert loud.max() > 1.2 * plain.max()
    assert low.max() < 0.7 * plain.max()


@pytest.mark.parametrize("name", FACES)
@pytest.mark.parametrize("down", [-0.15, 0.0, 0.17, 0.3])
@pytest.mark.parametrize("mood", [{}, {"happy": 1}, {"surprised": 1}, {"sad": 1}])
def test_lids_close_by_their_share_for_any_gaze(name: str, down: float, mood: dict[str, float]) -> None:
    face = prepared_face(name)
    shares = np.array([0, 0.25, 0.5, 0.75, 1], np.float32)
    gestures = expression_gestures(5, **mood) | {
        "blink": np.column_stack([shares, shares]),
        "gaze": np.tile(np.array([down, 0], np.float32), (5, 1)),
    }
    performed = face.perform(silence(load_face(name), 5), gestures)
    opening = lid_openings(face.face, performed.motion.values)
    assert (opening[0] > 3).all()  # mm
    assert np.abs(opening[-1]).max() < 0.8  # lids meet within a lash's width
    assert (np.diff(opening, axis=0) < 0).all()


@pytest.mark.parametrize("name", FACES)
def test_a_laugh_opens_closed_lips_as_far_as_it_says(name: str) -> None:
    face, still = prepared_face(name), silence(load_face(name), 3)
    opened = np.array([[0.0], [3.0], [6.0]], np.float32)
    middle = gaps(face.face, face.perform(still, {"mouth": opened}).motion.values)[:, 5]
    assert middle[1:] - middle[0] == pytest.approx([3.0, 6.0], abs=0.6)
    squinting = face.perform(still, {"squint": np.eye(3, 2, dtype=np.float32)}).motion
    left, right = (squinting.columns([f"cheekSquint{side}"])[:, 0] for side in ("Left", "Right"))
    assert (left[0] - left[2], right[1] - right[2]) == pytest.approx((1.0, 1.0), abs=0.05)


def test_one_eye_winks_and_a_negative_share_opens_wider() -> None:
    face = prepared_face("head")
    weights = face.perform(silence(load_face("head")), {"blink": np.array([[1, -0.3]], np.float32)}).motion.values
    rest = lid_openings(face.face, np.zeros_like(weights))[0]
    left, right = lid_openings(face.face, weights)[0]
    assert abs(left) < 0.8
    assert right == pytest.approx(1.3 * rest[1], rel=0.1)


@pytest.mark.parametrize("name", FACES)
@pytest.mark.parametrize("gaze", [(0.17, 0.0), (-0.17, 0.0), (0.0, 0.17), (0.0, -0.17), (0.1, 0.12)])
def test_eyes_turn_by_the_gaze_angles(name: str, gaze: tuple[float, float]) -> None:
    face = prepared_face(name)
    weights = face.perform(silence(load_face(name)), {"gaze": np.array([gaze], np.float32)}).motion.values[0]
    turns = build_rig(face.face).eye_turns
    for turn in np.einsum("ekc,k->ec", turns, weights):
        assert turn == pytest.approx([*gaze, 0], abs=1e-5)


@pytest.mark.parametrize("name", FACES)
@pytest.mark.parametrize(("feature", "landmarks"), [("brows", BROWS), ("cheeks", CHEEKS)])
def test_regions_move_their_landmarks_and_not_lips_or_lids(name: str, feature: str, landmarks: tuple[int, ...]) -> None:
    """Landmarks rise 4 mm on the talker; a face moves in proportion to its size, and distant vertices do not move."""
    face = prepared_face(name)
    raised = np.array([[4 * np.sqrt(len(landmarks)), 0]], np.float32)
    weights = face.perform(silence(load_face(name)), {feature: raised}).motion.values
    moved = (posed_landmarks(face.face, weights) - landmark_positions(face.face))[0]
    assert 2 < moved[at(face.face, landmarks), 1].mean() < 8
    assert (
        np.abs(moved[at(face.face, tuple({*LIP_LANDMARKS, *LID_LANDMARKS}))]).max() < 0.3
    )  # mm; they lie inside triangles
    shape = face.face.shapes[face.face.shape_names.index(f"{feature}0")]
    still = {
        "sclera",
        "iris",
        "teeth_upper",
        "teeth_lower",
        "gums_upper",
        "gums_lower",
        "tongue",
        "hair_locks",
        "shirt",
    }
    for part in face.face.parts:
        used = face.face.triangles[part.first : part.first + part.count]
        assert part.name not in still or not shape[used].any()
    support = 0.31 * eye_distance(face.face)
    moving, kept = (
        KDTree(landmark_positions(face.face)[at(face.face, some)]).query(face.face.vertices, p=np.inf)[0] > support
        for some in (landmarks, (*landmarks, *LIP_LANDMARKS, *LID_LANDMARKS))
    )
    assert not shape[kept].any()
    assert np.abs(shape[moving]).max() < 0.05 * np.abs(shape).max()


def test_the_head_moves_and_gains_multiply() -> None:
    face = prepared_face("head")
    gestures = expression_gestures(2, happy=0.4) | {"head": np.full((2, 6), 0.1, np.float32)}
    gestures |= {"brows": np.ones((2, 2), np.float32), "gaze": np.full((2, 2), 0.1, np.float32)}
    still = silence(load_face("head"), 2)
    doubled = face.perform(still, gestures, dict.fromkeys(("expression", "head", "brows", "gaze"), 2.0))
    same = face.perform(still, {name: 2 * values for name, values in gestures.items()})
    assert np.array_equal(doubled.motion.values, same.motion.values)
    assert np.array_equal(doubled.head.values, np.full((2, 6), 0.2, np.float32))


def test_frames_are_independent() -> None:
    face, speech = prepared_face("head"), speech_motion("head")
    values = np.random.default_rng(1).uniform(-0.1, 1.1, (len(speech), 5)).astype(np.float32)
    whole = face.perform(speech, {"expression": values}).motion.values
    part = face.perform(Trajectory(speech.channels, speech.values[40:50], speech.fps), {"expression": values[40:50]})
    assert np.array_equal(whole[40:50], part.motion.values)
    low, high = face.face.limits.T
    assert (whole >= low - 1e-6).all()
    assert (whole <= high + 1e-6).all()


def rename_shapes(face: Face, kept: tuple[str, ...]) -> Face:
    """A face with renamed shapes, except those with the prefixes `kept`, and without eye rotations."""
    names = tuple(name if name.startswith(kept) else f"rig_{i}" for i, name in enumerate(face.shape_names))
    return replace(face, shape_names=names, eyes=tuple(replace(eye, turns={}) for eye in face.eyes))


@pytest.mark.parametrize("kept", [("jaw", "mouth"), ("jaw", "mouthClose", "mouthF", "mouthPucker", "eyeBlink")])
def test_a_renamed_rig_moves_like_the_original(kept: tuple[str, ...]) -> None:
    """The default head with renamed shapes: transferred shapes give the motion of the original ones."""
    head = load_face("head")
    face, known = gesture_face(rename_shapes(head, kept), palette()), prepared_face("head")
    for name in EXPRESSIONS:
        original, transferred = (
            posed_landmarks(model.face, model.perform(silence(own), expression_gestures(1, **{name: 1})).motion.values)[
                0, :468
            ]
            for model, own in ((known, head), (face, rename_shapes(head, kept)))
        )
        rest = landmark_positions(head)[:468]
        # .84 for sad where most shapes of the mouth are missing: others close its lips.
        assert np.corrcoef((original - rest).ravel(), (transferred - rest).ravel())[0, 1] > 0.82
    shut = face.perform(silence(rename_shapes(head, kept)), {"blink": np.ones((1, 2), np.float32)}).motion.values
    assert np.abs(lid_openings(face.face, shut)).max() < 0.8
    looking = face.perform(
        silence(rename_shapes(head, kept)), {"gaze": np.array([[0.1, 0.1]], np.float32)}
    ).motion.values[0]
    for turn in np.einsum("ekc,k->ec", build_rig(face.face).eye_turns, looking):
        assert turn == pytest.approx([0.1, 0.1, 0], abs=1e-5)


def test_basis_expressions_have_closed_lips_and_open_eyes() -> None:
    for name in FACES:
        face = load_face(name)
        moved = expression_landmarks(face)
        assert moved.shape == (len(EXPRESSIONS), 478, 3)
        lips = moved[:, INNER_LIP_UPPER, 1] - moved[:, INNER_LIP_LOWER, 1]
        assert np.abs(lips).max() < KEPT_MM
        lids = moved[:, UPPER_LIDS, 1] - moved[:, LOWER_LIDS, 1]
        assert (
            landmark_positions(face)[list(UPPER_LIDS), 1] - landmark_positions(face)[list(LOWER_LIDS), 1] + lids > 3
        ).all()
        corners = moved[MASK["happy"], [MOUTH_CORNER_LEFT, MOUTH_CORNER_RIGHT]]
        assert (corners[:, 1] > 3).all()
        assert corners[0, 0] > 2 > -2 > corners[1, 0]
        assert (moved[MASK["surprised"], BROWS, 1] > 3).all()
        assert (moved[MASK["angry"], [55, 285], 1] < -2).all()


def test_the_table_names_shapes_of_the_default_head() -> None:
    assert set(expression_table()) <= set(load_face("head").shape_names)
    assert add_expression_shapes(load_face("head")).shape_names == load_face("head").shape_names


def test_invalid_gestures_are_refused() -> None:
    face = prepared_face("head")
    still = silence(load_face("head"))
    with pytest.raises(InputError, match="no feature 'ears'"):
        face.perform(still, {"ears": np.zeros((1, 2), np.float32)})
    with pytest.raises(InputError, match=r"blink must be finite values \(1, 2\), not \(2, 2\)"):
        face.perform(still, {"blink": np.zeros((2, 2), np.float32)})
    with pytest.raises(InputError, match="no gain for 'ears'"):
        face.perform(still, {}, {"ears": 1.0})
    with pytest.raises(InputError, match="gain of jaw must be 0 or more, not -1"):
        face.perform(still, {}, {"jaw": -1.0})
    with pytest.raises(InputError, match="not in the shapes of this face"):
        face.perform(Trajectory(("a",), np.zeros((1, 1)), 25.0), {})
    head = load_face("head")
    kept = np.flatnonzero(head.landmarks != 386)
    lidless = replace(
        head,
        landmarks=head.landmarks[kept],
        landmark_vertices=head.landmark_vertices[kept],
        landmark_weights=head.landmark_weights[kept],
    )
    with pytest.raises(DataError, match="lacks landmarks of its lids"):
        gesture_face(lidless, palette())
