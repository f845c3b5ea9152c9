"""A face that speaks in a photograph, from its file."""

from collections.abc import Callable
from pathlib import Path

from tts2face.models.consent import consent_record
from tts2face.models.face import Face
from tts2face.models.face_loading import load_face
from tts2face.models.hair import BALD
from tts2face.photo.found_face import PhotoReader
from tts2face.photo.own_teeth import read_teeth
from tts2face.photo.photo_fit import NOTHING_GIVEN, PhotoFit, read_fit
from tts2face.photo.photograph import split_number
from tts2face.photo.speaking_photo import speaking_photo
from tts2face.request import REALISTIC_FACE


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
        Statement of consent of the person shown, kept in the face with its date; ``drawn`` for a face that is nobody's.
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
    reader, head = PhotoReader(model, on_warning), load_face(REALISTIC_FACE, hair=BALD)
    seen = reader.read(photo)
    teeth = None if smile is None else read_teeth(reader, smile, photo, seen.found, head)
    metadata = {"name": record["name"], "consent": dict(record), "made_by": "tts2face --photo"}
    return speaking_photo(seen, head, metadata, teeth=teeth, fit=given)
