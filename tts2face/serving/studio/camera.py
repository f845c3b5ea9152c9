"""The connection of a live camera: pictures go to a process that tracks the face, its motion goes back.

One camera of a key is live at a time. Pictures that arrive faster than they can be read are dropped, the older ones
first. The process ends with the connection.
"""

import asyncio
import json
import struct
from collections.abc import AsyncIterator, Mapping
from contextlib import aclosing, suppress
from typing import Any

from fastapi import WebSocket, WebSocketDisconnect

from lexicon.errors import Tts2faceError
from tts2face.processes.async_parent import started
from tts2face.processes.program import Program
from tts2face.serving.service.keys import ApiKey
from tts2face.serving.studio.camera_process import FOLLOW, LIMITS

PROGRAM = Program("tts2face.serving.studio.camera_process:HANDLERS", LIMITS)
TIME = struct.Struct("<d")  # before each JPEG of a client
# of a JPEG of the camera's page
MAX_PICTURE_BYTES = 1 << 20
# a forgotten page must not hold a process for ever
MAX_LIVE_S = 3600.0
ENDING_S = 3.0  # for which the end of an earlier connection is waited for
POLL_S = 0.05  # between two checks of it
REFUSED = 1008  # close code of WebSockets


async def follow_camera(connection: WebSocket, key: ApiKey, live: set[str]) -> None:
    """Answer the pictures of a connection, each 8 bytes of time and a JPEG, until it ends; `live` has the owners."""
    await connection.accept()
    reason = ""
    if "build" not in key.scopes:
        reason = f"the key {key.name} lacks the scope build, which a camera needs; use another key"
    elif not await _is_free(key.name, live):
        reason = "the camera is live in another tab; stop it there first"
    if reason:
        await connection.send_text(json.dumps({"error": "InputError", "message": reason}))
        await connection.close(REFUSED)
        return
    live.add(key.name)
    try:
        async with asyncio.timeout(MAX_LIVE_S):
            await _follow(connection)
    except TimeoutError:
        with suppress(RuntimeError):
            message = "the camera was live for an hour and is stopped; start it again"
            await connection.send_text(json.dumps({"error": "InputError", "message": message}))
            await connection.close()
    finally:
        live.discard(key.name)


async def _is_free(owner: str, live: set[str]) -> bool:
    """Whether no camera of an owner is live; one that is ending, as of a page that is loaded anew, is waited for."""
    for _ in range(round(ENDING_S / POLL_S)):
        if owner not in live:
            return True
        await asyncio.sleep(POLL_S)
    return owner not in live


async def _follow(connection: WebSocket) -> None:
    newest: asyncio.Queue[bytes] = asyncio.Queue(1)
    tasks = [asyncio.create_task(_receive(connection, newest)), asyncio.create_task(_answer(connection, newest))]
    try:
        await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
    finally:
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
        with suppress(RuntimeError):
            await connection.close()


async def _receive(connection: WebSocket, newest: "asyncio.Queue[bytes]") -> None:
    """Keep the newest picture of a client until it leaves."""
    with suppress(WebSocketDisconnect, KeyError):
        while True:
            picture = await connection.receive_bytes()
            if TIME.size < len(picture) <= TIME.size + MAX_PICTURE_BYTES:
                if newest.full():
                    newest.get_nowait()
                newest.put_nowait(picture)


async def _answer(connection: WebSocket, newest: "asyncio.Queue[bytes]") -> None:
    """Give the process one picture after the other, and the client its answers."""
    is_asked = asyncio.Event()  # for another picture, by an answer

    async def pictures() -> AsyncIterator[tuple[Mapping[str, Any], bytes]]:
        while True:
            await is_asked.wait()
            is_asked.clear()
            picture = await newest.get()
            (seconds,) = TIME.unpack_from(picture)
            yield {"time": seconds}, picture[TIME.size :]

    with suppress(WebSocketDisconnect, RuntimeError):
        try:
            async with started(PROGRAM) as child, aclosing(child.stream(FOLLOW, {}, inputs=pictures())) as answers:
                async for answer in answers:
                    await connection.send_text(json.dumps(dict(answer.content)))
                    is_asked.set()
        except Tts2faceError as error:
            await connection.send_text(json.dumps({"error": type(error).__name__, "message": str(error)}))
