"""A content store in a bucket of S3, Google Cloud Storage or Azure Blob Storage, through obstore."""

import contextlib
import os
import re
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import timedelta
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from lexicon.errors import BackendError, InputError, import_of_extra
from tts2face.storage.temporary import Temporary

PROBE = "tts2face-store"  # object that shows that the store can be written
# Requests are repeated for 20 s; obstore's own limit is 3 minutes.
RETRIES = {
    "max_retries": 4,
    "retry_timeout": timedelta(seconds=20),
    "backoff": {"init_backoff": timedelta(seconds=0.2), "max_backoff": timedelta(seconds=4), "base": 2},
}
CONNECT_TIMEOUT = "5s"
REQUEST_TIMEOUT = "120s"  # of a whole request: 50 MB at 4 Mbit/s
ENDPOINTS = ("AWS_ENDPOINT_URL_S3", "AWS_ENDPOINT_URL", "AWS_ENDPOINT", "GOOGLE_BASE_URL", "AZURE_STORAGE_ENDPOINT",
             "AZURE_ENDPOINT")  # fmt: skip
ALLOW_HTTP = ("AWS_ALLOW_HTTP", "GOOGLE_ALLOW_HTTP", "AZURE_ALLOW_HTTP", "AZURE_STORAGE_USE_EMULATOR")
CREDENTIALS = {
    "s3": "AWS_ACCESS_KEY_ID, AWS_SECRET_ACCESS_KEY and AWS_REGION",
    "gs": "GOOGLE_SERVICE_ACCOUNT or GOOGLE_APPLICATION_CREDENTIALS",
    "az": "AZURE_STORAGE_ACCOUNT_NAME and AZURE_STORAGE_ACCOUNT_KEY",
}
_ENDPOINT_OF = {"s3": "AWS_ENDPOINT_URL", "gs": "GOOGLE_BASE_URL", "az": "AZURE_STORAGE_ENDPOINT"}
# Messages of obstore; what else they contain (requests, answers) may hold secrets and is never repeated.
_CODE = re.compile(r"<Code>(\w{1,60})</Code>")
_STATUS = re.compile(r"status code: (\d{3}(?: [A-Z][A-Za-z]+)*)")
_NO_BUCKET = re.compile(r"<Code>(?:NoSuchBucket|ContainerNotFound)</Code>")
_NO_CREDENTIALS = re.compile(
    r"169\.254\.169\.254|metadata\.google|token request|Missing(?: \w+)* ?(?:Access|Secret|Key|Account)|"
    r"Invalid Access Key|[Cc]redential|service account|private key|must be specified",
)
_AWAY = re.compile(
    r"error sending request|timed out|error decoding|connection|status code: (?:429|5\d\d)", re.IGNORECASE
)


class StoreAwayError(BackendError):
    """The store cannot be reached now; another try may succeed."""


@dataclass(frozen=True, slots=True)
class Stored:
    """Content under a name: its bytes, and when it was stored, in seconds since 1970."""

    name: str
    n_bytes: int
    stored_s: float


