"""OpenAI's speech endpoint, with movies and curves as further formats."""

import base64
import json
from collections.abc import AsyncIterator
from typing import Annotated, Any, Literal

from fastapi import APIRouter
from fastapi import Request as HttpRequest
from fastapi.responses import StreamingResponse
from pydantic import BaseModel, ConfigDict, Field

from tts2face.picture.sound_stream import SOUND_KINDS
from tts2face.processes.message import Message
from tts2face.serving.service.library import OPENAI_MODELS, shipped_names
from tts2face.serving.service.options import divide_options
from tts2face.serving.service.request_fields import described
from tts2face.serving.service.routes.clips import data_bytes, service_state, stream_work
from tts2face.serving.work.resource_check import TALKER
from tts2face.session import catalogue
from tts2face.session.outputs import media_types

router = APIRouter(prefix="/v1", tags=["speech"])

OPENAI_VOICES = (
    "alloy", "ash", "ballad", "cedar", "coral", "echo", "fable", "marin", "nova", "onyx", "sage", "shimmer", "verse",
)  # fmt: skip
SAME_NAMES = {"language", "face", "palette", "dictionary"}  # of fields and of options of clips
FORMATS = {"jsonl": "curves"}  # further names of formats
Format = Literal[
    "mp3", "opus", "aac", "flac", "wav", "pcm", "weba", "mp4", "webm", "glb", "jsonl", "curves", "oculus", "azure"
]


class Speech(BaseModel):
    """A text to speak."""

    model_config = ConfigDict(extra="ignore", strict=True)

    input: Annotated[str, described("text", "Text, with marks or SSML.", min_length=1)]
    model: Annotated[str, Field(description="A talker, or a model name of OpenAI for the default talker.")] = "tts-1"
    voice: Annotated[
        str | dict[str, Any], Field(description="A voice of GET /v1/voices, or one of OpenAI's for the default voice.")
    ] = "alloy"
    response_format: Annotated[
        Format,
        Field(
            description="Sound; mp4, webm: the clip; glb: animated mesh; jsonl: ARKit curves; oculus, azure: visemes."
        ),
    ] = "mp3"
    speed: Annotated[float, described("rate", "Factor of the speaking rate.")] = 1.0
    stream_format: Annotated[
        Literal["audio", "sse"], Field(description="Bytes, or server-sent events with base64 (sound only).")
    ] = "audio"
    instructions: Annotated[str | None, Field(description="Accepted and not used.", examples=["Speak calmly."])] = None
    language: Annotated[str, described("language", "Language of the text; not part of OpenAI's API.")] = "en-us"
    face: Annotated[
        str | None, described("face", "A face of GET /v1/faces; not part of OpenAI's API.", examples=["head"])
    ] = None
    palette: Annotated[str | None, described("palette", "A palette of GET /v1/palettes; not part of it.")] = None
    dictionary: Annotated[
        str | None, described("dictionary", "A dictionary of GET /v1/dictionaries; not part of it.")
    ] = None


@router.post("/audio/speech", response_class=StreamingResponse, summary="Speak a text")
async def speak(request: HttpRequest, speech: Speech) -> StreamingResponse:
    """Sound of a text, or its clip, curves or visemes, sent while it is made."""
    voice = speech.voice if isinstance(speech.voice, str) else str(speech.voice.get("id", ""))
    given = speech.model_dump(include=SAME_NAMES, exclude_none=True) | {"text": speech.input, "rate": speech.speed}
    if voice not in OPENAI_VOICES:
        given["voice"] = voice
    if speech.model not in OPENAI_MODELS:
        given["talker"] = speech.model
    format = FORMATS.get(speech.response_format, speech.response_format)
    state = service_state(request)
    fields = await divide_options(state, request.state.key, given)
    work = state.work(models=fields.models, request=fields.request, format=format)
    if speech.stream_format == "sse" and format in SOUND_KINDS:
        return await stream_work(request, work, "text/event-stream", convert=_sse)
    return await stream_work(request, work, media_types()[format])


async def _sse(messages: AsyncIterator[Message]) -> AsyncIterator[bytes]:
    """OpenAI's events of sound."""
    async for chunk in data_bytes(messages):
        yield _event({"type": "speech.audio.delta", "audio": base64.b64encode(chunk).decode()})
    yield _event({"type": "speech.audio.done", "usage": {"input_tokens": 0, "output_tokens": 0, "total_tokens": 0}})


def _event(content: dict[str, Any]) -> bytes:
    return f"data: {json.dumps(content, separators=(',', ':'))}\n\n".encode()


@router.get("/models", summary="Talkers as models")
def models(request: HttpRequest) -> dict[str, Any]:
    """The talkers, those of the key too, and the names of OpenAI's models."""
    own = [one.name for one in service_state(request).library.uploads(TALKER, request.state.key.name)]
    names = [*shipped_names(TALKER), *own, *OPENAI_MODELS]
    return {
        "object": "list",
        "data": [{"id": name, "object": "model", "created": 0, "owned_by": "tts2face"} for name in names],
    }


@router.get("/voices", summary="Voices")
def voices() -> dict[str, Any]:
    """The voices with their languages."""
    return {"voices": [
        {
            "id": voice.name,
            "name": voice.name,
            "description": f"{voice.summary}, {voice.sex}; licence {voice.licence}",
            "languages": list(voice.languages),
        }
        for voice in catalogue.voices()
    ]}  # fmt: skip
