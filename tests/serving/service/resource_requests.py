"""Requests for the resources of a service in the process of the test, as keys send them, and their answers."""

import asyncio
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import httpx

from tts2face.serving.service.application import create_app
from tts2face.serving.service.settings import ServiceSettings

WORDS = b"Siobhan  SH IH0 V AO1 N\n"
Ask = Callable[..., httpx.Response]


@contextmanager
def asking(settings: ServiceSettings, keys: dict[str, str]) -> Iterator[Ask]:
    app = create_app(settings)

    def ask_as(key: str, method: str, path: str, **options: Any) -> httpx.Response:
        async def send() -> httpx.Response:
            headers = {"authorization": f"Bearer {keys[key]}"} | options.pop("headers", {})
            async with httpx.AsyncClient(transport=httpx.ASGITransport(app), base_url="http://localhost") as client:
                return await client.request(method, path, headers=headers, **options)

        return asyncio.run(send())

    yield ask_as
    app.state.service.library.close()


def form(name: str, content: bytes = WORDS) -> dict[str, Any]:
    return {"data": {"name": name}, "files": {"file": ("../../evil.dict", content)}}


def refusal(answer: httpx.Response) -> tuple[int, str]:
    return answer.status_code, answer.json()["error"]["code"]


def names(answer: httpx.Response) -> list[tuple[str, str | None]]:
    return [(one["name"], one["owner"]) for one in answer.json()["data"]]
