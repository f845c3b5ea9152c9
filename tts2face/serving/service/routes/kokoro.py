"""Routes of Kokoro-FastAPI beyond OpenAI's interface: captioned speech, phones, download links, combined voices."""

import asyncio
import base64
from collections.abc import AsyncIterator
from typing import Annotated, Any

from fastapi import APIRouter, Body, Path
from fastapi import Request as HttpRequest
from fastapi.responses import JSONResponse, Response, StreamingResponse
from pydantic import BaseModel, ConfigDict, Field

from lexicon.languages import language_code
from tts2face.processes.message import Message
from tts2face.serving.service.client_names import KOKORO_LANGUAGES, Adjustments, choose_voice, combined_name
from tts2face.serving.service.clip_options import described
from tts2face.serving.service.kokoro_text import phones_text, with_marks
from tts2face.serving.service.results import json_line, stream_work, timed_speech
from tts2face.serving.service.routes.openai import SoundFormat, SpokenText, TimedJson, speech_work, timed, with_download
from tts2face.serving.service.state import service_state
from tts2face.session.encoded_stream import media_types

router = APIRouter(tags=["kokoro"])
FileName = Annotated[str, Path(description="Name of the file.", examples=["0123456789abcdef01234567.mp3"])]


class CaptionedSpeech(SpokenText):
    """A text to speak with the times of its words."""

    model: Annotated[str, Field(description="A talker; any other name is the default talker.", examples=["kokoro"])] = (
        "kokoro"
    )
    voice: Annotated[
        str, Field(description="A voice of GET /v1/voices; for one of Kokoro, the nearest.", examples=["af_heart"])
    ] = "af_heart"
    response_format: Annotated[SoundFormat, Field(description="Sound.")] = "mp3"
    stream: Annotated[
        bool, Field(description="A JSON object on a line for each part, else one object.", examples=[True])
    ] = True
    return_timestamps: Annotated[bool, Field(description="With times of words.", examples=[True])] = True


def _timestamps(words: list[dict[str, Any]]) -> list[dict[str, Any]]:
    return [{"word": word["word"], "start_time": word["start"], "end_time": word["end"]} for word in words]


class _Captioned(TimedJson):
    """One object, whose list of times has Kokoro-FastAPI's name."""

    def listed(self, lists: dict[str, list[Any]]) -> dict[str, list[Any]]:
        return {"timestamps": _timestamps(lists.get("words", []))}


class _CaptionedLines:
    """An object on a line for each part of the sound, with the words that begin in it."""

    def __init__(self, format: str, names: tuple[str, ...]) -> None:
        self._format, self._names = format, names

    async def __call__(self, messages: AsyncIterator[Message]) -> AsyncIterator[bytes]:
        """The lines."""
        due: list[dict[str, Any]] = []
        async for message in messages:
            if "event" in message.content and self._names:
                due += timed(message.content["event"], self._names)["words"]
            if message.payload:
                part = {
                    "audio": base64.b64encode(message.payload).decode(), "audio_format": media_types()[self._format],
                    "timestamps": _timestamps(due),
                }  # fmt: skip
                yield json_line(part)
                due = []

    def failed(self, content: dict[str, Any]) -> bytes:
        """A last line."""
        return json_line(content)


@router.post(
    "/dev/captioned_speech", response_class=StreamingResponse, summary="Speak a text with the times of its words"
)
async def captioned_speech(request: HttpRequest, speech: CaptionedSpeech) -> Response:
    """Sound in base64 with the times of its words in seconds."""
    adjustments, format = Adjustments(), speech.response_format
    names = ("word",) if speech.return_timestamps else ()
    work = await speech_work(
        request, speech, {}, adjustments, kind="speech", format=format, is_complete=not speech.stream
    )
    convert = _CaptionedLines(format, names) if speech.stream else _Captioned(format, names)
    answer = await stream_work(request, work, "application/json", convert=convert)
    return adjustments.on(with_download(request, speech, work, answer))


