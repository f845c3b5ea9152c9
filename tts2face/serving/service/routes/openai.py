"""OpenAI's speech endpoint, with movies and curves as further formats, and times of words and phones."""

import base64
from collections.abc import AsyncIterator, Iterator, Mapping, Sequence
from types import MappingProxyType
from typing import Annotated, Any, Literal

from fastapi import APIRouter, Path, Query
from fastapi import Request as HttpRequest
from fastapi.responses import Response, StreamingResponse
from pydantic import BaseModel, ConfigDict, Field

from lexicon.marked_text import VOLUME_LIMITS
from tts2face.picture.sound_stream import SOUND_KINDS
from tts2face.picture.streamed_movie import MOVIE_KINDS
from tts2face.processes.message import Message
from tts2face.serving.service.client_names import (
    KOKORO_EXAMPLES,
    OPENAI_VOICES,
    Adjustments,
    Answer,
    is_client_model,
    spoken_fields,
)
from tts2face.serving.service.clip_options import described, divide_options
from tts2face.serving.service.errors import RefusedError
from tts2face.serving.service.library import CLIENT_MODELS, shipped_names
from tts2face.serving.service.messages import Work
from tts2face.serving.service.results import error_event, json_line, stream_work
from tts2face.serving.service.state import service_state
from tts2face.serving.work.resource_check import TALKER
from tts2face.session import catalogue
from tts2face.session.encoded_stream import media_types

router = APIRouter(prefix="/v1", tags=["speech"])

DOWNLOAD = "X-Download-Path"  # relative to /v1, as Kokoro-FastAPI has it
SAME_NAMES = {"face", "palette", "dictionary", "text_marks"}  # of fields and of options of clips
FORMATS = {"jsonl": "curves"}  # further names of formats
SoundFormat = Literal["mp3", "opus", "aac", "flac", "wav", "pcm", "weba"]
Format = Literal[
    "mp3", "opus", "aac", "flac", "wav", "pcm", "weba", "mp4", "webm", "glb", "jsonl", "curves", "oculus", "azure"
]
Markup = Literal["auto", "plain", "ssml", "llm"]  # as `tts2face.source_options.MARKUPS`
TimeName = Literal["word", "phone"]
LISTS: Mapping[str, str] = MappingProxyType({"word": "words", "phone": "phones"})  # in answers, by what has times


class SpokenText(BaseModel):
    """A text, and how it is spoken; names are those of OpenAI and Kokoro."""

    model_config = ConfigDict(extra="ignore", strict=True)

    input: Annotated[str, described("text", "Text, with marks or SSML.", min_length=1)]
    model: Annotated[str, Field(description="A talker; any other name is the default talker.", examples=["tts-1"])] = (
        "tts-1"
    )
    voice: Annotated[
        str | dict[str, Any],
        Field(
            description="A voice of GET /v1/voices; for one of OpenAI or Kokoro (af_bella+af_sky), the nearest.",
            examples=["alloy"],
        ),
    ] = "alloy"
    speed: Annotated[
        float, Field(ge=0.25, le=4.0, description="Speaking rate; limited to 0.5 to 2.", examples=[1.0])
    ] = 1.0
    language: Annotated[
        str | None,
        described(
            "language", "Language of the text; by default guessed from it; not part of OpenAI's API.", examples=["de"]
        ),
    ] = None
    lang_code: Annotated[
        str | None, Field(description="The same, also as Kokoro's letter (a, b, e, ...).", examples=["a"])
    ] = None
    volume_multiplier: Annotated[
        float | None,
        Field(ge=VOLUME_LIMITS[0], le=VOLUME_LIMITS[1], description="Factor of the loudness.", examples=[1.0]),
    ] = None
    markup: Annotated[Markup | None, described("markup")] = None
    voice_pitch: Annotated[float | None, described("voice_pitch")] = None
    voice_range: Annotated[float | None, described("voice_range")] = None
    return_download_link: Annotated[
        bool, Field(description="`X-Download-Path` of the answer names a complete file, below /v1.", examples=[False])
    ] = False
    download_format: Annotated[
        SoundFormat | None, Field(description="Format of this file; by default that of the answer.", examples=["flac"])
    ] = None


