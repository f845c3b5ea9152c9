"""Score maps and the retargeting that matches scores."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lexicon.errors import DataError
from tests.picture.tiny_face import tiny_face
from tts2face.lips.retargeting import BILABIALS, Retargeter, build_retargeter
from tts2face.lips.score_matching import REST_TOLERANCE, build_score_matching, scaled_scores
from tts2face.models.face import Face
from tts2face.models.face_file import read_face, write_face
from tts2face.models.landmarks import INNER_LIP_LOWER, INNER_LIP_UPPER, UPPER_LIP_INNER_MID
from tts2face.models.score_map import N_SCORES, SCORE_SHAPES, ScoreMap, logistic, mouth_scores
from tts2face.models.talker import Talker, speech_channels
from tts2face.models.talker_file import read_talker, write_talker
from tts2face.numeric.least_squares import bounded_least_squares
from tts2face.storage.shipped import find_file
from tts2face.types import Trajectory

JAW, UPPER = list(SCORE_SHAPES).index("jawOpen"), list(SCORE_SHAPES).index("mouthUpperUp")


def made_map(inputs: tuple[str, ...], n_units: int = 5, seed: int = 0) -> ScoreMap:
    rng = np.random.default_rng(seed)
    sizes = ((n_units, len(inputs)), (n_units,), (N_SCORES, n_units), (N_SCORES, len(inputs)), (N_SCORES,))
    return ScoreMap(inputs, *(rng.normal(size=size).astype(np.float32) for size in sizes))


@pytest.fixture(scope="module")
def head() -> Face:
    return read_face(find_file("head", "face"))


@pytest.fixture(scope="module")
def speech(talker: Talker) -> Trajectory:
    values = np.concatenate([utterance.shape[:, : talker.model.n_speech] for utterance in talker.utterances[::100]])
    return Trajectory(speech_channels(talker.model), values, talker.fps)


def moving_weights(retargeter: Retargeter, speech: Trajectory) -> np.ndarray:
    return retargeter.retarget(speech).values[:, retargeter.moving].astype(np.float64)


def lip_gaps(face: Face, weights: np.ndarray) -> np.ndarray:
    """(T, P) gaps of the face's inner lips, mm."""
    mixed = face.landmark_weights.astype(np.float64)[..., None]
    places = np.zeros((len(weights), 478))
    rest = (face.vertices[face.landmark_vertices] * mixed).sum(axis=1)[:, 1]
    moved = np.stack([(shape[face.landmark_vertices] * mixed).sum(axis=1)[:, 1] for shape in face.shapes])
    places[:, face.landmarks] = rest + weights @ moved
    return places[:, list(INNER_LIP_UPPER)] - places[:, list(INNER_LIP_LOWER)]


def test_slopes_are_the_derivatives_of_the_logits() -> None:
    score_map = made_map(("a", "b", "c"))
    at = np.random.default_rng(1).normal(size=(4, 3))
    step = 1e-6 * np.eye(3)
    numeric = np.stack([(score_map.logits(at + d) - score_map.logits(at - d)) / 2e-6 for d in step], axis=2)
    assert score_map.slopes(at) == pytest.approx(numeric, abs=1e-6)
    assert score_map.scores(at) == pytest.approx(1 / (1 + np.exp(-score_map.logits(at))))


def test_a_map_whose_arrays_differ_in_size_is_refused() -> None:
    good = made_map(("a", "b"))
    with pytest.raises(DataError, match="arrays of the score map do not fit"):
        replace(good, inputs=("a", "b", "c"))


def test_mouth_scores_average_both_sides() -> None:
    names = [name for names in SCORE_SHAPES.values() for name in names]
    scores = mouth_scores(Trajectory(names, [np.arange(len(names)) / 20], 25.0))
    assert scores[0] == pytest.approx([0, 0.05, 0.1, 0.175, 0.275, 0.375, 0.475])


def test_maps_return_from_files(tmp_path: Path, talker: Talker) -> None:
    small = replace(talker, utterances=talker.utterances[:2])
    scores = made_map(speech_channels(talker.model))
    write_talker(tmp_path / "a.talker", replace(small, scores=scores))
    again = read_talker(tmp_path / "a.talker").scores
    assert again is not None
    assert again.inputs == scores.inputs
    assert np.array_equal(again.direct, scores.direct)
    write_talker(tmp_path / "b.talker", replace(small, scores=None))
    assert read_talker(tmp_path / "b.talker").scores is None
    of_face = made_map(("jawOpen", "mouthSmileLeft"))
    write_face(tmp_path / "a.face", replace(tiny_face(), scores=of_face))
    read = read_face(tmp_path / "a.face").scores
    assert read is not None
    assert read.inputs == of_face.inputs
    assert np.array_equal(read.hidden, of_face.hidden)


def test_each_row_may_have_a_matrix_of_its_own() -> None:
    rng = np.random.default_rng(4)
    roots = rng.normal(size=(6, 9, 4))
    matrices, linear = np.einsum("trk,trj->tkj", roots, roots), rng.normal(size=(6, 4))
    limits = np.tile([-0.2, 0.3], (4, 1))
    together = bounded_least_squares(matrices, linear, limits)
    apart = [bounded_least_squares(matrix, row[None], limits)[0] for matrix, row in zip(matrices, linear, strict=True)]
    assert together == pytest.approx(np.array(apart), abs=1e-9)


