"""Live streams for avatars: text or sound comes in, speech, phones and curves go out with their times."""

import asyncio
from collections.abc import AsyncIterator, Mapping
from contextlib import aclosing, suppress
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Annotated, Any, Literal

from fastapi import APIRouter, WebSocket, WebSocketDisconnect
from pydantic import Field, ValidationError

from lexicon.errors import InputError
from lexicon.spoken_mark import END, mark_words
from tts2face.processes.message import Message
from tts2face.serving.service.clip_options import (
    MODEL_FIELDS,
    PICTURE_FIELDS,
    StrictModel,
    check_voice,
    options_model,
    resolve_models,
    resolve_texts,
)
from tts2face.serving.service.errors import RefusedError
from tts2face.serving.service.keys import ApiKey
from tts2face.serving.service.live_text import REFUSED_S, SAMPLE_BYTES, SAMPLE_RATES, LiveText, Pace, parse_message
from tts2face.serving.service.messages import Work
from tts2face.serving.service.pool import InputQueue
from tts2face.serving.service.state import ServiceState
from tts2face.storage.marks import LIVE_NOTICE, MOTION_NOTICE, Mark, mark_fields

router = APIRouter(tags=["live"])

# of messages of a stream of text
TEXT_TYPES = frozenset({"text", "gesture", "style", "listen", "flush", "cancel", "interrupt", "end"})
AUDIO_TYPES = frozenset({"end"})  # of a stream of sound, besides the sound
MAX_BLOCK_BYTES = 1 << 16  # of sound in one message
MAX_BLOCKS = 16  # that wait for the task
Targets = Annotated[
    tuple[str, ...],
    Field(description="Targets of the operator that show the face, by name; curves are not sent then.", max_length=8),
]
INVALID = 1007  # WebSocket close code: a message is not what it should be


# Options that live text does not take, with the reason.
NOT_IN_LIVE_TEXT: Mapping[str, str] = MappingProxyType(
    {"audio": "live sound has options of its own", "audio_map": "there is no recording"}
    | dict.fromkeys(("text", "partner"), "it comes in parts")
    | {"spoken_mark": "a setting of the operator"}
    | dict.fromkeys(("idle", "listen", "timeline", "expression"), "the end of live text is not known")
    | dict.fromkeys(
        ("plain_delivery", "synthesis", "context", "exemplars", "articulation", "pitch"), "live text has the defaults"
    )
    | dict.fromkeys(("hair", "hair_color", *PICTURE_FIELDS), "curves are sent, no pictures")
)
if TYPE_CHECKING:
    from tts2face.serving.service.clip_options import StrictModel as TextFields
else:
    TextFields = options_model("TextFields", NOT_IN_LIVE_TEXT)


class TextOptions(TextFields):
    """First message of a live stream of text."""

    type: Literal["start"]
    input: Literal["text"] = "text"
    with_idle: Annotated[bool, Field(description="Curves of a living face between utterances.")] = True
    targets: Targets = ()


class AudioOptions(StrictModel):
    """First message of a live stream of sound."""

    type: Literal["start"]
    input: Literal["audio"]
    rate: Annotated[int, Field(ge=SAMPLE_RATES[0], le=SAMPLE_RATES[1], description="Sample rate in Hz.")] = 16_000
    targets: Targets = ()
    talker: str | None = None
    face: str | None = None
    identity: str | None = None


@router.websocket("/v1/stream")
async def stream(connection: WebSocket) -> None:
    """A live stream; docs/http.md describes its messages."""
    await connection.accept()
    state: ServiceState = connection.app.state.service
    try:
        options = _read_options(await _first_message(connection, state.settings.body_s))
        work = await _work(state, connection.state.key, options)
        notice = _spoken_mark(state, options)
        if options.targets:
            state.presentations.check(connection.state.key, options.targets)
    except (ValidationError, RefusedError) as wrong:
        await _refuse(connection, _reason(wrong))
        return
    except (WebSocketDisconnect, KeyError):
        return
    key, receiver = connection.state.key, _receiver(state, connection.state.key, options, work)
    if notice:
        await receiver.receive({"type": "text", "text": notice}, b"")
    if options.targets:
        messages = state.presentations.messages(work, key, receiver.inputs, options.targets)
    else:
        messages = state.results.messages(work, key, receiver.inputs)
    sending = asyncio.create_task(_send(connection, messages, receiver))
    receiving = asyncio.create_task(_receive(connection, receiver))
    try:
        await asyncio.wait({sending, receiving}, return_when=asyncio.FIRST_COMPLETED)
        # True after "end"; False when the client has left, who waits for nothing
        if receiving.done() and receiving.exception() is None and receiving.result():
            await sending  # the client ended its input and waits for the rest
    finally:
        for task in (sending, receiving):
            task.cancel()
        await asyncio.gather(sending, receiving, return_exceptions=True)
        with suppress(RuntimeError):
            await connection.close()


def _spoken_mark(state: ServiceState, options: TextOptions | AudioOptions) -> str:
    """First text of a stream: the words of the operator's mark; empty without one."""
    if not state.settings.spoken_mark or not isinstance(options, TextOptions):
        return ""
    try:
        return mark_words(state.settings.spoken_mark, getattr(options, "language", "en-us")) + END
    except InputError as unknown:
        raise RefusedError(422, "invalid_request", str(unknown)) from unknown


