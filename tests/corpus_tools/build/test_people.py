"""A finished talker on tracks of other people: reading, z-scores, paired intervals, figures by phone, the command."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cli.main import run
from corpus_tools.measures.intervals import IntervalEstimate, PairedCurves, estimate, estimate_difference
from corpus_tools.recordings.observation import Observation
from corpus_tools.studies.evaluation.evaluate import EVALUATION_METADATA
from corpus_tools.studies.evaluation.people import PeopleEvaluation, compare_people, evaluate_people, z_score_people
from corpus_tools.studies.evaluation.people_tables import (
    FIGURE_HEADS,
    difference_table,
    people_rows,
    people_table,
    phone_table,
)
from corpus_tools.studies.evaluation.person_tracks import read_person
from corpus_tools.studies.evaluation.tracks import ExternalTrack
from corpus_tools.training.train_talker import learn_talker
from lexicon.errors import DataError, InputError
from lexicon.sequence import SILENCE
from tests.corpus_tools.speaking import FPS, OPENINGS, observation, track_arrays, with_words
from tts2face.lips.motion_measures import speech_frames
from tts2face.models.talker import Talker
from tts2face.models.talker_file import write_talker


@pytest.fixture(scope="module")
def talker() -> Talker:
    return learn_talker([observation(number) for number in range(30)], metadata=EVALUATION_METADATA)


def person(gain: float, name: str) -> list[Observation]:
    return [observation(100 + number, gain, name) for number in range(5)]


@pytest.fixture(scope="module")
def found(talker: Talker) -> PeopleEvaluation:
    return evaluate_people(talker, [person(2.0, "loud"), person(0.5, "quiet")])


def write_tracks(folder: Path, gain: float = 2.0, **changes: Any) -> Path:
    folder.mkdir()
    for one in person(gain, "p"):
        arrays = {**track_arrays(with_words(one)), **changes}
        np.savez(folder / f"{one.name}.npz", **{name: value for name, value in arrays.items() if value is not None})
    return folder


def test_tracks_are_read_as_written(tmp_path: Path) -> None:
    for one, read in zip(person(2.0, "p"), read_person(write_tracks(tmp_path / "person")), strict=True):
        np.testing.assert_array_equal(read.landmarks, one.landmarks)
        np.testing.assert_array_equal(read.phones.edges, one.phones.edges)
        assert (read.name, read.fps, read.phones.phones) == (one.name, FPS, one.phones.phones)
        assert read.words == with_words(one).words


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"edges": None}, "has no array edges"),
        ({"edges": np.arange(4.0)}, "10 phones need 11 edges, not 4"),
        ({"edges": np.zeros(11)}, "increas"),
        ({"landmarks": np.zeros((9, 68, 3))}, "landmarks must be finite numbers"),
        ({"fps": 0.0}, "fps must be above 0, not 0.0"),
        ({"head": np.zeros((3, 6))}, "do not fit"),
    ],
)
def test_damaged_tracks_are_refused(tmp_path: Path, changes: dict[str, Any], reason: str) -> None:
    with pytest.raises(DataError, match=reason):
        read_person(write_tracks(tmp_path / "person", **changes))


def test_a_folder_without_tracks_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="holds no tracks"):
        read_person(tmp_path)


def test_people_with_other_amplitudes_are_predicted_alike(talker: Talker, found: PeopleEvaluation) -> None:
    assert (found.n_people, found.n_utterances) == (2, 10)
    assert found.figures["exemplar"]["r_opening"].value > 0.97
    alone = evaluate_people(talker, [person(2.0, "loud")])
    for name, value in alone.figures["exemplar"].items():
        assert value.value == pytest.approx(found.figures["exemplar"][name].value, abs=0.02), name
    assert found.figures["mean face"]["r_opening"].value == pytest.approx(0.0, abs=0.01)


def test_real_curves_have_mean_0_and_spread_1_in_each_person() -> None:
    tests = z_score_people([person(2.0, "loud"), person(0.5, "quiet")])
    for part in (tests[:5], tests[5:]):
        frames = np.concatenate([one.real for one in part])
        np.testing.assert_allclose(frames.mean(axis=0), 0.0, atol=1e-9)
        np.testing.assert_allclose(frames.std(axis=0), 1.0, rtol=1e-9)


def test_phones_have_the_real_means_and_whether_they_were_recorded(talker: Talker) -> None:
    tests = z_score_people([person(1.0, "one")])
    curves = {"real": [one.real for one in tests]}
    found = compare_people(tests, curves, n_people=1, heard={"p", "i"})
    by_phone = {one.phone: one for one in found.phones}
    assert set(by_phone) <= set(OPENINGS) - {SILENCE}
    assert by_phone["i"].is_heard
    assert not by_phone["ɑ"].is_heard
    assert by_phone["ɑ"].real[0] > by_phone["i"].real[0] > by_phone["p"].real[0]
    assert all(one.made["real"] == one.real for one in found.phones)
    assert found.heard["real"] == pytest.approx((1.0, 1.0))


def test_figures_equal_those_of_pooled_frames(rng_curves: tuple[list[np.ndarray], list[np.ndarray]]) -> None:
    real, made = rng_curves
    figures = estimate(PairedCurves.of(real, made, [1.0, 2.0, 3.0, 4.0]))
    expected = np.corrcoef(np.concatenate(real)[:, 0], np.concatenate(made)[:, 0])[0, 1]
    assert figures["r_opening"].value == pytest.approx(expected, rel=1e-12)
    apart = [np.concatenate([one - one.mean(axis=0) for one in curves]) for curves in (real, made)]
    expected = np.corrcoef(apart[0][:, 1], apart[1][:, 1])[0, 1]
    assert figures["r_width_within"].value == pytest.approx(expected, rel=1e-12)
    assert figures["dtw_cost"].value == 2.5
    assert figures["r_opening"].low <= figures["r_opening"].value <= figures["r_opening"].high


@pytest.fixture
def rng_curves() -> tuple[list[np.ndarray], list[np.ndarray]]:
    stream = np.random.default_rng(1)
    real = [stream.normal(size=(40, 2)) for _ in range(4)]
    return real, [values + stream.normal(size=values.shape) for values in real]


def test_paired_intervals_are_narrower_than_those_of_single_methods(
    rng_curves: tuple[list[np.ndarray], list[np.ndarray]],
) -> None:
    real, made = rng_curves
    one = PairedCurves.of(real, made, [1.0, 2.0, 3.0, 4.0])
    other = PairedCurves.of(real, made, [1.1, 2.1, 3.1, 4.1])
    difference = estimate_difference(one, other)
    assert (difference["r_opening"].low, difference["r_opening"].high) == (0.0, 0.0)
    assert difference["dtw_cost"].low == pytest.approx(-0.1)
    assert difference["dtw_cost"].high == pytest.approx(-0.1)
    single = estimate(one)["dtw_cost"]
    assert single.high - single.low > 1.0


@pytest.mark.parametrize("value", [0.0, 1e-6, 0.1, 0.37, 1.0, 1e6])
def test_a_curve_that_never_moves_correlates_with_nothing(
    value: float, rng_curves: tuple[list[np.ndarray], list[np.ndarray]]
) -> None:
    """Rounding of sums of squares is not taken for motion, at any value and in either precision."""
    real, made = rng_curves
    for precision in (np.float32, np.float64):
        flat = [np.full(one.shape, value, precision) for one in made]
        figures = estimate(PairedCurves.of(real, flat, [1.0] * 4))
        assert figures["r_opening"] == figures["r_opening_within"] == IntervalEstimate(0.0, 0.0, 0.0)


def test_a_mood_of_single_utterances_changes_no_correlation_within(
    rng_curves: tuple[list[np.ndarray], list[np.ndarray]],
) -> None:
    real, made = rng_curves
    smiling = [one + 3.0 * number for number, one in enumerate(real)]
    plain, shifted = (estimate(PairedCurves.of(one, made, [1.0] * 4)) for one in (real, smiling))
    assert shifted["r_width"].value < plain["r_width"].value - 0.1
    assert shifted["r_width_within"].value == pytest.approx(plain["r_width_within"].value, rel=1e-9)


@pytest.mark.parametrize("scale", [1e-6, 1e6])
def test_correlations_do_not_depend_on_the_scale(
    scale: float, rng_curves: tuple[list[np.ndarray], list[np.ndarray]]
) -> None:
    real, made = rng_curves
    small = estimate(PairedCurves.of([scale * one for one in real], made, [1.0] * 4))["r_width"].value
    assert small == pytest.approx(estimate(PairedCurves.of(real, made, [1.0] * 4))["r_width"].value, abs=1e-9)
    assert abs(small) > 0.01


def test_other_numbers_of_utterances_cannot_be_paired(rng_curves: tuple[list[np.ndarray], list[np.ndarray]]) -> None:
    real, made = rng_curves
    with pytest.raises(InputError, match="4 utterances cannot be paired with 3"):
        estimate_difference(PairedCurves.of(real, made, [1.0] * 4), PairedCurves.of(real[:3], made[:3], [1.0] * 3))


def test_external_tracks_stand_in_the_same_table(talker: Talker) -> None:
    people = [person(2.0, "loud")]
    tracks = {
        one.name: ExternalTrack(np.arange(len(one.landmarks)) / FPS, one.landmarks[:, [14], 1].astype(np.float64))
        for one in (*(observation(number) for number in range(30)), *people[0])
    }
    found = evaluate_people(talker, people, tracks)
    assert found.figures["tracks"]["r_opening"].value > 0.99
    assert ("exemplar", "tracks") in found.differences


def test_tables_hold_every_method(found: PeopleEvaluation) -> None:
    assert [line.split(" | ")[0] for line in people_table(found).splitlines()[2:]] == [f"| {m}" for m in found.figures]
    assert len(difference_table(found, "exemplar").splitlines()) == 2 + len(found.figures) - 1
    assert f"| {found.phones[0].phone} | {found.phones[0].n_tokens} | yes |" in phone_table(found, ["exemplar"])
    assert len(list(people_rows(found))) == 1 + len(FIGURE_HEADS) * (len(found.figures) + len(found.differences))


def test_speech_only_is_evaluated() -> None:
    one = z_score_people([person(2.0, "loud")])[0]
    here = speech_frames(one.observation.phones, len(one.observation.landmarks), FPS)
    assert one.evaluated == here
    assert len(one.real) == here.stop - here.start


def test_the_command_prints_tables_and_writes_them(
    tmp_path: Path, talker: Talker, capsys: pytest.CaptureFixture[str]
) -> None:
    write_talker(tmp_path / "t.talker", talker)
    one, other = write_tracks(tmp_path / "one"), write_tracks(tmp_path / "other", 0.5)
    flags = ["--talker", str(tmp_path / "t.talker"), "--people", str(one), "--people", str(other)]
    for name in ("out.json", "out.csv"):
        assert run(["corpus", "evaluate", *flags, "--out", str(tmp_path / name)]) == 0
    captured = capsys.readouterr()
    assert "| exemplar minus | r opening |" in captured.out
    assert "10 utterances of 2 people" in captured.err
    stored = json.loads((tmp_path / "out.json").read_text())
    assert stored["n_people"] == 2
    assert (tmp_path / "out.csv").read_text().startswith("table,method,figure,value,low,high\n")


@pytest.mark.parametrize(
    ("flags", "reason"),
    [
        (["--talker", "grid_s1"], "--talker has no effect without --people"),
        (["--people", "a", "--own-durations"], "can be combined only with"),
        (["--people", "a", "--recordings", "b"], "can be combined only with"),
        (["--people", "a", "--people", "a"], "names a folder twice"),
        (["--people", "a", "--out", "x.html"], "x.html"),
    ],
)
def test_contradicting_flags_are_refused(flags: list[str], reason: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["corpus", "evaluate", *flags]) == 2
    assert reason in capsys.readouterr().err
