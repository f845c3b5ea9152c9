"""USD files: pxr itself skins the mesh; vertices are those of the renderer."""

import sys
from dataclasses import replace

import numpy as np
import pytest

import tts2face
from lexicon.errors import BackendError
from tests.interchange.exports.made import FACE, made_clip, signed_clip, turned_clip, with_gesture
from tests.packages import package
from tts2face.face.deformation import build_rig
from tts2face.interchange.exports.surfaces import divide_surface
from tts2face.interchange.exports.usd import _identifiers

pytestmark = pytest.mark.formats

TOLERANCE_MM = 1e-3  # weights and offsets are 32-bit, scales of joints 16-bit

Usd = package("pxr.Usd")


@pytest.mark.parametrize("suffix", [".usda", ".usdc", ".usd"])
def test_vertices_skinned_by_usd_are_those_of_the_renderer(suffix, tmp_path):
    from pxr import UsdSkel

    face = with_gesture()
    clip = signed_clip(4, face)
    tts2face.export(clip, tmp_path / f"a{suffix}", face=face)
    assert ((tmp_path / f"a{suffix}").read_bytes()[:5] == b"#usda") == (suffix == ".usda")
    stage = Usd.Stage.Open(str(tmp_path / f"a{suffix}"))
    assert UsdSkel.BakeSkinning(UsdSkel.Root.Get(stage, "/Face"))
    rig = build_rig(face)
    for frame in (0, 3):
        expected = rig.pose(clip.motion.values[frame], clip.head.values[frame])
        for number, surface in enumerate(divide_surface(face)):
            mesh = stage.GetPrimAtPath(f"/Face/{surface.part.name}_{number}")
            found = np.array(mesh.GetAttribute("points").Get(frame))
            assert np.allclose(found, expected[surface.vertices], rtol=0, atol=TOLERANCE_MM)


def test_units_times_and_names(tmp_path):
    from pxr import UsdGeom, UsdSkel

    person = replace(FACE, metadata={"name": "Ada", "consent": "I agree"})
    tts2face.export(turned_clip(5, 24.0, yaw=np.radians(10.0)), tmp_path / "a.usda", face=person)
    stage = Usd.Stage.Open(str(tmp_path / "a.usda"))
    assert UsdGeom.GetStageMetersPerUnit(stage) == 0.001
    assert UsdGeom.GetStageUpAxis(stage) == "Y"
    assert (stage.GetTimeCodesPerSecond(), stage.GetStartTimeCode(), stage.GetEndTimeCode()) == (24, 0, 4)
    animation = UsdSkel.Animation(stage.GetPrimAtPath("/Face/Skeleton/Animation"))
    assert list(animation.GetBlendShapesAttr().Get()) == list(FACE.shape_names)
    turn = animation.GetRotationsAttr().Get(2)[0]
    assert turn.GetReal() == pytest.approx(np.cos(np.radians(5)), abs=1e-6)
    assert tuple(turn.GetImaginary()) == pytest.approx((0, np.sin(np.radians(5)), 0), abs=1e-6)
    assert "motion of Ada" in stage.GetRootLayer().customLayerData["notice"]
    assert (tmp_path / "a.wav").is_file()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.usda", "a.wav"]


def test_names_that_usd_does_not_allow_are_changed():
    assert _identifiers(("jawOpen", "mouth smile", "1st", "Ä")) == ["jawOpen", "mouth_smile", "_1st", "_"]
    assert _identifiers(("a b", "a-b")) == ["a_b_0", "a_b_1"]


def test_without_usd_core_the_extra_is_named(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "pxr.Gf", None)
    with pytest.raises(BackendError, match=r"pip install 'tts2face\[usd\]'"):
        tts2face.export(made_clip(), tmp_path / "a.usdc", face=FACE)
    assert not list(tmp_path.iterdir())
