"""The comparison on a made corpus in which every phone has one mouth opening: the answer is known to be good."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from corpus_tools.measures.scores import FIGURES
from corpus_tools.measures.splits import split_by_words, split_into_folds, split_randomly
from corpus_tools.recordings.observation import Observation
from corpus_tools.studies.evaluation.evaluate import CEILING_METHOD, SplitResult, evaluate
from corpus_tools.studies.evaluation.page import evaluation_page
from corpus_tools.studies.evaluation.tables import AS_TRACKED, Evaluation, figure_rows
from corpus_tools.studies.evaluation.tracks import ExternalTrack, read_tracks
from lexicon.errors import DataError, InputError
from lexicon.sequence import WordSpan
from tests.corpus_tools.speaking import FPS, observation
from tests.packages import needs


@pytest.fixture(scope="module")
def observations() -> list[Observation]:
    return [observation(number) for number in range(40)]


@pytest.fixture(scope="module")
def measured(observations: list[Observation]) -> tuple[Evaluation, tuple[SplitResult, ...]]:
    return evaluate([split_randomly(observations, hold_out=8, seed=0)])


def test_a_face_that_follows_its_phones_is_predicted(measured: tuple[Evaluation, tuple[SplitResult, ...]]):
    scores = {one.method: one for one in measured[0].scores}
    assert list(scores) == ["mean face", "mean phone pose", "exemplar", "theobald2007", CEILING_METHOD]
    assert scores["mean face"]["r_opening"] == 0.0
    assert scores["exemplar"]["r_opening"] > 0.97
    assert scores["exemplar"]["dtw_cost"] < scores["mean face"]["dtw_cost"]  # most of the parameters are noise
    assert scores[CEILING_METHOD]["r_opening"] > 0.999
    assert scores[CEILING_METHOD]["dtw_cost"] == 0.0
    assert scores[CEILING_METHOD]["peak_offset_ms"] < 1.0
    assert all(len(one.utterances) == 8 for one in measured[0].scores)


def test_intervals_hold_their_value(measured: tuple[Evaluation, tuple[SplitResult, ...]]):
    for one in measured[0].scores:
        assert set(one.figures) == {name for name, _, _ in FIGURES} - {"free_cost"}
        for name, figure in one.figures.items():
            assert figure.low - 1e-9 <= figure.value <= figure.high + 1e-9, (one.method, name)
    exact = measured[0].scores[-1].figures["dtw_cost"]
    assert (exact.low, exact.high) == (0.0, 0.0)


def test_classes_hold_every_judged_frame_once(measured: tuple[Evaluation, tuple[SplitResult, ...]]):
    result, (run,) = measured
    n_frames = sum(one.evaluated.stop - one.evaluated.start for one in run.real)
    for one in result.scores:
        assert sum(some.n_frames for some in one.classes) == n_frames
        assert {some.phones for some in one.classes} <= {"bilabial", "labiodental", "rounded", "open", "other"}
    mean_face = {some.phones: some for some in result.scores[0].classes}
    assert mean_face["open"].opening_bias < 0 < mean_face["bilabial"].opening_bias  # too little, and too much


def test_tells_itself_as_tables_json_and_rows(measured: tuple[Evaluation, tuple[SplitResult, ...]]):
    result, _ = measured
    lines = result.table().splitlines()
    assert len(lines) == 2 + 5
    assert lines[0].startswith("| method | r opening | r width |")
    assert any("(0.000-0.000)" in cell for row in figure_rows(result.scores, intervals=True) for cell in row)
    assert result.class_table().startswith("| method | phones | frames |")
    content = json.loads(json.dumps(result.to_json()))
    assert (content["n_train"], content["n_test"]) == (32, 8)
    assert content["scores"][2]["utterances"][0]["name"].startswith("u")
    head, *rows = result.rows()
    assert len(head) == 2 + 3 * len(FIGURES)
    assert [row[:2] for row in rows] == [("true durations", one.method) for one in result.scores]
    assert all(len(row) == len(head) for row in rows)


@pytest.mark.needs("matplotlib")
def test_the_page_shows_all_figures_and_loads_nothing(measured: tuple[Evaluation, tuple[SplitResult, ...]]):
    html = evaluation_page(*measured)
    assert html.count("<h3>") == 9
    assert "Worst sentences of exemplar" in html
    assert "http" not in html
    worst = max(measured[0].scores[2].utterances, key=lambda one: one.dtw_cost)
    assert f"<h3>{worst.name} (DTW cost {worst.dtw_cost:.2f})</h3>" in html


def test_the_recorded_face_as_tracked_has_a_table_of_its_own(observations: list[Observation]):
    """Landmarks that move with the head's yaw are corrected for the first table, and not for the second."""
    turned = []
    for number, one in enumerate(observations):
        yaw = np.random.default_rng(number).uniform(-0.3, 0.3)
        head = one.head.copy()
        head[:, 1] = yaw
        landmarks = one.landmarks.copy()
        landmarks[:, 291, 0] += 20.0 * yaw
        turned.append(replace(one, head=head, landmarks=landmarks))
    result, runs = evaluate([split_randomly(turned, hold_out=8, seed=0)])
    at_ceiling = {name: scores[-1] for name, scores in result.tables()}
    corrected, tracked = at_ceiling["true durations"], at_ceiling[AS_TRACKED]
    assert corrected["dtw_cost"] == 0.0
    assert tracked["dtw_cost"] > 0.5
    assert tracked["r_width"] < corrected["r_width"] - 0.05
    assert "<h2>Recorded face as tracked</h2>" in evaluation_page(result, runs)


