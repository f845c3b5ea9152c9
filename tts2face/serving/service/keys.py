"""API keys: random, stored as hashes, with scopes and limits."""

import hashlib
import hmac
import re
import secrets
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from lexicon.errors import DataError, InputError
from lexicon.values.files import read_text
from lexicon.values.records import checked
from lexicon.values.toml_text import parse_toml
from tts2face.storage.files import write_atomically

# synthesis; live targets of the operator; uploads and talkers; everybody's jobs and metrics
SCOPES = ("speak", "live", "build", "admin")
KEY_PREFIX = "t2f_"
# 256 random bits: a plain hash of them cannot be guessed, and needs no salt
N_KEY_BYTES = 32
MAX_FILE_BYTES = 1_000_000
LIMITS = ("requests_per_minute", "concurrent", "speech_s_per_day", "resources", "resources_mb", "photos_per_day")
MAY_BE_NONE = ("resources", "resources_mb", "photos_per_day")  # limits of which 0 is one, too
MAX_LIMIT = 1e9
NAME = re.compile(r"[A-Za-z0-9._-]{1,64}")
HASH = re.compile(r"[0-9a-f]{64}")
NO_SECRET = hashlib.sha256(b"").hexdigest()  # what a request without a key would match
MINUTE_S, DAY_S = 60.0, 86_400.0
# Names of quantities.
REQUESTS = "requests"
SPEECH = "speech_s"
PHOTOS = "photos"


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
    if any(key.name == name for key in keys):
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
    # hashes and names of keys are for the operator alone
    path.chmod(0o600)
