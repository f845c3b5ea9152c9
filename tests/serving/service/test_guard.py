"""What is refused before any work; a tiny application stands behind the guard."""

import asyncio
import errno
import json
import logging
from collections.abc import AsyncIterator, Callable
from pathlib import Path
from typing import Any

import httpx
import pytest

from lexicon.errors import InputError
from tts2face.serving.service.exchange import Receive, Scope, Send
from tts2face.serving.service.guard import Guard
from tts2face.serving.service.keys import add_key
from tts2face.serving.service.logs import LineFormatter
from tts2face.serving.service.settings import ServiceSettings
from tts2face.serving.service.state import ServiceState


async def echo(scope: Scope, receive: Receive, send: Send) -> None:
    """Application that answers with the size of the body and the name of the key."""
    size = 0
    while True:
        message = await receive()
        size += len(message.get("body", b""))
        if not message.get("more_body"):
            break
    body = json.dumps({"size": size, "key": scope["state"]["key"].name}).encode()
    await send({"type": "http.response.start", "status": 200, "headers": []})
    await send({"type": "http.response.body", "body": body})


Make = Callable[..., httpx.AsyncClient]


@pytest.fixture
def make_client() -> Make:
    def make(**settings: Any) -> httpx.AsyncClient:
        state = ServiceState(ServiceSettings(processes=1, **settings))
        return httpx.AsyncClient(transport=httpx.ASGITransport(Guard(echo, state)), base_url="http://localhost:8880")

    return make


def answer(client: httpx.AsyncClient, method: str = "POST", path: str = "/v1/x", **options: Any) -> httpx.Response:
    async def ask() -> httpx.Response:
        async with client:
            return await client.request(method, path, **options)

    return asyncio.run(ask())


def code(response: httpx.Response) -> tuple[int, str]:
    assert response.is_error, f"served: {response.text}"
    return response.status_code, response.json()["error"]["code"]


def test_a_request_passes_with_headers(make_client: Make) -> None:
    response = answer(make_client(), content=b"abc", headers={"x-request-id": "id-7"})
    assert response.json() == {"size": 3, "key": "local"}
    assert response.headers["x-request-id"] == "id-7"
    assert response.headers["server-timing"].startswith("total;dur=")
    assert response.headers["x-content-type-options"] == "nosniff"


def test_an_answer_may_take_longer_than_a_body_that_there_is_not() -> None:
    """Files that are made first are sent while their end of the connection is watched."""

    async def slow(scope: Scope, receive: Receive, send: Send) -> None:
        await asyncio.sleep(0.15)
        await echo(scope, receive, send)

    state = ServiceState(ServiceSettings(processes=1, body_s=0.1))
    client = httpx.AsyncClient(transport=httpx.ASGITransport(Guard(slow, state)), base_url="http://localhost:8880")
    assert answer(client, "GET").json() == {"size": 0, "key": "local"}


def test_a_full_disk_is_no_defect(caplog: pytest.LogCaptureFixture) -> None:
    async def save(scope: Scope, receive: Receive, send: Send) -> None:
        raise OSError(errno.ENOSPC, "No space left on device", "/srv/data/x")

    state = ServiceState(ServiceSettings(processes=1))
    client = httpx.AsyncClient(transport=httpx.ASGITransport(Guard(save, state)), base_url="http://localhost:8880")
    with caplog.at_level(logging.ERROR):
        response = answer(client)
    assert code(response) == (503, "unavailable")
    assert response.headers["retry-after"]
    assert "is full, /readyz names its folder" in response.text
    assert "/srv" not in response.text
    assert not caplog.records


@pytest.mark.parametrize("given", ["a b", "x" * 65, "é"])
def test_a_request_id_that_could_confuse_a_log_is_replaced(make_client: Make, given: str) -> None:
    response = answer(make_client(), headers={"x-request-id": given.encode()})
    assert len(response.headers["x-request-id"]) == 32


@pytest.mark.parametrize("host", ["evil.example", "localhost.evil.example", "", "[bad"])
def test_hosts_of_others_are_refused(make_client: Make, host: str) -> None:
    assert code(answer(make_client(), headers={"host": host})) == (421, "unknown_host")


