"""What all parts of a running service share."""

import asyncio
import json
import logging
from collections.abc import AsyncIterator
from contextlib import aclosing
from typing import TYPE_CHECKING, Any

from lexicon.errors import Tts2faceError
from tts2face.service.errors import RefusedError, as_refused
from tts2face.service.job_service import JobService
from tts2face.service.keys import ApiKey, read_keys
from tts2face.service.library import Library
from tts2face.service.messages import Message, MessageKind
from tts2face.service.metrics import Metrics
from tts2face.service.pool import Pool, PoolSettings
from tts2face.service.rate_limits import RateLimits
from tts2face.service.settings import ServiceSettings
from tts2face.service.upload_checks import Checks
from tts2face.service.work import Work

if TYPE_CHECKING:
    from tts2face.service.exchange import Exchange

LOG = logging.getLogger("tts2face.service")
WARM_TEXT = "Hello there."


class ServiceState:
    """Settings, keys, pool, limits and metrics of a service."""

    def __init__(self, settings: ServiceSettings) -> None:
        self.settings = settings
        self.keys = read_keys(settings.keys) if settings.keys is not None else ()
        self.pool = Pool(PoolSettings(
            settings.processes, settings.sessions, settings.waiting,
            (self.work(format="mp4", request={"text": WARM_TEXT}).as_json(),
             self.work(kind="speech", request={"text": WARM_TEXT}).as_json()),
        ))  # fmt: skip
        self.jobs = JobService(settings)
        self.limits, self.metrics = RateLimits(), Metrics(self.pool, self.jobs)
        self.library, self.checks = Library(settings), Checks()
        self.is_draining = False

    def work(self, *, models: dict[str, Any] | None = None, **fields: Any) -> Work:
        """A work with the models of the settings unless it names others."""
        defaults = {"talker": self.settings.talker, "face": self.settings.face, "palette": self.settings.palette}
        return Work(models=defaults | (models or {}), **fields)

    async def messages(
        self, work: Work, key: ApiKey, inputs: "asyncio.Queue[Any] | None" = None
    ) -> AsyncIterator[Message]:
        """Messages of a work, without the last one; counted in the metrics.

        Raises
        ------
        RefusedError
            The work failed, or too many works wait.
        """
        if len(str(work.request.get("text", ""))) > self.settings.text_characters:
            raise RefusedError(
                413, "too_long", f"the text has more than {self.settings.text_characters} characters; divide it"
            )
        try:
            async with aclosing(self.pool.stream(work, key.name, inputs=inputs)) as stream:  # type: ignore[type-var]
                async for message in stream:
                    if message.kind == MessageKind.END:
                        measures = json.loads(message.payload)
                        self.metrics.speech.inc(measures["seconds"])
                        self.metrics.cpu.inc(measures["cpu_s"])
                        return
                    yield message
        except Tts2faceError as error:
            refused = as_refused(error)
            self.metrics.failures.labels(refused.code).inc()
            raise refused from error

    def record(self, request: "Exchange", key: ApiKey | None) -> None:
        """Log and count a finished request."""
        route = request.scope.get("route")
        path = getattr(route, "path", "other")
        self.metrics.requests.labels(path, str(request.status)).inc()
        self.metrics.sent_bytes.inc(request.n_bytes)
        if request.first_byte_s is not None and request.status == 200:
            self.metrics.first_byte.labels(path).observe(request.first_byte_s)
        LOG.info(json.dumps({
            "event": "request", "id": request.id, "method": request.scope.get("method", "WS"), "path": path,
            "status": request.status, "key": key.name if key else None, "bytes": request.n_bytes,
            "first_byte_s": round(request.first_byte_s, 4) if request.first_byte_s is not None else None,
            "seconds": round(request.age_s, 4),
        }))  # fmt: skip
