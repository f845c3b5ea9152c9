"""Faces of photos in the user's cache folder, with their consent, so that each is made and asked for once."""

import hashlib
from pathlib import Path

from tts2face.models.face import Face
from tts2face.models.face_file import write_face
from tts2face.photo.photograph import split_number
from tts2face.storage.user_folders import user_cache

FOLDER, N_KEPT = "photos", 8
VERSION = "1"  # of how they are made


def kept_face(photo: str | Path) -> Path:
    """Where `keep_face` keeps the face of a photo, by the content of the file."""
    path, number = split_number(photo)
    content = hashlib.sha256(path.read_bytes())
    content.update(f"{VERSION} {number}".encode())
    return user_cache() / FOLDER / f"{content.hexdigest()[:32]}.face"


def keep_face(face: Face, kept: Path) -> None:
    """Keep the face of a photo in the user's cache folder; the last ones are kept."""
    kept.parent.mkdir(parents=True, exist_ok=True)
    write_face(kept, face)
    others = sorted(kept.parent.glob("*.face"), key=lambda path: path.stat().st_mtime)
    for path in others[:-N_KEPT]:
        path.unlink(missing_ok=True)