def test_scores_of_the_person_are_read_on_the_head(talker: Talker, head: Face, speech: Trajectory) -> None:
    """The tracker's scores by the head's own map, with and without score rows."""
    assert talker.scores is not None
    assert head.scores is not None
    person = talker.scores.scores(speech.values.astype(np.float64))
    plain = moving_weights(build_retargeter(replace(talker, scores=None), head), speech)
    matched = moving_weights(build_retargeter(talker, head), speech)
    open_ = person[:, JAW] > 0.2
    before, after = ((head.scores.scores(weights) - person)[open_] for weights in (plain, matched))
    assert abs(after[:, JAW].mean()) < 0.08
    assert abs(after[:, UPPER].mean()) < min(0.03, before[:, UPPER].mean())
    assert abs(after[:, -1].mean()) < 0.5 * before[:, -1].mean()  # the lips' own match reads as a smile
    assert np.abs(after.mean(axis=0)).max() < 0.08


def test_bilabials_stay_closed(talker: Talker, head: Face) -> None:
    retargeter = build_retargeter(talker, head)
    at, fps = INNER_LIP_UPPER.index(UPPER_LIP_INNER_MID), talker.fps
    model, n_speech = talker.model, talker.model.n_speech
    apart = model.basis[:n_speech, INNER_LIP_UPPER[at], 1] - model.basis[:n_speech, INNER_LIP_LOWER[at], 1]
    mean = model.mean[INNER_LIP_UPPER[at], 1] - model.mean[INNER_LIP_LOWER[at], 1]
    closed = []
    for utterance in talker.utterances[::20]:
        gaps = lip_gaps(head, retargeter.retarget(talker.speech_trajectory(utterance)).values)[:, at]
        own = utterance.shape[:, :n_speech] @ apart + mean
        phones = utterance.phones
        for phone, start, end in zip(phones.phones, phones.edges[:-1], phones.edges[1:], strict=True):
            first, last = int(np.floor((start - 0.03) * fps)), int(np.ceil((end + 0.03) * fps)) + 1
            nearest = max(0, first) + int(own[max(0, first) : last].argmin())
            if phone in BILABIALS and own[nearest] < 0.7:  # mm: the tracked gap of touching lips
                closed.append(gaps[nearest])
    assert len(closed) > 20
    assert max(closed) < 0.3


def test_rest_stays_at_rest(talker: Talker, head: Face) -> None:
    still = Trajectory(speech_channels(talker.model), talker.model.rest[None, : talker.model.n_speech], 25.0)
    weights = build_retargeter(talker, head).retarget(still).values
    assert np.abs(lip_gaps(head, weights)).max() < 0.4
    assert weights.max() < 0.15


def test_frames_are_independent_and_within_limits(talker: Talker, head: Face, speech: Trajectory) -> None:
    retargeter = build_retargeter(talker, head)
    weights = retargeter.retarget(speech).values
    assert weights.min() >= 0.0
    assert weights.max() <= 1.0
    order = np.random.default_rng(5).permutation(len(speech))
    shuffled = retargeter.retarget(Trajectory(speech.channels, speech.values[order], speech.fps)).values
    assert shuffled == pytest.approx(weights[order], abs=1e-5)


def test_given_scores_replace_those_of_the_map(talker: Talker, head: Face, speech: Trajectory) -> None:
    retargeter = build_retargeter(talker, head)
    assert talker.scores is not None
    own = talker.scores.scores(speech.values.astype(np.float64))
    assert np.array_equal(retargeter.retarget(speech, own).values, retargeter.retarget(speech).values)
    rounder = own.copy()
    rounder[:, list(SCORE_SHAPES).index("mouthPucker")] += 0.2
    column = head.shape_names.index("mouthPucker")
    assert (retargeter.retarget(speech, rounder).values - retargeter.retarget(speech).values)[:, column].mean() > 0.05


def test_a_map_of_other_shapes_or_parameters_is_not_used(talker: Talker, head: Face) -> None:
    other = replace(head, scores=made_map(("jawOpen", "mouthPucker")))
    assert build_retargeter(talker, other).matching is None
    grown = replace(talker, scores=made_map(("shape0", "shape1")))
    assert build_retargeter(grown, head).matching is None
    assert build_retargeter(talker, head).matching is not None


def test_scores_at_rest_become_those_of_the_face() -> None:
    """Small differences vanish during speech; large ones are a person's build and remain."""
    names = tuple(name for names in SCORE_SHAPES.values() for name in names)
    response = replace(made_map(names), output=np.zeros((N_SCORES, 5), np.float32))
    own = logistic(response.bias.astype(np.float64))
    rest = np.clip(own + np.array([0.05, -0.05, 0.3, 0, 0, 0, 0]), 0.01, 0.97)
    arrays = np.eye(len(names)), np.tile([0.0, 1.0], (len(names), 1)), np.zeros((11, len(names)))
    matching = build_score_matching(response, arrays, rest)
    still, speaking = matching.face_scores(np.stack([rest, rest]), np.array([0.0, 9.0]))
    assert still == pytest.approx(own, abs=1e-6)
    assert speaking[:2] == pytest.approx(rest[:2])
    assert speaking[2] == pytest.approx(own[2] + REST_TOLERANCE)


def test_a_gain_scales_scores_about_rest() -> None:
    rest = np.array([0.1] * N_SCORES)
    assert scaled_scores(np.full((1, N_SCORES), 0.3), rest, 2.0) == pytest.approx(0.5)
    assert scaled_scores(np.full((1, N_SCORES), 0.3), rest, 9.0) == pytest.approx(1.0)
