"""What all parts of a running service share.

Prometheus metrics of the service.
"""

import asyncio
import logging
import os
from collections.abc import AsyncIterator
from contextlib import aclosing
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from prometheus_client import CollectorRegistry, Counter, Gauge, Histogram, generate_latest

from lexicon.errors import Tts2faceError
from tts2face.processes.message import RESULT, Message
from tts2face.serving.service.access import KeyRing
from tts2face.serving.service.errors import RefusedError, as_refused
from tts2face.serving.service.exchange import in_background, while_client_stays
from tts2face.serving.service.job_service import JobService
from tts2face.serving.service.keys import LOCAL_KEY, ApiKey, RateLimits
from tts2face.serving.service.library import Library
from tts2face.serving.service.logs import log_event
from tts2face.serving.service.messages import QUALITY, SYNTHESISE, Work, check_words
from tts2face.serving.service.pool import STREAM_PRIORITY, InputQueue, Pool, PoolSettings, work_call
from tts2face.serving.service.preparation import Step
from tts2face.serving.service.readiness import Readiness
from tts2face.serving.service.result_cache import CACHED_KINDS, ResultCache
from tts2face.serving.service.settings import ServiceSettings
from tts2face.serving.service.tracing import tracing_from_environment
from tts2face.serving.service.uploads import Checks

if TYPE_CHECKING:
    from tts2face.serving.service.exchange import Exchange
    from tts2face.serving.service.pool import Pool
    from tts2face.serving.service.result_cache import ResultCache


LATENCY_BUCKETS_S = (0.025, 0.05, 0.1, 0.15, 0.25, 0.35, 0.5, 0.75, 1, 2, 5, 10, 30, 120)


class Metrics:
    """Counters of requests and results; gauges of the pool are read when they are asked for."""

    def __init__(self, pool: "Pool", jobs: "JobService", cache: "ResultCache | None" = None) -> None:
        self.registry = CollectorRegistry()
        self.requests = Counter(
            "tts2face_requests", "Requests by path and status.", ["path", "status"], registry=self.registry
        )
        self.first_byte = Histogram(
            "tts2face_first_byte_seconds", "Seconds to the first byte of the body.", ["path"],
            buckets=LATENCY_BUCKETS_S, registry=self.registry,
        )  # fmt: skip
        self.sent_bytes = Counter("tts2face_sent_bytes", "Bytes of bodies.", registry=self.registry)
        self.failures = Counter("tts2face_failures", "Failed works by kind.", ["kind"], registry=self.registry)
        self.speech = Counter("tts2face_speech_seconds", "Seconds of speech made.", registry=self.registry)
        self.cpu = Counter("tts2face_synthesis_seconds", "Seconds that processes spent on it.", registry=self.registry)
        self.quality = Counter(
            "tts2face_quality_changes", "Changes of the quality of movies in work, by the one that follows.",
            ["samples", "frames"], registry=self.registry,
        )  # fmt: skip
        self.cancel = Histogram(
            "tts2face_cancel_seconds", "Seconds until a cancelled work had released what it held.",
            buckets=LATENCY_BUCKETS_S, registry=self.registry,
        )  # fmt: skip
        for process in pool.processes:
            process.on_cancelled = self.cancel.observe
        gauges = {
            "tts2face_processes_ready": ("Synthesis processes that are ready.", lambda: pool.n_ready),
            "tts2face_waiting": ("Requests that wait for a process.", lambda: pool.n_waiting),
            "tts2face_oldest_waiting_seconds": ("Age of the oldest of them.", lambda: pool.oldest_waiting_s),
            "tts2face_jobs_oldest_waiting_seconds": ("Age of the oldest waiting job.", lambda: jobs.oldest_waiting_s),
            "tts2face_load": ("Cost of the running works; 1 is a movie.", lambda: pool.load),
        }
        if cache is not None:
            gauges |= {
                "tts2face_cache_hits": ("Results that the cache had.", lambda: cache.n_hits),
                "tts2face_cache_misses": ("Results that it did not have.", lambda: cache.n_misses),
                "tts2face_cache_bytes": ("Size of the cache.", lambda: cache.n_bytes),
            }
        for name, (text, read) in gauges.items():
            Gauge(name, text, registry=self.registry).set_function(read)
        by_state = Gauge("tts2face_jobs", "Jobs of the database by state.", ["state"], registry=self.registry)
        for state in jobs.counts:
            by_state.labels(state).set_function(partial(_count, jobs, state))

    def as_text(self) -> bytes:
        """All metrics in Prometheus' text format."""
        return generate_latest(self.registry)


