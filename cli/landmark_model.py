"""The face landmark model is set up at its first use, after one yes."""

import sys
from collections.abc import Sequence
from typing import Annotated

from cli.flags import END_OF_OPTIONS, switch
from cli.process import ask, write_message
from lexicon.errors import BackendError

YES, AGREED = "--yes", ("y", "yes")
Yes = Annotated[bool, switch("Download the face landmark model without asking, if it is not installed.")]


def is_missing_model(error: BackendError) -> bool:
    """Whether an error is that the landmark model is not installed; its module is imported where it was raised."""
    module = sys.modules.get("tts2face.video.landmark_models")
    return module is not None and isinstance(error, module.MissingModelError)


def sets_up_model(arguments: Sequence[str]) -> bool:
    """Set up the landmark model that a command line lacks, if it has --yes or its user agrees; whether it is there now.

    Raises
    ------
    BackendError
        It cannot be downloaded.
    """
    from tts2face.video.setup_models import SOURCE, set_up_model

    options = arguments[: arguments.index(END_OF_OPTIONS)] if END_OF_OPTIONS in arguments else arguments
    question = f"Faces are found with {SOURCE}. Download it now? [y/N]"
    if YES not in options and ask(question).lower() not in AGREED:
        return False
    write_message(f"face landmark model: {set_up_model()}")
    return True
