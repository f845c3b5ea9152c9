"""``tts2face report retarget`` on rendered takes: every kind of file, every refusal."""

import json
from pathlib import Path

import pytest

from cli.main import run
from tests.rendered_takes import ONLY_RENDERED, copy_takes

CLIPS = ("bbaf2n", "bgim1n")


@pytest.fixture(scope="module")
def recordings(takes: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return copy_takes(takes, CLIPS, tmp_path_factory.mktemp("recordings"))


@ONLY_RENDERED
def test_a_head_that_mimics_itself_reads_alike(
    recordings: Path, tmp_path: Path, face_model: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The person in the takes is the head itself, so that the tracker reads the same mouth again."""
    assert face_model.is_file()
    out, cache = tmp_path / "r.json", str(tmp_path / "cache")
    assert run(["report", "retarget", str(recordings), "--out", str(out), "--jobs", "1", "--cache", cache]) == 0
    content = json.loads(out.read_text())
    assert content["recordings"] == len(CLIPS)
    assert f"wrote {out}: 2 recordings, " in capsys.readouterr().err
    assert content["motion"]["r_opening"] > 0.95
    assert content["motion"]["r_width"] > 0.8
    tokens = sum(phone["tokens"] for phone in content["phones"])
    jaw = sum(phone["tokens"] * (phone["face"]["jawOpen"] - phone["person"]["jawOpen"]) for phone in content["phones"])
    assert abs(jaw / tokens) < 0.06
    assert any((tmp_path / "cache").iterdir())


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["nowhere", "--out", "r.html"], "nowhere"),
        (["clips", "--out", "r.pdf"], "a report is written as .html, .csv, .json, .png, not r.pdf"),
        (["clips", "--out", "r.csv", "--face", "bust"], "there is no face 'bust'"),
        (["clips", "--out", "r.csv", "--jobs", "0"], "jobs must be 1 or more, not 0"),
    ],
)
def test_wrong_requests_are_refused(
    arguments: list[str], said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "clips").mkdir()
    (tmp_path / "clips" / "a.mp4").write_bytes(b"no video")
    assert run(["report", "retarget", *arguments]) == 2
    assert said in capsys.readouterr().err
    assert not list(tmp_path.glob("r.*"))
