"""What the soak counts as an answer that was cut, and what as none."""

import asyncio
from pathlib import Path
from types import SimpleNamespace

import pytest

from tests.bench.soak_traffic import CUT, LOST, Soak, client_of

HEAD = b"HTTP/1.1 200 OK\r\ntransfer-encoding: chunked\r\n\r\n"
CHUNK = b"2\r\nab\r\n"
ANSWERS = {
    "whole": (HEAD + CHUNK + b"0\r\n\r\n", 200),
    "in a chunk": (HEAD + b"5\r\nab", CUT),
    "between chunks": (HEAD + CHUNK, CUT),
    "in the size of a chunk": (HEAD + CHUNK + b"5", CUT),
    "in the trailer that says why": (HEAD + CHUNK + b"0\r\nx-tts2face-error: {}\r\n", CUT),
    "in the head": (HEAD[:-10], LOST),
    "before it": (b"", LOST),
}


@pytest.mark.parametrize("name", ANSWERS)
def test_only_an_answer_that_has_begun_is_cut(name: str) -> None:
    content, status = ANSWERS[name]

    async def answer(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        await reader.readuntil(b"}")  # of the request's JSON
        writer.write(content)
        writer.close()

    async def ask() -> Soak:
        server = await asyncio.start_server(answer, "127.0.0.1", 0)
        url = "http://{}:{}".format(*server.sockets[0].getsockname())
        soak = Soak(SimpleNamespace(url=url), Path(), None, None, 0.0)  # type: ignore[arg-type]
        async with server, client_of(soak) as client:
            await soak.one(client, "speech")
        return soak

    assert dict(asyncio.run(ask()).statuses) == {("speech", status): 1}
