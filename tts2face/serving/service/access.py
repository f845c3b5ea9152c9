"""Rights of a key: whether it still exists, its scopes, and its limits of requests, speech and faces of photos."""

import asyncio
import logging
import time
from collections import Counter
from collections.abc import Awaitable, Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

from fastapi import Request as HttpRequest

from tts2face.serving.service.errors import RefusedError
from tts2face.serving.service.keys import (
    DAY_S,
    LOCAL_KEY,
    MINUTE_S,
    NOBODY,
    PHOTOS,
    REQUESTS,
    SPEECH,
    ApiKey,
    find_key,
    read_keys,
)  # fmt: skip
from tts2face.serving.service.logs import log_event
from tts2face.serving.work.usage import Name, SharedUsage, Spent

PHOTOS_AT_ONCE = 1  # of a key; those that wait would take the turns of other keys
Exchange = Callable[[list[Spent], dict[Name, int]], Awaitable[SharedUsage]]  # as `UsageTable.exchange`


class KeyRing:
    """Who may use a service: everybody who reaches it if no file of keys is named, otherwise whom the file names now.

    A named file never opens the service, however few keys it holds and whatever is wrong with it.
    """

    def __init__(self, path: Path | None) -> None:
        self._path, self._keys = path, () if path is None else read_keys(path)
        self._reading = asyncio.Lock()
        self._note_if_empty()

    @property
    def is_open(self) -> bool:
        """Whether no key is asked for, as no file of keys is named."""
        return self._path is None

    def find(self, given: str) -> ApiKey:
        """Key of a secret; `LOCAL_KEY` for all secrets if no key is asked for.

        Raises
        ------
        RefusedError
            There is none.
        """
        found = LOCAL_KEY if self.is_open else find_key(self._keys, given)
        if found is None:
            what = f"the API key is {'unknown' if given else 'missing'}; send it as `Authorization: Bearer KEY`"
            raise _unauthorized(what if self._keys else "the service has no API keys now; ask its operator for one")
        return found

    def current(self, key: ApiKey) -> ApiKey:
        """A key that was found earlier, as it is now; raises as `find` if it has been removed."""
        if self.is_open:
            return key
        found = next((held for held in self._keys if held.hash == key.hash), None)
        # a named file without keys serves nobody: absence is no permission (decision 202)
        if found is None and not self._keys:
            raise _unauthorized("the service has no API keys now, so that nobody is served; ask its operator")
        if found is None:
            raise _unauthorized(f"the API key {key.name} has been removed; connect with another one")
        return found

    def with_scope(self, key: ApiKey, scope: str) -> ApiKey:
        """A key as it is now, if it has a scope."""
        key = self.current(key)
        if scope not in key.scopes:
            raise RefusedError(403, "forbidden", f"the key {key.name} lacks the scope {scope}; use another key")
        return key

    def loss_of(self, key: ApiKey) -> RefusedError | None:
        """Why what is open for a key ends: it has been removed, or may do less than it might; None: neither."""
        if key is NOBODY:
            return None
        try:
            lost = set(key.scopes) - set(self.current(key).scopes)
        except RefusedError as removed:
            return removed
        return (
            _unauthorized(f"the API key {key.name} has lost {', '.join(sorted(lost))}; connect again") if lost else None
        )

    def named(self, name: str) -> ApiKey | None:
        """The key of a name."""
        return next((key for key in ((LOCAL_KEY,) if self.is_open else self._keys) if key.name == name), None)

    async def reload(self) -> tuple[str, ...]:
        """Read the file again, in a thread, as its disk may be slow; names of its keys.

        The keys stay as they are until it has been read.
        """
        async with self._reading:
            found: tuple[ApiKey, ...] = ()
            try:
                # in a thread: a slow disk must not stop the event loop
                found = () if self._path is None else await asyncio.to_thread(read_keys, self._path)
            finally:
                self._keys = found
                self._note_if_empty()
        return tuple(key.name for key in found)

    def _note_if_empty(self) -> None:
        if not self.is_open and not self._keys:
            log_event("no keys", level=logging.ERROR, reason=f"{self._path} has no valid key, so nobody is served")


@dataclass(slots=True)
class Bucket:
    """The part of a period's most that is left; it comes back evenly over the period, and is full at first."""

    left: float = 0.0
    at: float | None = None
    most: float = 0.0
    period_s: float = MINUTE_S
    spent: float = 0.0  # of which the other servers do not know yet

    def refill(self, now: float, most: float, period_s: float) -> float:
        """The part that is left now."""
        self.left = most if self.at is None else min(most, self.left + (now - self.at) * most / period_s)
        self.at = now
        self.most, self.period_s = most, period_s
        return self.left

    def take(self, amount: float) -> None:
        """Take some of what is left."""
        self.left -= amount
        self.spent += amount