def test_a_configured_host_is_served(make_client: Make) -> None:
    assert answer(make_client(hosts=("face.example",)), headers={"host": "face.example:80"}).status_code == 200


def test_pages_of_other_origins_are_refused(make_client: Make) -> None:
    assert code(answer(make_client(), headers={"origin": "https://evil.example"})) == (403, "unknown_origin")
    assert code(answer(make_client(), headers={"origin": "null"})) == (403, "unknown_origin")
    assert answer(make_client(), headers={"origin": "http://localhost:8880"}).status_code == 200
    allowed = make_client(origins=("https://a.example",))
    assert answer(allowed, headers={"origin": "https://a.example"}).status_code == 200


@pytest.mark.parametrize("site", ["cross-site", "same-site"])
def test_what_another_site_causes_without_an_origin_is_refused(make_client: Make, site: str) -> None:
    """Pictures, frames and scripts of other pages come without ``Origin``; a link to a page of the service may."""
    for dest in ("image", "script", "iframe", "empty", ""):
        asked = {"sec-fetch-site": site, "sec-fetch-dest": dest}
        assert code(answer(make_client(), "GET", headers=asked)) == (403, "unknown_origin")
    link = {"sec-fetch-site": site, "sec-fetch-mode": "navigate", "sec-fetch-dest": "document"}
    assert answer(make_client(), "GET", headers=link).status_code == 200
    assert answer(make_client(), "GET", headers={"sec-fetch-site": "same-origin"}).status_code == 200
    assert answer(make_client(), "GET", headers={"sec-fetch-site": "none"}).status_code == 200
    page = {"sec-fetch-site": site, "origin": "https://a.example"}
    assert answer(make_client(origins=("https://a.example",)), headers=page).status_code == 200


@pytest.mark.parametrize("origin", ["", "localhost:8880", "//localhost:8880", "null"])
def test_an_origin_that_says_nothing_is_another_one(make_client: Make, origin: str) -> None:
    assert code(answer(make_client(), headers={"origin": origin})) == (403, "unknown_origin")


PAGE = "https://a.example"
PREFLIGHT = {
    "origin": PAGE, "access-control-request-method": "POST",
    "access-control-request-headers": "authorization,x-stainless-os",
}  # fmt: skip


def test_a_browser_asks_without_a_key_whether_a_page_may_send_a_request(make_client: Make, tmp_path: Path) -> None:
    path = tmp_path / "keys.toml"
    add_key(path, "a", ["speak"])
    asked = answer(make_client(keys=path, origins=(PAGE,)), "OPTIONS", headers=PREFLIGHT)
    assert (asked.status_code, asked.content) == (204, b"")
    assert asked.headers["access-control-allow-origin"] == PAGE
    assert asked.headers["access-control-allow-headers"] == PREFLIGHT["access-control-request-headers"]
    assert {"POST", "DELETE"} <= set(asked.headers["access-control-allow-methods"].split(", "))
    assert asked.headers["access-control-max-age"] == "600"
    assert "access-control-allow-credentials" not in asked.headers
    assert asked.headers["vary"].startswith("Access-Control-Request-Headers")
    assert "Origin" in asked.headers.get_list("vary")
    other = answer(
        make_client(keys=path, origins=(PAGE,)), "OPTIONS", headers=PREFLIGHT | {"origin": "https://b.example"}
    )
    assert code(other) == (403, "unknown_origin")
    assert "access-control-allow-origin" not in other.headers
    assert code(answer(make_client(keys=path), "OPTIONS", headers=PREFLIGHT)) == (403, "unknown_origin")


def test_answers_differ_by_origin_and_show_their_ids(make_client: Make, tmp_path: Path) -> None:
    allowed = answer(make_client(origins=(PAGE,)), headers={"origin": PAGE})
    assert (allowed.headers["access-control-allow-origin"], allowed.headers["vary"]) == (PAGE, "Origin")
    assert {"X-Request-ID", "Location"} <= set(allowed.headers["access-control-expose-headers"].split(", "))
    without = answer(make_client(origins=(PAGE,)))  # a cache must not give this answer to the page
    assert ("access-control-allow-origin" in without.headers, without.headers["vary"]) == (False, "Origin")
    path = tmp_path / "keys.toml"
    add_key(path, "a", ["speak"])
    refused = answer(make_client(keys=path, origins=(PAGE,)), headers={"origin": PAGE})
    assert (refused.status_code, refused.headers["access-control-allow-origin"]) == (401, PAGE)
    assert "vary" not in answer(make_client()).headers


