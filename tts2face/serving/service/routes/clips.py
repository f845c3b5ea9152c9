"""Clips with all options of a request and of its picture."""

import asyncio
from contextlib import AbstractAsyncContextManager, AsyncExitStack
from typing import Any

from fastapi import APIRouter
from fastapi import Request as HttpRequest
from fastapi.exceptions import RequestValidationError
from fastapi.responses import StreamingResponse
from pydantic import ValidationError
from starlette.datastructures import FormData

from lexicon.g2p import DEFAULT_LANGUAGE
from tts2face.picture.streamed_movie import MOVIE_KINDS
from tts2face.serving.service.client_names import Adjustments
from tts2face.serving.service.clip_options import ClipRequest, divide_options
from tts2face.serving.service.errors import RefusedError
from tts2face.serving.service.results import stream_work
from tts2face.serving.service.state import service_state
from tts2face.serving.service.uploads import MAX_TEXT_BYTES, UploadFolder, upload_folder
from tts2face.session.encoded_stream import media_types
from tts2face.session.named_models import Models
from tts2face.source_options import AUTO

router = APIRouter(prefix="/v1", tags=["clips"])
FILES = ("audio", "background", "partner", "timeline")
SOUNDS = ("audio", "partner")
MULTIPART = {
    "description": "Options as JSON; or a form whose part `request` holds them, with files.",
    "required": True,
    "content": {
        "application/json": {"schema": ClipRequest.model_json_schema()},
        "multipart/form-data": {
            "schema": {
                "type": "object",
                "properties": {
                    "request": {
                        "type": "string",
                        "description": "The options as JSON.",
                        "examples": ['{"text": "Hello there."}'],
                    },
                    "audio": {"type": "string", "format": "binary", "description": "Speech in place of a voice."},
                    "background": {"type": "string", "format": "binary", "description": "Picture behind the face."},
                    "partner": {"type": "string", "format": "binary", "description": "Sound that the face listens to."},
                    "timeline": {"type": "string", "format": "binary", "description": "Timeline of gestures, JSON."},
                },
            }
        },
    },
}


@router.post(
    "/clips", response_class=StreamingResponse, summary="Make a clip", openapi_extra={"requestBody": MULTIPART}
)
async def make_clip(request: HttpRequest) -> StreamingResponse:
    """The clip of a text as fragmented MP4, WebM, sound, or lines of curves, sent while it is made."""
    if not request.headers.get("content-type", "").startswith("multipart/form-data"):
        return await _answer(request, _parse(await request.body()), {}, Adjustments())
    async with AsyncExitStack() as stack:
        form = await stack.enter_async_context(request.form(max_files=len(FILES), max_fields=4))
        folder = await stack.enter_async_context(_folder(request))
        clip, files = await _read_form(form, folder)
        adjustments = Adjustments()
        adjustments.note_sounds(folder.notes)
        # the files are read until the clip is complete
        return await _answer(request, clip, files, adjustments, stack.pop_all())


def _folder(request: HttpRequest) -> "AbstractAsyncContextManager[UploadFolder]":
    state = service_state(request)
    return upload_folder(state.settings, state.decoders, request.state.key.name)


def _parse(body: bytes | str) -> ClipRequest:
    try:
        return ClipRequest.model_validate_json(body)
    except ValidationError as wrong:
        # as FastAPI raises it of a body that it reads itself
        raise RequestValidationError(wrong.errors()) from wrong


async def _read_form(form: FormData, folder: UploadFolder) -> tuple[ClipRequest, dict[str, str]]:
    """Options of a form, and the paths of its files after decoding."""
    unknown = set(form) - {"request", *FILES}
    if unknown:
        raise RefusedError(422, "invalid_request", f"there is no part {min(unknown)[:40]!r}; send {', '.join(FILES)}")
    options = form.get("request", "{}")
    files: dict[str, str] = {}
    for name in FILES:
        upload = form.get(name)
        if isinstance(upload, str):
            raise RefusedError(422, "invalid_request", f"{name} must be a file with a file name")
        if upload is None:
            continue
        if name in SOUNDS:
            files[name] = str(await folder.sound(name, upload))
        elif name == "background":
            files[name] = str(await folder.picture(name, upload))
        else:
            files[name] = str(await folder.text(name, upload, ".json"))
    return _parse(options if isinstance(options, str) else await options.read(MAX_TEXT_BYTES)), files


async def _answer(
    request: HttpRequest,
    clip: ClipRequest,
    files: dict[str, str],
    adjustments: Adjustments,
    resources: AsyncExitStack | None = None,
) -> StreamingResponse:
    given: dict[str, Any] = clip.model_dump(exclude_none=True, exclude_defaults=True)
    format = given.pop("format", "mp4")
    state = service_state(request)
    state.results.check_length(given.get("text", ""))
    fields = await divide_options(state, request.state.key, given)
    await adjustments.note_words(state, fields)
    picture = fields.picture | {name: files[name] for name in ("background",) if name in files}
    spoken = fields.request | {name: files[name] for name in (*SOUNDS, "timeline") if name in files}
    keeps_pace = format in MOVIE_KINDS and not clip.model_fields_set & {"quality", "supersampling"}
    work = state.results.work(
        models=fields.models, request=spoken, picture=picture, format=format, keeps_pace=keeps_pace
    )
    if given.get("text") and given.get("voice") in (None, AUTO):
        await asyncio.to_thread(adjustments.note_fitted, Models(**work.models), given.get("language", DEFAULT_LANGUAGE))
    return adjustments.on(await stream_work(request, work, media_types()[format], resources=resources))