def _count(jobs: "JobService", state: str) -> float:
    return jobs.counts[state]


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
        self.library, self.checks, self.video_checks = Library(settings), Checks(), Checks()
        self.limits = RateLimits()
        self.jobs = JobService(settings, self.library, self.limits)
        self.cache: ResultCache | None = None
        if settings.cache_mb:
            self.cache = ResultCache(settings.data_folder / "cache", settings.cache_mb * 1_000_000)
        self.metrics = Metrics(self.pool, self.jobs, self.cache)
        self.tracing = tracing_from_environment(os.environ)
        self.is_draining = False
        self.readiness = Readiness(self.pool, self.jobs, settings)
        self.exchanges: set[Exchange] = set()  # requests that are being answered
        self._ending: list[asyncio.Task[None]] = []  # those of keys that were removed
        self.running: set[Exchange] = set()  # those for which a draining service waits

    def reload_keys(self) -> None:
        """Read the file of keys again, and end what is open for keys that it no longer has, or that may do less.

        If it cannot be read, nobody is served.
        """
        if self.keys.is_open:
            return log_event("keys not reloaded", reason="the service has no file of keys")
        names: tuple[str, ...] | None = None
        try:
            names = self.keys.reload()
        except Tts2faceError as error:
            log_event("keys not reloaded", level=logging.ERROR, reason=str(error))
        losses = [(one, self.keys.loss_of(one.key)) for one in self.exchanges if one.key is not None]
        self._ending = [in_background(one.revoke(loss)) for one, loss in losses if loss is not None]
        if names is not None:
            log_event("keys reloaded", keys=list(names), ended=len(self._ending))
        return None

    def speaking_key(self, key: ApiKey) -> ApiKey:
        """A key as it is now, if it may have something spoken.

        Raises
        ------
        RefusedError
            It has been removed, lacks the scope speak, or has used its seconds of speech.
        """
        key = self.keys.current(key)
        if "speak" not in key.scopes:
            raise RefusedError(403, "forbidden", f"the key {key.name} lacks the scope speak; use another key")
        self.limits.check_speech(key)
        return key

    def count(self, key: ApiKey) -> None:
        """Count an utterance of an open WebSocket as a request of its key; errors as `speaking_key` and the limits."""
        self.limits.count(self.speaking_key(key))

    def work(self, *, models: dict[str, Any] | None = None, **fields: Any) -> Work:
        """A work with the models of the settings unless it names others."""
        defaults = {"talker": self.settings.talker, "face": self.settings.face, "palette": self.settings.palette}
        return Work(models=defaults | (models or {}), owner=self.common_owner, **fields)

    def _steps(self) -> tuple[Step, ...]:
        """What synthesis processes prepare: the longest compilation first, then the voice and the models of a movie."""
        works = {"voice": self.work(kind="speech", request={"text": WARM_TEXT}),
                 "models": self.work(format="mp4", request={"text": WARM_TEXT})}  # fmt: skip
        kernels = {f"kernels of {part}": f"compile_{part}" for part in ("pictures", "motion", "gestures", "sound")}
        return (
            *(Step(name, call, works["models"].models, is_shared=True) for name, call in kernels.items()),
            *(Step(name, SYNTHESISE, work_call(work)) for name, work in works.items()),
        )

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
        ClientDisconnect
            The client of the present request has left; the work no longer waits, or has been stopped.
        """
        if len(str(work.request.get("text", ""))) > self.settings.text_characters:
            raise RefusedError(
                413, "too_long", f"the text has more than {self.settings.text_characters} characters; divide it"
            )
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
            samples, frames = "all" if event["has_all_samples"] else "one a pixel", f"1 of {event['frame_step']}"
            self.metrics.quality.labels(samples, frames).inc()
            log_event("quality", samples=samples, frames=frames)

    def _stream(self, work: Work, key: ApiKey, inputs: InputQueue | None, priority: int) -> AsyncIterator[Message]:
        """Messages of a work from the cache, or from a process."""
        made = self.pool.stream(work, key.name, priority, inputs)
        if self.cache is None or work.kind not in CACHED_KINDS:
            return made
        return self.cache.messages(work, made)

    def record(self, request: "Exchange") -> None:
        """Log, count and trace a finished request."""
        self.metrics.requests.labels(request.route, str(request.status)).inc()
        self.metrics.sent_bytes.inc(request.n_bytes)
        if request.first_byte_s is not None and request.status == 200:
            self.metrics.first_byte.labels(request.route).observe(request.first_byte_s)
        log_event(
            "request", id=request.id, method=request.method, path=request.route, status=request.status,
            code=request.code, key=request.key.name if request.key else None, bytes=request.n_bytes,
            first_byte_s=round(request.first_byte_s, 4) if request.first_byte_s is not None else None,
            seconds=round(request.age_s, 4), cut=request.is_cut,
        )  # fmt: skip
        if self.tracing is not None:
            self.tracing.record(request)


def _folders(work: Work) -> set[Path]:
    """Folders of the files that a work reads, uploads among them."""
    values = [value for fields in (work.models, work.request, work.picture) for value in fields.values()]
    return {Path(value).parent for value in values if isinstance(value, str | Path) and Path(value).is_absolute()}


def _log_spoken(message: Message) -> None:
    if text := message.content["event"].get("text"):
        log_event("text", text=text)
