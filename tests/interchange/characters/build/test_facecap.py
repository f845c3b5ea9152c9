"""The head that the package openfacefx carries: meshopt, KTX2, 52 shapes with other names, eyeballs without bones."""

import json
from pathlib import Path

import numpy as np
import pytest

from tests.interchange.characters.build.test_animation import Played
from tests.interchange.exports import programs
from tests.packages import package
from tts2face.face.landmarks import landmark_motion, landmark_positions, scatter_landmarks
from tts2face.interchange.characters.animation import write_character
from tts2face.interchange.characters.gltf_reader import read_gltf_character
from tts2face.interchange.characters.importing import ImportedFace, import_face
from tts2face.interchange.characters.shape_names import ARKIT_SHAPES, guess_mapping
from tts2face.session.session import Session


@pytest.fixture(scope="module")
def path() -> Path:
    return Path(package("openfacefx").__file__).parent / "studio_web/assets/facecap.glb"


@pytest.fixture(scope="module")
def imported(path: Path, face_model: Path) -> ImportedFace:
    return import_face(path)


def test_meshes_and_names_are_read(path: Path) -> None:
    character = read_gltf_character(path)
    assert [len(piece.vertices) for piece in character.pieces] == [530, 530, 2694, 614]
    assert len(guess_mapping(character.target_names.values())) == 52
    assert "KTX2" in character.notes[0]
    head = character.pieces[2]
    size = np.ptp(head.vertices, axis=0)
    edges = head.vertices[head.triangles[:, 0]] - head.vertices[head.triangles[:, 1]]
    assert np.linalg.norm(edges, axis=1).max() < 0.3 * size.max()  # wrongly decoded triangles cross the whole head


def test_its_landmarks_lie_on_lips_and_lids(imported: ImportedFace) -> None:
    face = imported.face
    assert set(ARKIT_SHAPES) - set(face.shape_names) <= {"tongueOut"}
    assert len(face.eyes) == 2
    places = scatter_landmarks(face, landmark_positions(face))
    assert 4.0 < np.linalg.norm(places[13] - places[0]) < 25.0  # mm; the height of the upper lip
    assert abs(places[13, 1] - places[14, 1]) < 4.0  # the lips are closed
    opened, closed = (
        scatter_landmarks(face, landmark_motion(face, np.array([face.shape_names.index(name)])))[:, :, 0]
        for name in ("jawOpen", "eyeBlinkLeft")
    )
    assert opened[13, 1] - opened[14, 1] > 15.0  # mm
    lid = places[386, 1] - places[374, 1]  # height of the left eye's opening
    assert closed[374, 1] - closed[386, 1] == pytest.approx(lid, rel=0.5)
    assert np.abs(closed[[159, 145]]).max() < 1.0  # the right eye stays open


def test_it_speaks_in_its_own_file(imported: ImportedFace, tmp_path: Path) -> None:
    session = Session(face=imported.face)
    clip = session.clip("Bob may move five maps.", fps=15)
    written = write_character(clip, session.mesh, tmp_path / "spoken.glb")
    assert written.n_targets > 20
    played = Played(written.path)
    names = played.root["meshes"][2]["extras"]["targetNames"]
    tracks = [
        # the last key holds the last frame until the sound ends
        played.rows(played.animation.samplers[channel.sampler].output).reshape(len(clip.motion) + 1, -1)[:-1]
        for channel in played.animation.channels
        if channel.target.path == "weights"
    ]
    jaw = next(track for track in tracks if track.shape[1] == len(names))[:, names.index("jawOpen")]
    own = clip.motion.values[:, clip.motion.channels.index("jawOpen")]
    assert np.ptp(own) > 0.1
    assert played.root["meshes"][2]["weights"][names.index("jawOpen")] > 0.1  # a pose that the file was saved in
    np.testing.assert_allclose(jaw, own, atol=1e-5)
    packages = programs.node_package("gltf-validator")
    report = json.loads(programs.run_node(programs.VALIDATE, packages, str(written.path)))
    assert [message["code"] for message in report["issues"]["messages"] if message["severity"] == 0] == []
