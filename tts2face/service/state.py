"""What all parts of a running service share."""

import logging
import os
from collections.abc import AsyncIterator
from contextlib import aclosing
from typing import TYPE_CHECKING, Any

from lexicon.errors import Tts2faceError
from tts2face.processes.message import RESULT, Message
from tts2face.service.access.keys import LOCAL_KEY, ApiKey, read_keys
from tts2face.service.access.rate_limits import RateLimits
from tts2face.service.errors import RefusedError, as_refused
from tts2face.service.jobs.job_service import JobService
from tts2face.service.logs import log_event
from tts2face.service.metrics import Metrics
from tts2face.service.settings import ServiceSettings
from tts2face.service.synthesis.pool import STREAM_PRIORITY, Pool, PoolSettings
from tts2face.service.synthesis.result_cache import CACHED_KINDS, ResultCache
from tts2face.service.synthesis.warm_process import InputQueue
from tts2face.service.synthesis.words import check_words
from tts2face.service.synthesis.work import Work
from tts2face.service.tracing import tracing_from_environment
from tts2face.service.uploads.library import Library
from tts2face.service.uploads.upload_checks import Checks

if TYPE_CHECKING:
    from tts2face.service.access.exchange import Exchange

WARM_TEXT = "Hello there."


class ServiceState:
    """Settings, keys, pool, limits and metrics of a service; `tasks` as `tts2face.service.app.Mount` has them."""

    def __init__(self, settings: ServiceSettings, tasks: tuple[str, ...] = ()) -> None:
        self.settings = settings
        self.keys = read_keys(settings.keys) if settings.keys is not None else ()
        self.pool = Pool(PoolSettings(
            settings.processes, settings.waiting,
            (self.work(format="mp4", request={"text": WARM_TEXT}).as_json(),
             self.work(kind="speech", request={"text": WARM_TEXT}).as_json()),
            {"n_sessions": settings.sessions, "log_format": settings.log_format, "log_text": settings.log_text,
             "memory_mb": settings.memory_mb, "sentences_mb": settings.sentences_mb, "tasks": tasks},
        ))  # fmt: skip
        self.library, self.checks, self.video_checks = Library(settings), Checks(), Checks()
        self.jobs = JobService(settings, self.library)
        self.cache: ResultCache | None = None
        if settings.cache_mb:
            self.cache = ResultCache(settings.data_folder / "cache", settings.cache_mb * 1_000_000)
        self.limits, self.metrics = RateLimits(), Metrics(self.pool, self.jobs, self.cache)
        self.tracing = tracing_from_environment(os.environ)
        self.is_draining = False
        self.running: set[Exchange] = set()

    def reload_keys(self) -> None:
        """Read the file of keys again; the present keys stay valid if it cannot be read."""
        if self.settings.keys is None:
            return log_event("keys not reloaded", reason="the service has no file of keys")
        try:
            self.keys = read_keys(self.settings.keys)
        except (Tts2faceError, OSError) as error:
            return log_event("keys not reloaded", level=logging.ERROR, reason=str(error))
        return log_event("keys reloaded", keys=[key.name for key in self.keys])

    def work(self, *, models: dict[str, Any] | None = None, **fields: Any) -> Work:
        """A work with the models of the settings unless it names others."""
        defaults = {"talker": self.settings.talker, "face": self.settings.face, "palette": self.settings.palette}
        return Work(models=defaults | (models or {}), owner=self.common_owner, **fields)

    @property
    def common_owner(self) -> str:
        """For whom processes keep finished sentences, whoever asks: the one user of a service without keys."""
        return LOCAL_KEY.name if self.settings.studio and self.settings.keys is None else ""

    async def messages(
        self, work: Work, key: ApiKey, inputs: InputQueue | None = None, priority: int = STREAM_PRIORITY
    ) -> AsyncIterator[Message]:
        """Messages of a work, without the last one; counted in the metrics.

        A work of a higher `priority` runs in its process when no other one can.

        Raises
        ------
        RefusedError
            The work failed, or too many works wait.
        """
        if len(str(work.request.get("text", ""))) > self.settings.text_characters:
            raise RefusedError(
                413, "too_long", f"the text has more than {self.settings.text_characters} characters; divide it"
            )
        if "speak" not in key.scopes:
            raise RefusedError(403, "forbidden", f"the key {key.name} lacks the scope speak; use another key")
        self.limits.check_speech(key)
        made = 0.0
        if self.settings.log_text and work.request.get("text"):
            log_event("text", text=work.request["text"])
        try:
            check_words(str(work.request.get("text", "")))
            async with aclosing(self._stream(work, key, inputs, priority)) as stream:  # type: ignore[type-var]
                async for message in stream:
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
                    yield message
        except Tts2faceError as error:
            refused = as_refused(error)
            self.metrics.failures.labels(refused.code).inc()
            raise refused from error

    def _stream(self, work: Work, key: ApiKey, inputs: InputQueue | None, priority: int) -> AsyncIterator[Message]:
        """Messages of a work from the cache, or from a process."""
        made = self.pool.stream(work, key.name, priority, inputs)
        if self.cache is None or work.kind not in CACHED_KINDS:
            return made
        return self.cache.messages(work, made)

    def record(self, request: "Exchange", key: ApiKey | None) -> None:
        """Log, count and trace a finished request."""
        self.metrics.requests.labels(request.route, str(request.status)).inc()
        self.metrics.sent_bytes.inc(request.n_bytes)
        if request.first_byte_s is not None and request.status == 200:
            self.metrics.first_byte.labels(request.route).observe(request.first_byte_s)
        log_event(
            "request", id=request.id, method=request.method, path=request.route, status=request.status,
            code=request.code, key=key.name if key else None, bytes=request.n_bytes,
            first_byte_s=round(request.first_byte_s, 4) if request.first_byte_s is not None else None,
            seconds=round(request.age_s, 4), cut=request.is_cut,
        )  # fmt: skip
        if self.tracing is not None:
            self.tracing.record(request)


def _log_spoken(message: Message) -> None:
    if text := message.content["event"].get("text"):
        log_event("text", text=text)
