"""The window: its requirements, its camera, and playing a clip on a display."""

from types import SimpleNamespace

import numpy as np
import pytest

from lexicon.errors import BackendError
from lexicon.sequence import SILENCE, PhoneSequence
from tests.packages import package
from tests.picture.tiny_face import tiny_face
from tts2face.picture import vtk_renderer as vtk
from tts2face.picture import window as view
from tts2face.picture.camera import camera_matrices
from tts2face.picture.options import Picture, parse_camera
from tts2face.types import HEAD_CHANNELS, Clip, Speech, Trajectory, Waveform

ONE_PROCESS = pytest.mark.xdist_group("vtk")  # imports VTK, which takes 1.5 s
pytestmark = ONE_PROCESS


def clip_of(face):
    motion = np.linspace(0, 1, 3)[:, None] * [1, 0, 0, 0]
    speech = Speech(Waveform(np.zeros(2400), 24_000), PhoneSequence((SILENCE,), np.array([0.0, 0.1])), ())
    return Clip(Trajectory(face.shape_names, motion, 30), Trajectory(HEAD_CHANNELS, np.zeros((3, 6)), 30), speech)


def test_without_a_display_the_window_is_refused_before_it_opens(monkeypatch):
    monkeypatch.setattr(view, "require_pyvista", lambda purpose: None)
    monkeypatch.setattr(view, "sys", SimpleNamespace(platform="linux"))
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    monkeypatch.setattr(view, "can_draw_with", lambda window: pytest.fail("no probe is needed without a display"))
    with pytest.raises(BackendError, match=r"this machine has no display; write a file with --out"):
        view.show_clip(clip_of(tiny_face()), tiny_face(), Picture())


def test_a_display_that_vtk_cannot_use_is_refused(monkeypatch):
    monkeypatch.setattr(view, "require_pyvista", lambda purpose: None)
    monkeypatch.setenv("DISPLAY", ":77")
    monkeypatch.setattr(view, "can_draw_with", lambda window: False)
    with pytest.raises(BackendError, match="VTK cannot open a window on this display"):
        view.show_clip(clip_of(tiny_face()), tiny_face(), Picture())


def test_without_pyvista_the_error_names_what_to_install(monkeypatch):
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    with pytest.raises(BackendError, match=r"--view needs pyvista.*pip install 'tts2face\[view\]'"):
        view.show_clip(clip_of(tiny_face()), tiny_face(), Picture())


@pytest.mark.parametrize("name", ["front", "three-quarter", "profile", "close", "-20,15,700"])
def test_the_window_has_the_camera_of_the_picture(name):
    pyvista = package("pyvista")
    wanted = camera_matrices(parse_camera(name), tiny_face(), (320, 240))
    plotter = SimpleNamespace(camera=pyvista.Camera())
    vtk.aim_camera(plotter, wanted, 240)
    np.testing.assert_allclose(view.camera_matrix(plotter.camera), wanted.view, atol=1e-3)
    assert np.tan(np.radians(plotter.camera.view_angle) / 2) == pytest.approx(120 / wanted.lens[0])


def skip_without_display(option):
    try:
        view.require_display(option)
    except BackendError as missing:
        pytest.skip(f"needs a display and pyvista: {missing}")


def test_a_clip_plays_to_its_last_frame_and_turning_the_camera_relights_it():
    skip_without_display("--view")
    face = tiny_face()
    player = view.ClipPlayer(clip_of(face), face, Picture(size="128x128"))
    try:
        player.plotter.show(auto_close=False, interactive=False)
        seen = []
        for seconds in (0.0, 0.05, 0.099, 5.0):
            assert player.show_at(seconds) == (seconds < 1 and seconds > 0), seconds
            player.plotter.render()
            seen.append(np.asarray(player.plotter.screenshot(return_img=True)).astype(int))
        assert np.abs(seen[0] - seen[1]).max() > 20
        np.testing.assert_array_equal(seen[2], seen[3])
        player.plotter.camera.Azimuth(30)
        assert player.show_at(5.0)
        player.restart()
        assert not player.show_at(0.0)
    finally:
        player.close()


def test_a_live_window_shows_the_newest_motion():
    skip_without_display("--camera")
    face = tiny_face()
    motions = [None, (np.array([1.0, 0, 0, 0], np.float32), np.zeros(6, np.float32)), None]
    live_window = view.LiveWindow(face, Picture(size="128x128"), lambda: motions.pop(0))
    try:
        live_window.plotter.show(auto_close=False, interactive=False)
        seen = []
        for moved in (False, True, False):
            assert live_window.tick() == moved
            live_window.plotter.render()
            seen.append(np.asarray(live_window.plotter.screenshot(return_img=True)).astype(int))
        assert np.abs(seen[0] - seen[1]).max() > 20
        np.testing.assert_array_equal(seen[1], seen[2])
    finally:
        live_window.close()
