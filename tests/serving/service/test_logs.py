"""The log: one safe line for each event, with the id of its request, and without texts unless they are asked for."""

import asyncio
import json
import logging
import os
from collections.abc import AsyncIterator
from typing import Any

import httpx
import pytest

from tts2face.processes.message import EVENT, RESULT, Message
from tts2face.serving.service import logs
from tts2face.serving.service.exchange import Receive, Scope, Send
from tts2face.serving.service.guard import Guard
from tts2face.serving.service.keys import LOCAL_KEY
from tts2face.serving.service.logs import LOG, LineFormatter, log_event
from tts2face.serving.service.results import Results
from tts2face.serving.service.settings import ServiceSettings
from tts2face.serving.service.state import ServiceState

HOSTILE = 'a\r\n{"event": "forged"}\x1b[31m\u2028'


def record(message: str, *, name: str = LOG.name, **fields: Any) -> logging.LogRecord:
    made = logging.LogRecord(name, logging.INFO, "file.py", 1, message, None, None)
    if fields:
        made.fields = fields
    return made


def raised(error: Exception) -> Exception:
    try:
        raise error
    except type(error) as caught:
        return caught


@pytest.mark.parametrize("format", ["json", "text"])
def test_nothing_in_a_record_begins_a_line(format: str) -> None:
    line = LineFormatter(format).format(record("request", path=HOSTILE, code=None))
    assert line.isascii()
    assert line.isprintable()
    library = LineFormatter(format).format(record(HOSTILE, name="uvicorn.error"))
    assert library.isascii()
    assert library.isprintable()


def test_both_forms_hold_the_same() -> None:
    made = record("request", status=200, key="studio")
    as_json = json.loads(LineFormatter("json").format(made))
    assert (as_json["event"], as_json["level"], as_json["status"], as_json["key"]) == ("request", "info", 200, "studio")
    assert as_json["time"].endswith("Z")
    assert LineFormatter("text").format(made) == f'{as_json["time"]} INFO request status=200 key="studio"'


def test_messages_of_errors_may_quote_texts_and_are_written_on_request_only(caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.INFO, LOG.name):
        log_event("defect", level=logging.ERROR, error=raised(ValueError("my words")))
    (made,) = caplog.records
    plain = json.loads(LineFormatter().format(made))
    assert plain["error"] == "ValueError"
    assert any(frame.endswith(" raised") and __file__ in frame for frame in plain["traceback"])
    assert "my words" not in json.dumps(plain)
    assert json.loads(LineFormatter(with_text=True).format(made))["error_message"] == "my words"
    library = record("Task exception was never retrieved\nfuture: my words", name="asyncio")
    assert "my words" not in LineFormatter().format(library)


async def fails(scope: Scope, receive: Receive, send: Send) -> None:
    """Application with a defect."""
    raise KeyError("my words")


def test_a_defect_is_answered_with_its_id_and_logged_with_its_traceback(caplog: pytest.LogCaptureFixture) -> None:
    state = ServiceState(ServiceSettings(processes=1))
    guard = Guard(fails, state)

    async def ask() -> httpx.Response:
        async with httpx.AsyncClient(transport=httpx.ASGITransport(guard), base_url="http://localhost") as client:
            return await client.get("/v1/x", headers={"x-request-id": "id-3"})

    with caplog.at_level(logging.INFO, LOG.name):
        answer = asyncio.run(ask())
    assert answer.status_code == 500
    assert answer.headers["x-request-id"] == "id-3"
    assert answer.json()["error"] == {
        "message": "internal error: KeyError; the log has it under the id id-3", "type": "server_error",
        "param": None, "code": "internal",
    }  # fmt: skip
    defect, request = caplog.records
    assert (defect.getMessage(), request.getMessage()) == ("defect", "request")
    assert any("test_logs.py" in frame for frame in json.loads(LineFormatter().format(defect))["traceback"])
    assert request.fields["status"] == 500  # type: ignore[attr-defined]
    assert b'tts2face_failures_total{kind="internal"} 1.0' in state.metrics.as_text()


class FakePool:
    """A pool whose works are done at once."""

    async def stream(self, work: Any, key: str, *_: Any) -> AsyncIterator[Message]:
        yield Message(EVENT, {"seconds": 2.0}, b"abc")
        yield Message(RESULT, {"seconds": 2.5, "cpu_s": 0.1})


@pytest.mark.parametrize("log_text", [False, True])
def test_texts_are_logged_if_the_setting_says_so(caplog: pytest.LogCaptureFixture, log_text: bool) -> None:
    state = ServiceState(ServiceSettings(processes=1, log_text=log_text))
    pool: Any = FakePool()
    state.results = Results(state.settings, state.permissions, pool, state.metrics, None)

    async def make() -> None:
        async for _ in state.results.messages(state.results.work(request={"text": "my words"}), LOCAL_KEY):
            pass

    with caplog.at_level(logging.INFO, LOG.name):
        asyncio.run(make())
    assert [one.fields for one in caplog.records] == ([{"text": "my words"}] if log_text else [])  # type: ignore[attr-defined]


def test_nobody_waits_for_a_reader_of_the_log(monkeypatch: pytest.MonkeyPatch) -> None:
    """A full pipe stops the thread that writes, not the service; what was lost is told."""
    monkeypatch.setattr(logs, "MAX_LINES", 5)
    reading, writing = os.pipe()
    with os.fdopen(writing, "w") as file:
        writer = logs.LineWriter(file)
        writer.setFormatter(LineFormatter())
        for number in range(50):
            writer.handle(record(f"{number} {'x' * 60_000}", n=1))
        with os.fdopen(reading) as lines:
            events = [json.loads(lines.readline())]
            writer.handle(record("after", n=1))
            while events[-1]["event"] != "after":
                events.append(json.loads(lines.readline()))
                writer.handle(record("after", n=1))
            writer.close()
    assert sum(event["lines"] for event in events if event["event"] == "lines dropped") >= 40


def test_a_loop_that_a_defect_ends_is_told_and_counted(caplog: pytest.LogCaptureFixture) -> None:
    """As that which sends webhooks: nobody asks for it, so that only an alert tells of its end."""
    state = ServiceState(ServiceSettings(processes=1))

    async def run() -> None:
        async def loop() -> None:
            raise KeyError("my words")

        task = asyncio.create_task(loop())
        task.add_done_callback(state.jobs._note_end)
        await asyncio.wait({task})
        await asyncio.sleep(0)

    with caplog.at_level(logging.INFO, LOG.name):
        asyncio.run(run())
    assert [one.getMessage() for one in caplog.records] == ["defect"]
    assert b'tts2face_failures_total{kind="internal"} 1.0' in state.metrics.as_text()
