"""Agreement of both renderers, and the error on a machine without GL."""

from dataclasses import replace
from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest

from lexicon.errors import BackendError
from lexicon.sequence import SILENCE, PhoneSequence
from tests.face.people import load_plain
from tests.packages import needs
from tests.picture.test_cutouts import face_with_sheet, without_sheet
from tests.picture.test_view import ONE_PROCESS
from tests.picture.tiny_face import tiny_face
from tts2face.picture import vtk_renderer as vtk
from tts2face.picture.options import NUMBA, PYVISTA, Picture
from tts2face.picture.renderer import mesh_renderer
from tts2face.processes.program import Program
from tts2face.types import HEAD_CHANNELS, Clip, Speech, Trajectory, Waveform

pytestmark = [pytest.mark.usefixtures("few_directions"), ONE_PROCESS]
BOUND = 2.0  # of 255: mean difference between the renderers' pictures; VTK interpolates highlights of vertices
TURNED = np.array([0.05, 0.2, 0.0, 3.0, 0.0, 0.0])


@pytest.fixture(scope="module")
def gl():
    needs("pyvista")
    if not vtk.can_draw_with(vtk.OFF_SCREEN):
        pytest.skip("needs a GPU or software GL, and VTK finds neither on this machine")


@pytest.fixture
def _fresh_probe():
    vtk.can_draw_with.cache_clear()
    yield
    vtk.can_draw_with.cache_clear()


def both(face, weights, head=TURNED * 0, **options):
    renderers = [mesh_renderer(face, Picture(renderer=name, **options)) for name in (NUMBA, PYVISTA)]
    return [renderer.draw(weights, head).astype(int) for renderer in renderers]


@cache
def shipped_renderers(name, camera):
    """Of a shipped head without strands and baked light, which VTK does not draw (decision 026)."""
    face = replace(load_plain(name), light=())
    return [mesh_renderer(face, Picture(renderer=kind, size="256x256", camera=camera)) for kind in (NUMBA, PYVISTA)]


@pytest.mark.usefixtures("gl")
@pytest.mark.parametrize("name", ["head", "ada"])
@pytest.mark.parametrize(("jaw", "camera"), [(0.0, "front"), (0.6, "front"), (0.6, "three-quarter")])
def test_both_renderers_agree_on_the_shipped_heads(name, jaw, camera):
    renderers, shapes = shipped_renderers(name, camera), load_plain(name).shape_names
    weights = np.zeros(len(shapes))
    weights[shapes.index("jawOpen")] = jaw
    ours, theirs = (renderer.draw(weights, TURNED).astype(int) for renderer in renderers)
    assert np.abs(ours - theirs).mean() <= BOUND
    on_head = np.abs(ours - ours[0, 0]).max(axis=2) > 40
    assert np.abs(ours - theirs)[on_head].mean() <= 4 * BOUND
    assert np.abs((ours - theirs)[on_head].mean(axis=0)).max() <= 2.5 * BOUND  # brightness and hue, with highlights


@pytest.mark.usefixtures("gl")
@pytest.mark.parametrize("supersampling", [1, 2, 3])
def test_a_transparent_picture_has_the_same_coverage(supersampling):
    face = tiny_face(n_rings=40)
    ours, theirs = both(face, [0, 0, 0, 0], size="128x96", background="transparent", supersampling=supersampling)
    assert ours.shape == theirs.shape == (96, 128, 4)
    differing = np.abs(ours[..., 3] - theirs[..., 3]) > 255 / supersampling**2 + 1
    assert differing.mean() < 0.002
    solid = (ours[..., 3] == 255) & (theirs[..., 3] == 255)
    assert 0.2 < solid.mean() < 0.9
    assert np.abs(ours - theirs)[solid].mean() < 4 * BOUND


@pytest.mark.usefixtures("gl")
def test_textures_have_the_same_orientation():
    # Light changes hard between vertices where the chequers do, so that colours agree less than on a face.
    ours, theirs = both(tiny_face(textured=True, n_rings=40), [0, 0, 0, 0], TURNED, size="128x128")
    alike = np.corrcoef(ours.ravel(), theirs.ravel())[0, 1]
    upside_down = np.corrcoef(ours.ravel(), theirs[::-1].ravel())[0, 1]
    assert alike > 0.9
    assert upside_down < 0.5


