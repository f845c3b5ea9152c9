"""Evaluation against another talker: figures do not depend on the size of the face or the amplitude of the lips."""

import csv
from pathlib import Path

import numpy as np
import pytest

from corpus_tools.measures.lip_measures import midpoint_openings, min_openings
from corpus_tools.measures.reference import LipCurves
from corpus_tools.measures.scale import CurveScale
from corpus_tools.recordings.observation import Observation
from corpus_tools.run_options import RunOptions
from corpus_tools.studies.evaluation.evaluate import SplitResult, evaluate_across_talkers
from corpus_tools.studies.evaluation.livelink import observe_livelink
from corpus_tools.studies.evaluation.page import evaluation_page
from corpus_tools.studies.evaluation.tables import Evaluation
from lexicon.errors import InputError
from tests.corpus_tools.speaking import observation
from tts2face.face.landmarks import moved_landmarks
from tts2face.models.face_loading import load_face
from tts2face.types import Trajectory


@pytest.fixture(scope="module")
def train() -> list[Observation]:
    return [observation(number) for number in range(30)]


def others(gain: float) -> list[Observation]:
    return [observation(100 + number, gain, "other") for number in range(8)]


@pytest.fixture(scope="module")
def measured(train: list[Observation]) -> tuple[Evaluation, tuple[SplitResult, ...]]:
    return evaluate_across_talkers(train, others(2.0))


def test_a_talker_with_twice_the_opening_is_predicted(
    measured: tuple[Evaluation, tuple[SplitResult, ...]],
) -> None:
    scores = {one.method: one for one in measured[0].scores}
    assert list(scores) == ["mean face", "mean phone pose", "exemplar", "theobald2007"]
    assert scores["exemplar"]["r_opening"] > 0.97
    assert scores["exemplar"]["range_ratio"] == pytest.approx(1.0, abs=0.1)
    assert scores["exemplar"]["closure"] > 0.8
    assert scores["mean face"]["range_ratio"] < 1e-6
    assert scores["mean face"]["dtw_cost"] > 2 * scores["exemplar"]["dtw_cost"]


def test_figures_do_not_depend_on_the_amplitude_of_the_other_talker(
    train: list[Observation], measured: tuple[Evaluation, tuple[SplitResult, ...]]
) -> None:
    alike, _ = evaluate_across_talkers(train, others(1.0))
    for one, other in zip(alike.scores, measured[0].scores, strict=True):
        for name in ("r_opening", "rmse_z", "dtw_cost", "range_ratio", "closure"):
            assert one[name] == pytest.approx(other[name], abs=0.01), name


def test_a_scale_makes_the_mean_0_and_the_spread_1(train: list[Observation]) -> None:
    scale = CurveScale.of_observations(train)
    scored = scale.z_score_lips(LipCurves(scale.mean[:1] + 2 * scale.spread[:1], scale.mean[1:] - scale.spread[1:]))
    np.testing.assert_allclose((scored.opening[0], scored.width[0]), (2.0, -1.0), rtol=1e-12)


@pytest.mark.needs("matplotlib")
def test_the_result_states_its_method(measured: tuple[Evaluation, tuple[SplitResult, ...]]) -> None:
    result, runs = measured
    assert result.to_json()["is_across"]
    assert result.rows()[1][:2] == ("another talker", "mean face")
    html = evaluation_page(result, runs)
    assert "8 utterances of another talker with their own phone edges, 30 training utterances" in html
    assert "lip gap (z)" in html


def test_recordings_of_the_same_talker_are_refused(train: list[Observation]) -> None:
    with pytest.raises(InputError, match="u03 is in both the training and the held-out part"):
        evaluate_across_talkers(train, train[3:5])


def test_landmarks_of_a_face_are_its_own_at_rest_and_follow_its_shapes() -> None:
    face = load_face("head")
    jaw = face.shape_names.index("jawOpen")
    weights = np.zeros((3, len(face.shape_names)))
    weights[1:, jaw] = (0.5, 1.0)
    opening = LipCurves.of(moved_landmarks(face, Trajectory(face.shape_names, weights, 30.0))).opening
    np.testing.assert_allclose(opening[1] - opening[0], opening[2] - opening[1], rtol=0.2)  # eyes hold, the jaw drops
    assert opening[2] > opening[0] + 0.1


def test_a_capture_closes_its_lips_at_recognised_bilabials(shared_recordings: Path, tmp_path: Path) -> None:
    capture = shared_recordings / "livelink" / "testset_arkit61_60fps.csv"
    found = observe_livelink(capture, RunOptions(tmp_path))
    assert len(found) >= 4
    assert all(one.fps == 60.0 and one.is_recognised for one in found)
    curves = [LipCurves.of(one.landmarks).opening for one in found]
    closed = [min_openings(curve, one.phones, 60.0) for curve, one in zip(curves, found, strict=True)]
    opened = [midpoint_openings(curve, one.phones, 60.0) for curve, one in zip(curves, found, strict=True)]
    assert 2 * np.median(np.concatenate(closed)) < np.median(np.concatenate(opened))


@pytest.mark.parametrize(
    ("sounds", "reason"),
    [
        ((), r"there is no sound file beside take\.csv"),
        (("a.wav", "b.flac"), r"there are 2 sound files beside take\.csv"),
    ],
)
def test_a_capture_needs_one_sound(sounds: tuple[str, ...], reason: str, tmp_path: Path) -> None:
    rows = [["Timecode", "BlendshapeCount", "JawOpen"], *([f"00:00:00:{at:02d}", "1", "0.1"] for at in range(20))]
    with (tmp_path / "take.csv").open("w", newline="") as file:
        csv.writer(file).writerows(rows)
    for sound in sounds:
        (tmp_path / sound).touch()
    with pytest.raises(InputError, match=reason):
        observe_livelink(tmp_path / "take.csv", RunOptions(tmp_path / "cache"))
