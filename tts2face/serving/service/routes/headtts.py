"""The protocol of HeadTTS (npm @met4citizen/headtts 1.3), which TalkingHead avatars use: REST and WebSocket."""

import asyncio
import base64
import datetime
import re
from collections.abc import Callable, Sequence
from typing import Annotated, Any, Literal
from xml.sax.saxutils import escape, quoteattr

from fastapi import APIRouter, WebSocket, WebSocketDisconnect
from fastapi import Request as HttpRequest
from fastapi.responses import JSONResponse, PlainTextResponse
from pydantic import BaseModel, ConfigDict, Field

from tts2face.interchange.exports.labels import Label
from tts2face.picture.sound_stream import PCM_RATE
from tts2face.serving.service.client_names import Adjustments, choose_voice, limited_rate
from tts2face.serving.service.clip_options import OptionValues, described, resolve_texts
from tts2face.serving.service.errors import ErrorBody, RefusedError
from tts2face.serving.service.live_text import REFUSED_S, parse_message
from tts2face.serving.service.results import timed_speech
from tts2face.serving.service.state import service_state
from tts2face.storage.marks import UNKNOWN, sound_mark
from tts2face.storage.wave_files import wave_head

router = APIRouter(tags=["headtts"])

MAX_CHARACTERS = 500  # of a text, as in HeadTTS
DELTA_START_MS, DELTA_END_MS = -10, 10  # by which HeadTTS widens words and visemes
SILENT_VISEME = "sil"


class HeadTtsRequest(BaseModel):
    """A text, or items, and how they are spoken."""

    model_config = ConfigDict(extra="ignore", strict=True)

    input: Annotated[
        str | list[str | dict[str, Any]],
        Field(
            description="Text, or items of type text, speech, phonetic, characters, number, date, time, break.",
            examples=["Hello there."],
        ),
    ]
    voice: Annotated[
        str, Field(description="A voice of GET /v1/voices; for one of Kokoro, the nearest.", examples=["af_bella"])
    ] = "af_bella"
    language: Annotated[str, described("language")] = "en-us"
    speed: Annotated[
        float, Field(ge=0.25, le=4.0, description="Speaking rate; limited to 0.5 to 2.", examples=[1.0])
    ] = 1.0
    dictionary: Annotated[
        str | None, described("dictionary", "A dictionary of GET /v1/dictionaries; not part of HeadTTS.")
    ] = None
    audioEncoding: Annotated[Literal["wav", "pcm"], Field(description="Sound.")] = "wav"  # noqa: N815


@router.post("/v1/hello", response_class=PlainTextResponse, summary="Whether this is a HeadTTS server")
def hello() -> str:
    """The answer that HeadTTS clients expect."""
    return "HeadTTS v1.3 (tts2face)"


class HeadTtsError(BaseModel):
    """An error as HeadTTS reports it."""

    error: Annotated[
        str,
        Field(
            description="What is wrong, which value, what to do.",
            examples=["there is no voice 'anna'; GET /v1/voices lists them"],
        ),
    ]


class HeadTtsAudio(BaseModel):
    """Sound with its words and visemes; times in milliseconds."""

    audio: Annotated[
        str, Field(description="Base64 of a .wav file or of 16-bit samples.", examples=["UklGRiQAAABXQVZF"])
    ]
    audioEncoding: Annotated[str, Field(description="wav or pcm.", examples=["wav"])]  # noqa: N815
    words: Annotated[
        list[str],
        Field(description="Words, each but the last with a space behind it.", examples=[["Hello ", "there."]]),
    ]
    wtimes: Annotated[list[int], Field(description="Start of each word.", examples=[[100, 480]])]
    wdurations: Annotated[list[int], Field(description="Duration of each word.", examples=[[380, 350]])]
    visemes: Annotated[list[str], Field(description="Oculus visemes.", examples=[["E", "nn", "O"]])]
    vtimes: Annotated[list[int], Field(description="Start of each viseme.", examples=[[160, 230, 290]])]
    vdurations: Annotated[list[int], Field(description="Duration of each viseme.", examples=[[70, 60, 190]])]
    phonemes: Annotated[list[str], Field(description="Phone of each viseme.", examples=[["ə", "l", "oʊ"]])]


