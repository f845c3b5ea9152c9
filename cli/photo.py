"""``--photo``: the face of a photograph, asked for once and kept."""

import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from cli.flags import switch
from cli.process import write_message
from lexicon.errors import BackendError, InputError
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
Yes = Annotated[bool, switch("Download the face landmark model without asking, if it is not installed.")]


def face_of_photo(photo: str, consent: str | None, *, yes: bool, quiet: bool) -> str:
    """Path of the face of a photo, which is made and kept with the consent if it is not there yet.

    Raises
    ------
    InputError
        There is no such photo or face, or no consent.
    DataError
        The picture shows no face that can be moved.
    BackendError
        The landmark model is not installed, and shall not be.
    """
    from tts2face.photo.kept_faces import keep_face, kept_face

    kept = kept_face(photo)
    if consent is not None or not kept.is_file():
        keep_face(make_face(photo, consent, yes=yes, quiet=quiet), kept)
    return str(kept)


def make_face(
    photo: str,
    consent: str | None,
    *,
    name: str | None = None,
    model: Path | None = None,
    yes: bool,
    quiet: bool,
) -> "Face":
    """Face of a photo, whose consent is asked for at a terminal; errors as `face_of_photo`."""
    from tts2face.photo.face_from_photo import face_from_photo

    consent = agreed(photo, consent, name, model=model, yes=yes)
    return face_from_photo(photo, consent=consent, name=name, model=model, on_warning=warner(quiet=quiet))


def agreed(photo: str, consent: str | None, name: str | None, *, model: Path | None, yes: bool) -> str | None:
    """The consent of the person in a photo, given or asked for; then the landmark model is there.

    Raises
    ------
    InputError
        There is no such photo, or no consent.
    BackendError
        The landmark model is not installed, and shall not be.
    """
    from tts2face.photo.photograph import split_number

    shown = name or split_number(photo)[0].stem
    if consent is None and sys.stdin.isatty():
        consent = input(f"The clips will show {shown} speaking. Statement of consent of the person (or: drawn): ")
    consent_record(shown, consent)  # before anything is downloaded
    offer_model(model, yes=yes)
    return consent


def warner(*, quiet: bool) -> Callable[[str], None]:
    """Writes warnings to standard error, or nothing."""

    def warn(sentence: str) -> None:
        if not quiet:
            write_message(f"tts2face: warning: {sentence}")

    return warn


def offer_model(model: Path | None, *, yes: bool) -> None:
    """Set up the face landmark model if it is missing: after one yes at a terminal, or without asking.

    Raises
    ------
    BackendError
        It is missing and shall not be, or cannot be downloaded.
    """
    from tts2face.video.landmark_models import find_bundle
    from tts2face.video.setup_models import SOURCE, set_up_model

    try:
        find_bundle(model)
    except BackendError:
        if not yes and not (sys.stdin.isatty() and _agrees(f"Faces are found with {SOURCE}. Download it now?")):
            raise BackendError(
                f"faces are found with {SOURCE}, which is not installed; add --yes, or run `tts2face corpus setup`"
            ) from None
        write_message(f"face landmark model: {set_up_model()}")


def _agrees(question: str) -> bool:
    return input(f"{question} [y/N] ").strip().lower() in ("y", "yes")


def refuse_face_beside(photo: str | None, face: str | None, identity: str | None, hair: str | None) -> None:
    """Refuse another face, an identity or a haircut beside a photo."""
    for name, given in (("--face", face), ("--identity", identity), ("--hair", hair)):
        if photo is not None and given is not None:
            raise InputError(f"--photo cannot be combined with {name}; remove one of them")
