"""The distribution over people is learnt back from people who were made from it, and made people resemble real ones."""

import gzip
from pathlib import Path

import numpy as np
import pytest

from corpus_tools.shipped.training.gaze import estimate, fit_lognormal, learn_gaze
from corpus_tools.studies.gestures.gaze import compare, made_person, study_gaze, survival
from corpus_tools.training.gaze_recordings import Fixations, Lengths, find_looks, jump_sizes, read_people
from lexicon.errors import DataError, InputError
from tests.corpus_tools.gesture_study.made_gaze import write_people
from tts2face.models.gaze import PARAMETERS, STATES, GazeModel, load_gaze

RECORDED = "gaze_dialogue"


def fixations(*rows: tuple[float, float, float, float, int]) -> Fixations:
    """From start, duration, degrees down and left, and segment; a passage of hundred segments."""
    start, duration, down, left, segment = np.array(rows).T
    segment = segment.astype(np.int64)
    return Fixations(start, duration, np.stack([down, left], axis=1), segment, segment // 100)


def test_looks_are_those_whose_begin_is_seen_and_complete_where_nothing_hides_the_end() -> None:
    looks = find_looks(
        fixations(
            (0.0, 0.5, 0, 0, 0),  # its begin was not seen
            (0.6, 0.3, 0, 20, 0),
            (1.0, 0.2, 0, 22, 1),
            (1.3, 0.4, 1, 0, 1),
            (1.8, 0.4, 0, 2, 1),
            (4.0, 0.4, 0, 9, 1),  # after a gap
            (4.5, 0.3, 0, 0, 1),
            (5.0, 0.3, -9, 0, 100),  # another passage
        )
    )
    np.testing.assert_allclose(looks.away.seconds, [0.7])
    assert looks.away.is_complete.tolist() == [True]
    np.testing.assert_allclose(looks.face.seconds, [0.9, 0.3])
    assert looks.face.is_complete.tolist() == [False, False]
    np.testing.assert_allclose(looks.landed, [[0, 20]])


def test_fixations_that_noise_splits_are_one() -> None:
    merged = fixations((0.0, 0.2, 0, 0, 0), (0.25, 0.2, 0, 1, 0), (0.5, 0.2, 0, 6, 0), (0.75, 0.2, 0, 6, 1)).merged()
    np.testing.assert_allclose(merged.place, [[0, 0.5], [0, 6], [0, 6]])
    np.testing.assert_allclose(merged.duration, [0.45, 0.2, 0.2])
    np.testing.assert_allclose(jump_sizes(merged), [5.5])


def test_survival_is_that_of_kaplan_and_meier() -> None:
    found = survival(Lengths(np.array([3.0, 1.0, 2.0, 4.0]), np.array([True, True, False, True])))
    np.testing.assert_allclose(found.shares, [3 / 4, 3 / 4, 3 / 8, 0])
    other = survival(Lengths(np.array([1.0, 1.5]), np.array([True, True])))
    assert found.distance(other) == pytest.approx(0.75)
    assert found.distance(found) == 0


def test_incomplete_lengths_are_no_short_ones() -> None:
    draws = np.exp(np.log(3.0) + 0.8 * np.random.default_rng(0).normal(size=4000))
    cut = np.random.default_rng(1).exponential(3.0, len(draws))
    median, spread = fit_lognormal(Lengths(np.minimum(draws, cut), draws <= cut))
    assert np.exp(median) == pytest.approx(3.0, rel=0.05)
    assert np.exp(spread) == pytest.approx(0.8, rel=0.05)


def test_a_made_person_is_estimated_as_made() -> None:
    shape = (len(STATES), len(PARAMETERS))
    model = GazeModel(load_gaze().mean, np.zeros(shape), {})
    for at, state in enumerate(STATES):
        found = estimate(made_person(model, state, 3)).values
        for name in ("face", "away", "beyond", "face_fixation", "spot"):
            column = PARAMETERS.index(name)
            assert found[column] == pytest.approx(model.mean[at, column], abs=0.35), (state, name)


def test_people_who_are_like_each_other_are_not_like_others() -> None:
    shape = (len(STATES), len(PARAMETERS))
    model = GazeModel(load_gaze().mean, np.zeros(shape), {})
    later = np.isin(PARAMETERS, ("face", "away", "beyond", "roam"))
    slow = GazeModel(load_gaze().mean + later, np.zeros(shape), {})
    people = [{state: made_person(model, state, seed) for state in STATES} for seed in range(2)]
    near, far = (compare(people, other, n_made=2, seed=5).comparisons for other in (model, slow))
    for one, other in zip(near[:3], far[:3], strict=True):
        assert 3 * one.made < other.made > 0.1


def test_tables_are_read_in_degrees_of_the_person(tmp_path: Path) -> None:
    people = read_people(write_people(tmp_path, 1))
    assert [*people] == ["person01"]
    for state in STATES:
        made, read = made_person(load_gaze(), state, 1), people["person01"][state]
        np.testing.assert_allclose(read.place, made.place, atol=1e-3)
        np.testing.assert_allclose(read.start, made.start, atol=1e-3)
        assert read.share_on_face == pytest.approx(made.share_on_face, abs=1e-3)


def test_tables_that_are_none_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no recordings of gaze"):
        read_people(tmp_path)
    (tmp_path / "passages.tsv").write_text("person\tpassage\tface_x\tface_y\n1\t0\t5\t5\n")
    (tmp_path / "person01.tsv.gz").write_bytes(gzip.compress(b"condition\tpassage\nSPEAK\t0\n"))
    with pytest.raises(DataError, match="a table of fixations cannot be read: KeyError"):
        read_people(tmp_path)


@pytest.mark.build
def test_the_shipped_file_is_learnt_and_its_people_are_no_further_from_people_than_these(
    shared_recordings: Path,
) -> None:
    learnt, shipped = learn_gaze(shared_recordings / RECORDED), load_gaze()
    np.testing.assert_allclose(learnt.mean, shipped.mean, atol=1e-3)
    np.testing.assert_allclose(learnt.spread, shipped.spread, atol=1e-3)
    study = study_gaze(shared_recordings / RECORDED, n_made=10)
    for one in study.comparisons:
        assert one.made < 1.1 * one.people, one  # of 60 people less than 1.0 (docs/gestures.md), of ten by chance more
    shares = [np.median([one.share for one in study.people[state]]) for state in STATES]
    np.testing.assert_allclose(shares, [0.58, 0.95], atol=0.01)  # README of the recordings
