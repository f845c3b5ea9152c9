"""The target window: what it shows, and what it refuses."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from lexicon.errors import BackendError, InputError
from tests.made_face import made_face
from tests.targets.made import FORMAT, States, made_tick
from tts2face.picture import window as picture_window
from tts2face.picture.options import Picture
from tts2face.targets import window as target_window
from tts2face.targets.live_targets import LiveTargets
from tts2face.targets.table import make_target, parse_target
from tts2face.targets.window import WindowTarget


@pytest.fixture
def window(monkeypatch: pytest.MonkeyPatch) -> WindowTarget:
    monkeypatch.setattr(target_window, "require_display", lambda *_: None)
    made = make_target(parse_target("window"), FORMAT)
    assert isinstance(made, WindowTarget)
    return made


def test_a_window_takes_the_newest_motion_once(window: WindowTarget, monkeypatch: pytest.MonkeyPatch) -> None:
    shown: list[Any] = []

    class MadeWindow:
        def __init__(self, face: Any, picture: Picture, newest: Callable[[], Any]) -> None:
            self.newest = newest

        def run(self) -> None:
            shown.extend([self.newest(), self.newest()])

        def close(self) -> None:
            shown.append("closed")

    monkeypatch.setattr(picture_window, "LiveWindow", MadeWindow)
    states = States()
    with LiveTargets([window], ["window"], states) as live:
        states.wait_for("connected")
        for number in range(3):
            live.send(made_tick(number))
        window.show(made_face(), Picture())
    (weights, head), nothing, closed = shown
    assert np.array_equal(weights, made_tick(2).motion)
    assert np.array_equal(head, made_tick(2).head)
    assert (nothing, closed) == (None, "closed")


def test_a_window_without_a_display_is_refused_before_anything_is_loaded(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(purpose: str, instead: str) -> None:
        raise BackendError(f"{purpose} opens a window, and this machine has no display; {instead}")

    monkeypatch.setattr(target_window, "require_display", refuse)
    with pytest.raises(BackendError, match="this machine has no display; choose another target"):
        make_target(parse_target("window"), FORMAT)


def test_a_photograph_is_no_head_for_a_window(window: WindowTarget, monkeypatch: pytest.MonkeyPatch) -> None:
    class Face:
        light = object()

    monkeypatch.setattr(target_window, "Photographed", object)
    with pytest.raises(InputError, match="the target window shows heads; send the face of a photograph to another"):
        window.show(Face(), Picture())  # type: ignore[arg-type]
