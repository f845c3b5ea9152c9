"""Files of jobs on this machine: fetched by their content, under names with endings.

The file of a job lies in a folder whose name is its SHA-256, and an uploaded model has its SHA-256 as its name, so that
a worker on another machine can fetch them.
"""

import contextlib
import os
import secrets
import shutil
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from tts2face.serving.batch.segment import Segment
from tts2face.serving.work.blobs import HASH, BlobStore, MissingBlobError
from tts2face.session.named_models import Models

MODEL_PATHS = ("talker", "face", "palette", "hair", "dictionary")
REQUEST_PATHS = ("audio", "timeline", "dictionary", "voice")


def place_file(blobs: Sequence[BlobStore], sha256: str, name: str, folder: Path) -> Path:
    """Path of a file with a name in a folder; it is a link where the system has links."""
    path = folder / sha256 / Path(name).name
    if path.exists():
        return path
    found = fetch_file(blobs, sha256)
    path.parent.mkdir(parents=True, exist_ok=True)
    placed = path.with_name(f".{secrets.token_hex(8)}")  # segments that need the same file place it at the same time
    try:
        os.symlink(found.resolve(), placed)
    except OSError:  # no links here
        shutil.copyfile(found, placed)
    placed.replace(path)
    return path


def fetch_file(blobs: Sequence[BlobStore], sha256: str) -> Path:
    """Local path of a file in the first store that has it."""
    for store in blobs[:-1]:
        with contextlib.suppress(MissingBlobError):
            return store.fetch(sha256)
    return blobs[-1].fetch(sha256)


def place_models(values: Mapping[str, Any], blobs: Callable[[], Sequence[BlobStore]]) -> dict[str, Any]:
    """Values of models or of a request with local paths of the uploads that another machine has named."""

    def local(value: Any) -> Any:
        name = Path(str(value)).name
        return str(fetch_file(blobs(), name)) if HASH.fullmatch(name) else value

    return _replaced(values, MODEL_PATHS, local)


def place_segment_files(
    segment: Segment, blobs: Callable[[], Sequence[BlobStore]], folder: Callable[[], Path]
) -> Segment:
    """The segment with local paths of the files that were placed by `place_file` elsewhere."""

    def local(value: Any) -> Any:
        path = Path(str(value))
        if HASH.fullmatch(path.name):
            return str(fetch_file(blobs(), path.name))
        if HASH.fullmatch(path.parent.name) is None:
            return value
        return str(place_file(blobs(), path.parent.name, path.name, folder()))

    request = _replaced(segment.request, REQUEST_PATHS, local)
    picture = _replaced(segment.picture, ("background",), local)
    models = Models(**_replaced(asdict(segment.models), MODEL_PATHS, local))
    return replace(segment, request=request, picture=picture, models=models)


def _replaced(values: Mapping[str, Any], names: Sequence[str], local: Callable[[Any], Any]) -> dict[str, Any]:
    return {name: local(value) if name in names and value is not None else value for name, value in values.items()}
