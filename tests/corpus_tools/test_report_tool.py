"""The tool that writes reports."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from corpus_tools.measures.splits import split_randomly
from corpus_tools.studies.evaluation.evaluate import evaluate
from corpus_tools.tools.report import report, talker_observations
from tests.processes.answered import answered
from tts2face.models.landmarks import lip_opening
from tts2face.models.talker_file import load_talker, write_talker


def messages(kind: str, model: str, out: Path) -> list[Mapping[str, Any]]:
    return [one.content for one in answered(report, {"kind": kind, "model": model, "name": "mine", "out": str(out)})]


def test_unknown_reports_and_small_talkers_are_refused(tmp_path: Path) -> None:
    talker = load_talker("grid_s1")
    small = tmp_path / "small.talker"
    write_talker(small, replace(talker, utterances=talker.utterances[:9]))
    (wrong,) = messages("beauty", "grid_s1", tmp_path / "a.html")
    assert (wrong["errors"][0], "similarity, gestures, accuracy" in wrong["message"]) == ("InputError", True)
    last = messages("accuracy", str(small), tmp_path / "a.html")[-1]
    assert last["message"] == ("the talker mine has 9 recordings; an accuracy report holds some out and needs 10")
    missing = messages("similarity", str(tmp_path / "none.talker"), tmp_path / "a.html")[-1]
    assert str(tmp_path) not in str(missing["message"])  # the client knows the name only
    assert not (tmp_path / "a.html").exists()


def test_observations_are_the_recordings_of_the_talker() -> None:
    talker = load_talker("grid_s1")
    talker = replace(talker, utterances=talker.utterances[:25])
    found = talker_observations(talker)
    assert [one.name for one in found] == [one.name for one in talker.utterances]
    np.testing.assert_allclose(talker.model.parameters(found[0].landmarks), talker.utterances[0].shape, atol=1e-3)
    result, _ = evaluate([split_randomly(found, seed=0)])
    r = {one.method: one.figures["r_opening"].value for one in result.scores}
    assert (result.n_train, result.n_test) == (20, 5)
    assert 0.6 < r["exemplar"] < 1.0  # of recordings that were not learnt from
    assert lip_opening(found[0].landmarks).max() > 0.05
