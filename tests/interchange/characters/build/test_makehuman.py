"""A real full body with real rigs: MakeHuman's, as skinned .glb files and as .obj files."""

from pathlib import Path

import numpy as np
import pytest

from tests.interchange.characters.build.test_animation import Played, made_clip
from tests.interchange.characters.makehuman import makehuman, write_obj_folder, write_rigged
from tts2face.face.landmarks import landmark_motion, landmark_positions, scatter_landmarks
from tts2face.face.shape_transfer import eye_distance
from tts2face.interchange.characters.animation import write_character
from tts2face.interchange.characters.importing import ImportedFace, import_face
from tts2face.interchange.characters.landmark_table import landmark_table
from tts2face.interchange.characters.shape_names import ARKIT_SHAPES
from tts2face.models.face import Face

BONES = {
    "default": {"neck": "neck01", "head": "head"},
    "mixamo": {"neck": "mixamorig:Neck", "head": "mixamorig:Head"},
    "game_engine": {"neck": "neck_01", "head": "head"},
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("makehuman")


@pytest.fixture(scope="module")
def tracked(folder: Path, face_model: Path) -> ImportedFace:
    """The body with the default rig, its landmarks found by tracking, and their table in the folder."""
    source = makehuman()
    imported = import_face(write_rigged(folder / "default.glb", source, "default"))
    (folder / "landmarks.tsv").write_text(landmark_table(imported.report.landmarks))
    return imported


def opening(face: Face, shape: str, upper: int, lower: int) -> float:
    """Distance in mm by which a shape moves two landmarks apart vertically."""
    motion = scatter_landmarks(face, landmark_motion(face, np.array([face.shape_names.index(shape)])))[:, 1, 0]
    return float(motion[upper] - motion[lower])


def check_head(imported: ImportedFace) -> None:
    """A head of natural size with all shapes, cut straight below the neck, whose lips and lids move."""
    face = imported.face
    assert set(face.shape_names) == set(ARKIT_SHAPES)
    assert imported.report.score is None or imported.report.score > 0.9
    places = scatter_landmarks(face, landmark_positions(face))
    assert np.linalg.norm(places[33] - places[263]) == pytest.approx(90.0, abs=15.0)  # mm; outer corners of the eyes
    assert abs(places[13, 1] - places[14, 1]) < 4.0  # the lips are closed
    assert opening(face, "jawOpen", 13, 14) > 15.0
    assert opening(face, "eyeBlinkLeft", 386, 374) < -5.0
    bottom = face.vertices[:, 1].min()
    assert -300.0 < bottom < -120.0  # the body of 1.7 m is cut off
    assert (face.vertices[:, 1] < bottom + 0.01).sum() > 30  # vertices along a straight cut


def test_the_body_is_tracked_and_cut(tracked: ImportedFace) -> None:
    check_head(tracked)


@pytest.mark.parametrize("rig", BONES)
def test_neck_and_head_bones_of_real_rigs_turn(rig: str, tracked: ImportedFace, folder: Path) -> None:
    character = folder / f"{rig}.glb"
    if not character.exists():
        write_rigged(character, makehuman(), rig)
    imported = tracked if rig == "default" else import_face(character, landmarks=folder / "landmarks.tsv")
    check_head(imported)
    clip = made_clip(imported.face, {"jawOpen": 0.6, "eyeLookOutLeft": 0.5}, head=(0.0, 0.5, 0.0, 0.0, 0.0, 0.0))
    written = write_character(clip, imported.face, folder / f"{rig}_out.glb")
    assert set(written.bones) == {"neck", "head"}  # gaze shapes of this body turn its eyes
    played = Played(written.path)
    angles = {}
    for bone, name in BONES[rig].items():
        x, y, z, w = played.track("rotation", name)[-1].astype(float)
        assert abs(x) + abs(z) < 1e-5
        angles[bone] = 2 * np.arctan2(y, w)
    assert angles["neck"] == pytest.approx(0.2, abs=1e-5)
    assert angles["head"] == pytest.approx(0.3, abs=1e-5)
    names = played.root["meshes"][0]["extras"]["targetNames"]
    last = played.track("weights", "Body")[-len(names) :, 0]
    moved = {name: float(weight) for name, weight in zip(names, last, strict=True) if weight}
    assert moved == {"jawOpen": pytest.approx(0.6, abs=1e-6), "eyeLookOutLeft": pytest.approx(0.5, abs=1e-6)}


def test_the_same_body_as_obj_files(tracked: ImportedFace, folder: Path) -> None:
    objects = write_obj_folder(folder / "objects", makehuman())
    units = 10.0 * np.stack([place for _, place in sorted(tracked.report.landmarks.items())])  # of the .obj files
    table = landmark_table(dict(zip(sorted(tracked.report.landmarks), units, strict=True)))
    (folder / "units.tsv").write_text(table)
    imported = import_face(objects, landmarks=folder / "units.tsv")
    check_head(imported)
    # Files in metres keep their size, others are scaled to the default head.
    moved = [opening(face, "jawOpen", 13, 14) / eye_distance(face) for face in (imported.face, tracked.face)]
    assert moved[0] == pytest.approx(moved[1], rel=1e-3)
