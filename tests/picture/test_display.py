"""Requirements of a window, and the child process that tries to open it."""

from types import SimpleNamespace

import pytest

from lexicon.errors import BackendError
from tests.picture.test_window import clip_of
from tests.picture.tiny_face import tiny_face
from tts2face.picture import display, window
from tts2face.picture.options import Picture
from tts2face.processes.program import Program


@pytest.fixture
def _fresh_probe():
    display.can_open_window.cache_clear()
    yield
    display.can_open_window.cache_clear()


@pytest.fixture
def _pyvista(monkeypatch):
    monkeypatch.setattr("importlib.util.find_spec", lambda name: object())


@pytest.mark.usefixtures("_pyvista")
def test_without_a_display_the_window_is_refused_before_it_opens(monkeypatch):
    monkeypatch.setattr(display, "sys", SimpleNamespace(platform="linux"))
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    monkeypatch.setattr(display, "can_open_window", lambda: pytest.fail("no probe is needed without a display"))
    with pytest.raises(BackendError, match=r"this machine has no display; write a file with --out"):
        window.show_clip(clip_of(tiny_face()), tiny_face(), Picture())


@pytest.mark.usefixtures("_pyvista")
def test_a_display_that_vtk_cannot_use_is_refused(monkeypatch):
    monkeypatch.setenv("DISPLAY", ":77")
    monkeypatch.setattr(display, "can_open_window", lambda: False)
    with pytest.raises(BackendError, match="VTK cannot open a window on this display"):
        window.show_clip(clip_of(tiny_face()), tiny_face(), Picture())


def test_without_pyvista_the_error_names_what_to_install(monkeypatch):
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    with pytest.raises(BackendError, match=r"--view needs pyvista.*pip install 'tts2face\[view\]'"):
        window.show_clip(clip_of(tiny_face()), tiny_face(), Picture())


@pytest.mark.usefixtures("_fresh_probe")
@pytest.mark.parametrize("probe", ["CRASHES", "FAILS", "HANGS"])
def test_a_child_that_crashes_fails_or_hangs_means_no_window(monkeypatch, probe):
    monkeypatch.setattr(display, "PROBE_PROGRAM", Program(f"tests.picture.vtk_probes:{probe}"))
    monkeypatch.setattr(display, "PROBE_TIMEOUT_S", 1.0 if probe == "HANGS" else 30.0)
    assert not display.can_open_window()


@pytest.mark.usefixtures("_fresh_probe")
def test_the_probe_runs_once(monkeypatch):
    monkeypatch.setattr(display, "PROBE_PROGRAM", Program("tests.picture.vtk_probes:SEES"))
    assert display.can_open_window()
    monkeypatch.setattr(display, "PROBE_PROGRAM", None)
    assert display.can_open_window()


def test_the_environment_is_restored(monkeypatch):
    monkeypatch.setattr(display, "sys", SimpleNamespace(platform="linux"))
    monkeypatch.setenv("VTK_DEFAULT_OPENGL_WINDOW", "mine")
    with display.use_window_class():
        assert display.os.environ["VTK_DEFAULT_OPENGL_WINDOW"] == "vtkXOpenGLRenderWindow"
    assert display.os.environ["VTK_DEFAULT_OPENGL_WINDOW"] == "mine"
