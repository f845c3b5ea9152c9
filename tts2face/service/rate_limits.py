"""Limits of each key: requests a minute, and requests at the same time."""

import time
from collections.abc import Callable
from dataclasses import dataclass, field

from tts2face.service.errors import RefusedError
from tts2face.service.keys import ApiKey

MINUTE_S = 60.0


@dataclass(slots=True)
class _Usage:
    tokens: float
    at: float
    n_running: int = 0


@dataclass(slots=True)
class RateLimits:
    """A token bucket for each key: a minute's requests may come at once, then one each 60 / n seconds."""

    clock: Callable[[], float] = time.monotonic
    _usage: dict[str, _Usage] = field(default_factory=dict)

    def begin(self, key: ApiKey) -> None:
        """Count a request.

        Raises
        ------
        RefusedError
            The key has no request left; with the seconds to wait.
        """
        now, per_minute = self.clock(), key.requests_per_minute
        usage = self._usage.setdefault(key.name, _Usage(float(per_minute or 0), now))
        if key.concurrent is not None and usage.n_running >= key.concurrent:
            raise _refused(f"the key {key.name} has {usage.n_running} requests running, its limit", 1.0)
        if per_minute is not None:
            usage.tokens = min(float(per_minute), usage.tokens + (now - usage.at) * per_minute / MINUTE_S)
            usage.at = now
            if usage.tokens < 1.0:
                wait_s = (1.0 - usage.tokens) * MINUTE_S / per_minute
                raise _refused(f"the key {key.name} has used its {per_minute} requests a minute", wait_s)
            usage.tokens -= 1.0
        usage.n_running += 1

    def end(self, key: ApiKey) -> None:
        """Count the end of a request."""
        self._usage[key.name].n_running -= 1


def _refused(reason: str, wait_s: float) -> RefusedError:
    seconds = max(1, int(wait_s + 0.999))
    return RefusedError(
        429, "rate_limited", f"{reason}; wait {seconds} s and repeat the request", {"Retry-After": str(seconds)}
    )
