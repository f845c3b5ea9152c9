"""A store in a bucket of S3, Google Cloud Storage or Azure Blob Storage, through obstore.

What all stores of segments share: names, results and errors.
"""

import contextlib
import json
import os
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from datetime import timedelta
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from lexicon.errors import BackendError, DataError, InputError
from lexicon.inputs import parse_json
from tts2face.serving.batch.segment import SEGMENT_SUFFIX, SegmentResult, result_from_json
from tts2face.storage.temporary import Temporary

RESULT_SUFFIX = ".json"


class StoreAwayError(BackendError):
    """The store cannot be reached now; another try may succeed."""


@dataclass(frozen=True, slots=True)
class StoredSegment:
    """A stored segment: its files together, and when it was stored, in seconds since 1970."""

    address: str
    n_bytes: int
    stored_s: float


def sum_files(files: Iterable[tuple[str, int, float]]) -> Iterator[StoredSegment]:
    """Segments of files given by address, bytes and time; a segment has the time of its latest file."""
    found: dict[str, StoredSegment] = {}
    for address, n_bytes, stored_s in files:
        other = found.get(address, StoredSegment(address, 0, 0.0))
        found[address] = StoredSegment(address, other.n_bytes + n_bytes, max(other.stored_s, stored_s))
    yield from found.values()


def parse_result(content: bytes) -> SegmentResult | None:
    """Result of its JSON; None if it is damaged, so that the segment is rendered again."""
    try:
        return result_from_json(parse_json(content.decode("utf-8"), "the result of a segment"))
    except (ValueError, TypeError, AttributeError, DataError):
        return None


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


