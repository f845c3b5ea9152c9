"""USD files: pxr itself skins the mesh; vertices are those of the renderer."""

import io
import sys
import zipfile
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

import tts2face
from lexicon.errors import BackendError, InputError
from tests.interchange.exports.made import FACE, made_clip, signed_clip, turned_clip, with_gesture
from tests.packages import package
from tts2face.face.deformation import build_rig
from tts2face.interchange.exports.surfaces import divide_surface, linear_colours
from tts2face.interchange.exports.usd import _identifiers
from tts2face.models.face import Texture
from tts2face.numeric.arrays import decode_srgb

pytestmark = pytest.mark.formats

TOLERANCE_MM = 1e-3  # weights and offsets are 32-bit, scales of joints 16-bit

Usd, Ar = package("pxr.Usd"), package("pxr.Ar")


@pytest.mark.parametrize("suffix", [".usda", ".usdc", ".usd", ".usdz"])
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


def test_a_package_is_dated_by_no_clock(tmp_path):
    tts2face.export(made_clip(2), tmp_path / "a.usdz", face=FACE)
    with zipfile.ZipFile(tmp_path / "a.usdz") as package_file:
        assert {one.date_time for one in package_file.infolist()} == {(1980, 1, 1, 0, 0, 0)}


def test_units_times_and_names(tmp_path):
    from pxr import UsdGeom, UsdSkel

    person = replace(FACE, metadata={"name": "Ada", "consent": "I agree"})
    tts2face.export(turned_clip(5, 24.0, yaw=np.radians(10.0)), tmp_path / "a.usda", face=person)
    stage = Usd.Stage.Open(str(tmp_path / "a.usda"))
    assert UsdGeom.GetStageMetersPerUnit(stage) == 0.001
    assert UsdGeom.GetStageUpAxis(stage) == "Y"
    assert (stage.GetTimeCodesPerSecond(), stage.GetStartTimeCode()) == (24, 0)
    animation = UsdSkel.Animation(stage.GetPrimAtPath("/Face/Skeleton/Animation"))
    assert list(animation.GetBlendShapesAttr().Get()) == list(FACE.shape_names)
    turn = animation.GetRotationsAttr().Get(2)[0]
    assert turn.GetReal() == pytest.approx(np.cos(np.radians(5)), abs=1e-6)
    assert tuple(turn.GetImaginary()) == pytest.approx((0, np.sin(np.radians(5)), 0), abs=1e-6)
    assert "motion of Ada" in stage.GetRootLayer().customLayerData["notice"]
    assert (tmp_path / "a.wav").is_file()
    beside = {"a.usda", "a.usda.colours.png", "a.usda.skin_0.jpg", "a.wav"}
    assert {path.name for path in tmp_path.iterdir()} == beside


@pytest.mark.parametrize("fps", [24.0, 30.0, 59.94])
def test_the_last_frame_holds_to_the_end_of_the_sound(fps, tmp_path):
    from pxr import UsdSkel

    clip = made_clip(5, fps)
    tts2face.export(clip, tmp_path / "a.usda", face=FACE)
    stage = Usd.Stage.Open(str(tmp_path / "a.usda"))
    end_s = stage.GetEndTimeCode() / stage.GetTimeCodesPerSecond()
    assert end_s == pytest.approx(clip.speech.waveform.duration, abs=1e-5)
    assert stage.GetEndTimeCode() > 4.9
    weights = UsdSkel.Animation(stage.GetPrimAtPath("/Face/Skeleton/Animation")).GetBlendShapeWeightsAttr()
    assert weights.GetTimeSamples()[:5] == [0, 1, 2, 3, 4]
    assert np.array_equal(weights.Get(stage.GetEndTimeCode()), weights.Get(4))


def _shown_colours(stage, path):
    """Linear colours (n, 3) of the vertices of a mesh, from the texture of its material as the stage resolves it."""
    from pxr import UsdGeom, UsdShade

    mesh = stage.GetPrimAtPath(path)
    surface = UsdShade.MaterialBindingAPI(mesh).ComputeBoundMaterial()[0].ComputeSurfaceSource()[0]
    assert surface.GetIdAttr().Get() == "UsdPreviewSurface"
    texture = UsdShade.Shader(surface.GetInput("diffuseColor").GetConnectedSource()[0])
    file = texture.GetInput("file").Get()
    packed = Ar.GetResolver().OpenAsset(Ar.ResolvedPath(file.resolvedPath))
    pixels = np.array(Image.open(io.BytesIO(packed.GetBuffer())).convert("RGB"))
    side = np.array(pixels.shape[1::-1])
    places = np.array(UsdGeom.PrimvarsAPI(mesh).GetPrimvar("st").Get()) * [1, -1] + [0, 1]
    column, row = np.clip(np.floor(places * side).astype(int), 0, side - 1).T
    return decode_srgb(pixels[row, column] / 255)


