"""Jobs of kind ``clip``: one clip in a format of `Session.stream_file`, as a complete file."""

import shutil
from pathlib import Path
from typing import Any

from lexicon.errors import DataError
from tts2face.serving.batch.segment import FILE_PREFIX, Segment, input_hashes
from tts2face.serving.work.kinds import JobTask, Product, Products
from tts2face.session.encoded_stream import line_formats, media_types
from tts2face.session.inspection import joined_mark
from tts2face.session.named_models import Models
from tts2face.storage.signing import EMBEDDED

# Fields of a request: names of the job's files.
FILES = {"audio": "audio.wav", "partner": "partner.wav", "timeline": "timeline.json"}
BACKGROUND = "background.png"


def run_clip(task: JobTask) -> Products:
    """Render the clip as one segment, whichever worker takes it."""
    format = str(task.request["format"])
    segment = clip_segment(task)
    missing = {} if task.store.result(segment.address) is not None else {segment.address: segment}
    for rendered in task.engine.render(missing, task.store):
        if rendered.result is None:
            raise DataError(rendered.reason)
    suffix = line_formats()[format].suffixes[0] if format in line_formats() else f".{format}"
    path = task.store.fetch(segment.address, task.folder)
    if task.signer is not None and format in EMBEDDED:
        path = _signed(path, format, task)
    return Products((Product(path, f"clip{suffix}", media_types()[format]),))


def _signed(path: Path, format: str, task: JobTask) -> Path:
    """A signed copy of a segment, which lies in the store for all who ask for it."""
    copy = task.folder / f"signed.{format}"
    shutil.copyfile(path, copy)
    mark = joined_mark([copy])
    if mark is not None and task.signer is not None:  # the sound of a recording is what it was
        task.signer.sign(copy, format, mark)
    return copy


def clip_segment(task: JobTask) -> Segment:
    """The segment that is the whole clip."""
    models = Models(**task.request["models"])
    request: dict[str, Any] = dict(task.request["request"])
    request |= {field: str(task.inputs[name]) for field, name in FILES.items() if name in task.inputs}
    picture: dict[str, Any] = dict(task.request["picture"])
    if BACKGROUND in task.inputs:
        picture["background"] = str(task.inputs[BACKGROUND])
    medium = f"{FILE_PREFIX}{task.request['format']}"
    hashes = input_hashes(models, request, picture)
    return Segment(request, picture, models, 1, file_hashes=hashes, medium=medium)
