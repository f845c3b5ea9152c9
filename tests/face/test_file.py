"""``.face`` files: round trip and validation."""

import pickle
from dataclasses import replace
from pathlib import Path
from unittest.mock import Mock

import numpy as np
import pytest
from safetensors.numpy import load_file

from lexicon.errors import DataError, InputError
from tests.face.posing import posed_vertices
from tts2face.models import face_file, face_loading
from tts2face.models.face import VERTEX_COLOURS, Eye, Face, FacePart, Texture
from tts2face.models.face_file import Identity, read_face, write_face
from tts2face.models.face_loading import load_face
from tts2face.processes.shared import Shared
from tts2face.session.catalogue import IdentityEntry, identities
from tts2face.storage.shipped import find_file
from tts2face.storage.tensors import read_tensors, write_tensors

N = 40
TINT = (0.5, 0.75, 1.0)


def small_face(with_texture: bool = True) -> Face:
    """Two parts, one sparse shape and one gaze shape, an eyeball of the last ten vertices."""
    rng = np.random.default_rng(4)
    shapes = np.zeros((2, N, 3), np.float32)
    shapes[0, :12] = rng.uniform(-30, 30, (12, 3))
    grey = np.full((16, 16, 3), 120, np.uint8)
    return Face(
        vertices=rng.uniform(-90, 90, (N, 3)).astype(np.float32),
        triangles=rng.integers(0, N, (20, 3)).astype(np.int32),
        parts=(
            FacePart("skin", 0, 12, specular=0.2, texture=0 if with_texture else VERTEX_COLOURS),
            FacePart("iris", 12, 8, opacity=0.5),
        ),
        shape_names=("jawOpen", "eyeLookUpLeft"),
        shapes=shapes,
        limits=np.array([[0, 1], [-0.5, 1.5]], np.float32),
        eyes=(Eye(30, 10, np.array([30, 0, 5], np.float32), {"eyeLookUpLeft": np.array([-0.4, 0, 0], np.float32)}),),
        colours=rng.integers(0, 255, (N, 3)).astype(np.uint8),
        uv=rng.uniform(0, 1, (N, 2)).astype(np.float32) if with_texture else None,
        textures=(Texture(grey),) if with_texture else (),
        landmarks=np.array([13, 14], np.int32),
        landmark_vertices=np.array([[0, 1, 2], [3, 4, 5]], np.int32),
        landmark_weights=np.array([[0.2, 0.3, 0.5], [1, 0, 0]], np.float32),
        pivot=np.array([0, -60, -70], np.float32),
        metadata={"name": "small", "licence": "CC0-1.0"},
    )


@pytest.fixture
def written(tmp_path: Path) -> tuple[Face, Path]:
    face, path = small_face(), tmp_path / "small.face"
    older = Identity(np.full((N, 3), 2.5, np.float32), {"skin": TINT}, "somebody else")
    write_face(path, face, {"older": older})
    return face, path


def test_a_face_round_trips(written: tuple[Face, Path]) -> None:
    face, path = written
    read = read_face(path)
    for name in (
        "vertices",
        "triangles",
        "limits",
        "colours",
        "landmarks",
        "landmark_vertices",
        "landmark_weights",
        "pivot",
    ):
        assert np.array_equal(getattr(read, name), getattr(face, name)), name
    assert (read.parts, read.shape_names, dict(read.metadata)) == (face.parts, face.shape_names, dict(face.metadata))
    assert np.abs(read.shapes - face.shapes).max() < 0.005  # mm: finer than a tenth of a pixel
    assert np.abs(read.uv - face.uv).max() < 1e-5
    assert np.abs(read.textures[0].pixels.astype(int) - face.textures[0].pixels).max() <= 2
    assert np.array_equal(read.eyes[0].centre, face.eyes[0].centre)
    assert np.array_equal(read.eyes[0].turns["eyeLookUpLeft"], face.eyes[0].turns["eyeLookUpLeft"])
    weights = np.array([0.7, 1.0])
    assert posed_vertices(read, weights) == pytest.approx(posed_vertices(face, weights), abs=0.005)


def test_an_earlier_face_whose_arrays_are_not_packed_is_the_same(written: tuple[Face, Path], tmp_path: Path) -> None:
    arrays, header = read_tensors(written[1], "face", 1)
    write_tensors(tmp_path / "earlier.face", "face", 1, arrays, header)
    assert set(arrays) <= set(load_file(tmp_path / "earlier.face"))
    for identity in (None, "older"):
        packed, earlier = (read_face(path, identity) for path in (written[1], tmp_path / "earlier.face"))
        for name in ("vertices", "triangles", "shapes", "colours", "uv", "landmark_weights"):
            assert np.array_equal(getattr(packed, name), getattr(earlier, name)), name
        assert packed.metadata == earlier.metadata
    assert identities(str(tmp_path / "earlier.face"))[0].name == "older"


