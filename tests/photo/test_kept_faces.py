"""Faces of photos are made once, and again where what is kept does not fit."""

from pathlib import Path

import pytest

from lexicon.errors import InputError
from tests.models.made import write_made_face
from tts2face.models.face_file import read_face
from tts2face.photo import face_from_photo
from tts2face.photo.face_from_photo import N_KEPT, find_kept, keep_face, kept_path


@pytest.fixture
def photo(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(face_from_photo, "user_cache", lambda: tmp_path / "cache")
    path = tmp_path / "me.jpg"
    path.write_bytes(b"a picture")
    return path


def keep(photo: Path, statement: str) -> Path:
    made = photo.with_suffix(".face")
    write_made_face(made)
    face = read_face(made)
    object.__setattr__(face, "metadata", {**face.metadata, "consent": {"statement": statement}})
    kept = kept_path(photo)
    keep_face(face, kept)
    return kept


def test_a_face_is_found_again_with_its_consent(photo: Path) -> None:
    assert not find_kept(kept_path(photo), None)
    kept = keep(photo, "me: for a test")
    assert find_kept(kept, None)
    assert find_kept(kept, " Me, for a test ")
    assert not find_kept(kept_path(photo), "nobody")
    with pytest.raises(InputError, match="not one of the three"):
        find_kept(kept, "I agree to this.")
    assert not find_kept(kept_path(f"{photo}@2"), None)
    other = photo.with_name("anna.jpg")
    other.write_bytes(photo.read_bytes())
    assert not find_kept(kept_path(other), None)  # its clips name another person


def test_a_correction_makes_another_face(photo: Path) -> None:
    keep(photo, "drawn")
    fit = photo.with_name("fit.json")
    fit.write_text('{"pivot": [10, 10]}')
    corrected = kept_path(photo, fit)
    assert not find_kept(corrected, "nobody")
    fit.write_text('{"pivot": [10, 11]}')
    assert len({kept_path(photo), corrected, kept_path(photo, fit)}) == 3
    with pytest.raises(InputError, match=r"cannot read .*no\.json"):
        kept_path(photo, photo.with_name("no.json"))


def test_a_smile_makes_another_face(photo: Path) -> None:
    smile = photo.with_name("smile.jpg")
    smile.write_bytes(b"a smile")
    first = kept_path(photo, smile=smile)
    assert len({kept_path(photo), first, kept_path(photo, smile), kept_path(photo, smile=f"{smile}@2")}) == 4
    smile.write_bytes(b"another smile")
    assert kept_path(photo, smile=smile) != first
    with pytest.raises(InputError, match=r"there is no photo .*no\.jpg"):
        kept_path(photo, smile=photo.with_name("no.jpg"))


def test_a_damaged_face_is_made_again(photo: Path) -> None:
    kept = keep(photo, "drawn")
    kept.write_bytes(kept.read_bytes()[:500])
    assert not find_kept(kept_path(photo), None)
    keep(photo, "drawn")
    assert find_kept(kept, None)


def test_the_oldest_faces_are_removed(photo: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for number in range(N_KEPT + 2):
        photo.write_bytes(f"picture {number}".encode())
        keep(photo, "drawn")
    assert len(list(kept_path(photo).parent.iterdir())) == N_KEPT + 2  # another process may be about to read one
    monkeypatch.setattr(face_from_photo, "LEAST_AGE_S", -1.0)
    keep(photo, "drawn")
    assert len(list(kept_path(photo).parent.iterdir())) == N_KEPT
    assert find_kept(kept_path(photo), None)
