"""The list of kinds of durable work, and what the function of a kind gets and returns.

The next kind:
1. its function in a module of this room, ``NAME_job.py``: it may run again after any death, so that whatever it stores
   has a name by content, or is replaced;
2. its row in `KINDS`, with a queue of `PLACES` if it computes for minutes;
3. what clients send, and its checks, in a module of ``service/job_kinds`` and a row of `JOB_KINDS`;
4. a test of the function with a `JobTask` made by hand (``tests/serving/work/test_talker_job.py``).
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any

from tts2face.serving.batch.engine import Engine
from tts2face.serving.batch.store import Store
from tts2face.serving.work.blobs import BlobStore
from tts2face.serving.work.queues import JOB_QUEUE, TALKER_QUEUE
from tts2face.storage.signing import Signer

# No HTML: a report that ran as a page of the service could use the key of its reader.
MEDIA_TYPES = {
    ".mp4": "video/mp4", ".webm": "video/webm", ".mov": "video/quicktime", ".json": "application/json",
    ".csv": "text/csv", ".jsonl": "application/jsonl", ".glb": "model/gltf-binary", ".wav": "audio/wav",
    ".vtt": "text/vtt", ".txt": "text/plain",
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Execution:
    """How jobs of a kind are executed. Work that changes what an open page shows is a `WorkKind` of the studio.

    Parameters
    ----------
    run
        Module and function, which gets a `JobTask` and returns `Products`; imported by the worker that needs it.
    queue
        One of `PLACES`: how many of the kind a worker executes at once.
    """

    run: str
    queue: str = JOB_QUEUE


KINDS: Mapping[str, Execution] = MappingProxyType({
    "clip": Execution("tts2face.serving.work.clip_job:run_clip"),
    "subtitles": Execution("tts2face.serving.work.subtitles_job:run_subtitles"),
    "talker": Execution("tts2face.serving.work.talker_job:run_talker", TALKER_QUEUE),
})  # fmt: skip


class JobCancelledError(Exception):
    """The job was cancelled or deleted while it ran."""


@dataclass(frozen=True, slots=True)
class JobTask:
    """A job as the function of its kind gets it.

    Parameters
    ----------
    request
        JSON of the job, as the service has checked it.
    inputs
        Files by name.
    folder
        Empty folder, which is removed afterwards.
    engine, store
        Engine and store of the segments of a batch.
    report
        Adds an event to the job; ``done`` and ``of`` are its progress.
    check
        Raises `JobCancelledError` if the job is no longer wanted; to be called now and then.
    database, resources
        URL of the database, and the files of the uploaded models in the store.
    signer
        Who signs the results; None: nobody.
    """

    request: Mapping[str, Any]
    inputs: Mapping[str, Path]
    folder: Path
    engine: Engine
    store: Store
    report: Callable[[dict[str, Any]], None]
    check: Callable[[], None]
    database: str = ""
    resources: Callable[[], BlobStore] | None = None
    signer: Signer | None = None


@dataclass(frozen=True, slots=True)
class Product:
    """A file that a job has made; clients see its name."""

    path: Path
    name: str
    media_type: str


@dataclass(frozen=True, slots=True)
class Products:
    """Files that a job has made, and why some are missing."""

    files: tuple[Product, ...]
    error: str | None = None


def media_type(name: str) -> str:
    """Media type of a file name."""
    return MEDIA_TYPES.get(Path(name).suffix.lower(), "application/octet-stream")


def products_of(paths: Sequence[Path], error: str | None = None) -> Products:
    """Products with the names of their files."""
    return Products(tuple(Product(path, path.name, media_type(path.name)) for path in paths), error)
