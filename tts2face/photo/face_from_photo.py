"""A face that speaks in a photograph, from its file."""

import hashlib
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np

from lexicon.errors import InputError
from tts2face.models.consent import consent_record
from tts2face.models.face import Face
from tts2face.models.face_file import write_face
from tts2face.models.face_loading import load_face
from tts2face.models.hair import BALD
from tts2face.photo.found_face import find_face
from tts2face.photo.photograph import read_photograph
from tts2face.photo.speaking_photo import speaking_photo
from tts2face.request import REALISTIC_FACE
from tts2face.storage.user_folders import user_cache

NUMBERED = re.compile(r"(.+)@(\d{1,3})")  # a photo, and which of its faces
SMILES = ("mouthSmileLeft", "mouthSmileRight")
FOLDER, N_KEPT = "photos", 8  # in the user's cache folder
VERSION = "1"  # of the faces kept there


def face_from_photo(
    photo: str | Path,
    *,
    consent: str | None = None,
    name: str | None = None,
    model: Path | None = None,
    on_warning: Callable[[str], None] = lambda _: None,
) -> Face:
    """Face that speaks in a photograph; `tts2face.save_face` keeps it in a ``.face`` file.

    Parameters
    ----------
    photo
        Picture file; ``photo.jpg@2`` is its second largest face.
    consent
        Statement of consent of the person shown, kept in the face with its date; ``drawn`` for a face that is nobody's.
    name
        The person's name; the file's name if omitted.
    model
        Path of face_landmarker.task; found or set up if omitted.
    on_warning
        Gets sentences about what may look worse.

    Raises
    ------
    InputError
        There is no such file or face, or no consent.
    DataError
        The picture cannot be read, or shows no face that can be moved.
    BackendError
        The landmark models or a package are not installed.
    """
    from tts2face.video.blendshapes import BLENDSHAPES, BlendshapeReader
    from tts2face.video.track import FaceTracker

    path, number = split_number(photo)
    record = consent_record(name or path.stem, consent)
    picture = read_photograph(path)
    found = find_face(picture.pixels, FaceTracker(model), path, number=number, reduced_by=picture.reduced_by)
    for warning in found.warnings:
        on_warning(warning)
    scores = BlendshapeReader(model).blendshape_scores(found.landmarks)
    smile = float(np.mean([scores[BLENDSHAPES.index(shape)] for shape in SMILES]))
    metadata = {"name": record["name"], "consent": dict(record), "made_by": "tts2face --photo"}
    return speaking_photo(picture.pixels, found, smile, load_face(REALISTIC_FACE, hair=BALD), metadata)


def split_number(photo: str | Path) -> tuple[Path, int]:
    """Path of a photo, and which of its faces: ``photo.jpg@2`` is the second largest one."""
    path = Path(photo)
    match = NUMBERED.fullmatch(str(photo))
    if match is not None and not path.exists():
        path = Path(match[1])
    if not path.is_file():
        raise InputError(f"there is no photo {path}; check the path")
    return path, int(match[2]) if match is not None and str(path) == match[1] else 1


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
