"""What clients ask for as jobs: kinds, and orders that are being checked."""

from collections.abc import Awaitable, Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from pydantic import BaseModel
from starlette.datastructures import UploadFile

from tts2face.service.access.keys import ApiKey
from tts2face.service.state import ServiceState
from tts2face.service.uploads.upload_folder import UploadFolder


@dataclass(slots=True)
class Upload:
    """Files of a new job after their checks: local paths by the names that its function sees."""

    folder: UploadFolder
    files: dict[str, Path] = field(default_factory=dict)
    n_cues: int = 0
    seconds: float | None = None  # of the recording of a talker


@dataclass(frozen=True, slots=True)
class JobOrder:
    """What a client has asked for, before it is a job."""

    state: ServiceState
    key: ApiKey
    options: Any
    upload: Upload


CHARACTERS_PER_S, CUE_S = 15.0, 3.0  # of speech; what a job takes of its key's day before it is made


def expected_speech_s(order: JobOrder) -> float:
    """Seconds of speech that a job is expected to make."""
    options = order.options
    text, idle = getattr(options, "text", ""), getattr(options, "idle", None)
    return len(text) / CHARACTERS_PER_S + (idle or 0.0) + CUE_S * order.upload.n_cues


AddFile = Callable[[JobOrder, str, UploadFile, int], Awaitable[None]]


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
        Parts of a form with its files, their descriptions, and what checks one file and notes its path: gets the
        order, the part's name, the file and its number from 1.
    prepare
        Checks an order; JSON for the function that executes it.
    """

    scope: str
    model: type[BaseModel]
    parts: Mapping[str, tuple[str, AddFile]]
    prepare: Callable[[JobOrder], Awaitable[dict[str, Any]]]
