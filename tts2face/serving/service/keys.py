"""API keys: random, stored as hashes, with scopes and limits.

Limits of each key: requests a minute and at the same time, seconds of speech a day, and faces of photos.
"""

import hashlib
import hmac
import re
import secrets
import time
from collections import Counter
from collections.abc import Awaitable, Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from lexicon.errors import DataError, InputError
from lexicon.values.files import read_text
from lexicon.values.records import checked
from lexicon.values.toml_text import parse_toml
from tts2face.serving.service.errors import RefusedError
from tts2face.serving.work.usage import Name, SharedUsage, Spent
from tts2face.storage.files import write_atomically

SCOPES = ("speak", "build", "admin")  # synthesis; uploads and talkers; everybody's jobs and metrics
KEY_PREFIX = "t2f_"
N_KEY_BYTES = 32
MAX_FILE_BYTES = 1_000_000
LIMITS = ("requests_per_minute", "concurrent", "speech_s_per_day", "resources", "resources_mb", "photos_per_day")
MAY_BE_NONE = ("resources", "resources_mb", "photos_per_day")  # limits of which 0 is one, too
MAX_LIMIT = 1e9
NAME = re.compile(r"[A-Za-z0-9._-]{1,64}")
HASH = re.compile(r"[0-9a-f]{64}")
NO_SECRET = hashlib.sha256(b"").hexdigest()  # what a request without a key would match


@dataclass(frozen=True, slots=True)
class ApiKey:
    """A key without its secret.

    Parameters
    ----------
    hash
        SHA-256 of the key, hexadecimal; a key has 256 random bits, so that no slow hash is needed.
    scopes
        What it may do; a key of a file that names none may do nothing.
    requests_per_minute, concurrent, speech_s_per_day
        Limits; None: none.
    resources, resources_mb, photos_per_day
        Uploads, their MB, and the faces that are made of photos in a day; None: those of the settings.
    """

    name: str
    hash: str
    scopes: tuple[str, ...] = ("speak",)
    requests_per_minute: int | None = None
    concurrent: int | None = None
    speech_s_per_day: int | None = None
    resources: int | None = None
    resources_mb: float | None = None
    photos_per_day: int | None = None

    def __post_init__(self) -> None:
        """Check the name, the scopes and the limits."""
        if not NAME.fullmatch(self.name):
            raise InputError(
                f"a key's name consists of letters, digits, dots, dashes and underscores, not {self.name[:80]!r}"
            )
        for scope in self.scopes:
            if scope not in SCOPES:
                raise InputError(f"there is no scope {scope!r}; the scopes are {', '.join(SCOPES)}")
        for name in LIMITS:
            value = getattr(self, name)
            if value is not None and name in MAY_BE_NONE and not 0 <= value <= MAX_LIMIT:
                raise InputError(f"{name} must be a number from 0 to {MAX_LIMIT:g}, not {value!r}")
            if value is not None and name not in MAY_BE_NONE and value < 1:
                raise InputError(f"{name} must be a whole number of at least 1, not {value!r}")


@dataclass(frozen=True, slots=True)
class _Written:
    key: tuple[ApiKey, ...] = ()


LOCAL_KEY = ApiKey("local", "", SCOPES)  # of requests to a service without a file of keys
NOBODY = ApiKey("nobody", "", ())  # of requests that need no key


def find_key(keys: Sequence[ApiKey], given: str) -> ApiKey | None:
    """Key of a secret; compares all hashes in constant time."""
    digest, found = hashlib.sha256(given.encode()).hexdigest(), None
    for key in keys:
        if hmac.compare_digest(key.hash, digest):
            found = key
    return found


def read_keys(path: Path) -> tuple[ApiKey, ...]:
    """Keys of a file.

    Raises
    ------
    InputError
        The file does not exist, or cannot be read.
    DataError
        It is no file of keys.
    """
    try:
        content = parse_toml(read_text(path, MAX_FILE_BYTES), str(path))
    except FileNotFoundError as missing:
        raise InputError(
            f"there is no file of keys {path}; create it with `tts2face keys add NAME --file {path}`"
        ) from missing
    except OSError as refused:
        raise InputError(
            f"the file of keys {path} cannot be read: {refused.strerror}; check its place and its rights"
        ) from refused
    found = checked(_Written, content, str(path)).key
    found = tuple(key if "scopes" in given else replace(key, scopes=())
                  for key, given in zip(found, content.get("key", ()), strict=True))  # fmt: skip
    if len({key.name for key in found}) < len(found):
        raise DataError(f"{path} names a key twice; write it with `tts2face keys`")
    for key in found:
        if not HASH.fullmatch(key.hash) or key.hash == NO_SECRET:
            raise DataError(f"{path}: the hash of the key {key.name} is that of no key; write it with `tts2face keys`")
    return found


