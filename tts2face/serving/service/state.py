"""Parts that all of a running service share: settings, keys, pool, limits, jobs and metrics."""

import asyncio
import logging
import os
from typing import TYPE_CHECKING

from fastapi import Request as HttpRequest
from fastapi import WebSocket

from lexicon.errors import Tts2faceError
from tts2face.serving.service.access import KeyRing, Permissions, RateLimits
from tts2face.serving.service.decoders import Decoders
from tts2face.serving.service.downloads import Downloads
from tts2face.serving.service.errors import STATUS
from tts2face.serving.service.exchange import in_background
from tts2face.serving.service.job_service import JobService
from tts2face.serving.service.library import Library
from tts2face.serving.service.logs import log_event
from tts2face.serving.service.messages import DefectError
from tts2face.serving.service.metrics import Metrics
from tts2face.serving.service.pool import Pool, PoolSettings
from tts2face.serving.service.presentations import Presentations
from tts2face.serving.service.readiness import Readiness
from tts2face.serving.service.result_cache import ResultCache
from tts2face.serving.service.results import Results, warm_steps
from tts2face.serving.service.settings import ServiceSettings
from tts2face.serving.service.tracing import tracing_from_environment

if TYPE_CHECKING:
    from tts2face.serving.service.exchange import Exchange


class ServiceState:
    """Settings, keys, pool, limits and metrics of a service; `tasks` as `server.Mount` has them."""

    def __init__(self, settings: ServiceSettings, tasks: tuple[str, ...] = ()) -> None:
        self.settings = settings
        self.keys = KeyRing(settings.keys)
        self.pool = Pool(PoolSettings(
            settings.processes, settings.waiting, warm_steps(settings),
            {"n_sessions": settings.sessions, "log_format": settings.log_format, "log_text": settings.log_text,
             "memory_mb": settings.memory_mb, "sentences_mb": settings.sentences_mb, "tasks": tasks,
             "signing": settings.signing},
        ))  # fmt: skip
        self.downloads = Downloads()
        self.library, self.decoders = Library(settings), Decoders()
        self.limits = RateLimits()
        self.jobs = JobService(settings, self.library, self.limits)
        self.cache: ResultCache | None = None
        if settings.cache_mb:
            folder = "cache" if settings.signing is None else "cache-signed"
            self.cache = ResultCache(settings.data_folder / folder, settings.cache_mb * 1_000_000)
        self.readiness = Readiness(self.pool, self.jobs, settings)
        self.metrics = Metrics(self.pool, self.jobs, self.readiness, self.cache)
        self.jobs.on_defect = self.note_defect
        self.permissions = Permissions(self.keys, self.limits)
        self.results = Results(settings, self.permissions, self.pool, self.metrics, self.cache)
        self.presentations = Presentations(settings.live_targets, self.permissions)
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
            # a damaged file serves nobody (decision 202)
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


def service_state(request: HttpRequest | WebSocket) -> ServiceState:
    """State of the service that received a request."""
    state: ServiceState = request.app.state.service
    return state