@pytest.mark.parametrize("suffix", [".usda", ".usdc", ".usdz"])
def test_materials_show_textures_and_the_colours_of_vertices(suffix, tmp_path):
    colours = FACE.colours.copy()
    colours[:, 0] = np.arange(len(colours)) % 200
    colours[:, 2] = 255 - colours[:, 0] // 2
    face = replace(FACE, colours=colours)
    files = tts2face.export(made_clip(2), tmp_path / f"a{suffix}", face=face)
    assert set(files) == set(tmp_path.iterdir())
    assert len(files) == (2 if suffix == ".usdz" else 4)
    stage = Usd.Stage.Open(str(tmp_path / f"a{suffix}"))
    for number, surface in enumerate(divide_surface(face)):
        shown = _shown_colours(stage, f"/Face/{surface.part.name}_{number}")
        expected, most = linear_colours(face)[surface.vertices], 0.1  # the texel in place of a mix of four
        if surface.part.is_textured:
            pixels = face.textures[surface.part.texture].pixels
            side = np.array(pixels.shape[1::-1])
            column, row = np.clip((face.uv[surface.vertices] * side).astype(int), 0, side - 1).T
            expected, most = decode_srgb(pixels[row, column] / 255), 0.15  # JPEG at edges of the pattern
        assert np.abs(shown - expected).max() < most


def test_parts_cut_out_by_their_texture_are_so_in_usd(tmp_path):
    from pxr import UsdShade

    alpha = np.zeros(FACE.textures[0].pixels.shape[:2], np.uint8)
    parts = (replace(FACE.parts[0], cutout=True), *FACE.parts[1:])
    face = replace(FACE, parts=parts, textures=(Texture(FACE.textures[0].pixels, alpha), *FACE.textures[1:]))
    tts2face.export(made_clip(2), tmp_path / "a.usda", face=face)
    stage = Usd.Stage.Open(str(tmp_path / "a.usda"))
    surface = UsdShade.Shader(stage.GetPrimAtPath("/Face/Materials/skin_0/Surface"))
    source, output, _ = surface.GetInput("opacity").GetConnectedSource()
    assert (source.GetPrim().GetName(), output) == ("Texture", "a")
    assert surface.GetInput("opacityThreshold").Get() == 0.5
    with Image.open(tmp_path / "a.usda.skin_0.png") as picture:
        assert picture.mode == "RGBA"


def test_tinyusdz_reads_a_face_whose_parts_have_no_shapes(tmp_path):
    tinyusdz = package("tinyusdz")
    still = FACE.shapes.copy()
    still[:, divide_surface(FACE)[-1].vertices] = 0
    tts2face.export(made_clip(2), tmp_path / "a.usda", face=replace(FACE, shapes=still))
    assert "blendShapes = []" not in (tmp_path / "a.usda").read_text()
    scene = tinyusdz.tydra.convert_to_render_scene(tinyusdz.load(str(tmp_path / "a.usda")))
    assert len(scene.meshes()) == len(scene.materials()) == len(divide_surface(FACE))


def test_names_that_usd_does_not_allow_are_changed():
    assert _identifiers(("jawOpen", "mouth smile", "1st", "Ä")) == ["jawOpen", "mouth_smile", "_1st", "_"]
    assert _identifiers(("a b", "a-b")) == ["a_b_0", "a_b_1"]


def test_without_usd_core_the_extra_is_named(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "pxr.Gf", None)
    with pytest.raises(BackendError, match=r"pip install 'tts2face\[usd\]'"):
        tts2face.export(made_clip(), tmp_path / "a.usdc", face=FACE)
    assert not list(tmp_path.iterdir())


def test_nothing_is_left_of_an_export_that_fails(tmp_path):
    (tmp_path / "a.usda.skin_0.jpg").write_text("of an earlier clip")
    pieces = [made_clip(2), made_clip(2, channels=("other",))]
    with pytest.raises(InputError):
        tts2face.export(pieces, tmp_path / "a.usda", face=FACE)
    assert [path.name for path in tmp_path.iterdir()] == ["a.usda.skin_0.jpg"]
    assert (tmp_path / "a.usda.skin_0.jpg").read_text() == "of an earlier clip"
