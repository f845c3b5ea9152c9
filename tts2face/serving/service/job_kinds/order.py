"""The order of a job while it is checked, and the base of the kinds of jobs.

A new kind of jobs:

1. a module of this package with the model of its options, a function for each part of its form that checks the file
   and notes its path in the order, and a function that checks the whole and returns the JSON of the job;
2. a row of `JOB_KINDS` in ``table.py``; routes, quotas and the OpenAPI description follow;
3. a row of `KINDS` in ``serving/work/kinds.py`` with the function that executes it.
"""

from collections.abc import Awaitable, Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

from pydantic import BaseModel
from starlette.datastructures import UploadFile

from tts2face.serving.service.errors import RefusedError
from tts2face.serving.service.keys import ApiKey
from tts2face.serving.service.state import ServiceState
from tts2face.serving.service.uploads import UploadFolder


@dataclass(slots=True)
class Upload:
    """Files of a new job after their checks: local paths by the names that its function sees."""

    folder: UploadFolder
    files: dict[str, Path] = field(default_factory=dict)
    n_cues: int = 0
    seconds: float | None = None  # of the recording of a talker


@dataclass(frozen=True, slots=True)
class JobOrder:
    """A job that a client asks for, before it is queued."""

    state: ServiceState
    key: ApiKey
    options: Any
    upload: Upload


AddFile = Callable[[JobOrder, str, UploadFile, int], Awaitable[None]]


class FormPart(NamedTuple):
    """A part of a form with a file.

    Parameters
    ----------
    description
        Text for clients.
    add
        Checks a file and notes its path: gets the order, the part's name, the file and its number from 1.
    is_list
        Whether it is described as a list of files; `add` refuses those beyond the first where it takes one.
    """

    description: str
    add: AddFile
    is_list: bool = False


@dataclass(frozen=True, slots=True)
class JobKind:
    """A kind of jobs.

    Parameters
    ----------
    scope
        Scope of the keys that may ask for it.
    model
        Its options.
    parts
        Parts of a form with its files, by name.
    prepare
        Checks an order; JSON for the function that executes it.
    """

    scope: str
    model: type[BaseModel]
    parts: Mapping[str, FormPart]
    prepare: Callable[[JobOrder], Awaitable[dict[str, Any]]]


def refuse_second(part: str, number: int) -> None:
    """Refuse a part that may be sent once and was sent again."""
    if number > 1:
        raise RefusedError(422, "invalid_request", f"{part} was sent twice; send one")
