"""Commands that look for faces set up the landmark model where it is missing, after one yes."""

import inspect
import io
import sys
from collections.abc import Callable, Iterator
from dataclasses import fields, is_dataclass
from pathlib import Path

import numpy as np
import pytest
from cyclopts import App
from PIL import Image

from cli import photo as photo_command
from cli.main import app, run
from lexicon.errors import BackendError
from tts2face.video import networks, setup_models


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


@pytest.fixture
def photo(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A picture without a face, on a machine without the model."""
    path = tmp_path / "me.png"
    Image.fromarray(np.random.default_rng(0).integers(0, 255, (90, 90, 3), np.uint8)).save(path)
    monkeypatch.setattr(networks, "user_cache", lambda: tmp_path / "cache")
    monkeypatch.setattr(networks, "BUNDLING_PACKAGES", ())
    monkeypatch.delenv(networks.MODEL_VARIABLE, raising=False)
    photo_command.agreed.cache_clear()
    return path


@pytest.fixture
def downloads(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    made: list[str] = []

    def refuse() -> Path:
        made.append("download")
        raise BackendError("the network is down")

    monkeypatch.setattr(setup_models, "set_up_model", refuse)
    return made


def command(photo: Path, *more: str) -> list[str]:
    return ["face", "picture", str(photo), "--out", str(photo.with_suffix(".face")), *more]


def test_nothing_is_downloaded_without_a_yes(
    photo: Path, downloads: list[str], capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    assert run(command(photo, "--consent", "nobody")) != 0
    assert "run `tts2face corpus setup`" in capsys.readouterr().err
    monkeypatch.setattr(sys, "stdin", Terminal("n\n"))
    assert run(command(photo, "--consent", "nobody")) != 0
    shown = capsys.readouterr()
    assert "3.8 MB" in shown.out + shown.err
    assert not downloads


@pytest.mark.parametrize("answer", ["--yes", "y"])
def test_a_yes_is_enough(
    photo: Path,
    downloads: list[str],
    answer: str,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(sys, "stdin", Terminal("y\n" if answer == "y" else ""))
    assert run(command(photo, "--consent", "nobody", *([answer] if answer == "--yes" else []))) != 0
    assert downloads == ["download"]
    assert "the network is down" in capsys.readouterr().err


def functions(commands: App) -> Iterator[Callable[..., object]]:
    """Functions of all commands below one."""
    for name in commands:
        if not name.startswith("-"):
            yield from functions(commands[name])
    if commands.default_command is not None:
        yield commands.default_command


def flags(command: Callable[..., object]) -> set[str]:
    """Names of a command's parameters, and of those that it shares with others, which are fields of one."""
    parameters = inspect.signature(command).parameters.values()
    shared = [declared.name for each in parameters if is_dataclass(each.default) for declared in fields(each.default)]
    return {each.name for each in parameters} | {*shared}


def test_every_command_with_a_model_takes_a_yes() -> None:
    with_model = [taken for command in functions(app) if "model" in (taken := flags(command))]
    assert len(with_model) > 10
    assert all("yes" in taken for taken in with_model)


def test_consent_is_asked_for_before_anything_is_downloaded(
    photo: Path, downloads: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(command(photo, "--yes")) != 0
    assert "state the consent" in capsys.readouterr().err
    assert not downloads


def test_a_photo_stands_alone(photo: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for other in (["--face", "ada"], ["--identity", "kofi"], ["--hair", "long"], ["--hair-color", "red"]):
        assert run(["Hello.", "--photo", str(photo), *other, "--out", str(photo.with_suffix(".mp4"))]) != 0
        assert f"--photo cannot be combined with {other[0]};" in capsys.readouterr().err
    assert run(["Hello.", "--photo", "nobody.jpg", "--out", str(photo.with_suffix(".mp4"))]) != 0
    assert "there is no photo nobody.jpg; check the path" in capsys.readouterr().err
    assert run(["Hello.", "--consent", "me", "--out", "me.mp4"]) != 0
    assert "--consent belongs to --photo" in capsys.readouterr().err


def test_a_photo_is_not_asked_about_in_vain(photo: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["Hello.", "--photo", str(photo), "--consent", "nobody"]) != 0
    assert "there is no output" in capsys.readouterr().err
    shown = photo.with_suffix(".gif")
    with Image.open(photo) as picture:
        picture.save(shown)
    content = shown.read_bytes()
    assert run(["Hello.", "--photo", str(shown), "--consent", "nobody", "--out", str(shown)]) != 0
    assert "--photo" in capsys.readouterr().err
    assert shown.read_bytes() == content
