"""Limits of each key: requests a minute and at the same time, seconds of speech a day, and faces of photos."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

from tts2face.service.access.keys import ApiKey
from tts2face.service.errors import RefusedError

MINUTE_S, DAY_S = 60.0, 86_400.0
PHOTOS_AT_ONCE = 1  # of a key; those that wait would take the turns of other keys


@dataclass(slots=True)
class _Bucket:
    """What is left of a period's most; it comes back evenly over the period, and is full at first."""

    left: float = 0.0
    at: float | None = None

    def refill(self, now: float, most: float, period_s: float) -> float:
        """What is left now."""
        self.left = most if self.at is None else min(most, self.left + (now - self.at) * most / period_s)
        self.at = now
        return self.left


@dataclass(slots=True)
class _Usage:
    requests: _Bucket = field(default_factory=_Bucket)
    speech_s: _Bucket = field(default_factory=_Bucket)
    photos: _Bucket = field(default_factory=_Bucket)
    n_running: int = 0
    n_photos: int = 0


@dataclass(slots=True)
class RateLimits:
    """Token buckets for each key: a minute's requests may come at once, then one each 60 / n seconds.

    Speech and photos likewise: a day's seconds may be made at once, and come back evenly over the day. What is made is
    subtracted afterwards, also of requests that were cancelled, so that the last request may use more than is left.
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
        per_minute, usage = key.requests_per_minute, self._of(key)
        if key.concurrent is not None and usage.n_running >= key.concurrent:
            raise _refused(f"the key {key.name} has {usage.n_running} requests running, its limit", 1.0)
        if per_minute is not None:
            left = usage.requests.refill(self.clock(), per_minute, MINUTE_S)
            if left < 1.0:
                wait_s = (1.0 - left) * MINUTE_S / per_minute
                raise _refused(f"the key {key.name} has used its {per_minute} requests a minute", wait_s)
            usage.requests.left -= 1.0
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
        if key.speech_s_per_day is not None:
            left = self._of(key).speech_s.refill(self.clock(), key.speech_s_per_day, DAY_S)
            if left <= 0:
                wait_s = (1.0 - left) * DAY_S / key.speech_s_per_day
                raise _refused(
                    f"the key {key.name} has used its {key.speech_s_per_day} seconds of speech a day", wait_s
                )

    def add_speech(self, key: ApiKey, seconds: float) -> None:
        """Count speech that was made for a key."""
        if key.speech_s_per_day is not None and seconds > 0:
            speech = self._of(key).speech_s
            speech.refill(self.clock(), key.speech_s_per_day, DAY_S)
            speech.left -= seconds

    @contextmanager
    def photo(self, key: ApiKey, per_day: int, *, counts: bool = True) -> Iterator[None]:
        """Read a photo of a key; `counts`: as one of its day's, of which the key may have its own number.

        Raises
        ------
        RefusedError
            The key reads one already, has used its photos of the day, or may have none.
        """
        usage = self._of(key)
        most = per_day if key.photos_per_day is None else key.photos_per_day
        if most == 0:
            raise RefusedError(403, "forbidden", f"the key {key.name} may make no faces of photos")
        if usage.n_photos >= PHOTOS_AT_ONCE:
            raise _refused(f"a face of a photo of the key {key.name} is being made", 5.0)
        left = usage.photos.refill(self.clock(), most, DAY_S)
        if left < 1.0:
            raise _refused(f"the key {key.name} has used its {most} photos a day", (1.0 - left) * DAY_S / most)
        usage.photos.left -= 1.0 if counts else 0.0
        usage.n_photos += 1
        try:
            yield
        finally:
            usage.n_photos -= 1

    def _of(self, key: ApiKey) -> _Usage:
        return self._usage.setdefault(key.name, _Usage())


def _refused(reason: str, wait_s: float) -> RefusedError:
    seconds = max(1, int(wait_s + 0.999))
    return RefusedError(
        429, "rate_limited", f"{reason}; wait {seconds} s and repeat the request", {"Retry-After": str(seconds)}
    )