@pytest.mark.parametrize("given", ["https://a.example/", "a.example", "https://A.example", "*", "null"])
def test_origins_that_no_browser_sends_are_refused(given: str) -> None:
    with pytest.raises(InputError, match=r"origins must be such as https://example\.org"):
        ServiceSettings(origins=(given,))


def test_a_service_with_keys_needs_one(make_client: Make, tmp_path: Path) -> None:
    path = tmp_path / "keys.toml"
    secret = add_key(path, "studio", ["speak"])
    missing = answer(make_client(keys=path))
    assert code(missing) == (401, "unauthorized")
    assert missing.headers["www-authenticate"] == "Bearer"
    assert "missing" in missing.text
    wrong = answer(make_client(keys=path), headers={"authorization": "Bearer t2f_wrong"})
    assert code(wrong) == (401, "unauthorized")
    assert "t2f_wrong" not in wrong.text
    named = [{"authorization": f"{scheme} {secret}"} for scheme in ("Bearer", "bearer", "BEARER ")]
    for headers in (*named, {"x-api-key": secret}):
        assert answer(make_client(keys=path), headers=headers).json()["key"] == "studio"
    assert code(answer(make_client(keys=path), params={"key": secret})) == (401, "unauthorized")  # logs keep addresses
    assert answer(make_client(keys=path), "GET", "/healthz").status_code == 200


def test_a_large_body_is_refused_before_it_is_read(make_client: Make) -> None:
    read: list[int] = []

    async def body(n_parts: int) -> AsyncIterator[bytes]:
        for number in range(n_parts):
            read.append(number)
            yield bytes(1000)

    stated = answer(make_client(body_mb=0.01), content=body(100), headers={"content-length": "100000"})
    assert code(stated) == (413, "too_large")
    assert read == []
    unstated = answer(make_client(body_mb=0.01), content=body(100))
    assert code(unstated) == (413, "too_large")
    assert len(read) <= 12
    negative = answer(make_client(), headers={"content-length": "-1"})
    assert code(negative) == (413, "too_large")


def test_a_slow_body_is_refused(make_client: Make) -> None:
    async def body() -> AsyncIterator[bytes]:
        for _ in range(100):
            yield b"x"
            await asyncio.sleep(0.05)

    assert code(answer(make_client(body_s=0.2), content=body())) == (408, "too_slow")


def test_limits_of_a_key(make_client: Make, tmp_path: Path) -> None:
    path = tmp_path / "keys.toml"
    headers = {"authorization": f"Bearer {add_key(path, 'a', ['speak'], requests_per_minute=2)}"}
    other = {"authorization": f"Bearer {add_key(path, 'b', ['speak'])}"}

    async def ask() -> list[httpx.Response]:
        async with make_client(keys=path) as client:
            return [await client.post("/v1/x", headers=one) for one in (headers, headers, headers, other)]

    first, second, third, of_other = asyncio.run(ask())
    assert [one.status_code for one in (first, second, third, of_other)] == [200, 200, 429, 200]
    assert 1 <= int(third.headers["retry-after"]) <= 30
    assert "the key a has used its 2 requests a minute; wait" in third.text


def test_the_log_has_one_line_and_no_secret(
    make_client: Make, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    path = tmp_path / "keys.toml"
    secret = add_key(path, "studio", ["speak"])
    with caplog.at_level(logging.INFO, "tts2face.service"):
        answer(make_client(keys=path), content=b"my words", headers={"authorization": f"Bearer {secret}"})
    (record,) = caplog.records
    text = LineFormatter().format(record)
    line = json.loads(text)
    assert (line["event"], line["key"], line["status"], line["method"]) == ("request", "studio", 200, "POST")
    assert secret not in text
    assert "my words" not in text