def test_textures_of_a_shipped_face_are_decoded_when_one_is_read(monkeypatch: pytest.MonkeyPatch) -> None:
    decoded = Mock(side_effect=face_file.decode_colours)
    monkeypatch.setattr(face_file, "decode_colours", decoded)
    monkeypatch.setattr(face_loading, "_FACES", Shared())  # no other test has read it
    face = load_face("head", "mei")
    assert (len(face.textures) > 1, decoded.call_count) == (True, 0)
    shapes = [texture.pixels.shape for texture in face.textures]
    assert decoded.call_count == len(shapes) - 1  # the hair's is painted
    assert [texture.pixels.shape for texture in pickle.loads(pickle.dumps(face.textures))] == shapes
    assert decoded.call_count == len(shapes) - 1


def test_a_face_without_texture_round_trips(tmp_path: Path) -> None:
    write_face(tmp_path / "plain.face", small_face(with_texture=False))
    read = read_face(tmp_path / "plain.face")
    assert read.uv is None
    assert not read.textures


def test_a_face_with_holes_round_trips(tmp_path: Path) -> None:
    face, holes = small_face(), np.arange(256, dtype=np.uint8).reshape(16, 16)
    face = replace(
        face,
        textures=(replace(face.textures[0], alpha=holes),),
        parts=(replace(face.parts[0], cutout=True), face.parts[1]),
    )
    write_face(tmp_path / "holes.face", face)
    read = read_face(tmp_path / "holes.face")
    assert np.array_equal(read.textures[0].alpha, holes)
    assert read.parts == face.parts
    with pytest.raises(DataError, match="differ in size"):
        replace(face.textures[0], alpha=holes[:8])


def test_holes_without_alpha_are_refused(tmp_path: Path) -> None:
    face = small_face()
    write_face(tmp_path / "holes.face", replace(face, parts=(replace(face.parts[0], cutout=True), face.parts[1])))
    with pytest.raises(DataError, match="has a part with cutout, but no alpha"):
        read_face(tmp_path / "holes.face")


def test_an_identity_moves_vertices_and_eyes_and_tints_its_part(written: tuple[Face, Path]) -> None:
    face, path = written
    read = read_face(path, "older")
    assert read.vertices == pytest.approx(face.vertices + 2.5, abs=0.002)  # mm
    assert read.eyes[0].centre == pytest.approx(face.eyes[0].centre + 2.5, abs=0.001)
    only_skin = np.setdiff1d(face.triangles[:12], face.triangles[12:])
    assert read.colours[only_skin] == pytest.approx(face.colours[only_skin] * np.array(TINT), abs=1)
    assert read.metadata["identity"] == "older"
    assert identities(str(path)) == (IdentityEntry("older", str(path), "somebody else"),)


def test_the_same_face_gives_the_same_bytes(written: tuple[Face, Path], tmp_path: Path) -> None:
    face, _ = written
    write_face(tmp_path / "one.face", face)
    write_face(tmp_path / "two.face", face)
    assert (tmp_path / "one.face").read_bytes() == (tmp_path / "two.face").read_bytes()


def test_an_unknown_identity_is_refused_with_the_known_ones(written: tuple[Face, Path]) -> None:
    with pytest.raises(InputError, match="no identity 'younger'; it has: older"):
        read_face(written[1], "younger")


def test_an_unknown_name_is_refused() -> None:
    with pytest.raises(InputError, match="there is no face 'nobody'"):
        find_file("nobody", "face")


def test_a_missing_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="there is no face file"):
        load_face(str(tmp_path / "gone.face"))


@pytest.mark.parametrize("share", [0.0, 0.02, 0.5, 0.999])
def test_a_truncated_file_is_refused(written: tuple[Face, Path], share: float) -> None:
    path = written[1]
    content = path.read_bytes()
    path.write_bytes(content[: int(share * len(content))])
    with pytest.raises(DataError, match="damaged"):
        read_face(path)


def test_another_version_is_refused(tmp_path: Path) -> None:
    write_tensors(tmp_path / "new.face", "face", 99, {"vertices": np.zeros((1, 3), np.float32)}, {})
    with pytest.raises(DataError, match="version 99"):
        read_face(tmp_path / "new.face")


def test_another_kind_is_refused(tmp_path: Path) -> None:
    write_tensors(tmp_path / "talker.face", "talker", 1, {"vertices": np.zeros((1, 3), np.float32)}, {})
    with pytest.raises(DataError, match="not a face file"):
        read_face(tmp_path / "talker.face")


def test_a_file_that_lacks_a_part_is_refused(tmp_path: Path) -> None:
    write_tensors(tmp_path / "half.face", "face", 1, {"vertices": np.zeros((1, 3), np.float32)}, {"identities": []})
    with pytest.raises(DataError, match=r"metadata lacks (parts|shape_names|eyes|metadata)"):
        read_face(tmp_path / "half.face")


def test_arrays_that_do_not_fit_are_refused() -> None:
    face = small_face()
    with pytest.raises(DataError, match="do not fit each other"):
        replace(face, colours=face.colours[1:])
    with pytest.raises(DataError, match="beyond its 40"):
        replace(face, triangles=np.full((20, 3), N, np.int32))


def test_an_identity_that_a_face_lacks_is_refused(tmp_path: Path) -> None:
    write_face(tmp_path / "own.face", small_face(), {"walter": Identity(np.ones((N, 3), np.float32))})
    assert read_face(tmp_path / "own.face", "walter").metadata["identity"] == "walter"
    with pytest.raises(InputError, match="no identity 'kenji'; it has: walter"):
        read_face(tmp_path / "own.face", "kenji")
