"""A talker cloned onto another's face, and the file that keeps it."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from corpus_tools.clone_talker import clone_talker, transfer_talker
from lexicon.errors import InputError
from tests.lips.test_clone import gaps_of, model_of, opening_model
from tts2face.lips.cloning import build_parameter_transfer, face_size
from tts2face.models.talker import Talker
from tts2face.models.talker_file import load_talker, read_talker

SOURCE_STATED = {
    "name": "A",
    "language": "en",
    "sources": "s",
    "licence": "CC BY 4.0",
    "attribution": "a",
    "refused": [],
}
TARGET_STATED = {
    "name": "B",
    "language": "de",
    "sources": "t",
    "licence": "CC0",
    "attribution": "a",
    "consent": {"name": "B", "statement": "me", "date": "2026-01-02"},
}


def talkers() -> tuple[Talker, Talker]:
    """The starter's first utterances, and a talker of another shape and size with other modes."""
    starter = load_talker("grid_s1")
    source = replace(starter, utterances=starter.utterances[:3], metadata=SOURCE_STATED)
    own = starter.model
    kept = [*range(1, 9), *range(20, 24)]
    model = replace(own, mean=1.2 * own.mean, basis=own.basis[kept], spread=own.spread[kept], rest=own.rest[kept],
                    n_speech=8)  # fmt: skip
    return source, replace(starter, model=model, utterances=starter.utterances[3:4], metadata=TARGET_STATED)


def test_the_target_speaks_with_the_source_s_articulation() -> None:
    source, target = talkers()
    made = transfer_talker(source, target, gain=0.9)
    ready = build_parameter_transfer(source.model, target.model, gain=0.9)
    assert made.n_appended == 0
    assert made.talker.model is target.model
    for before, after in zip(source.utterances, made.talker.utterances, strict=True):
        assert np.array_equal(after.shape, ready.parameters(before.shape))
        assert (after.name, after.phones, after.words) == (before.name, before.phones, before.words)
        assert np.array_equal(after.intensity, before.intensity)
        assert np.array_equal(after.head[:, :3], before.head[:, :3])
        assert after.head[:, 3:] == pytest.approx(1.2 * before.head[:, 3:], rel=1e-4)


def test_appended_components_bring_the_opening_back() -> None:
    """The target lacks the source's first mode, which opens the mouth."""
    source, target = talkers()
    made = {append: transfer_talker(source, target, append=append) for append in (False, True)}
    assert made[True].n_appended == len(made[True].talker.model.spread) - len(target.model.spread) > 0
    frames = np.concatenate([utterance.shape for utterance in source.utterances])
    opened = 1.2 * gaps_of(source.model, frames)[:, 4]
    reached = {
        append: gaps_of(one.talker.model, np.concatenate([u.shape for u in one.talker.utterances]))[:, 4]
        for append, one in made.items()
    }
    assert np.corrcoef(opened, reached[True])[0, 1] > 0.99 > np.corrcoef(opened, reached[False])[0, 1]
    assert np.ptp(reached[True]) > 2 * np.ptp(reached[False])


def test_provenance_of_both_is_kept() -> None:
    stated = transfer_talker(*talkers(), gain=1.5).talker.metadata
    assert stated["name"] == "B with the speech of A"
    assert stated["language"] == "en"
    assert stated["licence"] == "speech: CC BY 4.0; face: CC0"
    assert stated["sources"] == "speech: s; face: t"
    assert stated["attribution"] == "a"
    assert "consent" not in stated
    cloned = stated["cloning"]
    assert (cloned["gain"], cloned["size"], cloned["appended_modes"]) == (1.5, 1.2, 0)
    assert cloned["speech"] == {key: value for key, value in SOURCE_STATED.items() if key != "refused"}
    assert cloned["face"] == TARGET_STATED


def test_the_share_at_limits_is_counted() -> None:
    source, target = talkers()
    made = transfer_talker(source, target, gain=2.0)
    frames = np.concatenate([utterance.shape for utterance in source.utterances])
    ready = build_parameter_transfer(source.model, target.model, gain=2.0)
    expected = (np.abs(ready.parameters(frames)) >= ready.limits).any(axis=1).mean()
    assert made.share_at_limits == pytest.approx(expected)
    assert 0 < made.share_at_limits < 1


def test_the_written_talker_keeps_limits_and_lips(tmp_path: Path) -> None:
    made = clone_talker("grid_s1", "grid_s1", tmp_path / "c.talker", gain=1.3, append=True, created="2026-01-01")
    read = read_talker(tmp_path / "c.talker")
    frames = np.concatenate([utterance.shape for utterance in read.utterances])
    assert (np.abs(frames) <= 3 * read.model.spread * (1 + 1e-6)).all()
    assert gaps_of(read.model, frames).min() > 0
    assert (
        read.metadata["command"] == "tts2face corpus clone grid_s1 grid_s1 --out c.talker --gain 1.3 --append-missing"
    )
    assert read.metadata["created"] == "2026-01-01"
    again = tmp_path / "d" / "c.talker"
    again.parent.mkdir()
    clone_talker("grid_s1", "grid_s1", again, gain=1.3, append=True, created="2026-01-01")
    assert again.read_bytes() == (tmp_path / "c.talker").read_bytes()
    assert made.n_appended == 0


def test_pictures_of_the_source_are_dropped_where_the_target_has_none() -> None:
    source, target = talkers()
    assert not transfer_talker(source, target).lacks_appearance
    made = transfer_talker(replace(source, appearance=SimpleNamespace()), target)
    assert made.lacks_appearance
    assert made.talker.appearance is None
    assert all(utterance.appearance_parameters is None for utterance in made.talker.utterances)


def test_a_source_without_speech_is_refused() -> None:
    source, target = talkers()
    with pytest.raises(InputError, match="no utterance to clone"):
        transfer_talker(replace(source, utterances=()), target)


def test_sizes_are_those_of_the_mean_shapes() -> None:
    assert face_size(model_of(1, size=1.5)) == pytest.approx(1.5 * face_size(model_of(1)), rel=1e-5)
    assert build_parameter_transfer(opening_model(), opening_model()).size == 1.0