@pytest.mark.usefixtures("gl")
def test_holes_have_the_same_place():
    alpha = np.where(np.indices((64, 64)).sum(axis=0) % 32 < 16, 255, 0).astype(np.uint8)
    ours, theirs = both(face_with_sheet(alpha), [0, 0, 0, 0], size="256x256", background="transparent")
    solid, _ = both(face_with_sheet(None), [0, 0, 0, 0], size="256x256", background="transparent")
    bare = mesh_renderer(without_sheet(face_with_sheet(None)), Picture(size="256x256", background="transparent"))
    on_sheet = np.abs(solid - bare.draw([0, 0, 0, 0]).astype(int)).max(axis=2) > 60
    assert on_sheet.sum() > 200
    both_drawn = on_sheet & (np.abs(ours - solid).max(axis=2) < 30) & (np.abs(theirs - solid).max(axis=2) < 60)
    both_left = on_sheet & (np.abs(ours - solid).max(axis=2) > 60) & (np.abs(theirs - solid).max(axis=2) > 60)
    assert both_drawn.sum() > 0.25 * on_sheet.sum()
    assert both_left.sum() > 0.25 * on_sheet.sum()
    assert (both_drawn | both_left).sum() > 0.75 * on_sheet.sum()


@pytest.mark.usefixtures("gl")
def test_a_clip_is_drawn_frame_by_frame_in_one_window():
    face = tiny_face()
    motion = np.linspace(0, 1, 3)[:, None] * [1, 0, 0, 0]
    speech = Speech(Waveform(np.zeros(2400), 24_000), PhoneSequence((SILENCE,), np.array([0.0, 0.1])), ())
    clip = Clip(Trajectory(face.shape_names, motion, 30), Trajectory(HEAD_CHANNELS, np.zeros((3, 6)), 30), speech)
    renderer = mesh_renderer(face, Picture(size="64x64", renderer=PYVISTA))
    drawn = list(renderer.frames(clip))
    assert len(drawn) == 3
    for weights, picture in zip(motion, drawn, strict=True):
        np.testing.assert_array_equal(picture, renderer.draw(weights))
    assert (drawn[0] != drawn[2]).any()


def test_without_pyvista_the_error_names_what_to_install(monkeypatch):
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    with pytest.raises(BackendError, match=r"--renderer pyvista needs pyvista.*pip install 'tts2face\[view\]'"):
        mesh_renderer(tiny_face(), Picture(renderer=PYVISTA))


def test_without_gl_the_error_names_what_to_install(monkeypatch):
    monkeypatch.setattr(vtk, "require_pyvista", lambda purpose: None)
    monkeypatch.setattr(vtk, "can_draw_with", lambda window: False)
    with pytest.raises(BackendError, match=r"neither a GPU nor software GL.*--renderer numba"):
        mesh_renderer(tiny_face(), Picture(renderer=PYVISTA))


@pytest.mark.usefixtures("_fresh_probe")
@pytest.mark.parametrize("probe", ["CRASHES", "FAILS", "HANGS"])
def test_a_child_that_crashes_fails_or_hangs_means_no_gl(monkeypatch, probe):
    monkeypatch.setattr(vtk, "PROBE_PROGRAM", Program(f"tests.picture.vtk_probes:{probe}"))
    monkeypatch.setattr(vtk, "PROBE_TIMEOUT_S", 1.0 if probe == "HANGS" else 30.0)
    assert not vtk.can_draw_with(vtk.OFF_SCREEN)


@pytest.mark.usefixtures("_fresh_probe")
def test_the_probe_runs_once_and_with_the_window_class(monkeypatch):
    monkeypatch.setattr(vtk, "PROBE_PROGRAM", Program("tests.picture.vtk_probes:SEES"))
    assert not vtk.can_draw_with(vtk.ON_SCREEN)
    assert vtk.can_draw_with(vtk.OFF_SCREEN)
    monkeypatch.setattr(vtk, "PROBE_PROGRAM", None)
    assert vtk.can_draw_with(vtk.OFF_SCREEN)


def test_the_environment_is_restored(monkeypatch):
    monkeypatch.setattr(vtk, "sys", SimpleNamespace(platform="linux"))
    monkeypatch.setenv("VTK_DEFAULT_OPENGL_WINDOW", "mine")
    with vtk.use_window_class(vtk.OFF_SCREEN):
        assert vtk.os.environ["VTK_DEFAULT_OPENGL_WINDOW"] == "vtkEGLRenderWindow"
    assert vtk.os.environ["VTK_DEFAULT_OPENGL_WINDOW"] == "mine"