@pytest.mark.needs("matplotlib")
def test_folds_hold_out_every_utterance_once(observations: list[Observation]):
    parts = split_into_folds(observations, n_folds=4, seed=1)
    assert sorted(one.name for _, test in parts for one in test) == [one.name for one in observations]
    assert all(len(train) == 30 for train, _ in parts)
    result, runs = evaluate(parts[:2])
    assert (result.n_test, len(runs)) == (20, 2)
    assert len(result.scores[0].utterances) == 20
    assert [(fold.n_train, fold.n_test) for fold in result.folds] == [(30, 10), (30, 10)]
    for one in result.scores:  # a mean over utterances is the mean of the folds' means where these are alike in size
        mean, spread = result.fold_mean_and_deviation(one.method, "dtw_cost")
        assert mean == pytest.approx(one["dtw_cost"], rel=1e-12)
        each = [fold.figures[one.method]["dtw_cost"] for fold in result.folds]
        assert spread == pytest.approx(abs(each[0] - each[1]) / np.sqrt(2), rel=1e-12)
    assert [row[0] for row in result.rows()[-5:]] == ["fold 2"] * 5
    assert "spread over 2 folds" in result.table()
    html = evaluation_page(result, runs)
    assert "<h2>2 folds</h2>" in html
    assert html.count("<td>mean ± spread</td>") == 5
    assert html.count("<td>2 (10 held out, 30 for training)</td>") == 5


def test_a_fifth_is_held_out_by_default(observations: list[Observation]):
    train, test = split_randomly(observations, seed=0)
    assert (len(train), len(test)) == (32, 8)
    assert len(split_randomly(observations[:3], seed=0)[1]) == 1
    many = [replace(observations[0], name=f"v{number}") for number in range(600)]
    assert len(split_randomly(many, seed=0)[1]) == 100


@pytest.mark.parametrize("n_folds", [1, 41])
def test_refuses_folds_that_cannot_be(observations: list[Observation], n_folds):
    with pytest.raises(InputError, match="40 utterances make 2 to 40 folds"):
        split_into_folds(observations, n_folds=n_folds, seed=0)


def test_words_are_held_out_with_every_utterance_that_holds_them(observations: list[Observation]):
    with_words = [replace(one, words=(WordSpan("ab"[number % 2], 1, 2),)) for number, one in enumerate(observations)]
    train, test = split_by_words(with_words, ["B"])
    assert {word.text for one in train for word in one.words} == {"a"}
    assert {word.text for one in test for word in one.words} == {"b"}
    with pytest.raises(InputError, match="no utterance contains zebra"):
        split_by_words(with_words, ["zebra"])
    with pytest.raises(InputError, match="hold out fewer words"):
        split_by_words(with_words, ["a", "b"])


def test_a_split_is_repeatable_and_keeps_every_utterance(observations: list[Observation]):
    names = [one.name for one in observations]
    train, test = split_randomly(observations[::-1], hold_out=8, seed=3)
    assert sorted(one.name for one in (*train, *test)) == names
    assert [one.name for one in test] == [one.name for one in split_randomly(observations, hold_out=8, seed=3)[1]]
    assert [one.name for one in test] != [one.name for one in split_randomly(observations, hold_out=8, seed=4)[1]]