class BucketStore:
    """A folder of a bucket, or of a local folder by ``file://``; puts are atomic, and a file that was added stays."""

    def __init__(self, url: str, folder: str = "") -> None:
        with import_of_extra("stores by URL need the package obstore; pip install 'tts2face[batch]'"):
            import obstore
            import obstore.store
        self._obstore, self.place = obstore, url
        self._prefix = f"{folder}/" if folder else ""
        parts = urlsplit(url)
        if parts.password is not None or parts.query:
            raise InputError(
                f"the URL {parts.scheme}://... contains credentials, which other users of this machine can see; "
                f"give them by environment variables: {CREDENTIALS[self._kind]}"
            )
        options: dict[str, Any] = {}
        if parts.scheme == "file":
            Path(url.removeprefix("file://")).mkdir(parents=True, exist_ok=True)
        elif parts.scheme != "memory":
            options = {"retry_config": RETRIES, "client_options": _client_options()}
        try:
            self._store: Any = obstore.store.from_url(url, **options)
        except (ValueError, obstore.exceptions.BaseError) as wrong:
            if _NO_CREDENTIALS.search(str(wrong)):
                raise self._translate(wrong) from None
            raise InputError(f"cannot open the store {url} ({_first_line(wrong)}); correct the URL") from None

    def check(self) -> None:
        """Write a small object, so that wrong credentials end a batch before anything is rendered.

        Raises
        ------
        BackendError
            The store cannot be reached or written; the message says why.
        """
        with self._errors(is_put=True):
            self._obstore.put(self._store, PROBE, b"segments of tts2face batch\n")

    def has(self, name: str) -> bool:
        """Whether there is an object of a name."""
        try:
            with self._errors():
                self._obstore.head(self._store, self._prefix + name)
        except FileNotFoundError:
            return False
        return True

    def get(self, name: str, max_bytes: int) -> bytes | None:
        """Content of an object, of which more than `max_bytes` is cut off; None if there is none."""
        try:
            with self._errors():
                return bytes(self._obstore.get(self._store, self._prefix + name).bytes())[:max_bytes]
        except FileNotFoundError:
            return None

    def put(self, name: str, content: bytes) -> None:
        """Store bytes in place of what the name had."""
        with self._errors(is_put=True):
            self._obstore.put(self._store, self._prefix + name, content)

    def add(self, name: str, path: Path) -> None:
        """Upload a file if there is none of this name; one that is read by another machine is not replaced."""
        exceptions = self._obstore.exceptions
        with self._errors(is_put=True):
            try:
                self._obstore.put(self._store, self._prefix + name, path, mode="create", use_multipart=False)
            except exceptions.AlreadyExistsError:
                return
            except exceptions.BaseError as refused:
                if "501" not in str(refused) and not isinstance(refused, exceptions.NotSupportedError):
                    raise
                self._obstore.put(self._store, self._prefix + name, path)  # the server has no conditional puts

    def lend(self, name: str, copy: Path) -> Path:
        """Path of a copy, to which an object is downloaded unless it is there; FileNotFoundError if there is none."""
        if not copy.exists():
            with self._errors(), Temporary(copy) as temporary:
                found = self._obstore.get(self._store, self._prefix + name)
                with temporary.path.open("wb") as file:
                    for block in found.stream():
                        file.write(block)
                temporary.replace(copy)
        return copy

    def delete(self, name: str) -> None:
        """Remove an object, if there is one."""
        # another process has removed it
        with contextlib.suppress(FileNotFoundError), self._errors():
            self._obstore.delete(self._store, self._prefix + name)

    def entries(self) -> Iterator[Stored]:
        """All objects."""
        with self._errors():
            for page in self._obstore.list(self._store, self._prefix or None):
                for entry in page:
                    name = str(entry["path"]).removeprefix(self._prefix)
                    yield Stored(name, entry["size"], entry["last_modified"].timestamp())

    def scratch(self) -> None:
        """Nothing local."""

    @property
    def _kind(self) -> str:
        scheme = urlsplit(self.place).scheme
        return scheme if scheme in CREDENTIALS else "az"

    @contextlib.contextmanager
    def _errors(self, *, is_put: bool = False) -> Iterator[None]:
        """Errors of the store as BackendError; FileNotFoundError of a missing object stays."""
        try:
            yield
        except FileNotFoundError as missing:
            if not is_put and not _NO_BUCKET.search(str(missing)):
                raise
            raise BackendError(
                f"{self.place} does not exist; create the bucket or container, or correct the URL"
            ) from None
        except (self._obstore.exceptions.BaseError, OSError, ValueError) as error:
            raise self._translate(error) from None

    def _translate(self, error: Exception) -> BackendError:
        text = str(error).split("\n\nDebug source")[0]
        status, code = _STATUS.search(text), _CODE.search(text)
        reason = ", ".join(match[1] for match in (status, code) if match)
        exceptions = self._obstore.exceptions
        if isinstance(error, exceptions.PermissionDeniedError | exceptions.UnauthenticatedError):
            return BackendError(
                f"{self.place} refuses the credentials ({reason}); check {CREDENTIALS[self._kind]}, and their rights "
                "to read, write, list and delete"
            )
        if _NO_CREDENTIALS.search(text):
            return BackendError(f"there are no usable credentials for {self.place}; set {CREDENTIALS[self._kind]}")
        if _AWAY.search(text):
            variable = _ENDPOINT_OF[self._kind]
            place = urlsplit(os.environ.get(variable, "")).netloc.rpartition("@")[2]
            where = f"{self.place} cannot be reached{' at ' + place if place else ''}"
            return StoreAwayError(f"{where} ({reason or 'no connection'}); check the network and {variable}")
        return BackendError(f"{self.place} failed ({reason or _first_line(error)}); run again")


def _client_options() -> dict[str, Any]:
    """Limits of time; http only where an environment variable names such an endpoint."""
    is_local = any(os.environ.get(name, "").lower().startswith("http://") for name in ENDPOINTS)
    is_allowed = any(os.environ.get(name, "").lower() in ("1", "true", "yes") for name in ALLOW_HTTP)
    return {"connect_timeout": CONNECT_TIMEOUT, "timeout": REQUEST_TIMEOUT, "allow_http": is_local or is_allowed}


def _first_line(error: Exception) -> str:
    """Start of a message, without the queries of URLs, which may be signatures."""
    # queries of signed addresses are credentials
    return re.sub(r"\?\S+", "", str(error).split("\n")[0])[:160]
