"""Faces that speak in photographs, made of their files.

They are kept in the user's cache folder, with their consent, so that each is made and asked for once.
"""

import hashlib
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

from lexicon.errors import DataError, InputError
from tts2face.models.consent import consent_record, parse_consent, stated_consent
from tts2face.models.face import Face
from tts2face.models.face_file import FORMAT_VERSION, KIND, read_face, write_face
from tts2face.models.face_loading import load_face
from tts2face.models.face_names import BALD
from tts2face.photo.fit import NOTHING_GIVEN, PhotoFit, read_fit
from tts2face.photo.found_face import PhotographedFace, PhotoReader
from tts2face.photo.matte import part_background
from tts2face.photo.photograph import Photograph, split_number
from tts2face.photo.speaking_photo import speaking_photo
from tts2face.photo.teeth import read_teeth
from tts2face.request import REALISTIC_FACE
from tts2face.storage.content_store import FolderStore
from tts2face.storage.user_folders import user_cache
from tts2face.video.networks import LandmarkNetwork, find_segmenter

FOLDER, N_KEPT = "photos", 8
LEAST_AGE_S = 3600.0  # of a face that is removed: another process may be about to read a younger one
MAKING = 6  # raised when faces of photos are made in another way, or of another head


def face_from_photo(  # noqa: PLR0913 - one parameter an option
    photo: str | Path,
    *,
    consent: str | None = None,
    name: str | None = None,
    fit: str | Path | PhotoFit | None = None,
    smile: str | Path | None = None,
    model: Path | None = None,
    on_warning: Callable[[str], None] = lambda _: None,
) -> Face:
    """Face that speaks in a photograph; `tts2face.save_face` keeps it in a ``.face`` file.

    Parameters
    ----------
    photo
        Picture file; ``photo.jpg@2`` is its second largest face.
    consent
        Consent of the person shown, kept in the face with the date: ``me``, ``agreed: NAME, YYYY-MM-DD``, or ``nobody``
        for a face that is drawn or generated; words may follow after a comma.
    name
        The person's name; the file's name if omitted.
    fit
        Corrections of what is found, or the path of their file (docs/photo.md); ``face.metadata["fit"]`` of a face has
        the places that were used.
    smile
        Second picture of the person, with a smile whose teeth are shown between the lips of this one; a smile in the
        first picture gives its own.
    model
        Path of face_landmarker.task; found or set up if omitted.
    on_warning
        Gets sentences about what may look worse.

    Raises
    ------
    InputError
        There is no such file or face, or no consent.
    DataError
        The picture cannot be read, or shows no face that can be moved; the fit is none, or that of another picture;
        the smile shows another person, or no teeth.
    BackendError
        The landmark models or a package are not installed.
    """
    record = consent_record(name or split_number(photo)[0].stem, consent)
    given = fit if isinstance(fit, PhotoFit) else NOTHING_GIVEN if fit is None else read_fit(Path(fit))
    metadata = {"name": record["name"], "consent": dict(record), "made_by": "tts2face --photo"}
    return _made(photo, metadata, smile, given, PhotoReader(model, on_warning))[1]


def places_in_photo(photo: str | Path, on_warning: Callable[[str], None]) -> tuple[Photograph, dict[str, Any]]:
    """The picture of a photo, and the places of lips, lids, teeth and pivot that are found in it, as a fit in JSON.

    Errors are those of `face_from_photo`.
    """
    picture, face = _made(photo, {}, None, NOTHING_GIVEN, PhotoReader(None, on_warning))
    return picture, face.metadata["fit"]


def _made(
    photo: str | Path, metadata: Mapping[str, Any], smile: str | Path | None, fit: PhotoFit, reader: PhotoReader
) -> tuple[Photograph, Face]:
    head, seen = load_face(REALISTIC_FACE, hair=BALD), reader.read(photo)
    teeth = None if smile is None else read_teeth(reader, smile, photo, seen.found, head)
    layers = _without_background(seen, reader, split_number(photo)[0])
    return seen.picture, speaking_photo(layers, head, metadata, teeth=teeth, fit=fit)


def _without_background(seen: PhotographedFace, reader: PhotoReader, name: Path) -> PhotographedFace:
    """An opaque picture in two layers, person and background, if they differ enough."""
    if seen.picture.alpha is not None:
        return seen
    segmenter = find_segmenter(reader.model)
    if segmenter is None:
        reader.warn(
            f"the background of {name} bends where the head turns: `tts2face corpus setup` adds the model that tells "
            "persons from backgrounds"
        )
        return seen
    network = LandmarkNetwork(segmenter.read_bytes())
    parted = part_background(seen.picture, seen.found.landmarks, seen.found.eye_distance_px, network)
    if parted.alpha is None:
        reader.warn(
            f"the person in {name} is not told from the background, which bends where the head turns; a calmer "
            "background, or a PNG picture whose background is transparent, does not"
        )
    return replace(seen, picture=parted)


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
    """Whether a kept face can be read, and has the consent that is given, if any.

    Raises
    ------
    InputError
        The given consent is none.
    """
    given = None if consent is None else parse_consent(consent)
    with suppress(InputError, DataError, OSError):
        stated = stated_consent(read_face(kept).metadata)
        if stated is not None and given in (None, stated):
            FolderStore(kept.parent).touch(kept.name)
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
    FolderStore(kept.parent).prune(max_files=N_KEPT, least_age_s=LEAST_AGE_S)
