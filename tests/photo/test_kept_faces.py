"""Faces of photos are made once, and again where what is kept does not fit."""

from pathlib import Path

import pytest

from tests.model_files.made import write_made_face
from tts2face.models.face_file import read_face
from tts2face.photo import kept_faces
from tts2face.photo.kept_faces import N_KEPT, find_kept, keep_face, kept_path


@pytest.fixture
def photo(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(kept_faces, "user_cache", lambda: tmp_path / "cache")
    path = tmp_path / "me.jpg"
    path.write_bytes(b"a picture")
    return path


def keep(photo: Path, statement: str) -> Path:
    made = photo.with_suffix(".face")
    write_made_face(made)
    face = read_face(made)
    object.__setattr__(face, "metadata", {**face.metadata, "consent": {"statement": statement}})
    return keep_face(face, photo)


def test_a_face_is_found_again_with_its_consent(photo: Path) -> None:
    assert find_kept(photo, None) is None
    kept = keep(photo, "I agree to this.")
    assert find_kept(photo, None) == find_kept(photo, " I agree to this. ") == kept
    assert find_kept(photo, "drawn") is None
    assert find_kept(f"{photo}@2", None) is None
    other = photo.with_name("anna.jpg")
    other.write_bytes(photo.read_bytes())
    assert find_kept(other, None) is None  # its clips name another person


def test_a_damaged_face_is_made_again(photo: Path) -> None:
    kept = keep(photo, "drawn")
    kept.write_bytes(kept.read_bytes()[:500])
    assert find_kept(photo, None) is None
    assert find_kept(photo.parent / "me.jpg", "drawn") is None
    keep(photo, "drawn")
    assert find_kept(photo, None) == kept


def test_the_oldest_faces_are_removed(photo: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for number in range(N_KEPT + 2):
        photo.write_bytes(f"picture {number}".encode())
        keep(photo, "drawn")
    assert len(list(kept_path(photo).parent.iterdir())) == N_KEPT + 2  # another process may be about to read one
    monkeypatch.setattr(kept_faces, "LEAST_AGE_S", -1.0)
    keep(photo, "drawn")
    assert len(list(kept_path(photo).parent.iterdir())) == N_KEPT
    assert find_kept(photo, None) is not None
