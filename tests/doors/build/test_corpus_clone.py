"""``tts2face corpus clone`` as a person uses it."""

import re
from dataclasses import replace
from pathlib import Path

import pytest

from cli.main import run
from corpus_tools.clone_talker import clone_talker
from tts2face.models.talker_file import load_talker, read_talker, write_talker


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with two small talkers: the starter's first utterances, whole and with half of its modes."""
    monkeypatch.chdir(tmp_path)
    starter = load_talker("grid_s1")
    few = replace(starter, utterances=starter.utterances[:4])
    kept, own = [*range(8), *range(20, 25)], starter.model
    model = replace(own, basis=own.basis[kept], spread=own.spread[kept], rest=own.rest[kept], n_speech=8)
    narrow = replace(
        few,
        model=model,
        network=None,
        scores=None,
        audio_maps={},
        utterances=tuple(replace(u, shape=u.shape[:, kept]) for u in few.utterances),
    )
    write_talker(tmp_path / "a.talker", few)
    write_talker(tmp_path / "b.talker", narrow)
    return tmp_path


def test_a_cloned_talker_is_written_and_can_be_shown(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["corpus", "clone", "a.talker", "b.talker", "--out", "c.talker"]) == 0
    captured = capsys.readouterr().err
    assert re.search(r"wrote c.talker: 4 utterances, \d+\.\d% of frames at limits", captured)
    assert run(["corpus", "show", "c.talker"]) == 0
    shown = capsys.readouterr().out
    assert "GRID s1 with the speech of GRID s1" in shown
    assert "mouth modes: 8" in shown


def test_the_door_does_what_the_core_does(here: Path) -> None:
    flags = ["--gain", "1.2", "--append-missing"]
    assert run(["corpus", "clone", "a.talker", "b.talker", "--out", "c.talker", *flags]) == 0
    by_door = (here / "c.talker").read_bytes()
    clone_talker("a.talker", "b.talker", Path("c.talker"), gain=1.2, append=True)
    assert (here / "c.talker").read_bytes() == by_door


def test_every_option_matters(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for out, flags in (("plain", []), ("gain", ["--gain", "0.5"]), ("more", ["--append-missing"])):
        assert run(["corpus", "clone", "a.talker", "b.talker", "--out", f"{out}.talker", *flags]) == 0
    assert re.search(r"4 utterances, [1-9]\d* modes appended", capsys.readouterr().err)
    plain, gain, more = (read_talker(here / f"{out}.talker") for out in ("plain", "gain", "more"))
    assert abs(gain.utterances[0].shape[:, 0]).max() < abs(plain.utterances[0].shape[:, 0]).max()
    assert more.model.n_speech > plain.model.n_speech == 8


def test_a_cloned_talker_can_be_spoken(here: Path) -> None:
    assert run(["corpus", "clone", "grid_s1", "b.talker", "--out", "c.talker"]) == 0
    small = ["--size", "64x64", "--fps", "5", "--quiet"]
    assert run(["Place blue.", "--talker", "c.talker", "--out", "x.mp4", *small]) == 0
    assert (here / "x.mp4").stat().st_size > 1000


@pytest.mark.parametrize(
    ("arguments", "code", "reason"),
    [
        (["a.talker", "b.talker", "--out", "c.face"], 2, "a talker is written as .talker, not c.face"),
        (["none.talker", "b.talker", "--out", "c.talker"], 2, "no talker file none.talker"),
        (["a.talker", "none.talker", "--out", "c.talker"], 2, "no talker file none.talker"),
        (["a.talker", "junk.talker", "--out", "c.talker"], 3, "junk.talker is damaged or not a talker file"),
        (["a.talker", "b.talker", "--out", "c.talker", "--gain", "-1"], 2, "the gain must be 0 or more, not -1"),
        (["a.talker", "b.talker", "--out", "c.talker", "--gain", "inf"], 2, "the gain must be 0 or more, not inf"),
        (["a.talker", "b.talker", "--out", "none/c.talker"], 2, "there is no folder none to write c.talker to"),
    ],
)
def test_invalid_input_gives_one_sentence_and_no_output(
    arguments: list[str], code: int, reason: str, here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (here / "junk.talker").write_bytes(b"no talker at all")
    before = set(here.iterdir())
    assert run(["corpus", "clone", *arguments]) == code
    captured = capsys.readouterr().err
    assert reason in captured
    assert len(captured.strip().splitlines()) == 1
    assert set(here.iterdir()) == before
