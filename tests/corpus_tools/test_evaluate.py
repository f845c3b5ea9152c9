"""The comparison on a made corpus in which every phone has one mouth opening: the answer is known to be good."""

import json
from pathlib import Path

import numpy as np
import pytest

from corpus_tools.evaluate import Evaluation, evaluate, split
from corpus_tools.observation import Observation, Quality
from lexicon.errors import InputError
from lexicon.sequence import SILENCE, PhoneSequence

OPENINGS = {"p": 0.0, "b": 0.0, "m": 0.0, "s": 4.0, "t": 5.0, "i": 7.0, "ɑ": 15.0, SILENCE: 0.0}
FPS = 25.0


def observation(number: int) -> Observation:
    stream = np.random.default_rng(number)
    names = [label for label in OPENINGS if label != SILENCE]
    labels = [SILENCE, *(names[at] for at in stream.integers(0, len(names), 8)), SILENCE]
    edges = np.concatenate([[0.0], np.cumsum([0.5, *stream.uniform(0.1, 0.2, 8), 0.5])])
    phones = PhoneSequence(labels, edges)
    times = np.arange(int(edges[-1] * FPS)) / FPS
    opening = np.interp(times, (edges[:-1] + edges[1:]) / 2, [OPENINGS[label] for label in labels])
    points = np.tile(np.random.default_rng(0).normal(0, 30, (478, 3)), (len(times), 1, 1))
    points += stream.normal(0, 0.01, points.shape)
    points[:, 13] = (0.0, -40.0, 0.0)
    points[:, 14] = np.stack([np.zeros_like(times), -40.0 - opening, np.zeros_like(times)], axis=1)
    points[:, 291, 0] = 25.0 - 0.3 * opening
    points[:, [33, 263]] = ((-45.0, 0.0, 0.0), (45.0, 0.0, 0.0))
    head = np.zeros((len(times), 6), np.float32)
    quality = Quality(0.0, 1.0, 0, 0.0)
    return Observation(
        f"u{number:02d}", FPS, points.astype(np.float32), head, phones, (), head[:, 0], quality, Path("u.mkv")
    )


@pytest.fixture(scope="module")
def observations() -> list[Observation]:
    return [observation(number) for number in range(40)]


@pytest.fixture(scope="module")
def evaluation(observations: list[Observation]) -> Evaluation:
    train, test = split(observations, hold_out=8, seed=0)
    return evaluate(train, test)


def test_a_face_that_follows_its_phones_is_predicted(evaluation: Evaluation):
    scores = {one.method: one for one in evaluation.scores}
    assert list(scores) == ["mean face", "mean phone pose", "exemplar", "theobald2007", "real, through the model"]
    assert scores["mean face"].r_opening == 0.0
    assert scores["exemplar"].r_opening > 0.97
    assert scores["exemplar"].dtw_cost < scores["mean face"].dtw_cost  # most of the parameters are noise
    assert scores["real, through the model"].r_opening > 0.999
    assert scores["real, through the model"].dtw_cost == 0.0
    assert all(len(one.utterances) == 8 for one in evaluation.scores)


def test_tells_itself_as_table_and_json(evaluation: Evaluation):
    lines = evaluation.table().splitlines()
    assert len(lines) == 2 + 5
    assert lines[0].startswith("| method | r opening | r width |")
    told = json.loads(json.dumps(evaluation.to_json()))
    assert (told["n_train"], told["n_test"]) == (32, 8)
    assert told["scores"][2]["utterances"][0]["name"].startswith("u")


def test_a_split_is_repeatable_and_parts_nothing_else(observations: list[Observation]):
    names = [one.name for one in observations]
    train, test = split(observations[::-1], hold_out=8, seed=3)
    assert sorted(one.name for one in (*train, *test)) == names
    assert [one.name for one in test] == [one.name for one in split(observations, hold_out=8, seed=3)[1]]
    assert [one.name for one in test] != [one.name for one in split(observations, hold_out=8, seed=4)[1]]


@pytest.mark.parametrize("hold_out", [0, 40])
def test_refuses_a_split_without_two_parts(observations: list[Observation], hold_out):
    with pytest.raises(InputError, match="can be held out"):
        split(observations, hold_out=hold_out, seed=0)


def test_refuses_an_empty_test(observations: list[Observation]):
    with pytest.raises(InputError, match="no utterance to test"):
        evaluate(observations, [])
