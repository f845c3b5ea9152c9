"""Results of synthesis processes: the messages of a `Work`, counted and cached, and the answers over HTTP with them."""

import json
from collections.abc import AsyncIterator, Mapping
from contextlib import AsyncExitStack, aclosing
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType
from typing import Any, Protocol

from fastapi import Request as HttpRequest
from fastapi import WebSocket
from fastapi.responses import StreamingResponse

from lexicon.errors import Tts2faceError
from tts2face.interchange.exports.table import JSON_LINES
from tts2face.processes.message import RESULT, Message
from tts2face.serving.service.access import Permissions
from tts2face.serving.service.errors import RefusedError, as_refused
from tts2face.serving.service.exchange import ERROR_FIELD, while_client_stays
from tts2face.serving.service.keys import LOCAL_KEY, ApiKey
from tts2face.serving.service.logs import log_event
from tts2face.serving.service.messages import QUALITY, SYNTHESISE, Work
from tts2face.serving.service.metrics import Metrics, quality_labels
from tts2face.serving.service.pool import STREAM_PRIORITY, InputQueue, Pool
from tts2face.serving.service.preparation import Step
from tts2face.serving.service.result_cache import CACHED_KINDS, ResultCache
from tts2face.serving.service.scheduler import check_words
from tts2face.serving.service.settings import ServiceSettings
from tts2face.serving.service.warm_process import work_call
from tts2face.storage.marks import PROGRAM

SPOKEN_KINDS = ("file", "speech")
MARK_HEADER = "X-Synthetic"  # what made synthetic sound, pictures or motion; raw samples have no other place
WARM_TEXT = "Hi."


def warm_steps(settings: ServiceSettings) -> tuple[Step, ...]:
    """Steps of synthesis processes: the longest compilation first, then the voice and the models of a movie."""
    spoken = replace(default_work(settings), request={"text": WARM_TEXT})
    first = {"voice": replace(spoken, kind="speech"), "models": replace(spoken, format="mp4")}
    kernels = {f"kernels of {part}": f"compile_{part}" for part in ("pictures", "motion", "gestures", "sound")}
    return (
        *(Step(name, call, first["models"].models, is_shared=True) for name, call in kernels.items()),
        *(Step(name, SYNTHESISE, work_call(work)) for name, work in first.items()),
    )


def default_work(settings: ServiceSettings) -> Work:
    """A `Work` with the models of the settings.

    Processes keep its finished sentences, whoever asks, for the one user of a service without keys.
    """
    models = {"talker": settings.talker, "face": settings.face, "palette": settings.palette}
    return Work(models=models, owner=LOCAL_KEY.name if settings.studio and settings.keys is None else "")


class Results:
    """Messages of what clients ask for, from the cache or from a process."""

    def __init__(
        self,
        settings: ServiceSettings,
        permissions: Permissions,
        pool: Pool,
        metrics: Metrics,
        cache: ResultCache | None,
    ) -> None:
        self._settings, self._permissions = settings, permissions
        self._pool, self._metrics = pool, metrics
        self._cache = cache
        self._default = default_work(settings)

    def work(self, *, models: Mapping[str, Any] = MappingProxyType({}), **fields: Any) -> Work:
        """A `Work` with the models of the settings unless it names others, and the marks that the operator wants."""
        work = replace(self._default, models={**self._default.models, **models}, **fields)
        settings, request = self._settings, dict(work.request)
        is_spoken = str(request.get("text", "")).strip() and request.get("audio") is None
        if settings.spoken_mark and work.kind in SPOKEN_KINDS and is_spoken:
            request.setdefault("spoken_mark", settings.spoken_mark)
        picture = {**work.picture, "visible_mark": True} if settings.visible_mark else work.picture
        return replace(work, request=request, picture=picture)

    def check_length(self, text: str) -> None:
        """Refuse a text of more than `text_characters`."""
        most = self._settings.text_characters
        if len(text) > most:
            raise RefusedError(413, "too_long", f"the text has more than {most} characters; divide it")

    async def messages(
        self, work: Work, key: ApiKey, inputs: InputQueue | None = None, priority: int = STREAM_PRIORITY
    ) -> AsyncIterator[Message]:
        """Messages of a task, without the last one; counted in the metrics.

        A task of a higher `priority` runs in its process when no other one can.

        Raises
        ------
        RefusedError
            The task failed, or too many tasks wait.
        ClientDisconnect
            The client of the present request has left; the work no longer waits, or has been stopped.
        """
        self.check_length(str(work.request.get("text", "")))
        key = self._permissions.speaking_key(key)
        made = 0.0
        if self._settings.log_text and work.request.get("text"):
            log_event("text", text=work.request["text"])
        try:
            check_words(str(work.request.get("text", "")))
            async with aclosing(self._stream(work, key, inputs, priority)) as stream:  # type: ignore[type-var]
                while True:
                    with while_client_stays():
                        message = await anext(stream)
                    seconds = message.content["seconds"]
                    if message.kind == RESULT:
                        self._permissions.limits.add_speech(key, seconds - made)  # of parts without content
                        self._metrics.speech.inc(seconds)
                        self._metrics.cpu.inc(message.content["cpu_s"])
                        return
                    made += seconds
                    self._permissions.limits.add_speech(key, seconds)
                    if self._settings.log_text and work.kind == "live" and "event" in message.content:
                        _log_spoken(message)
                    self._note_quality(message)
                    yield message
        except Tts2faceError as error:
            refused = as_refused(error, _folders(work))
            self._metrics.failures.labels(refused.code).inc()
            raise refused from error

    def _note_quality(self, message: Message) -> None:
        event = message.content.get("event", {})
        if event.get("type") == QUALITY:
            samples, frames = quality_labels(event["has_all_samples"], event["frame_step"])
            self._metrics.quality.labels(samples, frames).inc()
            log_event("quality", samples=samples, frames=frames)

    def _stream(self, work: Work, key: ApiKey, inputs: InputQueue | None, priority: int) -> AsyncIterator[Message]:
        """Messages of a task from the cache, or from a process."""
        made = self._pool.stream(work, key.name, priority, inputs)
        if self._cache is None or work.kind not in CACHED_KINDS:
            return made
        return self._cache.messages(work, made)