OWN_ERRORS: dict[int | str, dict[str, Any]] = {
    status: {"model": HeadTtsError | ErrorBody} for status in (400, 413, 429, 503)
}


@router.post(
    "/v1/synthesize", summary="Speak a text with words and visemes", response_model=HeadTtsAudio, responses=OWN_ERRORS
)
async def synthesize(request: HttpRequest, body: HeadTtsRequest) -> JSONResponse:
    """Sound as base64, words and Oculus visemes with times in milliseconds."""
    adjustments = Adjustments()
    try:
        content, sound = await _speak(request, body, adjustments)
    except RefusedError as refused:
        # HeadTTS' own form of an error
        return JSONResponse({"error": refused.message}, refused.status, refused.headers)
    return adjustments.on(JSONResponse(content | {"audio": base64.b64encode(sound).decode()}))


@router.websocket("/")
@router.websocket("/v1/headtts")
async def socket(connection: WebSocket) -> None:
    """Messages ``setup`` and ``synthesize``, one after another; answers ``audio`` and its sound, or ``error``."""
    await connection.accept()
    setup: dict[str, Any] = {}
    try:
        while True:
            try:
                message = parse_message(await connection.receive_text())
            except RefusedError as refused:
                await _send_error(connection, None, refused.message)
                continue
            # HeadTTS ignores what it does not know
            if not isinstance(message, dict):
                continue
            if message.get("type") == "setup" and isinstance(message.get("data"), dict):
                setup |= message["data"]
            elif message.get("type") == "synthesize":
                await _answer(connection, setup, message)
    except (WebSocketDisconnect, KeyError):  # KeyError: a binary message
        return


async def _send_error(connection: WebSocket, reference: Any, reason: str) -> None:
    await connection.send_json({"type": "error", "ref": reference, "data": {"error": reason}})
    await asyncio.sleep(REFUSED_S)


async def _answer(connection: WebSocket, setup: dict[str, Any], message: dict[str, Any]) -> None:
    """Answer one ``synthesize``, which counts as a request."""
    reference = message.get("id")
    try:
        service_state(connection).permissions.count(connection.state.key)
        body = HeadTtsRequest(**(setup | (message.get("data") or {})))
        content, sound = await _speak(connection, body, Adjustments())
    except (RefusedError, ValueError, TypeError) as error:
        reason = error.message if isinstance(error, RefusedError) else "the request is invalid: " + str(error)[:200]
        await _send_error(connection, reference, reason)
        return
    await connection.send_json({"type": "audio", "ref": reference, "data": content})
    await connection.send_bytes(sound)


async def _speak(
    request: HttpRequest | WebSocket, body: HeadTtsRequest, adjustments: Adjustments
) -> tuple[dict[str, Any], bytes]:
    """Fields of an audio message, and the sound."""
    items = body.input if isinstance(body.input, list) else [body.input]
    text, subtitles = items_to_ssml(items)
    fields: dict[str, Any] = {
        "text": text, "language": body.language, "rate": limited_rate(body.speed, adjustments),
        "gestures": "none", "dictionary": body.dictionary,
    }  # fmt: skip
    fields["voice"], _ = await asyncio.to_thread(choose_voice, body.voice, body.language, text, adjustments)
    state = service_state(request)
    await adjustments.note_words(state, OptionValues({}, fields, {}))
    fields = await resolve_texts(state.library, request.state.key, fields)
    events, pcm = await timed_speech(request, state.results.work(kind="speech", request=fields))
    sound = pcm if body.audioEncoding == "pcm" else wave_head(PCM_RATE, len(pcm), sound_mark(UNKNOWN)) + pcm
    return audio_fields(events, subtitles) | {"audioEncoding": body.audioEncoding}, sound


