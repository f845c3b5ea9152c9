"""The window: its camera, its pictures and playing a clip, in a window of VTK that is off screen."""

from dataclasses import replace

import numpy as np
import pytest

from lexicon.sequence import SILENCE, PhoneSequence
from tests.packages import package
from tests.picture.film.lit_face import lit_tiny_face
from tests.picture.tiny_face import tiny_face
from tts2face.picture import display
from tts2face.picture import window as view
from tts2face.picture.camera import camera_matrices
from tts2face.picture.camera_view import NAMED_VIEWS, parse_camera
from tts2face.picture.options import Picture
from tts2face.picture.renderer import mesh_renderer
from tts2face.processes.parent import Child
from tts2face.processes.program import Program
from tts2face.types import HEAD_CHANNELS, Clip, Speech, Trajectory, Waveform

pytestmark = [pytest.mark.xdist_group("vtk"), pytest.mark.usefixtures("few_directions")]  # VTK's import takes 1.5 s
SMALL = Picture(size="128x96")


def clip_of(face):
    motion = np.linspace(0, 1, 3)[:, None] * [1, 0, 0, 0]
    speech = Speech(Waveform(np.zeros(2400), 24_000), PhoneSequence((SILENCE,), np.array([0.0, 0.1])), ())
    return Clip(Trajectory(face.shape_names, motion, 30), Trajectory(HEAD_CHANNELS, np.zeros((3, 6)), 30), speech)


@pytest.fixture(scope="module")
def gl():
    """Software GL, or a GPU, which VTK needs off screen; tried in a child process that may crash."""
    package("pyvista")
    child = Child(Program("tests.picture.vtk_probes:OFF_SCREEN"))
    try:
        child.call(display.PROBE, {}, timeout_s=display.PROBE_TIMEOUT_S)
    except display.BackendError as missing:
        pytest.skip(f"needs a GPU or software GL: {missing}")
    finally:
        child.close()


@pytest.fixture
def off_screen(gl, monkeypatch):
    """Windows without a display."""
    monkeypatch.setattr(display, "WINDOW_CLASS", display.OFF_SCREEN_CLASSES[0])
    monkeypatch.setattr(package("pyvista"), "OFF_SCREEN", True)


def shown(window):
    window.plotter.render()
    return np.asarray(window.plotter.screenshot(return_img=True)).astype(int)


@pytest.mark.parametrize("name", ["front", "three-quarter", "profile", "close", "-20,15,700"])
def test_the_window_has_the_camera_of_the_picture(name):
    pyvista = package("pyvista")
    wanted = camera_matrices(parse_camera(name), tiny_face(), (320, 240))
    camera = pyvista.Camera()
    view.aim_camera(camera, wanted, 240)
    np.testing.assert_allclose(view.camera_matrix(camera), wanted.view, atol=1e-3)
    assert np.tan(np.radians(camera.view_angle) / 2) == pytest.approx(120 / wanted.lens[0])


@pytest.mark.parametrize("name", sorted(NAMED_VIEWS))
def test_the_yaw_of_a_camera_is_that_of_its_view(name):
    assert camera_matrices(NAMED_VIEWS[name], tiny_face(), (96, 96)).yaw_deg == pytest.approx(NAMED_VIEWS[name].yaw_deg)


@pytest.mark.usefixtures("off_screen")
@pytest.mark.parametrize("face", [tiny_face(), lit_tiny_face()], ids=["lamps", "baked"])
@pytest.mark.parametrize("camera", ["front", "three-quarter"])
def test_the_window_shows_the_pictures_of_files(face, camera):
    picture, clip = replace(SMALL, camera=camera), clip_of(face)
    player = view.ClipPlayer(clip, face, picture)
    try:
        player.plotter.show(auto_close=False, interactive=False)
        for number in (0, 2):
            player.show_at(number / clip.fps + 1e-3)
            wanted = mesh_renderer(face, picture).frame(clip, number).astype(int)
            np.testing.assert_array_equal(shown(player), wanted)
    finally:
        player.close()


@pytest.mark.usefixtures("off_screen")
def test_a_turned_camera_sees_what_a_file_from_there_shows():
    face, clip = lit_tiny_face(), clip_of(lit_tiny_face())
    player = view.ClipPlayer(clip, face, SMALL)
    try:
        player.plotter.show(auto_close=False, interactive=False)
        side = replace(SMALL, camera="30,10")
        view.aim_camera(player.plotter.camera, camera_matrices(side.view, face, (128, 96)), 96)
        assert player.show_at(0.0)
        wanted = mesh_renderer(face, side).frame(clip, 0).astype(int)
        focal = player._renderer.scene.optics.lens[0] / mesh_renderer(face, side).scene.optics.lens[0]
        assert focal == pytest.approx(1.0)
        assert np.abs(shown(player) - wanted).mean() < 1.0  # positions of the camera in 32 bits
    finally:
        player.close()


@pytest.mark.usefixtures("off_screen")
def test_a_window_of_another_size_is_filled_without_distortion():
    face, clip = lit_tiny_face(), clip_of(lit_tiny_face())
    player = view.ClipPlayer(clip, face, SMALL)
    try:
        player.plotter.show(auto_close=False, interactive=False)
        player.plotter.window_size = [160, 200]
        assert player.show_at(0.0)
        assert shown(player).shape == (200, 160, 3)
        assert player._renderer.picture.size == "160x200"
    finally:
        player.close()


@pytest.mark.usefixtures("off_screen")
def test_a_clip_plays_to_its_last_frame_and_turning_the_camera_draws_it_again():
    face = tiny_face()
    player = view.ClipPlayer(clip_of(face), face, Picture(size="128x128", background="transparent"))
    try:
        player.plotter.show(auto_close=False, interactive=False)
        seen = []
        for seconds in (0.0, 0.05, 0.099, 5.0):
            assert player.show_at(seconds) == (seconds < 1 and seconds > 0), seconds
            seen.append(shown(player))
        assert np.abs(seen[0] - seen[1]).max() > 20
        np.testing.assert_array_equal(seen[2], seen[3])
        player.plotter.camera.Azimuth(30)
        assert player.show_at(5.0)
        player.restart()
        assert not player.show_at(0.0)
    finally:
        player.close()


@pytest.mark.usefixtures("off_screen")
def test_a_live_window_shows_the_newest_motion():
    face = tiny_face()
    motions = [None, (np.array([1.0, 0, 0, 0], np.float32), np.zeros(6, np.float32)), None]
    live_window = view.LiveWindow(face, Picture(size="128x128"), lambda: motions.pop(0))
    try:
        live_window.plotter.show(auto_close=False, interactive=False)
        seen = []
        for moved in (False, True, False):
            assert live_window.tick() == moved
            seen.append(shown(live_window))
        assert np.abs(seen[0] - seen[1]).max() > 20
        np.testing.assert_array_equal(seen[1], seen[2])
    finally:
        live_window.close()
