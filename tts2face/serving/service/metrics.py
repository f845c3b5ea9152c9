"""Prometheus metrics of the service.

Every series is there from the start, with 0: Prometheus sees no increase in one that begins with its first event.
"""

from collections.abc import Iterable
from functools import partial

from prometheus_client import (
    CollectorRegistry,
    Counter,
    Gauge,
    Histogram,
    disable_created_metrics,
    generate_latest,
)

from tts2face.picture.pace import QUALITIES
from tts2face.serving.service.errors import DOCUMENTED, STATUS
from tts2face.serving.service.exchange import LEFT, OTHER
from tts2face.serving.service.job_service import JobService
from tts2face.serving.service.pool import Pool
from tts2face.serving.service.readiness import CHECKS, Readiness
from tts2face.serving.service.result_cache import ResultCache

# fine below half a second, in which the first bytes are to come (decision 025)
LATENCY_BUCKETS_S = (0.025, 0.05, 0.1, 0.15, 0.25, 0.35, 0.5, 0.75, 1, 2, 5, 10, 30, 120)
STATUSES = (200, LEFT, *DOCUMENTED)  # of any path; others, such as 206, begin with their first answer

disable_created_metrics()  # type: ignore[no-untyped-call]  # times of creation would be as many series again


def quality_labels(has_all_samples: bool, frame_step: int) -> tuple[str, str]:
    """Labels of a quality of movies."""
    return "all" if has_all_samples else "one a pixel", f"1 of {frame_step}"


class Metrics:
    """Counters of requests and results; gauges of the pool are read when they are asked for."""

    def __init__(self, pool: Pool, jobs: JobService, readiness: Readiness, cache: ResultCache | None = None) -> None:
        self.registry = CollectorRegistry()
        self.requests = Counter(
            "tts2face_requests", "Requests by path and status.", ["path", "status"], registry=self.registry
        )
        self.first_byte = Histogram(
            "tts2face_first_byte_seconds", "Seconds to the first byte of the body.", ["path"],
            buckets=LATENCY_BUCKETS_S, registry=self.registry,
        )  # fmt: skip
        self.sent_bytes = Counter("tts2face_sent_bytes", "Bytes of bodies.", registry=self.registry)
        self.failures = Counter(
            "tts2face_failures", "Failed works, and defects, by kind.", ["kind"], registry=self.registry
        )
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
        self._by_check = Gauge("tts2face_ready", "1: what /readyz checks is well.", ["check"], registry=self.registry)
        self._readiness = readiness
        self._begin()

    def _begin(self) -> None:
        for _, code in STATUS.values():
            self.failures.labels(code)
        for quality in QUALITIES:
            self.quality.labels(*quality_labels(quality.has_all_samples, quality.frame_step))
        for check in CHECKS:
            self._by_check.labels(check)
        self.begin_paths([OTHER])

    def begin_paths(self, paths: Iterable[str]) -> None:
        """Begin the series of the routes of an application."""
        for path in paths:
            self.first_byte.labels(path)
            for status in STATUSES:
                self.requests.labels(path, str(status))

    async def check(self) -> None:
        """Take over the checks of `/readyz`."""
        for check, reason in (await self._readiness.check()).items():
            self._by_check.labels(check).set(not reason)

    def as_text(self) -> bytes:
        """All metrics in Prometheus' text format."""
        return generate_latest(self.registry)


def _count(jobs: JobService, state: str) -> float:
    return jobs.counts[state]
