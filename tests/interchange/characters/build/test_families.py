"""The shipped head under the names of other programs is the same face; small mouths pass, heads of no person speak."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lexicon.errors import DataError
from tests.interchange.characters.made import (
    Variant,
    head_without_mouth,
    split_glb,
    write_character_file,
    write_landmarks,
)
from tts2face import Session, export
from tts2face.face.landmarks import landmark_motion
from tts2face.interchange.characters.importing import import_face
from tts2face.interchange.exports.arkit import ARKIT_SHAPES, arkit_projection
from tts2face.models.face import Face

FAMILIES = {  # name of a shape -> that of the family
    "metahuman": {
        "jawOpen": "CTRL_expressions_jawOpen", "mouthSmileLeft": "CTRL_expressions_mouthCornerPullL",
        "mouthSmileRight": "CTRL_expressions_mouthCornerPullR", "mouthFunnel": "CTRL_expressions_mouthFunnelUL",
        "eyeBlinkLeft": "CTRL_expressions_eyeBlinkL", "eyeBlinkRight": "CTRL_expressions_eyeBlinkR",
    },
    "sranipal": {
        "jawOpen": "Jaw_Open", "mouthPucker": "Mouth_Pout", "mouthRollLower": "Mouth_Lower_Inside",
        "mouthFrownLeft": "Mouth_Sad_Left", "eyeBlinkLeft": "Eye_Left_Blink", "eyeBlinkRight": "Eye_Right_Blink",
    },
    "facs": {
        "jawOpen": "AU27", "mouthFunnel": "AU22", "browOuterUpLeft": "AU02_L", "eyeBlinkLeft": "AU45_L",
        "eyeBlinkRight": "AU45_R", "mouthStretchRight": "AU20R",
    },
}  # fmt: skip
VISEMES = {
    "vrchat": {
        "jawOpen": "vrc.v_aa",
        "mouthPucker": "vrc.v_ou",
        "mouthFunnel": "vrc.v_oh",
        "mouthPressLeft": "vrc.v_pp",
    },
    "azure": {"jawOpen": "2", "mouthPucker": "7", "mouthFunnel": "8", "mouthRollLower": "18", "mouthClose": "21"},
    "mmd": {
        "jawOpen": "あ",
        "mouthPucker": "う",
        "mouthFunnel": "お",
        "eyeBlinkLeft": "ウィンク２",
        "eyeBlinkRight": "ｳｨﾝｸ２右",
    },
}


def named(folder: Path, names: dict[str, str], size: float = 1.0) -> Path:
    """The head with shapes of these names alone, `size` times as large."""
    head = head_without_mouth()
    rows = [head.shape_names.index(name) for name in names]
    kept = replace(
        head, shape_names=tuple(names), shapes=np.float32(size) * head.shapes[rows], limits=head.limits[rows],
        scores=None, eyes=tuple(replace(eye, turns={}) for eye in head.eyes),
    )  # fmt: skip
    return write_character_file(folder / "named.glb", Variant(rename=lambda name: names[name]), face=kept)


def check_shape(face: Face, name: str, own: str) -> None:
    head = head_without_mouth()
    moved, true = (
        landmark_motion(shown, np.array([shown.shape_names.index(shape)]))[:468]
        for shown, shape in ((face, name), (head, own))
    )
    np.testing.assert_allclose(moved, true, atol=0.05)  # mm


@pytest.mark.parametrize("family", FAMILIES)
def test_a_head_under_names_of_a_family_is_the_same(family: str, tmp_path: Path) -> None:
    imported = import_face(named(tmp_path, FAMILIES[family]), landmarks=write_landmarks(tmp_path / "l.tsv"))
    assert {*FAMILIES[family]} <= {*imported.face.shape_names}
    for name in FAMILIES[family]:
        check_shape(imported.face, name, name)
    assert imported.face.opened_by == "jawOpen"
    assert not imported.report.unused


@pytest.mark.parametrize("family", VISEMES)
def test_a_head_of_visemes_is_opened_by_one_of_them(family: str, tmp_path: Path) -> None:
    imported = import_face(named(tmp_path, VISEMES[family]), landmarks=write_landmarks(tmp_path / "l.tsv"))
    face = imported.face
    assert face.opened_by == "mouthViseme_aa"
    assert face.n_lit_poses == 2
    for own, viseme in (("jawOpen", "aa"), ("mouthPucker", "ou"), ("mouthFunnel", "oh")):
        check_shape(face, f"mouthViseme_{viseme}", own)


@pytest.mark.parametrize(("size", "is_refused"), [(0.075, False), (0.04, True)])
def test_the_least_gap_of_the_lips_depends_on_the_mouth(size: float, is_refused: bool, tmp_path: Path) -> None:
    names = {"jawOpen": "jawOpen", "eyeBlinkLeft": "eyeBlinkLeft", "eyeBlinkRight": "eyeBlinkRight"}
    character, table = named(tmp_path, names, size), write_landmarks(tmp_path / "l.tsv")
    if not is_refused:  # 2.6 mm of a mouth 47 mm wide
        assert import_face(character, landmarks=table).face.opened_by == "jawOpen"
        return
    with pytest.raises(DataError, match=r"by more than 1\.\d mm, of a mouth \d\d mm wide"):
        import_face(character, landmarks=table)


@pytest.mark.usefixtures("face_model")
def test_a_head_of_no_person_has_no_landmarks_and_keeps_its_shapes(tmp_path: Path) -> None:
    head = head_without_mouth()
    squashed = head.vertices * np.array([1.0, 0.3, 2.5], np.float32)
    path = write_character_file(tmp_path / "animal.glb", Variant(), face=replace(head, vertices=squashed, scores=None))
    imported = import_face(path, front="+z")
    assert not imported.report.landmarks
    assert any("no face is recognised in its pictures" in note for note in imported.report.notes)
    assert {"jawOpen", "mouthSmileLeft", "eyeLookUpLeft"} <= {*imported.face.shape_names}
    assert len(imported.face.eyes) == 2


def test_a_combination_corrects_in_pictures_and_in_its_own_file(tmp_path: Path) -> None:
    """The head with a corrective of open jaw and pucker, which moves the chin by 5 mm."""
    head = head_without_mouth()
    names = ("jawOpen", "mouthPucker", "mouthFunnel", "eyeBlinkLeft", "eyeBlinkRight")
    rows = [head.shape_names.index(name) for name in names]
    moved = np.where(head.vertices[:, 1:2] < -60.0, np.float32([0.0, 0.0, 5.0]), np.float32(0.0))
    own = replace(
        head, shape_names=(*names, "jawOpen_mouthPucker"), shapes=np.concatenate([head.shapes[rows], moved[None]]),
        limits=np.tile(np.float32([0, 1]), (6, 1)), scores=None,
        eyes=tuple(replace(eye, turns={}) for eye in head.eyes),
    )  # fmt: skip
    path = write_character_file(tmp_path / "a.glb", Variant(), face=own)
    imported = import_face(path, landmarks=write_landmarks(tmp_path / "l.tsv"))
    combination = "combination*jawOpen*mouthPucker"
    assert combination in imported.face.shape_names
    assert "shapes that combine others get the products of their weights: jawOpen_mouthPucker" in imported.report.notes
    session = Session(face=imported.face)
    clip = session.clip("Who would use two old roads?")
    jaw, pucker, product = clip.motion.columns(["jawOpen", "mouthPucker", combination]).T
    assert product.max() > 0.05
    np.testing.assert_allclose(product, np.clip(jaw, 0, 1) * np.clip(pucker, 0, 1), atol=1e-6)
    export(clip, tmp_path / "b.glb", face=session.mesh)
    root, binary = split_glb((tmp_path / "b.glb").read_bytes())
    animation = root["animations"][0]
    sampler = next(
        animation["samplers"][channel["sampler"]]
        for channel in animation["channels"]
        if channel["target"]["path"] == "weights"
    )
    accessor = root["accessors"][sampler["output"]]
    at = root["bufferViews"][accessor["bufferView"]].get("byteOffset", 0)
    weights = np.frombuffer(binary, "<f4", accessor["count"], at).reshape(-1, 6)
    assert weights[: len(product), 5] == pytest.approx(product, abs=1e-4)
    arkit = arkit_projection(clip.motion.channels, session.mesh, "a.csv").weights(clip.motion.values)
    assert arkit[:, ARKIT_SHAPES.index("jawOpen")] == pytest.approx(np.clip(jaw, 0, 1), abs=1e-5)
