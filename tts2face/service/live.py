"""Live streams for avatars: text comes in word by word, speech, phones and curves go out with their times."""

import asyncio
from contextlib import aclosing, suppress
from typing import Annotated, Any, Literal

from fastapi import APIRouter, WebSocket, WebSocketDisconnect
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from lexicon.errors import DataError
from lexicon.inputs import parse_json
from tts2face.service.errors import RefusedError
from tts2face.service.messages import MessageKind
from tts2face.service.names import MODEL_FIELDS, check_voice, resolve_dictionary, resolve_models
from tts2face.service.state import ServiceState

router = APIRouter(tags=["live"])

INPUT_TYPES = frozenset({"text", "flush", "cancel", "end"})
INVALID = 1007  # WebSocket close code: a message is not what it should be


class LiveOptions(BaseModel):
    """First message of a live stream."""

    model_config = ConfigDict(extra="forbid", strict=True)

    type: Literal["start"]
    language: Annotated[str, Field(description="Language of the text.")] = "en-us"
    voice: Annotated[str | None, Field(description="A voice of GET /v1/voices.")] = None
    rate: Annotated[float, Field(ge=0.5, le=2.0)] = 1.0
    volume: Annotated[float, Field(ge=0.0, le=2.0)] = 1.0
    seed: Annotated[int, Field(ge=0, le=2**31 - 1)] = 0
    fps: Annotated[float, Field(ge=1, le=120)] = 30.0
    gestures: Literal["fields", "ju2008", "noise", "none"] = "fields"
    style: str | None = None
    gain: str | None = None
    talker: str | None = None
    face: str | None = None
    identity: str | None = None
    palette: str | None = None
    dictionary: Annotated[str | None, Field(description="A dictionary of GET /v1/dictionaries.")] = None
    with_idle: Annotated[bool, Field(description="Curves of a living face between utterances.")] = True


@router.websocket("/v1/stream")
async def stream(connection: WebSocket) -> None:
    """A live stream; docs/http.md describes its messages."""
    await connection.accept()
    state: ServiceState = connection.app.state.service
    try:
        options = LiveOptions.model_validate_json(await connection.receive_text())
        given: dict[str, Any] = options.model_dump(exclude_none=True, exclude_defaults=True, exclude={"type"})
        models = {name: given.pop(name) for name in MODEL_FIELDS if name in given}
        key = connection.state.key
        models = await resolve_models(state.library, key, models)
        given = await resolve_dictionary(state.library, key, given)
        check_voice(given.get("voice"))
    except (ValidationError, RefusedError) as wrong:
        await _refuse(connection, _reason(wrong))
        return
    except (WebSocketDisconnect, KeyError):
        return
    inputs: asyncio.Queue[Any] = asyncio.Queue(1000)
    work = state.work(kind="live", models=models, request=given)
    sending = asyncio.create_task(_send(connection, state, work, inputs))
    receiving = asyncio.create_task(_receive(connection, inputs))
    try:
        await asyncio.wait({sending, receiving}, return_when=asyncio.FIRST_COMPLETED)
        if receiving.done() and receiving.exception() is None and receiving.result():
            await sending  # the client ended the text and waits for the rest
    finally:
        for task in (sending, receiving):
            task.cancel()
        await asyncio.gather(sending, receiving, return_exceptions=True)
        with suppress(RuntimeError):
            await connection.close()


async def _receive(connection: WebSocket, inputs: "asyncio.Queue[Any]") -> bool:
    """Pass the client's messages on; True after ``end``, False when the client has left."""
    while True:
        try:
            content = parse_json(await connection.receive_text(), "the message")
        except (WebSocketDisconnect, KeyError):
            return False
        except DataError:
            content = None
        if not isinstance(content, dict) or content.get("type") not in INPUT_TYPES:
            await connection.send_json(
                {
                    "type": "error",
                    "message": f"a message must be JSON with one of the types {', '.join(sorted(INPUT_TYPES))}",
                }
            )
            continue
        await inputs.put(content)
        if content["type"] == "end":
            return True


async def _send(connection: WebSocket, state: ServiceState, work: Any, inputs: "asyncio.Queue[Any]") -> None:
    """Pass the results on: events as text, sound as binary messages."""
    try:
        async with aclosing(state.messages(work, connection.state.key, inputs)) as messages:  # type: ignore[type-var]
            async for message in messages:
                if message.kind == MessageKind.EVENT:
                    await connection.send_text(message.payload.decode())
                else:
                    await connection.send_bytes(message.payload)
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
