"""Prometheus metrics of the service."""

from functools import partial
from typing import TYPE_CHECKING

from prometheus_client import CollectorRegistry, Counter, Gauge, Histogram, generate_latest

if TYPE_CHECKING:
    from tts2face.service.jobs.job_service import JobService
    from tts2face.service.synthesis.pool import Pool
    from tts2face.service.synthesis.result_cache import ResultCache

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