@pytest.mark.parametrize("hold_out", [0, 40])
def test_refuses_a_split_without_two_parts(observations: list[Observation], hold_out):
    with pytest.raises(InputError, match="can be held out"):
        split_randomly(observations, hold_out=hold_out, seed=0)


def test_refuses_an_empty_part(observations: list[Observation]):
    with pytest.raises(InputError, match="no utterance to test"):
        evaluate([(tuple(observations), ())])
    with pytest.raises(InputError, match="no utterance to learn from"):
        evaluate([((), tuple(observations))])


def test_a_network_is_trained_and_compared_with_where_there_is_enough_to_learn(
    observations: list[Observation], monkeypatch: pytest.MonkeyPatch
):
    needs("sklearn")
    monkeypatch.setattr("corpus_tools.training.phone_network.MIN_FRAMES", 100)
    result, _ = evaluate([split_randomly(observations, hold_out=8, seed=0)])
    scores = {one.method: one for one in result.scores}
    assert scores["sliding-window network"]["r_opening"] > 0.8  # of some 700 frames it cannot learn more
    assert scores["exemplar"]["r_opening"] > 0.95


def curves_of(observations: list[Observation], hidden: np.ndarray) -> dict[str, ExternalTrack]:
    """What another system might give: opening and width of the lips mixed, at 60 frames a second."""
    found = {}
    for one in observations:
        opening, width = one.landmarks[:, 13, 1] - one.landmarks[:, 14, 1], one.landmarks[:, 291, 0]
        times = np.arange(0, len(opening) / FPS, 1 / 60)
        read = np.stack([np.interp(times, np.arange(len(opening)) / FPS, curve) for curve in (opening, width)], axis=1)
        found[one.name] = ExternalTrack(times, read @ hidden)
    return found


def test_good_curves_of_others_score_high_whatever_their_channels(observations: list[Observation]):
    hidden = np.array([[0.3, -2.0, 1.0], [1.0, 0.5, 0.0]])
    parts = split_randomly(observations, hold_out=8, seed=0)
    result, _ = evaluate([parts], tracks=curves_of(observations, hidden))
    scores = {one.method: one for one in result.scores}
    assert scores["tracks"]["r_opening"] > 0.99
    still = {
        name: ExternalTrack(track.times, 0 * track.values) for name, track in curves_of(observations, hidden).items()
    }
    assert {one.method: one for one in evaluate([parts], tracks=still)[0].scores}["tracks"]["r_opening"] < 0.1


def test_curves_that_do_not_cover_the_split_are_refused(observations: list[Observation]):
    train, test = split_randomly(observations, hold_out=8, seed=0)
    curves = curves_of(observations, np.eye(2))
    with pytest.raises(InputError, match=f"the tracks lack {test[0].name}"):
        evaluate([(train, test)], tracks={one.name: curves[one.name] for one in train})
    with pytest.raises(InputError, match="hold 3 training utterances"):
        evaluate([(train, test)], tracks={one.name: curves[one.name] for one in (*train[:3], *test)})


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        ("", "must begin with the columns"),
        ("name,time,jaw\na,0,1\n", "must begin with the columns"),
        ("utterance,time,jaw\na,0\n", "line 2: 2 columns, not 3"),
        ("utterance,time,jaw\na,0,x\n", "line 2: 'x' is not a number"),
        ("utterance,time,jaw\na,0,nan\n", "'nan' is not a number"),
        ("utterance,time,jaw\na,1,0\na,0.5,0\n", "times of a do not increase"),
    ],
)
def test_tracks_that_cannot_be_read(content: str, reason: str, tmp_path: Path):
    path = tmp_path / "peer.csv"
    path.write_text(content)
    with pytest.raises(DataError, match=reason):
        read_tracks(path)


def test_tracks_are_read_by_utterance(tmp_path: Path):
    path = tmp_path / "peer.csv"
    path.write_text("utterance,time,jaw,lips\na,0,1,2\nb,0,5,6\na,0.5,3,4\n")
    found = read_tracks(path)
    assert set(found) == {"a", "b"}
    assert found["a"].at(np.array([0.25, 9.0])).tolist() == [[2.0, 3.0], [3.0, 4.0]]
    with pytest.raises(InputError, match="there are no tracks"):
        read_tracks(tmp_path / "none.csv")
