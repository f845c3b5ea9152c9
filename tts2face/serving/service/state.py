"""Parts that all of a running service share: settings, keys, pool, limits, jobs and metrics."""

import asyncio
import logging
import os
from collections.abc import AsyncIterator
from contextlib import aclosing
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fastapi import Request as HttpRequest
from fastapi import WebSocket

from lexicon.errors import Tts2faceError
from tts2face.processes.message import RESULT, Message
from tts2face.serving.service.access import KeyRing
from tts2face.serving.service.decoders import Decoders
from tts2face.serving.service.downloads import Downloads
from tts2face.serving.service.errors import STATUS, RefusedError, as_refused
from tts2face.serving.service.exchange import in_background, while_client_stays
from tts2face.serving.service.job_service import JobService
from tts2face.serving.service.keys import LOCAL_KEY, ApiKey
from tts2face.serving.service.library import Library
from tts2face.serving.service.logs import log_event
from tts2face.serving.service.long_words import check_words
from tts2face.serving.service.messages import QUALITY, SYNTHESISE, DefectError, Work
from tts2face.serving.service.metrics import Metrics, quality_labels
from tts2face.serving.service.pool import STREAM_PRIORITY, Pool, PoolSettings
from tts2face.serving.service.preparation import Step
from tts2face.serving.service.rate_limits import RateLimits
from tts2face.serving.service.readiness import Readiness
from tts2face.serving.service.result_cache import CACHED_KINDS, ResultCache
from tts2face.serving.service.settings import ServiceSettings
from tts2face.serving.service.tracing import tracing_from_environment
from tts2face.serving.service.warm_process import InputQueue, work_call

if TYPE_CHECKING:
    from tts2face.serving.service.exchange import Exchange


WARM_TEXT = "Hi."


