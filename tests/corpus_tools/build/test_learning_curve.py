"""Learning curves: choice of the material, figures and their differences, the base, tables, files and the command."""

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from cli.main import run
from corpus_tools.recordings.observation import Observation
from corpus_tools.studies.evaluation.curve import CurvePoint, LearningCurve, compare_points
from corpus_tools.studies.evaluation.curve_page import REPORT
from corpus_tools.studies.evaluation.curve_tables import curve_rows, curve_tables, monotony
from corpus_tools.studies.evaluation.evaluate import EVALUATION_METADATA, evaluate
from corpus_tools.studies.evaluation.learning_curve import (
    BASE_ALONE,
    MEAN_FACE,
    MEAN_POSE,
    N_CHOICES,
    OWN_ALONE,
    WITH_BASE,
    choose_material,
    measure_learning_curve,
)
from corpus_tools.studies.evaluation.people_tables import FIGURE_HEADS
from corpus_tools.training.adapt_talker import Base
from corpus_tools.training.train_talker import learn_talker
from lexicon.errors import InputError
from tests.corpus_tools.build.test_people import write_tracks
from tests.corpus_tools.speaking import FPS, observation
from tests.kept import kept
from tts2face.models.talker_file import write_talker

TRAIN = [observation(number) for number in range(16)]
TEST = [observation(100 + number) for number in range(4)]
SECONDS = sum(len(one.landmarks) for one in TRAIN) / FPS


@pytest.fixture(scope="module")
def base() -> Base:
    return another_person()


def another_person() -> Base:
    """Lips that open half as far."""
    return Base.of(learn_talker([observation(200 + n, 0.5) for n in range(12)], metadata=EVALUATION_METADATA))


@pytest.fixture(scope="module")
def curve() -> LearningCurve:
    return kept(learning_curve)


def learning_curve() -> LearningCurve:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("corpus_tools.studies.evaluation.learning_curve.N_CHOICES", 2)
        return measure_learning_curve(TRAIN, TEST, another_person(), amounts_s=[5.0, 10.0])


def names(part: Sequence[Observation]) -> list[str]:
    return [one.name for one in part]


def test_choices_are_nested_and_have_the_amount() -> None:
    small, large, everything = choose_material(TRAIN, [10.0, 5.0], 0)
    assert (len(small), len(large)) == (N_CHOICES, N_CHOICES)
    assert [names(part) for part in everything] == [names(TRAIN)]
    assert len({tuple(names(part)) for part in small}) == N_CHOICES
    longest = max(len(one.landmarks) for one in TRAIN) / FPS
    for some, more in zip(small, large, strict=True):
        assert set(names(some)) < set(names(more))
        assert names(some) == sorted(names(some))
        for part, amount in ((some, 5.0), (more, 10.0)):
            assert abs(sum(len(one.landmarks) for one in part) / FPS - amount) <= longest / 2 + 1e-9


def test_amounts_beyond_the_material_are_all_material_once() -> None:
    assert len(choose_material(TRAIN, [SECONDS * 0.95, 1e6], 0)) == 1


def test_other_seeds_choose_other_material() -> None:
    one, other = (choose_material(TRAIN, [5.0], seed)[0] for seed in (0, 1))
    assert [names(part) for part in one] != [names(part) for part in other]


@pytest.mark.parametrize("amounts", [[], [0.0], [-3.0], [float("nan")], [float("inf")]])
def test_amounts_that_are_no_seconds_are_refused(amounts: list[float]) -> None:
    with pytest.raises(InputError, match="must be seconds above 0"):
        choose_material(TRAIN, amounts, 0)


def test_all_material_alone_has_the_correlations_of_the_evaluation(curve: LearningCurve) -> None:
    """r does not depend on the scale of a curve, so that z-scored ones have that of `corpus evaluate`."""
    reference, _ = evaluate([(tuple(TRAIN), tuple(TEST))])
    scores = {one.method: one for one in reference.scores}
    last = curve.points[-1]
    assert last.seconds == pytest.approx(SECONDS)
    for method, name in ((OWN_ALONE, "exemplar"), (MEAN_POSE, "mean phone pose")):
        for figure in ("r_opening", "r_width"):
            assert last.figures[method][figure].value == pytest.approx(scores[name][figure], abs=1e-6)
    assert last.figures[MEAN_FACE]["r_opening"].value == 0.0


def test_the_base_alone_does_not_depend_on_the_material(curve: LearningCurve) -> None:
    assert curve.methods == (WITH_BASE, OWN_ALONE, MEAN_POSE, MEAN_FACE, BASE_ALONE)
    values = {point.figures[BASE_ALONE]["dtw_cost"].value for point in curve.points}
    assert max(values) - min(values) < 1e-12
    own = [point.figures[MEAN_POSE]["dtw_cost"].value for point in curve.points]
    assert max(own) - min(own) > 1e-3