class Speech(SpokenText):
    """A text to speak."""

    response_format: Annotated[
        Format,
        Field(
            description="Sound; mp4, webm: the clip; glb: animated mesh; jsonl: ARKit curves; oculus, azure: visemes."
        ),
    ] = "mp3"
    stream_format: Annotated[
        Literal["audio", "sse"], Field(description="Bytes, or server-sent events with base64 (sound only).")
    ] = "audio"
    stream: Annotated[
        bool,
        Field(description="Sent while it is made; else a complete file, whose header has its length.", examples=[True]),
    ] = True
    timestamps: Annotated[
        list[TimeName] | None,
        Field(
            description="Times of words, phones: JSON with the sound, or an event before each sentence's sound.",
            examples=[["word"]],
        ),
    ] = None
    instructions: Annotated[str | None, Field(description="Accepted and not used.", examples=["Speak calmly."])] = None
    face: Annotated[
        str | None, described("face", "A face of GET /v1/faces; not part of OpenAI's API.", examples=["head"])
    ] = None
    palette: Annotated[str | None, described("palette", "A palette of GET /v1/palettes; not part of it.")] = None
    dictionary: Annotated[
        str | None, described("dictionary", "A dictionary of GET /v1/dictionaries; not part of it.")
    ] = None
    text_marks: Annotated[
        str | None, described("text_marks", "A table of marks of GET /v1/text_marks; not part of it.")
    ] = None


@router.post("/audio/speech", response_class=StreamingResponse, summary="Speak a text")
async def speak(request: HttpRequest, speech: Speech) -> Response:
    """Sound of a text, or its clip, curves or visemes, sent while it is made; with times, JSON or events."""
    format, names = FORMATS.get(speech.response_format, speech.response_format), tuple(speech.timestamps or ())
    if names and format not in SOUND_KINDS:
        raise RefusedError(
            400, "invalid_request", f"{format} has no timestamps; choose {', '.join(SOUND_KINDS)}, or leave them out"
        )
    adjustments, has_events = Adjustments(), speech.stream_format == "sse" and format in SOUND_KINDS
    is_complete = not has_events and (bool(names) or not speech.stream)
    work = await speech_work(
        request, speech, speech.model_dump(include=SAME_NAMES, exclude_none=True), adjustments,
        kind="speech" if names else "file", format=format, is_complete=is_complete,
        keeps_pace=format in MOVIE_KINDS and not is_complete,
    )  # fmt: skip
    if has_events:
        answer = await stream_work(request, work, "text/event-stream", convert=_Events(names))
    elif names:
        answer = await stream_work(request, work, "application/json", convert=TimedJson(format, names))
    else:
        answer = await stream_work(request, work, media_types()[format])
    return adjustments.on(with_download(request, speech, work, answer))


def with_download(request: HttpRequest, asked: SpokenText, work: Work, answer: Answer) -> Answer:
    """An answer with the path of a complete file of its work, if one is asked for."""
    if asked.return_download_link:
        name = service_state(request).downloads.add(
            request.state.key.name, work, asked.download_format or work.format
        )  # fmt: skip
        answer.headers[DOWNLOAD] = f"/download/{name}"
    return answer


async def speech_work(
    request: HttpRequest, asked: SpokenText, more: dict[str, Any], adjustments: Adjustments, **fields: Any
) -> Work:
    """Work that speaks a text; `more` are further options of a clip, `fields` those of the work."""
    state, key = service_state(request), request.state.key
    given = more | await spoken_fields(state, key, asked, adjustments)
    if asked.volume_multiplier is not None:
        given["volume"] = asked.volume_multiplier
    options = await divide_options(state, key, given)
    await adjustments.note_words(state, options)
    return state.results.work(models=options.models, request=options.request, **fields)


def timed(event: Mapping[str, Any], names: Sequence[str]) -> dict[str, list[dict[str, Any]]]:
    """Words and phones of an event of the task ``speech`` with their seconds, as OpenAI's transcriptions have them."""
    return {
        LISTS[name]: [
            {name: text, "start": round(start, 4), "end": round(end, 4)} for text, start, end in event[LISTS[name]]
        ]
        for name in names
    }