def _folders(work: Work) -> set[Path]:
    """Folders of the files that a task reads, uploads among them."""
    values = [value for fields in (work.models, work.request, work.picture) for value in fields.values()]
    return {Path(value).parent for value in values if isinstance(value, str | Path) and Path(value).is_absolute()}


def _log_spoken(message: Message) -> None:
    if text := message.content["event"].get("text"):
        log_event("text", text=text)


async def stream_work(
    request: HttpRequest,
    work: Work,
    media_type: str,
    *,
    convert: "Converter | None" = None,
    resources: AsyncExitStack | None = None,
) -> StreamingResponse:
    """Answer that sends a result while it is made.

    It begins with the first bytes, so that errors before them have their own status. A client that leaves cancels it.

    Parameters
    ----------
    convert
        Converts messages to bytes, and an error to what ends them; None: the bytes of all data.
    resources
        Closed when the answer is complete or has failed.
    """
    results: Results = request.app.state.service.results
    stack = resources or AsyncExitStack()
    messages = results.messages(work, request.state.key)
    convert = convert or DataBytes(media_type)
    chunks = convert(messages)
    try:
        first = await anext(chunks)
    except StopAsyncIteration:
        # a result without a byte
        first = b""
    except BaseException:
        await messages.aclose()  # type: ignore[attr-defined]
        await stack.aclose()
        raise

    async def body() -> AsyncIterator[bytes]:
        async with stack, aclosing(messages):  # type: ignore[type-var]
            yield first
            async for chunk in chunks:
                yield chunk

    request.state.exchange.ending = convert.failed
    headers = {MARK_HEADER: PROGRAM} | ({} if convert.failed({}) else {"Trailer": ERROR_FIELD})
    return StreamingResponse(body(), media_type=media_type, headers=headers)


class Converter(Protocol):
    """Converts the messages of a result to the bytes of an answer."""

    def __call__(self, messages: AsyncIterator[Message]) -> AsyncIterator[bytes]:
        """The bytes, as they come."""
        ...

    def failed(self, content: dict[str, Any]) -> bytes:
        """Bytes that follow those so far when the result ends with an error; empty: their form has no place for it."""
        ...


@dataclass(frozen=True, slots=True)
class DataBytes:
    """The bytes of the data of a result, as they are."""

    media_type: str

    async def __call__(self, messages: AsyncIterator[Message]) -> AsyncIterator[bytes]:
        """The bytes."""
        async for message in messages:
            if message.payload:
                yield message.payload

    def failed(self, content: dict[str, Any]) -> bytes:
        """A line, after lines of JSON."""
        return json_line(content) if self.media_type == JSON_LINES else b""


def error_event(content: dict[str, Any]) -> bytes:
    """Server-sent event with an error, the last one of a stream."""
    return b"event: error\ndata: " + json_line({"type": "error", **content}) + b"\n"


def json_line(content: Any) -> bytes:
    """Compact JSON on a line."""
    return json.dumps(content, ensure_ascii=False, separators=(",", ":")).encode() + b"\n"


async def timed_speech(request: HttpRequest | WebSocket, work: Work) -> tuple[list[dict[str, Any]], bytes]:
    """All events of a task of kind ``speech``, and its sound as 16-bit PCM."""
    events: list[dict[str, Any]] = []
    sound = bytearray()
    results: Results = request.app.state.service.results
    async with aclosing(results.messages(work, request.state.key)) as messages:  # type: ignore[type-var]
        async for message in messages:
            sound += message.payload
            if "event" in message.content:
                events.append(message.content["event"])
    return events, bytes(sound)