class ServiceState:
    """Settings, keys, pool, limits and metrics of a service; `tasks` as `server.Mount` has them."""

    def __init__(self, settings: ServiceSettings, tasks: tuple[str, ...] = ()) -> None:
        self.settings = settings
        self.keys = KeyRing(settings.keys)
        self.pool = Pool(PoolSettings(
            settings.processes, settings.waiting, self._steps(),
            {"n_sessions": settings.sessions, "log_format": settings.log_format, "log_text": settings.log_text,
             "memory_mb": settings.memory_mb, "sentences_mb": settings.sentences_mb, "tasks": tasks},
        ))  # fmt: skip
        self.downloads = Downloads()
        self.library, self.decoders = Library(settings), Decoders()
        self.limits = RateLimits()
        self.jobs = JobService(settings, self.library, self.limits)
        self.cache: ResultCache | None = None
        if settings.cache_mb:
            self.cache = ResultCache(settings.data_folder / "cache", settings.cache_mb * 1_000_000)
        self.readiness = Readiness(self.pool, self.jobs, settings)
        self.metrics = Metrics(self.pool, self.jobs, self.readiness, self.cache)
        self.jobs.on_defect = self.note_defect
        self.tracing = tracing_from_environment(os.environ)
        self.is_draining = False
        self.exchanges: set[Exchange] = set()  # requests that are being answered
        self._ending: set[asyncio.Task[None]] = set()  # those of keys that were removed
        self.running: set[Exchange] = set()  # those for which a draining service waits

    async def reload_keys(self) -> None:
        """Read the file of keys again, and end what is open for keys that it no longer has, or that may do less.

        If it cannot be read, nobody is served.
        """
        if self.keys.is_open:
            return log_event("keys not reloaded", reason="the service has no file of keys")
        try:
            names = await self.keys.reload()
        except Tts2faceError as error:
            log_event("keys dropped", level=logging.ERROR, reason=str(error), ended=self._end_lost())
        else:
            log_event("keys reloaded", keys=list(names), ended=self._end_lost())
        return None

    def _end_lost(self) -> int:
        """End what is open for keys that are gone or may do less; how many."""
        losses = [
            (exchange, self.keys.loss_of(exchange.key)) for exchange in self.exchanges if exchange.key is not None
        ]
        ending = {in_background(exchange.revoke(loss)) for exchange, loss in losses if loss is not None}
        for task in ending:
            task.add_done_callback(self._ending.discard)
        self._ending |= ending
        return len(ending)

    def speaking_key(self, key: ApiKey) -> ApiKey:
        """A key as it is now, if it may have something spoken."""
        key = self.key_with(key, "speak")
        self.limits.check_speech(key)
        return key

    def key_with(self, key: ApiKey, scope: str) -> ApiKey:
        """A key as it is now, if it has a scope."""
        key = self.keys.current(key)
        if scope not in key.scopes:
            raise RefusedError(403, "forbidden", f"the key {key.name} lacks the scope {scope}; use another key")
        return key

    def count(self, key: ApiKey) -> None:
        """Count an utterance of an open WebSocket as a request of its key; errors as `speaking_key` and the limits."""
        self.limits.count(self.speaking_key(key))

    def work(self, *, models: dict[str, Any] | None = None, **fields: Any) -> Work:
        """A task with the models of the settings unless it names others."""
        defaults = {"talker": self.settings.talker, "face": self.settings.face, "palette": self.settings.palette}
        return Work(models=defaults | (models or {}), owner=self.common_owner, **fields)

    def _steps(self) -> tuple[Step, ...]:
        """Steps of synthesis processes: the longest compilation first, then the voice and the models of a movie."""
        first = {"voice": self.work(kind="speech", request={"text": WARM_TEXT}),
                 "models": self.work(format="mp4", request={"text": WARM_TEXT})}  # fmt: skip
        kernels = {f"kernels of {part}": f"compile_{part}" for part in ("pictures", "motion", "gestures", "sound")}
        return (
            *(Step(name, call, first["models"].models, is_shared=True) for name, call in kernels.items()),
            *(Step(name, SYNTHESISE, work_call(work)) for name, work in first.items()),
        )

    @property
    def common_owner(self) -> str:
        """For whom processes keep finished sentences, whoever asks: the one user of a service without keys."""
        return LOCAL_KEY.name if self.settings.studio and self.settings.keys is None else ""

    def check_length(self, text: str) -> None:
        """Refuse a text of more than `text_characters`."""
        most = self.settings.text_characters
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
        key = self.speaking_key(key)
        made = 0.0
        if self.settings.log_text and work.request.get("text"):
            log_event("text", text=work.request["text"])
        try:
            check_words(str(work.request.get("text", "")))
            async with aclosing(self._stream(work, key, inputs, priority)) as stream:  # type: ignore[type-var]
                while True:
                    with while_client_stays():
                        message = await anext(stream)
                    seconds = message.content["seconds"]
                    if message.kind == RESULT:
                        self.limits.add_speech(key, seconds - made)  # of parts without content
                        self.metrics.speech.inc(seconds)
                        self.metrics.cpu.inc(message.content["cpu_s"])
                        return
                    made += seconds
                    self.limits.add_speech(key, seconds)
                    if self.settings.log_text and work.kind == "live" and "event" in message.content:
                        _log_spoken(message)
                    self._note_quality(message)
                    yield message
        except Tts2faceError as error:
            refused = as_refused(error, _folders(work))
            self.metrics.failures.labels(refused.code).inc()
            raise refused from error

    def _note_quality(self, message: Message) -> None:
        event = message.content.get("event", {})
        if event.get("type") == QUALITY:
            samples, frames = quality_labels(event["has_all_samples"], event["frame_step"])
            self.metrics.quality.labels(samples, frames).inc()
            log_event("quality", samples=samples, frames=frames)

    def _stream(self, work: Work, key: ApiKey, inputs: InputQueue | None, priority: int) -> AsyncIterator[Message]:
        """Messages of a task from the cache, or from a process."""
        made = self.pool.stream(work, key.name, priority, inputs)
        if self.cache is None or work.kind not in CACHED_KINDS:
            return made
        return self.cache.messages(work, made)

    def note_defect(self, error: BaseException) -> None:
        """Log an error of the program, and count it, so that it alerts."""
        log_event("defect", level=logging.ERROR, error=error)
        self.metrics.failures.labels(STATUS[DefectError][1]).inc()

    def record(self, request: "Exchange") -> None:
        """Log, count and trace a finished request; what a probe asks again and again is not logged."""
        self.metrics.requests.labels(request.route, str(request.status)).inc()
        self.metrics.sent_bytes.inc(request.n_bytes)
        if request.first_byte_s is not None and request.status == 200:
            self.metrics.first_byte.labels(request.route).observe(request.first_byte_s)
        if not request.is_probed:
            self._log(request)
        if self.tracing is not None:
            self.tracing.record(request)

    @staticmethod
    def _log(request: "Exchange") -> None:
        log_event(
            "request", id=request.id, method=request.method, path=request.route, status=request.status,
            code=request.code, key=request.key.name if request.key else None, bytes=request.n_bytes,
            first_byte_s=round(request.first_byte_s, 4) if request.first_byte_s is not None else None,
            seconds=round(request.age_s, 4), cut=request.is_cut,
        )  # fmt: skip


def _folders(work: Work) -> set[Path]:
    """Folders of the files that a task reads, uploads among them."""
    values = [value for fields in (work.models, work.request, work.picture) for value in fields.values()]
    return {Path(value).parent for value in values if isinstance(value, str | Path) and Path(value).is_absolute()}


def _log_spoken(message: Message) -> None:
    if text := message.content["event"].get("text"):
        log_event("text", text=text)


def service_state(request: HttpRequest | WebSocket) -> ServiceState:
    """State of the service that received a request."""
    state: ServiceState = request.app.state.service
    return state
