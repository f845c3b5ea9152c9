"""``--photo``: the face of a photograph, asked for once and kept."""

import functools
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from cli.process import write_message
from lexicon.errors import InputError
from tts2face.models.consent import consent_record

if TYPE_CHECKING:
    from tts2face.models.face import Face

Photo = Annotated[
    str | None,
    Parameter(help="Picture of a person who shall speak, in place of --face; photo.jpg@2 is its second largest face."),
]
Consent = Annotated[
    str | None,
    Parameter(help="Statement of consent of the person in --photo, asked for once; drawn for a face that is nobody's."),
]


def face_of_photo(photo: str, consent: str | None, *, quiet: bool) -> str:
    """Path of the face of a photo, which is made and kept with the consent if it is not there yet.

    Raises
    ------
    InputError
        There is no such photo or face, or no consent.
    DataError
        The picture shows no face that can be moved.
    BackendError
        The landmark model or a package is not installed.
    """
    from tts2face.photo.kept_faces import keep_face, kept_face

    kept = kept_face(photo)
    if consent is not None or not kept.is_file():
        keep_face(make_face(photo, consent, quiet=quiet), kept)
    return str(kept)


def make_face(
    photo: str,
    consent: str | None,
    *,
    name: str | None = None,
    model: Path | None = None,
    quiet: bool,
) -> "Face":
    """Face of a photo, whose consent is asked for at a terminal; errors as `face_of_photo`."""
    from tts2face.photo.face_from_photo import face_from_photo

    consent = agreed(photo, consent, name)
    return face_from_photo(photo, consent=consent, name=name, model=model, on_warning=warner(quiet=quiet))


@functools.cache  # asked for once, also where the command is run again with the landmark model
def agreed(photo: str, consent: str | None, name: str | None) -> str | None:
    """The consent of the person in a photo, given or asked for.

    Raises
    ------
    InputError
        There is no such photo, or no consent.
    """
    from tts2face.photo.photograph import split_number

    shown = name or split_number(photo)[0].stem
    if consent is None and sys.stdin.isatty():
        consent = input(f"The clips will show {shown} speaking. Statement of consent of the person (or: drawn): ")
    consent_record(shown, consent)  # before anything is downloaded
    return consent


def warner(*, quiet: bool) -> Callable[[str], None]:
    """Writes warnings to standard error, or nothing."""

    def warn(sentence: str) -> None:
        if not quiet:
            write_message(f"tts2face: warning: {sentence}")

    return warn


def refuse_face_beside(photo: str | None, face: str | None, identity: str | None, hair: str | None) -> None:
    """Refuse another face, an identity or a haircut beside a photo."""
    for name, given in (("--face", face), ("--identity", identity), ("--hair", hair)):
        if photo is not None and given is not None:
            raise InputError(f"--photo cannot be combined with {name}; remove one of them")
