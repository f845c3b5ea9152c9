"""API keys: random, stored as hashes, with scopes and limits."""

import hashlib
import hmac
import re
import secrets
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from lexicon.errors import DataError, InputError
from lexicon.inputs import parse_toml, read_text
from tts2face.storage.files import write_atomically

SCOPES = ("speak", "build", "admin")  # synthesis; uploads and talkers; everybody's jobs and metrics
KEY_PREFIX = "t2f_"
N_KEY_BYTES = 32
MAX_FILE_BYTES = 1_000_000
LIMITS = ("requests_per_minute", "concurrent", "speech_s_per_day", "resources", "resources_mb", "photos_per_day")
MAY_BE_NONE = ("resources", "resources_mb", "photos_per_day")  # limits of which 0 is one, too
MAX_LIMIT = 1e9
NAMES = {"name", "hash", "scopes", *LIMITS}
NAME = re.compile(r"[A-Za-z0-9._-]{1,64}")


@dataclass(frozen=True, slots=True)
class ApiKey:
    """A key without its secret.

    Parameters
    ----------
    hash
        SHA-256 of the key, hexadecimal; a key has 256 random bits, so that no slow hash is needed.
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


LOCAL_KEY = ApiKey("local", "", SCOPES)  # of requests to a service without keys


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
        The file does not exist.
    DataError
        It is no file of keys.
    """
    try:
        content = parse_toml(read_text(path, MAX_FILE_BYTES), str(path))
    except FileNotFoundError as missing:
        raise InputError(
            f"there is no file of keys {path}; create it with `tts2face keys add NAME --file {path}`"
        ) from missing
    if not isinstance(listed := content.get("key", []), list):
        raise DataError(f"{path} has a key that is no table [[key]]; write it with `tts2face keys`")
    found = tuple(_key(path, one) for one in listed)
    if len({key.name for key in found}) < len(found) or set(content) - {"key"}:
        raise DataError(f"{path} names a key twice, or has other tables than [[key]]; write it with `tts2face keys`")
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
    if not NAME.fullmatch(name):
        raise InputError(f"a key's name consists of letters, digits, dots, dashes and underscores, not {name[:80]!r}")
    _check_limits(limits)
    if any(key.name == name for key in keys):
        raise InputError(f"{path} has a key named {name} already; choose another name, or remove it first")
    secret = KEY_PREFIX + secrets.token_urlsafe(N_KEY_BYTES)
    digest = hashlib.sha256(secret.encode()).hexdigest()
    write_keys(path, (*keys, ApiKey(name, digest, tuple(scopes), **limits)))
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
        _check_scopes(key.scopes)
        lines = [f'name = "{key.name}"', f'hash = "{key.hash}"', f"scopes = {list(key.scopes)!r}".replace("'", '"')]
        lines += [f"{limit} = {getattr(key, limit)}" for limit in LIMITS if getattr(key, limit) is not None]
        parts.append("[[key]]\n" + "\n".join(lines) + "\n")
    write_atomically(path, "\n".join(parts).encode())
    path.chmod(0o600)


def _key(path: Path, content: Any) -> ApiKey:
    if not isinstance(content, dict) or not set(content) <= NAMES or not {"name", "hash"} <= set(content):
        raise DataError(f"{path} has a key without name or hash, or with other names than {', '.join(sorted(NAMES))}")
    scopes = content.get("scopes", ["speak"])
    texts = (content["name"], content["hash"], *(scopes if isinstance(scopes, list) else [scopes]))
    is_plain = isinstance(scopes, list) and all(isinstance(text, str) for text in texts)
    if not is_plain or not NAME.fullmatch(content["name"]):
        raise DataError(
            f"{path} has a key whose name, hash or scopes are no plain texts; write it with `tts2face keys`"
        )
    key = ApiKey(**{**content, "scopes": tuple(scopes)})
    try:
        _check_scopes(key.scopes)
        _check_limits({limit: getattr(key, limit) for limit in LIMITS})
    except InputError as wrong:
        raise DataError(f"{path}, key {key.name}: {wrong}") from wrong
    return key


def _check_limits(limits: Mapping[str, Any]) -> None:
    for name, value in limits.items():
        if name in MAY_BE_NONE and value is not None:
            if isinstance(value, bool) or not isinstance(value, int | float) or not 0 <= value <= MAX_LIMIT:
                raise InputError(f"{name} must be a number from 0 to {MAX_LIMIT:g}, not {value!r}")
        elif value is not None and (type(value) is not int or value < 1):
            raise InputError(f"{name} must be a whole number of at least 1, not {value!r}")


def _check_scopes(scopes: Sequence[str]) -> None:
    for scope in scopes:
        if scope not in SCOPES:
            raise InputError(f"there is no scope {scope!r}; the scopes are {', '.join(SCOPES)}")