def test_with_enough_material_the_talker_is_that_of_own_material_alone(
    base: Base, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("corpus_tools.training.short_talker.MIN_OWN_MINUTES", 8.0 / 60.0)
    monkeypatch.setattr("corpus_tools.studies.evaluation.learning_curve.N_CHOICES", 1)
    found = measure_learning_curve(TRAIN, TEST, base, amounts_s=[5.0])
    small, everything = found.points
    assert everything.figures[WITH_BASE] == everything.figures[OWN_ALONE]
    assert small.figures[WITH_BASE] != small.figures[OWN_ALONE]


def test_a_base_that_holds_a_test_recording_is_refused() -> None:
    held = replace(TEST[1], name="renamed")
    holds = Base.of(learn_talker([*TRAIN[:8], held], metadata=EVALUATION_METADATA))
    with pytest.raises(InputError, match="is in both the talker evaluation and the recordings"):
        measure_learning_curve(TRAIN, TEST, holds, amounts_s=[5.0])


def test_recordings_in_both_parts_are_refused() -> None:
    with pytest.raises(InputError, match="u00 is in both"):
        measure_learning_curve(TRAIN, [TRAIN[0]], None)


def test_a_point_has_the_mean_and_deviation_of_its_choices() -> None:
    stream = np.random.default_rng(0)
    values = [{name: stream.normal(one, 0.1, 2001) for name, _ in FIGURE_HEADS} for one in (1, 3)]
    point = CurvePoint.of(10.0, 0, {"method": values})
    first = [one["r_opening"][0] for one in values]
    estimate = point.figures["method"]["r_opening"]
    assert estimate.value == pytest.approx(np.mean(first))
    assert estimate.deviation == pytest.approx(np.std(first, ddof=1))
    # Both choices are drawn in half of the resamples, one of them twice in the others.
    assert estimate.low == pytest.approx(1.0, abs=0.2)
    assert estimate.high == pytest.approx(3.0, abs=0.2)
    assert CurvePoint.of(10.0, 0, {"method": values[:1]}).figures["method"]["r_width"].deviation is None


def made_curve(*means: float) -> LearningCurve:
    """A curve of one method, whose r and cost are the means at 10 s, 20 s, ... with deviations of .01."""
    stream, points = np.random.default_rng(0), []
    for number, mean in enumerate(means):
        values = {name: stream.normal(mean, 0.01, 2001) for name, _ in FIGURE_HEADS}
        values = {name: np.concatenate([[mean], one[1:]]) for name, one in values.items()}
        values["dtw_cost"] = 1.0 - values["r_opening"]
        points.append(CurvePoint.of(10.0 * (number + 1), number, {"own alone": [values, values]}))
    return compare_points(points, n_test=3, test_seconds=9.0, base=None)


def test_only_steps_beyond_their_interval_are_named() -> None:
    assert monotony(made_curve(0.5, 0.6, 0.59)).startswith("No figure becomes worse")
    assert monotony(made_curve(0.5, 0.6, 0.4)) == (
        "Worse than with less material by more than the 95 % interval: "
        "own alone at 30 s (r opening, r width, DTW cost, r opening within, r width within)."
    )


def test_tables_hold_every_amount_and_method(curve: LearningCurve) -> None:
    text = curve_tables(curve)
    assert (
        "| own material (s) | choices | as built with base | own alone | mean pose | mean face | base alone |" in text
    )
    assert f"| {SECONDS:.0f} | 1 |" in text
    assert "± " in text
    assert "| as built with base minus |" in text
    assert text.endswith((".", "interval."))
    n_numbers = len(FIGURE_HEADS) * (3 * 5 + 2 * 5 + 3 * 4)
    assert len(list(curve_rows(curve))) == 1 + n_numbers


@pytest.mark.needs("matplotlib")
def test_files_hold_the_curve(curve: LearningCurve) -> None:
    stored = json.loads(REPORT.formats[".json"](curve))
    assert [point["seconds"] for point in stored["points"]] == [point.seconds for point in curve.points]
    assert REPORT.formats[".csv"](curve).startswith(b"table,seconds,method,minus,figure,value,low,high,deviation\n")
    svg, page = REPORT.formats[".svg"](curve).decode(), REPORT.formats[".html"](curve).decode()
    assert svg.startswith("<svg ")
    assert 'xmlns="http://www.w3.org/2000/svg"' in svg
    assert "var(" not in svg
    for method in curve.methods:
        assert (method in svg) == (method != MEAN_FACE)
        assert method in page
    assert REPORT.formats[".png"](curve).startswith(b"\x89PNG")


def test_the_command_measures_tracks_of_a_person(
    tmp_path: Path, base: Base, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("corpus_tools.studies.evaluation.learning_curve.N_CHOICES", 1)
    write_talker(tmp_path / "base.talker", base.talker)
    tracks = write_tracks(tmp_path / "person")
    flags = ["--recordings", str(tracks), "--hold-out", "2", "--base", str(tmp_path / "base.talker")]
    command = ["corpus", "evaluate", "--learning-curve", "4", *flags, "--out", str(tmp_path / "curve.svg")]
    assert run(command) == 0
    captured = capsys.readouterr()
    assert "| as built with base minus | r opening |" in captured.out
    assert "curve.svg: 2 amounts of material, 2 utterances held out" in captured.err
    assert (tmp_path / "curve.svg").read_bytes().startswith(b"<svg ")


@pytest.mark.parametrize(
    ("flags", "reason"),
    [
        (["--learning-curve", "auto"], "give --recordings"),
        (["--learning-curve", "auto", "--recordings", "a", "--own-durations"], "can be combined only with"),
        (["--learning-curve", "auto", "--recordings", "a", "--folds", "3"], "can be combined only with"),
        (["--learning-curve", "10,many", "--recordings", "a"], "must be auto or seconds separated by commas"),
        (["--learning-curve", "auto", "--recordings", "a", "--out", "x.txt"], "x.txt"),
        (["--recordings", "a", "--base", "none"], "--base has no effect without --learning-curve"),
        (["--people", "a", "--learning-curve", "10"], "--learning-curve tests no --talker; remove it"),
        (["--people", "a", "--base", "none"], "--base has no effect without --learning-curve"),
    ],
)
def test_contradicting_flags_are_refused(flags: list[str], reason: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["corpus", "evaluate", *flags]) == 2
    assert reason in capsys.readouterr().err
