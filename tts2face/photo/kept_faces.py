"""Faces of photos in the user's cache folder, with their consent, so that each is made and asked for once."""

import hashlib
import os
import time
from contextlib import suppress
from pathlib import Path

from lexicon.errors import DataError, InputError
from tts2face.models.face import Face
from tts2face.models.face_file import FORMAT_VERSION, KIND, read_face, write_face
from tts2face.photo.photograph import split_number
from tts2face.storage.user_folders import user_cache
from tts2face.video.landmark_models import find_segmenter

FOLDER, N_KEPT = "photos", 8
LEAST_AGE_S = 3600.0  # of a face that is removed: another process may be about to read a younger one
MAKING = 4  # raised when faces of photos are made in another way, or of another head


def kept_path(photo: str | Path, fit: Path | None = None, smile: str | Path | None = None) -> Path:
    """Where the face of a photo is kept: by the content and name of the file, other files that it takes, and the maker.

    Raises
    ------
    InputError
        There is no such photo or smile, or the fit cannot be read.
    """
    path, number = split_number(photo)
    smiling, smile_number = (None, 0) if smile is None else split_number(smile)
    content = hashlib.sha256(path.read_bytes())
    content.update(
        f"{FORMAT_VERSION} {MAKING} {number} {path.stem} {smile_number} {find_segmenter() is not None}".encode()
    )
    for other in (fit, smiling):
        try:
            content.update(hashlib.sha256(b"" if other is None else other.read_bytes()).digest())
        except OSError as refused:
            raise InputError(f"cannot read {other}: {refused.strerror}; check the path") from refused
    return user_cache() / FOLDER / f"{content.hexdigest()[:32]}.{KIND}"


def find_kept(kept: Path, consent: str | None) -> bool:
    """Whether a kept face can be read, and has the statement of consent that is given, if any."""
    with suppress(InputError, DataError, OSError):
        stated = read_face(kept).metadata["consent"]["statement"]
        if consent is None or consent.strip() == stated:
            os.utime(kept)  # the last ones used are kept
            return True
    return False


def keep_face(face: Face, kept: Path) -> None:
    """Keep the face of a photo at its `kept_path`.

    Raises
    ------
    BackendError
        The cache folder cannot be written.
    """
    with suppress(OSError):
        kept.parent.mkdir(parents=True, exist_ok=True)
    write_face(kept, face)
    ages = {}
    for path in kept.parent.glob(f"*.{KIND}"):
        with suppress(OSError):
            ages[path] = time.time() - path.stat().st_mtime
    for path in sorted(ages, key=lambda path: ages[path])[N_KEPT:]:
        if ages[path] > LEAST_AGE_S:
            path.unlink(missing_ok=True)