def add_key(path: Path, name: str, scopes: Sequence[str], **limits: Any) -> str:
    """Add a key to a file, which is created if needed; returns the secret, which is stored nowhere.

    Raises
    ------
    InputError
        The name exists already or has other characters than letters, digits and ``._-``, a scope is unknown, or a limit
        is not positive.
    """
    keys = read_keys(path) if path.exists() else ()
    secret = KEY_PREFIX + secrets.token_urlsafe(N_KEY_BYTES)
    key = ApiKey(name, hashlib.sha256(secret.encode()).hexdigest(), tuple(scopes), **limits)
    if any(one.name == name for one in keys):
        raise InputError(f"{path} has a key named {name} already; choose another name, or remove it first")
    write_keys(path, (*keys, key))
    return secret


def remove_key(path: Path, name: str) -> None:
    """Remove a key from a file.

    Raises
    ------
    InputError
        There is no such key.
    """
    keys = read_keys(path)
    if all(key.name != name for key in keys):
        names = ", ".join(key.name for key in keys) or "none"
        raise InputError(f"{path} has no key named {name}; its keys are {names}")
    write_keys(path, [key for key in keys if key.name != name])


def write_keys(path: Path, keys: Sequence[ApiKey]) -> None:
    """Write a file of keys that only its owner can read."""
    parts = []
    for key in keys:
        lines = [f'name = "{key.name}"', f'hash = "{key.hash}"', f"scopes = {list(key.scopes)!r}".replace("'", '"')]
        lines += [f"{limit} = {getattr(key, limit)}" for limit in LIMITS if getattr(key, limit) is not None]
        parts.append("[[key]]\n" + "\n".join(lines) + "\n")
    write_atomically(path, "\n".join(parts).encode())
    path.chmod(0o600)


MINUTE_S, DAY_S = 60.0, 86_400.0
REQUESTS, SPEECH, PHOTOS = "requests", "speech_s", "photos"  # names of quantities
PHOTOS_AT_ONCE = 1  # of a key; those that wait would take the turns of other keys


Exchange = Callable[[list[Spent], dict[Name, int]], Awaitable[SharedUsage]]  # as `UsageTable.exchange`


@dataclass(slots=True)
class Bucket:
    """What is left of a period's most; it comes back evenly over the period, and is full at first."""

    left: float = 0.0
    at: float | None = None
    most: float = 0.0
    period_s: float = MINUTE_S
    spent: float = 0.0  # of which the other servers do not know yet

    def refill(self, now: float, most: float, period_s: float) -> float:
        """What is left now."""
        self.left = most if self.at is None else min(most, self.left + (now - self.at) * most / period_s)
        self.at, self.most, self.period_s = now, most, period_s
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
            raise _refused(f"the key {key.name} has {n_running} requests running, its limit", 1.0)
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
                raise _refused(f"the key {key.name} has used its {per_minute} requests a minute", wait_s)
            requests.take(1.0)

    def end(self, key: ApiKey) -> None:
        """Count the end of a request."""
        self._running[key.name, REQUESTS] -= 1

    def check_speech(self, key: ApiKey) -> None:
        """Check that a key may make speech.

        Raises
        ------
        RefusedError
            It has made its seconds of the day; with the seconds to wait.
        """
        if key.speech_s_per_day is not None:
            left = self._bucket(key, SPEECH).refill(self.clock(), key.speech_s_per_day, DAY_S)
            if left <= 0:
                wait_s = (1.0 - left) * DAY_S / key.speech_s_per_day
                raise _refused(
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
            raise _refused(f"a face of a photo of the key {key.name} is being made", 5.0)
        left = photos.refill(self.clock(), most, DAY_S)
        if left < 1.0:
            raise _refused(f"the key {key.name} has used its {most} photos a day", (1.0 - left) * DAY_S / most)
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
        spent = [Spent(name, one.spent, one.most, one.period_s) for name, one in self._buckets.items() if one.spent]
        for taken in spent:
            self._buckets[taken.name].spent = 0.0
        running, self._running = dict(self._running), +self._running  # what no longer runs is given once, as 0
        try:
            found = await exchange(spent, running)
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


def _refused(reason: str, wait_s: float) -> RefusedError:
    seconds = max(1, int(wait_s + 0.999))
    return RefusedError(
        429, "rate_limited", f"{reason}; wait {seconds} s and repeat the request", {"Retry-After": str(seconds)}
    )
