"""Limits of each key: requests a minute, requests at the same time, and seconds of speech a day."""

import time
from collections.abc import Callable
from dataclasses import dataclass, field

from tts2face.service.access.keys import ApiKey
from tts2face.service.errors import RefusedError

MINUTE_S, DAY_S = 60.0, 86_400.0


@dataclass(slots=True)
class _Usage:
    tokens: float
    at: float
    n_running: int = 0
    speech_s: float | None = None  # that are left of the day's
    speech_at: float = 0.0


@dataclass(slots=True)
class RateLimits:
    """Token buckets for each key: a minute's requests may come at once, then one each 60 / n seconds.

    Speech likewise: a day's seconds may be made at once, and come back evenly over the day. What is made is subtracted
    afterwards, also of requests that were cancelled, so that the last request may use more than is left.
    """

    clock: Callable[[], float] = time.monotonic
    _usage: dict[str, _Usage] = field(default_factory=dict)

    def begin(self, key: ApiKey) -> None:
        """Count a request.

        Raises
        ------
        RefusedError
            The key has no request left; with the seconds to wait.
        """
        now, per_minute, usage = self.clock(), key.requests_per_minute, self._of(key)
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

    def check_speech(self, key: ApiKey) -> None:
        """Check that a key may make speech.

        Raises
        ------
        RefusedError
            It has made its seconds of the day; with the seconds to wait.
        """
        if key.speech_s_per_day is not None and (left := self._speech_left(key)) <= 0:
            wait_s = (1.0 - left) * DAY_S / key.speech_s_per_day
            raise _refused(f"the key {key.name} has used its {key.speech_s_per_day} seconds of speech a day", wait_s)

    def add_speech(self, key: ApiKey, seconds: float) -> None:
        """Count speech that was made for a key."""
        if key.speech_s_per_day is not None and seconds > 0:
            left = self._speech_left(key) - seconds
            self._of(key).speech_s = left

    def _of(self, key: ApiKey) -> _Usage:
        return self._usage.setdefault(key.name, _Usage(float(key.requests_per_minute or 0), self.clock()))

    def _speech_left(self, key: ApiKey) -> float:
        """Seconds of speech that a key may make now; they are brought up to date."""
        usage, now, most = self._of(key), self.clock(), float(key.speech_s_per_day or 0)
        if usage.speech_s is None:
            usage.speech_s = most
        else:
            usage.speech_s = min(most, usage.speech_s + (now - usage.speech_at) * most / DAY_S)
        usage.speech_at = now
        return usage.speech_s


def _refused(reason: str, wait_s: float) -> RefusedError:
    seconds = max(1, int(wait_s + 0.999))
    return RefusedError(
        429, "rate_limited", f"{reason}; wait {seconds} s and repeat the request", {"Retry-After": str(seconds)}
    )