def items_to_ssml(items: Sequence[str | dict[str, Any]]) -> tuple[str, dict[str, str]]:
    """SSML of input items, and the subtitles of the items that have any, by the names of their marks."""
    parts: list[str] = []
    subtitles: dict[str, str] = {}
    for number, item in enumerate(items):
        name = f"i{number}"
        if isinstance(item, str):
            parts.append(f"<mark name={quoteattr(name)}/>{escape(item)}")
            continue
        value = str(item.get("value", ""))
        make = ITEMS.get(str(item.get("type", "text")))
        if make is None:
            raise RefusedError(400, "invalid_request", f"there is no item type {str(item.get('type'))[:40]!r}")
        # letters of phones are not shown to readers
        if item.get("subtitles") or item.get("type") == "phonetic":  # whose letters are no words
            subtitles[name] = str(item.get("subtitles") or "")
        parts.append(f"<mark name={quoteattr(name)}/>{make(value)} ")
    text = "".join(parts)
    if sum(len(str(item if isinstance(item, str) else item.get("value", ""))) for item in items) > MAX_CHARACTERS:
        raise RefusedError(400, "invalid_request", f"the text has more than {MAX_CHARACTERS} characters; divide it")
    return f"<speak>{text}</speak>", subtitles


def _phonetic(value: str) -> str:
    """A word by letters of the misaki alphabet, as IPA."""
    from lexicon.misaki import PHONE_OF_LETTER

    ipa = "".join(PHONE_OF_LETTER.get(letter, letter if letter in "ˈˌ " else "") for letter in value)
    return f"<phoneme alphabet='ipa' ph={quoteattr(ipa.strip())}>word</phoneme>"


def _moment(value: str) -> datetime.datetime:
    try:
        return datetime.datetime.fromtimestamp(float(value) / 1000, datetime.UTC)
    except (ValueError, OverflowError, OSError) as wrong:
        raise RefusedError(400, "invalid_request", f"{value[:40]!r} are no milliseconds since 1970") from wrong


def _break(value: str) -> str:
    if not re.fullmatch(r"\d{1,5}(\.\d+)?", value):
        raise RefusedError(400, "invalid_request", f"a break of {value[:40]!r} is no number of milliseconds")
    return f"<break time='{float(value):g}ms'/>"


ITEMS: dict[str, Callable[[str], str]] = {
    "text": escape,
    "speech": escape,
    "phonetic": _phonetic,
    "characters": lambda value: f"<say-as interpret-as='characters'>{escape(value)}</say-as>",
    "number": escape,
    "date": lambda value: f"{_moment(value):%B %-d, %Y}",
    "time": lambda value: f"{_moment(value):%-I:%M %p}",
    "break": _break,
}


def audio_fields(events: Sequence[dict[str, Any]], subtitles: dict[str, str]) -> dict[str, Any]:
    """Words and visemes of HeadTTS in milliseconds; the words of an item with subtitles are replaced by them."""
    marks = [(name, seconds) for event in events for name, seconds in event["marks"]]
    words: list[Label] = []
    spoken = [Label(*word) for event in events for word in event["words"]]
    ends = [seconds for _, seconds in marks[1:]] + [float("inf")]
    for (name, start), end in zip(marks, ends, strict=True):
        # times are rounded to microseconds
        own = [word for word in spoken if start - 1e-6 <= word.start < end - 1e-6]
        if name in subtitles and own:
            own = [Label(subtitles[name].strip(), own[0].start, own[-1].end)]
        words += own
    visemes = [viseme for event in events for viseme in event["visemes"] if viseme[0] != SILENT_VISEME]
    texts = [f"{word.text} " for word in words[:-1]] + [word.text for word in words[-1:]]
    return {
        "words": texts,
        **_times("w", [(word.start, word.end) for word in words]),
        "visemes": [name for name, *_ in visemes],
        **_times("v", [(start, end) for _, start, end, _ in visemes]),
        "phonemes": [phone for *_, phone in visemes],
    }


def _times(prefix: str, spans: Sequence[tuple[float, float]]) -> dict[str, list[int]]:
    starts = [round(1000 * start) + DELTA_START_MS for start, _ in spans]
    ends = [round(1000 * end) + DELTA_END_MS for _, end in spans]
    return {
        f"{prefix}times": starts,
        f"{prefix}durations": [end - start for start, end in zip(starts, ends, strict=True)],
    }