@dataclass(slots=True)
class RateLimits:
    """Token buckets for each key: a minute's requests may come at once, then one each 60 / n seconds.

    Speech and photos likewise: a day's seconds may be made at once, and come back evenly over the day. What is made is
    subtracted afterwards, also of requests that were cancelled, so that the last request may use more than is left.

    Servers that share a database share the buckets and what runs (decision 186); between two exchanges, and while the
    database is away, each counts alone.
    """

    clock: Callable[[], float] = time.monotonic
    _buckets: dict[Name, Bucket] = field(default_factory=dict)
    _running: Counter[Name] = field(default_factory=Counter)
    _elsewhere: Mapping[Name, int] = field(default_factory=dict)

    def begin(self, key: ApiKey) -> None:
        """Count a request.

        Raises
        ------
        RefusedError
            The key has no request left; with the seconds to wait.
        """
        n_running = self._n_running(key, REQUESTS)
        if key.concurrent is not None and n_running >= key.concurrent:
            raise _limited(f"the key {key.name} has {n_running} requests running, its limit", 1.0)
        self.count(key)
        self._running[key.name, REQUESTS] += 1

    def count(self, key: ApiKey) -> None:
        """Count a message of an open WebSocket that costs synthesis, as a request; raises as `begin`.

        The socket is one of the requests that run: its messages are worked on one after another.
        """
        per_minute = key.requests_per_minute
        if per_minute is not None:
            requests = self._bucket(key, REQUESTS)
            left = requests.refill(self.clock(), per_minute, MINUTE_S)
            if left < 1.0:
                wait_s = (1.0 - left) * MINUTE_S / per_minute
                raise _limited(f"the key {key.name} has used its {per_minute} requests a minute", wait_s)
            requests.take(1.0)

    def end(self, key: ApiKey) -> None:
        """Count the end of a request."""
        self._running[key.name, REQUESTS] -= 1

    def check_speech(self, key: ApiKey) -> None:
        """Check that a key may make speech."""
        if key.speech_s_per_day is not None:
            left = self._bucket(key, SPEECH).refill(self.clock(), key.speech_s_per_day, DAY_S)
            if left <= 0:
                wait_s = (1.0 - left) * DAY_S / key.speech_s_per_day
                raise _limited(
                    f"the key {key.name} has used its {key.speech_s_per_day} seconds of speech a day", wait_s
                )

    def add_speech(self, key: ApiKey, seconds: float) -> None:
        """Count speech that was made for a key."""
        if key.speech_s_per_day is not None and seconds > 0:
            speech = self._bucket(key, SPEECH)
            speech.refill(self.clock(), key.speech_s_per_day, DAY_S)
            speech.take(seconds)

    @contextmanager
    def photo(self, key: ApiKey, per_day: int, *, counts: bool = True) -> Iterator[None]:
        """Read a photo of a key; `counts`: as one of its day's, of which the key may have its own number.

        Raises
        ------
        RefusedError
            The key reads one already, has used its photos of the day, or may have none.
        """
        photos, name = self._bucket(key, PHOTOS), (key.name, PHOTOS)
        most = per_day if key.photos_per_day is None else key.photos_per_day
        if most == 0:
            raise RefusedError(403, "forbidden", f"the key {key.name} may make no faces of photos")
        if self._n_running(key, PHOTOS) >= PHOTOS_AT_ONCE:
            raise _limited(f"a face of a photo of the key {key.name} is being made", 5.0)
        left = photos.refill(self.clock(), most, DAY_S)
        if left < 1.0:
            raise _limited(f"the key {key.name} has used its {most} photos a day", (1.0 - left) * DAY_S / most)
        photos.take(1.0 if counts else 0.0)
        self._running[name] += 1
        try:
            yield
        finally:
            self._running[name] -= 1

    async def share(self, exchange: Exchange) -> None:
        """Give what was counted since the last time, and what runs now, and follow what all servers have counted.

        What `exchange` could not give, since the database is away, is given the next time; its error is raised.
        """
        spent = [
            Spent(name, bucket.spent, bucket.most, bucket.period_s)
            for name, bucket in self._buckets.items()
            if bucket.spent
        ]
        for taken in spent:
            self._buckets[taken.name].spent = 0.0
        running, self._running = dict(self._running), +self._running  # what no longer runs is given once, as 0
        try:
            found = await exchange(spent, running)
        # while the database is away each server counts alone (decision 186)
        except BaseException:
            self._elsewhere = {}
            for taken in spent:
                self._buckets[taken.name].spent += taken.amount
            raise
        self._elsewhere = found.running
        for name, (left, ago_s) in found.left.items():
            bucket = self._buckets.setdefault(name, Bucket())
            bucket.left, bucket.at = left - bucket.spent, self.clock() - ago_s

    def _bucket(self, key: ApiKey, quantity: str) -> Bucket:
        return self._buckets.setdefault((key.name, quantity), Bucket())

    def _n_running(self, key: ApiKey, quantity: str) -> int:
        return self._running[key.name, quantity] + self._elsewhere.get((key.name, quantity), 0)


@dataclass(frozen=True, slots=True)
class Permissions:
    """Which keys may have something spoken now: those that exist, have the scope speak, and have seconds left."""

    keys: KeyRing
    limits: RateLimits

    def speaking_key(self, key: ApiKey) -> ApiKey:
        """A key as it is now, if it may have something spoken."""
        key = self.keys.with_scope(key, "speak")
        self.limits.check_speech(key)
        return key

    def count(self, key: ApiKey) -> None:
        """Count an utterance of an open WebSocket as a request of its key; errors as `speaking_key` and the limits."""
        self.limits.count(self.speaking_key(key))


def _unauthorized(message: str) -> RefusedError:
    return RefusedError(401, "unauthorized", message, {"WWW-Authenticate": "Bearer"})


def require_scope(request: HttpRequest, scope: str, what: str) -> ApiKey:
    """Key of a request, which must have a scope; `what` names in the plural what needs it."""
    key: ApiKey = request.state.key
    if scope not in key.scopes:
        raise RefusedError(403, "forbidden", f"{what} need a key with the scope {scope}; this one has none such")
    return key


def _limited(reason: str, wait_s: float) -> RefusedError:
    # Retry-After has whole seconds: rounded up, so that the next try is not too early
    seconds = max(1, int(wait_s + 0.999))
    return RefusedError(
        429, "rate_limited", f"{reason}; wait {seconds} s and repeat the request", {"Retry-After": str(seconds)}
    )
