"""``--photo``: the face of a photograph, asked for once and kept.

The face landmark model is set up at its first use, after one yes.
"""

import functools
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from cli.flags import END_OF_OPTIONS, switch
from cli.process import ask, write_message
from lexicon.errors import BackendError, InputError
from tts2face.models.consent import THREE_ANSWERS, consent_record

if TYPE_CHECKING:
    from tts2face.models.face import Face

Photo = Annotated[
    str | None,
    Parameter(help="Picture of a person who shall speak, in place of --face; photo.jpg@2 is its second largest face."),
]
Consent = Annotated[
    str | None,
    Parameter(help=f"Consent of the person in the photo, asked for once and stored with the date: {THREE_ANSWERS}."),
]
Fit = Annotated[
    Path | None, Parameter(help="Corrections of lips, lids, teeth and pivot in the photo (.json, see docs/photo.md).")
]
Smile = Annotated[
    str | None, Parameter(help="Second picture of the person in the photo, with a smile whose teeth the clips show.")
]
YES, AGREED = "--yes", ("y", "yes")
# A command that takes it need not read it: `sets_up_model` finds it among the arguments.
Yes = Annotated[bool, switch("Download the face landmark model without asking, if it is not installed.")]


def face_of_photo(
    photo: str, consent: str | None, *, fit: Path | None = None, smile: str | None = None, quiet: bool
) -> str:
    """Path of the face of a photo, which is made and kept with the consent if it is not there yet."""
    from tts2face.photo.face_from_photo import find_kept, keep_face, kept_path

    kept = kept_path(photo, fit, smile)
    if not find_kept(kept, consent):
        keep_face(make_face(photo, consent, fit=fit, smile=smile, quiet=quiet), kept)
    return str(kept)


def make_face(photo: str, consent: str | None, *, name: str | None = None, quiet: bool, **options: Any) -> "Face":
    """Face of a photo, whose consent is asked for at a terminal; options of `face_from_photo`, errors of both."""
    from tts2face.photo.face_from_photo import face_from_photo

    consent = agreed(photo, consent, name)
    return face_from_photo(photo, consent=consent, name=name, on_warning=warner(quiet=quiet), **options)


@functools.cache  # asked for once, also where the command is run again with the landmark model
def agreed(photo: str, consent: str | None, name: str | None) -> str | None:
    """The consent of the person in a photo, given or asked for."""
    from tts2face.photo.photograph import split_number

    shown = name or split_number(photo)[0].stem
    if consent is None:
        consent = ask(f"The clips will show {shown} speaking. State the consent: {THREE_ANSWERS}:") or None
    consent_record(shown, consent)  # before anything is downloaded
    return consent


def warner(*, quiet: bool) -> Callable[[str], None]:
    """Writes warnings to standard error, or nothing."""

    def warn(sentence: str) -> None:
        if not quiet:
            write_message(f"tts2face: warning: {sentence}")

    return warn


def refuse_beside(others: Mapping[str, str | None]) -> None:
    """Refuse other faces and hair beside a photo, by their flags."""
    for name, given in others.items():
        if given is not None:
            raise InputError(f"--photo cannot be combined with {name}; remove one of them")


def refuse_without(belonging: Mapping[str, str | Path | None]) -> None:
    """Refuse what belongs to a photo without one, by its flags."""
    for name, value in belonging.items():
        if value is not None:
            raise InputError(f"{name} belongs to --photo; add the photo, or remove it")


def check_photo(photo: str, others: Mapping[str, str | Path | None], outputs: Mapping[str, str | Path | None]) -> None:
    """Refuse a photo that does not exist, no output, and outputs that would overwrite it or other files, by flags."""
    from tts2face.photo.photograph import split_number
    from tts2face.storage.output_paths import refuse_overwriting

    path, _ = split_number(photo)
    if all(output is None for output in outputs.values()):
        raise InputError("there is no output; add --out clip.mp4 (or .webm, .gif, or a folder for .png files)")
    refuse_overwriting(outputs, {"--photo": path} | dict(others))


def is_missing_model(error: BackendError) -> bool:
    """Whether an error is that the landmark model is not installed; its module is imported where it was raised."""
    module = sys.modules.get("tts2face.video.networks")
    return module is not None and isinstance(error, module.MissingModelError)


def sets_up_model(arguments: Sequence[str]) -> bool:
    """Set up the landmark model that a command line lacks, if it has --yes or its user agrees; whether it is there."""
    from tts2face.video.setup_models import SOURCE, set_up_model

    options = arguments[: arguments.index(END_OF_OPTIONS)] if END_OF_OPTIONS in arguments else arguments
    question = f"Faces are found with {SOURCE}. Download it now? [y/N]"
    if YES not in options and ask(question).lower() not in AGREED:
        return False
    write_message(f"face landmark model: {set_up_model()}")
    return True
