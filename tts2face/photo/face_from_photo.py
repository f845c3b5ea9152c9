"""A face that speaks in a photograph, from its file."""

from collections.abc import Callable
from pathlib import Path

import numpy as np

from tts2face.models.consent import consent_record
from tts2face.models.face import Face
from tts2face.models.face_loading import load_face
from tts2face.models.hair import BALD
from tts2face.photo.found_face import FoundFace, find_face
from tts2face.photo.person_matte import part_background
from tts2face.photo.photograph import Photograph, read_photograph, split_number
from tts2face.photo.speaking_photo import speaking_photo
from tts2face.request import REALISTIC_FACE

SMILES = ("mouthSmileLeft", "mouthSmileRight")


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
    picture = read_photograph(path).filled()
    found = find_face(picture.pixels, FaceTracker(model), path, number=number, reduced_by=picture.reduced_by)
    for warning in found.warnings:
        on_warning(warning)
    picture = _without_background(picture, found, model, path, on_warning)
    scores = BlendshapeReader(model).blendshape_scores(found.landmarks)
    smile = float(np.mean([scores[BLENDSHAPES.index(shape)] for shape in SMILES]))
    metadata = {"name": record["name"], "consent": dict(record), "made_by": "tts2face --photo"}
    return speaking_photo(picture, found, smile, load_face(REALISTIC_FACE, hair=BALD), metadata)


def _without_background(
    picture: Photograph, found: FoundFace, model: Path | None, name: Path, on_warning: Callable[[str], None]
) -> Photograph:
    """An opaque picture in two layers, person and background, if they can be told apart."""
    from tts2face.video.landmark_models import LandmarkNetwork, find_segmenter

    if picture.alpha is not None:
        return picture
    segmenter = find_segmenter(model)
    if segmenter is None:
        on_warning(
            f"the background of {name} bends where the head turns: `tts2face corpus setup` adds the model that tells "
            "persons from backgrounds"
        )
        return picture
    network = LandmarkNetwork(segmenter.read_bytes())
    parted = part_background(picture, found.landmarks, found.eye_distance_px, network)
    if parted.alpha is None:
        on_warning(
            f"the person in {name} is not told from the background, which bends where the head turns; a calmer "
            "background, or a PNG picture whose background is transparent, does not"
        )
    return parted