async def _work(state: ServiceState, key: ApiKey, options: TextOptions | AudioOptions) -> Work:
    """The work of a stream, with the files of its key in place of names."""
    given: dict[str, Any] = options.model_dump(
        exclude_none=True, exclude_defaults=True, exclude={"type", "input", "targets"}
    )
    models = {name: given.pop(name) for name in MODEL_FIELDS if name in given}
    models = await resolve_models(state.library, key, models)
    given = await resolve_texts(state.library, key, given)
    check_voice(given.get("voice"))
    kind = "listen" if isinstance(options, AudioOptions) else "live"
    return state.results.work(kind=kind, models=models, request=given)


def _receiver(state: ServiceState, key: ApiKey, options: TextOptions | AudioOptions, work: Work) -> "LiveText | _Sound":
    """Reader of the client's messages."""
    if isinstance(options, AudioOptions):
        return _Sound(options.rate)
    limits = state.settings.live_characters, state.settings.live_characters_per_minute
    language, markup = getattr(options, "language", "en-us"), getattr(options, "markup", "auto")
    table = work.request.get("text_marks")
    return LiveText(language, limits, lambda: state.permissions.count(key), markup, table and Path(table))


async def _first_message(connection: WebSocket, seconds: float) -> str:
    """First message of a client."""
    try:
        return await asyncio.wait_for(connection.receive_text(), seconds)
    except TimeoutError as late:
        raise RefusedError(
            408, "too_slow", f"the message `start` did not arrive within {seconds:g} s; send it first"
        ) from late


def _read_options(message: str) -> TextOptions | AudioOptions:
    content = parse_message(message)
    kind = AudioOptions if isinstance(content, dict) and content.get("input") == "audio" else TextOptions
    return kind.model_validate_json(message)


async def _receive(connection: WebSocket, receiver: "LiveText | _Sound") -> bool:
    """Pass the client's messages on; True after ``end``, False when the client has left."""
    while True:
        try:
            content, samples = _read_message(await connection.receive(), is_sound=isinstance(receiver, _Sound))
            await receiver.receive(content, samples)
            await _answer(connection, receiver)
        except WebSocketDisconnect:
            return False
        except RefusedError as wrong:
            await connection.send_json({"type": "error", "message": wrong.message})
            await _answer(connection, receiver)
            # who sends what is refused is slowed down
            await asyncio.sleep(REFUSED_S)
            continue
        if content["type"] == "end":
            return True


async def _answer(connection: WebSocket, receiver: "LiveText | _Sound") -> None:
    for event in receiver.answers():
        await connection.send_json(event)


class _Sound:
    """Sound of a client on its way to the task, not far ahead of real time."""

    def __init__(self, rate: int) -> None:
        self.inputs: InputQueue = asyncio.Queue(MAX_BLOCKS)
        self._pace = Pace(SAMPLE_BYTES * rate)

    async def receive(self, content: dict[str, Any], samples: bytes) -> None:
        await self._pace.add(len(samples))
        await self.inputs.put((content, samples))

    def is_note(self, _: Mapping[str, Any]) -> bool:
        return False

    def answers(self) -> list[dict[str, str]]:
        return []


def _read_message(message: Any, *, is_sound: bool) -> tuple[dict[str, Any], bytes]:
    """Content and sound of a message."""
    if message["type"] == "websocket.disconnect":
        raise WebSocketDisconnect
    samples = message.get("bytes")
    if samples is not None:
        if len(samples) % SAMPLE_BYTES or len(samples) > MAX_BLOCK_BYTES:
            raise RefusedError(
                400, "invalid_request",
                f"a block of sound has {len(samples)} bytes; send 16-bit samples in up to {MAX_BLOCK_BYTES} bytes",
            )  # fmt: skip
        return {"type": "audio"}, samples
    content, types = parse_message(message.get("text") or ""), AUDIO_TYPES if is_sound else TEXT_TYPES
    if not isinstance(content, dict) or content.get("type") not in types:
        raise RefusedError(
            400, "invalid_request",
            f"a message must be 16-bit samples, or JSON with one of the types "
            f"{', '.join(sorted(types))}",
        )  # fmt: skip
    return content, b""


async def _send(connection: WebSocket, results: AsyncIterator[Message], receiver: "LiveText | _Sound") -> None:
    """Pass the results on: a first event that they are synthetic, events as text, sound as binary messages."""
    mark = Mark(MOTION_NOTICE if isinstance(receiver, _Sound) else LIVE_NOTICE)
    await connection.send_json({"type": "mark", **mark_fields(mark)})
    try:
        async with aclosing(results) as messages:  # type: ignore[type-var]
            async for message in messages:
                event = message.content.get("event")
                if message.content.get("is_json"):
                    await connection.send_text(message.payload.decode())
                elif event is None:
                    await connection.send_bytes(message.payload)
                elif not receiver.is_note(event):
                    await connection.send_json(event)
                else:
                    await _answer(connection, receiver)
        await connection.send_json({"type": "done"})
    except RefusedError as refused:
        await connection.send_json({"type": "error", "message": refused.message})


async def _refuse(connection: WebSocket, reason: str) -> None:
    await connection.send_json({"type": "error", "message": reason})
    await connection.close(INVALID)


def _reason(wrong: Exception) -> str:
    if isinstance(wrong, ValidationError):
        first = wrong.errors()[0]
        return f"{'.'.join(map(str, first['loc'])) or 'message'}: {first['msg'][:200]}"
    return str(wrong)