class ObjectStore:
    """A bucket, or a folder by ``file://``; puts are atomic, and a stored movie is not replaced.

    Raises
    ------
    InputError
        The URL is wrong, or contains credentials.
    BackendError
        The package obstore is missing.
    """

    def __init__(self, url: str) -> None:
        try:
            import obstore
            import obstore.store
        except ImportError as missing:
            raise BackendError("stores by URL need the package obstore; pip install 'tts2face[batch]'") from missing
        self._obstore, self.url = obstore, url
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

    def result(self, address: str) -> SegmentResult | None:
        """Result of a stored segment; None if it is not stored."""
        try:
            with self._errors():
                return parse_result(bytes(self._obstore.get(self._store, self._name(address, RESULT_SUFFIX)).bytes()))
        except FileNotFoundError:
            return None

    def put(self, address: str, movie: Path, result: SegmentResult) -> None:
        """Upload a movie unless there is one, then its result."""
        with self._errors(is_put=True):
            self._put_new(self._name(address, SEGMENT_SUFFIX), movie)
            self._obstore.put(self._store, self._name(address, RESULT_SUFFIX), json.dumps(result.as_json()).encode())
        movie.unlink(missing_ok=True)

    def fetch(self, address: str, folder: Path) -> Path:
        """Path of a copy of a stored segment."""
        path = folder / f"{address}{SEGMENT_SUFFIX}"
        if path.exists():
            return path
        try:
            self.get_object(self._name(address, SEGMENT_SUFFIX), path)
        except FileNotFoundError:
            self.remove(address)  # a result without its movie
            raise BackendError(f"the segment {address[:12]} is missing in {self.url}; run again") from None
        return path

    def addresses(self) -> Iterator[str]:
        """Addresses of all stored segments."""
        with self._errors():
            for page in self._obstore.list(self._store):
                for entry in page:
                    path = str(entry["path"])
                    if path.endswith(RESULT_SUFFIX):
                        yield Path(path).stem

    def entries(self) -> Iterator[StoredSegment]:
        """All stored segments with their sizes and times."""
        with self._errors():
            files = (entry for page in self._obstore.list(self._store) for entry in page)
            yield from sum_files(
                (Path(entry["path"]).stem, entry["size"], entry["last_modified"].timestamp())
                for entry in files
                if entry["path"].endswith((SEGMENT_SUFFIX, RESULT_SUFFIX))
            )

    def remove(self, address: str) -> None:
        """Remove a segment, its result first."""
        for suffix in (RESULT_SUFFIX, SEGMENT_SUFFIX):
            self.delete_object(self._name(address, suffix))

    def put_object(self, name: str, path: Path) -> None:
        """Upload a file under a name unless there is one of this name."""
        with self._errors(is_put=True):
            self._put_new(name, path)

    def get_object(self, name: str, path: Path) -> None:
        """Download an object to a path, where it appears complete; FileNotFoundError if there is none."""
        with self._errors(), Temporary(path) as temporary:
            found = self._obstore.get(self._store, name)
            with temporary.path.open("wb") as file:
                for block in found.stream():
                    file.write(block)
            temporary.replace(path)

    def has_object(self, name: str) -> bool:
        """Whether there is an object of a name."""
        try:
            with self._errors():
                self._obstore.head(self._store, name)
        except FileNotFoundError:
            return False
        return True

    def list_objects(self, prefix: str) -> Iterator[tuple[str, float]]:
        """Names of the objects in a folder, with the times at which they were stored, in seconds since 1970."""
        with self._errors():
            for page in self._obstore.list(self._store, prefix):
                for entry in page:
                    yield str(entry["path"]), entry["last_modified"].timestamp()

    def delete_object(self, name: str) -> None:
        """Remove an object, if there is one."""
        with contextlib.suppress(FileNotFoundError), self._errors():
            self._obstore.delete(self._store, name)

    def scratch(self) -> Path | None:
        """Nothing local."""
        return None

    @property
    def _kind(self) -> str:
        scheme = urlsplit(self.url).scheme
        return scheme if scheme in CREDENTIALS else "az"

    def _put_new(self, name: str, movie: Path) -> None:
        """Upload a file if there is none of this name; one that is read by another machine is not replaced."""
        exceptions = self._obstore.exceptions
        try:
            self._obstore.put(self._store, name, movie, mode="create", use_multipart=False)
        except exceptions.AlreadyExistsError:
            return
        except exceptions.BaseError as refused:
            if "501" not in str(refused) and not isinstance(refused, exceptions.NotSupportedError):
                raise
            self._obstore.put(self._store, name, movie)  # the server has no conditional puts

    @contextlib.contextmanager
    def _errors(self, *, is_put: bool = False) -> Iterator[None]:
        """Errors of the store as BackendError; FileNotFoundError of a missing object stays."""
        try:
            yield
        except FileNotFoundError as missing:
            if not is_put and not _NO_BUCKET.search(str(missing)):
                raise
            raise BackendError(
                f"{self.url} does not exist; create the bucket or container, or correct the URL"
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
                f"{self.url} refuses the credentials ({reason}); check {CREDENTIALS[self._kind]}, and their rights to "
                "read, write, list and delete"
            )
        if _NO_CREDENTIALS.search(text):
            return BackendError(f"there are no usable credentials for {self.url}; set {CREDENTIALS[self._kind]}")
        if _AWAY.search(text):
            variable = _ENDPOINT_OF[self._kind]
            place = urlsplit(os.environ.get(variable, "")).netloc.rpartition("@")[2]
            where = f"{self.url} cannot be reached{' at ' + place if place else ''}"
            return StoreAwayError(f"{where} ({reason or 'no connection'}); check the network and {variable}")
        return BackendError(f"{self.url} failed ({reason or _first_line(error)}); run again")

    @staticmethod
    def _name(address: str, suffix: str) -> str:
        return f"{address[:2]}/{address}{suffix}"


def _client_options() -> dict[str, Any]:
    """Limits of time; http only where an environment variable names such an endpoint."""
    is_local = any(os.environ.get(name, "").lower().startswith("http://") for name in ENDPOINTS)
    is_allowed = any(os.environ.get(name, "").lower() in ("1", "true", "yes") for name in ALLOW_HTTP)
    return {"connect_timeout": CONNECT_TIMEOUT, "timeout": REQUEST_TIMEOUT, "allow_http": is_local or is_allowed}


def _first_line(error: Exception) -> str:
    """Start of a message, without the queries of URLs, which may be signatures."""
    return re.sub(r"\?\S+", "", str(error).split("\n")[0])[:160]
