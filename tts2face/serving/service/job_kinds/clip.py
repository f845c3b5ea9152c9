"""Jobs of kind ``clip``: their options, their files, and the checks before they are queued."""

from dataclasses import replace
from pathlib import Path
from typing import Any

from starlette.datastructures import UploadFile

from tts2face.picture.options import Picture
from tts2face.request import Request
from tts2face.serving.service.client_names import Adjustments
from tts2face.serving.service.clip_options import ClipRequest, divide_options
from tts2face.serving.service.errors import RefusedError
from tts2face.serving.service.job_kinds.order import FormPart, JobKind, JobOrder, refuse_second
from tts2face.serving.work.clip_job import BACKGROUND, FILES


async def add_background(order: JobOrder, part: str, file: UploadFile, number: int) -> None:
    """Check and note a background picture."""
    refuse_second(part, number)
    order.upload.files[BACKGROUND] = await order.upload.folder.picture(part, file)


async def add_clip_file(order: JobOrder, part: str, file: UploadFile, number: int) -> None:
    """Check and note the recording or the timeline of a clip."""
    refuse_second(part, number)
    folder = order.upload.folder
    made = await folder.sound(part, file) if FILES[part].endswith(".wav") else await folder.text(part, file, ".json")
    order.upload.files[FILES[part]] = made


async def prepare_clip(order: JobOrder) -> dict[str, Any]:
    """JSON of a job of kind ``clip``."""
    given: dict[str, Any] = order.options.model_dump(exclude_none=True, exclude_defaults=True)
    format = given.pop("format", ClipRequest.model_fields["format"].default)
    fields = await divide_options(order.state, order.key, given)
    order.state.results.check_length(given.get("text", ""))
    has_audio = FILES["audio"] in order.upload.files
    if not (given.get("text", "").strip() or has_audio or "idle" in given or "listen" in given):
        raise RefusedError(400, "invalid_request", "there is nothing to say; give text, audio, idle or listen")
    sounds = {name: Path(file) for name, file in FILES.items() if name != "timeline" and file in order.upload.files}
    Request(**fields.request | sounds)
    Picture(**fields.picture)
    adjustments = Adjustments()
    await adjustments.note_words(order.state, fields)
    order.upload.folder.notes.extend(adjustments.made)
    work = order.state.results.work(models=fields.models, request=fields.request, picture=fields.picture, format=format)
    if has_audio and "spoken_mark" not in fields.request:  # a recording lies beside the request
        work = replace(work, request={name: given for name, given in work.request.items() if name != "spoken_mark"})
    return work.as_json()


CLIP_KIND = JobKind(
    "speak",
    ClipRequest,
    {
        "audio": FormPart("Speech in place of a voice.", add_clip_file),
        "background": FormPart("Picture behind the face.", add_background),
        "partner": FormPart("Sound that the face listens to.", add_clip_file),
        "timeline": FormPart("Timeline of gestures, JSON.", add_clip_file),
    },
    prepare_clip,
)