class PhonesRequest(BaseModel):
    """A text and its language."""

    model_config = ConfigDict(extra="ignore", strict=True)

    text: Annotated[str, described("text", "Text, with marks or SSML.", min_length=1)]
    language: Annotated[str, Field(description="A language, or Kokoro's letter of one.", examples=["a"])] = "a"


class Phones(BaseModel):
    """Phones of a text."""

    phonemes: Annotated[
        str, Field(description="Words in IPA, with stress marks and punctuation.", examples=["həˈloʊ."])
    ]
    tokens: Annotated[list[int], Field(description="Empty: the service has no tokens of Kokoro.", examples=[[]])]


@router.post("/dev/phonemize", summary="Phones of a text", response_model=Phones)
async def phonemize(request: HttpRequest, asked: PhonesRequest) -> dict[str, Any]:
    """The phones that a voice of the language speaks."""
    language = language_code(KOKORO_LANGUAGES.get(asked.language, asked.language))
    state = service_state(request)
    state.results.check_length(asked.text)
    work = state.results.work(kind="phones", request={"text": with_marks(asked.text), "language": language})
    (event,), _ = await timed_speech(request, work)
    return {"phonemes": " ".join(event["words"]), "tokens": []}


class PhonesToSpeak(BaseModel):
    """Phones and the voice that speaks them."""

    model_config = ConfigDict(extra="ignore", strict=True)

    phonemes: Annotated[
        str,
        described(
            "text", "Words in IPA or in Kokoro's alphabet, with punctuation.", min_length=1, examples=["həlˈO wˈɜɹld."]
        ),
    ]
    voice: Annotated[
        str, Field(description="A voice of GET /v1/voices; for one of Kokoro, the nearest.", examples=["af_heart"])
    ] = "af_heart"


@router.post("/dev/generate_from_phonemes", response_class=StreamingResponse, summary="Speak phones")
async def generate_from_phonemes(request: HttpRequest, asked: PhonesToSpeak) -> Response:
    """Sound of phones as a complete .wav file."""
    adjustments, state = Adjustments(), service_state(request)
    state.results.check_length(asked.phonemes)
    voice, language = await asyncio.to_thread(choose_voice, asked.voice, None, "", adjustments)
    spoken = {"text": phones_text(asked.phonemes), "voice": voice, "language": language}
    work = state.results.work(request=spoken, format="wav", is_complete=True)
    return adjustments.on(await stream_work(request, work, media_types()["wav"]))


@router.get("/v1/download/{name}", response_class=StreamingResponse, summary="Complete file of a download link")
@router.get("/download/{name}", response_class=StreamingResponse, include_in_schema=False)
async def download(request: HttpRequest, name: FileName) -> Response:
    """The file of a link that `return_download_link` has given to the same key, made when it is asked for."""
    work = service_state(request).downloads.find(request.state.key.name, name)
    answer = await stream_work(request, work, media_types()[work.format])
    answer.headers["Content-Disposition"] = f'attachment; filename="{name}"'
    return answer


class CombinedVoice(BaseModel):
    """A combination of voices, which has no file of its own."""

    voice: Annotated[
        str, Field(description="Name of the combination, a `voice` of all requests.", examples=["af_bella+af_sky"])
    ]
    speaks: Annotated[str, Field(description="The installed voice that stands for it.", examples=["heart"])]
    language: Annotated[str, Field(description="Its language.", examples=["en-us"])]


@router.post("/v1/audio/voices/combine", summary="Combine voices", response_model=CombinedVoice)
async def combine_voices(
    voices: Annotated[
        str | list[str],
        Body(description="Names with + between them, or a list of names.", examples=["af_bella(2)+af_sky(1)"]),
    ],
) -> JSONResponse:
    """Name of a combination of Kokoro's voices, and what speaks for it: the voice nearest to the one of most weight."""
    adjustments, name = Adjustments(), combined_name(voices)
    speaks, language = await asyncio.to_thread(choose_voice, name, None, "", adjustments)
    answer = JSONResponse({"voice": name, "speaks": speaks, "language": language})
    answer.headers["Content-Disposition"] = f'attachment; filename="{name}.json"'
    return adjustments.on(answer)