class TimedJson:
    """Converts the messages of a complete file to one JSON object: ``audio`` in base64, then the times of the names."""

    def __init__(self, format: str, names: Sequence[str]) -> None:
        self._format, self._names = format, names

    async def __call__(self, messages: AsyncIterator[Message]) -> AsyncIterator[bytes]:
        """Parts of the object, from the first bytes of the file on."""
        rest, lists = b"", {LISTS[name]: list[Any]() for name in self._names}
        opening = b'{"audio":"'
        async for message in messages:
            if "event" in message.content:
                for name, found in timed(message.content["event"], self._names).items():
                    lists[name] += found
            if message.payload:
                rest += message.payload
                # parts of base64 can be joined only there
                n_whole = len(rest) - len(rest) % 3  # three bytes are four letters
                yield opening + base64.b64encode(rest[:n_whole])
                opening, rest = b"", rest[n_whole:]
        end = {"audio_format": media_types()[self._format], **self.listed(lists)}
        yield opening + base64.b64encode(rest) + b'",' + json_line(end)[1:-1]

    def failed(self, content: dict[str, Any]) -> bytes:
        """The end of the object, whose sound is incomplete."""
        return b'",' + json_line(content)[1:-1]

    def listed(self, lists: dict[str, list[Any]]) -> dict[str, list[Any]]:
        """The lists of times as they stand in the object."""
        return lists


class _Events:
    """Converts messages to OpenAI's events of sound, with one of times before the sound of each sentence."""

    def __init__(self, names: Sequence[str]) -> None:
        self._names = names

    async def __call__(self, messages: AsyncIterator[Message]) -> AsyncIterator[bytes]:
        """The events."""
        async for message in messages:
            for content in self._contents(message):
                yield _event(content)
        usage = {"input_tokens": 0, "output_tokens": 0, "total_tokens": 0}
        yield _event({"type": "speech.audio.done", "usage": usage})

    def failed(self, content: dict[str, Any]) -> bytes:
        """An event ``error``."""
        return error_event(content)

    def _contents(self, message: Message) -> Iterator[dict[str, Any]]:
        if "event" in message.content:
            yield {"type": "speech.timestamps", **timed(message.content["event"], self._names)}
        if message.payload:
            yield {"type": "speech.audio.delta", "audio": base64.b64encode(message.payload).decode()}


def _event(content: dict[str, Any]) -> bytes:
    return b"data: " + json_line(content) + b"\n"


def _model(name: str) -> dict[str, Any]:
    return {"id": name, "object": "model", "created": 0, "owned_by": "tts2face"}


def _model_names(request: HttpRequest) -> list[str]:
    own = [upload.name for upload in service_state(request).library.uploads(TALKER, request.state.key.name)]
    return [*shipped_names(TALKER), *own, *CLIENT_MODELS]


@router.get("/models", summary="Talkers as models")
def models(request: HttpRequest) -> dict[str, Any]:
    """The talkers, those of the key too, and the names of models of OpenAI and Kokoro."""
    return {"object": "list", "data": [_model(name) for name in _model_names(request)]}


@router.get("/models/{name}", summary="A talker as a model")
def model(
    request: HttpRequest, name: Annotated[str, Path(description="Name of the model.", examples=["tts-1"])]
) -> dict[str, Any]:
    """A talker, or a model of OpenAI or Kokoro, also a dated one."""
    if not is_client_model(name) and name not in _model_names(request):
        raise RefusedError(404, "model_not_found", f"there is no model {name[:60]!r}; GET /v1/models lists them")
    return _model(name)


@router.get("/audio/models", summary="Talkers as models, for Open WebUI")
def audio_models(request: HttpRequest) -> dict[str, Any]:
    """The names of the models."""
    return {"models": [{"id": name, "name": name} for name in _model_names(request)]}


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


@router.get("/audio/voices", summary="Voices, for Open WebUI and clients of Kokoro-FastAPI")
def audio_voices(
    *, legacy: Annotated[bool, Query(description="Names only.", examples=[False])] = False
) -> dict[str, Any]:
    """The service's voices, and names of OpenAI and Kokoro that stand for them."""
    own = [voice.name for voice in catalogue.voices() if voice.is_installed and voice.languages]
    names = [*own, *OPENAI_VOICES, *KOKORO_EXAMPLES]
    return {"voices": names if legacy else [{"id": name, "name": name} for name in names]}
