"""Clips with all options of a request and of its picture.

Streams of results as HTTP answers.
"""

import json
from collections.abc import AsyncIterator
from contextlib import AbstractAsyncContextManager, AsyncExitStack, aclosing
from dataclasses import dataclass
from typing import Any, Protocol

from fastapi import APIRouter, WebSocket
from fastapi import Request as HttpRequest
from fastapi.exceptions import RequestValidationError
from fastapi.responses import StreamingResponse
from pydantic import ValidationError
from starlette.datastructures import FormData

from lexicon.g2p import DEFAULT_LANGUAGE
from tts2face.picture.movie import MOVIE_KINDS
from tts2face.processes.message import Message
from tts2face.serving.service.client_names import Adjustments
from tts2face.serving.service.errors import RefusedError
from tts2face.serving.service.exchange import ERROR_FIELD
from tts2face.serving.service.messages import Work
from tts2face.serving.service.options import ClipRequest, divide_options
from tts2face.serving.service.state import ServiceState
from tts2face.serving.service.uploads import MAX_TEXT_BYTES, UploadFolder, upload_folder
from tts2face.session.encoded_stream import LINES, media_types


def service_state(request: HttpRequest | WebSocket) -> ServiceState:
    """State of the service that received a request."""
    state: ServiceState = request.app.state.service
    return state


async def stream_work(
    request: HttpRequest,
    work: Work,
    media_type: str,
    *,
    convert: "Converter | None" = None,
    resources: AsyncExitStack | None = None,
) -> StreamingResponse:
    """Answer that sends a result while it is made.

    It begins with the first bytes, so that errors before them have their own status. A client that leaves cancels it.

    Parameters
    ----------
    convert
        Converts messages to bytes, and an error to what ends them; None: the bytes of all data.
    resources
        Closed when the answer is complete or has failed.
    """
    state, stack = service_state(request), resources or AsyncExitStack()
    messages = state.messages(work, request.state.key)
    convert = convert or DataBytes(media_type)
    chunks = convert(messages)
    try:
        first = await anext(chunks)
    except StopAsyncIteration:
        first = b""
    except BaseException:
        await messages.aclose()  # type: ignore[attr-defined]
        await stack.aclose()
        raise

    async def body() -> AsyncIterator[bytes]:
        async with stack, aclosing(messages):  # type: ignore[type-var]
            yield first
            async for chunk in chunks:
                yield chunk

    request.state.exchange.ending = convert.failed
    headers = {} if convert.failed({}) else {"Trailer": ERROR_FIELD}
    return StreamingResponse(body(), media_type=media_type, headers=headers)


class Converter(Protocol):
    """Converts the messages of a result to the bytes of an answer."""

    def __call__(self, messages: AsyncIterator[Message]) -> AsyncIterator[bytes]:
        """The bytes, as they come."""
        ...

    def failed(self, content: dict[str, Any]) -> bytes:
        """What follows the bytes so far when the result ends with an error; empty: their form has no place for it."""
        ...


@dataclass(frozen=True, slots=True)
class DataBytes:
    """The bytes of the data of a result, as they are."""

    media_type: str

    async def __call__(self, messages: AsyncIterator[Message]) -> AsyncIterator[bytes]:
        """The bytes."""
        async for message in messages:
            if message.payload:
                yield message.payload

    def failed(self, content: dict[str, Any]) -> bytes:
        """A line, after lines of JSON."""
        return json_line(content) if self.media_type == LINES else b""


def error_event(content: dict[str, Any]) -> bytes:
    """Server-sent event with an error, the last one of a stream."""
    return b"event: error\ndata: " + json_line({"type": "error", **content}) + b"\n"


def json_line(content: Any) -> bytes:
    """Compact JSON on a line."""
    return json.dumps(content, ensure_ascii=False, separators=(",", ":")).encode() + b"\n"


async def timed_speech(request: HttpRequest | WebSocket, work: Work) -> tuple[list[dict[str, Any]], bytes]:
    """All events of a work of kind ``speech``, and its sound as 16-bit PCM."""
    events: list[dict[str, Any]] = []
    sound = bytearray()
    state = service_state(request)
    async with aclosing(state.messages(work, request.state.key)) as messages:  # type: ignore[type-var]
        async for message in messages:
            sound += message.payload
            if "event" in message.content:
                events.append(message.content["event"])
    return events, bytes(sound)


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
        return await _answer(request, _parse(await request.body()), {})
    async with AsyncExitStack() as stack:
        form = await stack.enter_async_context(request.form(max_files=len(FILES), max_fields=4))
        folder = await stack.enter_async_context(_folder(request))
        clip, files = await _read_form(form, folder)
        return await _answer(request, clip, files, stack.pop_all())  # the files are read until the clip is complete


def _folder(request: HttpRequest) -> "AbstractAsyncContextManager[UploadFolder]":
    state = service_state(request)
    return upload_folder(state.settings, state.decoders, request.state.key.name)


def _parse(body: bytes | str) -> ClipRequest:
    try:
        return ClipRequest.model_validate_json(body)
    except ValidationError as wrong:
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
    request: HttpRequest, clip: ClipRequest, files: dict[str, str], resources: AsyncExitStack | None = None
) -> StreamingResponse:
    given: dict[str, Any] = clip.model_dump(exclude_none=True, exclude_defaults=True)
    format = given.pop("format", "mp4")
    state, adjustments = service_state(request), Adjustments()
    await adjustments.note_words(state, given.get("text", ""), given.get("language", DEFAULT_LANGUAGE))
    fields = await divide_options(state, request.state.key, given)
    picture = fields.picture | {name: files[name] for name in ("background",) if name in files}
    spoken = fields.request | {name: files[name] for name in (*SOUNDS, "timeline") if name in files}
    keeps_pace = format in MOVIE_KINDS and not clip.model_fields_set & {"quality", "supersampling"}
    work = state.work(models=fields.models, request=spoken, picture=picture, format=format, keeps_pace=keeps_pace)
    return adjustments.on(await stream_work(request, work, media_types()[format], resources=resources))
