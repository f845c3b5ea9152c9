"""Moods are told apart by an independent network; mouths of moods keep closures."""

import csv
import json
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from cli.main import run
from corpus_tools.studies.gestures.moods import (
    MoodOptions,
    MoodStudy,
    confusion_matrix,
    mood_measures,
    study_moods,
)
from corpus_tools.studies.gestures.write_moods import REPORT, mood_rows
from lexicon.errors import BackendError, InputError
from tests.kept import kept
from tts2face.session.session import Session

SIX = ("neutral", "depressed", "delighted", "annoyed", "exaggerated", "exasperated")


@pytest.fixture(scope="module")
def study() -> MoodStudy:
    try:
        return kept(six_moods)
    except BackendError as missing:
        pytest.skip(f"the outside check cannot run: {missing}")


def six_moods() -> MoodStudy:
    return study_moods(Session("grid_s1", "head"), MoodOptions(seeds=4, first_seed=40, frames=6))


def test_the_classifier_recognises_classes_of_known_means() -> None:
    generator = np.random.default_rng(0)
    means = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    training, testing = ([mean + generator.normal(0, 0.1, (20, 3)) for mean in means] for _ in range(2))
    np.testing.assert_array_equal(confusion_matrix(training, testing), 20 * np.eye(3))


def test_the_classifier_counts_mistakes_in_the_column_of_its_answer() -> None:
    training = [np.array([[0.0], [0.2]]), np.array([[1.0], [1.2]])]
    assert confusion_matrix(training, [np.array([[0.1], [1.1]]), np.array([[1.0]])]).tolist() == [[1, 1], [0, 1]]


def test_what_features_say_twice_counts_once() -> None:
    """Two features that vary together, beside one that tells the classes apart by less than their common spread."""
    generator = np.random.default_rng(1)
    together = generator.normal(0, 1.0, (2, 2, 400))  # of two classes, to train and to test
    made = [[np.column_stack([row, row + 0.3 * number]) for number, row in enumerate(rows)] for rows in together]
    plain, joint = (np.trace(confusion_matrix(*made, share)) / 800 for share in (0.0, 0.99))
    assert plain < 0.65
    assert joint > 0.85


def test_measures_are_those_of_the_face_beyond_its_rest() -> None:
    rest = np.random.default_rng(2).normal(0, 40, (478, 3))
    moved = np.stack([rest, rest])
    moved[1, [61, 291], 1] -= 5.0
    found = mood_measures(moved, rest)
    size = np.linalg.norm(rest[263] - rest[33])
    assert not found[0].any()
    np.testing.assert_allclose(found[1, :2], -5.0 / size)
    assert not found[1, 2:].any()


def test_the_tracker_tells_the_six_moods_apart(study: MoodStudy) -> None:
    assert study.moods == SIX
    assert study.accuracy >= 0.8
    assert study.frame_accuracy >= 0.85
    assert study.confusion.sum() == 12


def test_a_delighted_smile_is_seen_and_varies(study: MoodStudy) -> None:
    low, mean, high = study.smile_range("delighted")
    assert 0.25 < low < mean < high < 0.9
    assert high - low > 0.1
    assert study.mean_score("delighted", "mouthSmileLeft") > study.mean_score("neutral", "mouthSmileLeft") + 0.4


def test_annoyed_and_exasperated_differ_in_the_brows(study: MoodStudy) -> None:
    assert study.mean_score("annoyed", "browDownLeft") > study.mean_score("exasperated", "browDownLeft") + 0.2
    assert study.mean_score("exasperated", "browInnerUp") > study.mean_score("annoyed", "browInnerUp") + 0.05


def test_neutral_is_not_sullen(study: MoodStudy) -> None:
    assert study.mean_score("neutral", "mouthFrownLeft", "mouthFrownRight") < 0.05
    assert study.mean_score("neutral", "browDownLeft", "browDownRight") < 0.25
    assert 0.03 < study.smile_range("neutral")[1] < 0.25


def test_every_file_holds_every_mood(study: MoodStudy) -> None:
    rows = list(csv.DictReader(REPORT.formats[".csv"](study).decode().splitlines()))
    assert [row["mood"] for row in rows] == list(SIX)
    content = json.loads(REPORT.formats[".json"](study))
    assert content["moods"] == mood_rows(study)
    assert np.trace(content["confusion"]) == sum(row["recognised"] for row in content["moods"])
    with Image.open(BytesIO(REPORT.formats[".png"](study))) as sheet:
        assert sheet.size == (6 * 256, 6 * 256)  # of six frames of each of the last clips of each mood


@pytest.mark.parametrize(
    ("options", "reason"),
    [
        ({"seeds": 5}, "must be an even number of 4 or more, not 5"),
        ({"first_seed": -1}, "a whole number from 0, not -1"),
        ({"size": 64}, "at least 2 frames of 160 pixels, not 12 of 64"),
        ({"sentences": ()}, "at least one sentence"),
    ],
)
def test_invalid_options(options: dict, reason: str) -> None:
    with pytest.raises(InputError, match=reason):
        MoodOptions(**options)


def test_one_mood_cannot_be_told_apart() -> None:
    with pytest.raises(InputError, match="at least two moods can be told apart, not 1"):
        study_moods(Session("grid_s1", "head"), MoodOptions(), ["neutral"])


def test_the_command_writes_a_contact_sheet(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], study: MoodStudy, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("corpus_tools.studies.gestures.write_moods.study_moods", lambda *_, **__: study)  # takes 30 s
    out = tmp_path / "moods.png"
    assert run(["report", "moods", "--out", str(out), "--seeds", "4"]) == 0
    with Image.open(out) as sheet:
        assert sheet.size == (6 * 256, 6 * 256)
    assert "of 12 clips of 6 moods" in capsys.readouterr().err
    assert run(["report", "moods", "--out", str(tmp_path / "moods.txt")]) == 2
    assert list(tmp_path.iterdir()) == [out]
