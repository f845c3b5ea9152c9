"""Files under names that say what made them, complete or not there at all, in a local folder or a bucket.

A name is a file name, or one in a folder of its first two characters (`divided`), of which a store may hold many.
"""

import hashlib
import os
import shutil
import time
from collections.abc import Collection, Iterator
from contextlib import suppress
from functools import lru_cache
from pathlib import Path

from lexicon.errors import BackendError, InputError
from tts2face.storage.bucket import BucketStore, Stored
from tts2face.storage.files import write_atomically
from tts2face.storage.temporary import NAME_INFIX, Temporary, remove_left_behind

REMOTE_SCHEMES = ("s3://", "gs://", "az://", "abfs://", "file://", "memory://")


def open_content_store(where: str | Path, folder: str = "") -> "ContentStore":
    """A folder of the store at a local path, or at a URL of S3, Google Cloud Storage or Azure; "": the store itself.

    Raises
    ------
    InputError
        The URL has an unknown scheme, is wrong, or contains credentials.
    BackendError
        The package obstore is missing.
    """
    text = str(where)
    if text.startswith(REMOTE_SCHEMES):
        return BucketStore(text, folder)
    if "://" in text:
        raise InputError(
            f"there is no store {text}; give a folder, or a URL that begins with {', '.join(REMOTE_SCHEMES)}"
        )
    return FolderStore(Path(text) / folder)


def divided(name: str) -> str:
    """The name in a folder of its first two characters."""
    return f"{name[:2]}/{name}"


class FolderStore:
    """A local folder, which is created when a file is stored; files appear by rename.

    As a cache it is bounded by `prune`. Callers translate the OSError of a folder that cannot be written and of a full
    disk, except of `check` and `put`.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    @property
    def place(self) -> str:
        """Path of the folder."""
        return str(self.folder)

    def check(self) -> None:
        """Refuse a folder that cannot be written.

        Raises
        ------
        BackendError
            It cannot be written.
        """
        try:
            with Temporary(self.scratch() / "check"):
                pass
        except OSError as error:
            raise BackendError(
                f"cannot write the folder {self.folder}: {error.strerror}; change its permissions or choose another one"
            ) from error

    def path(self, name: str) -> Path:
        """Path of the file of a name, which need not exist."""
        return self.folder / name

    def has(self, name: str) -> bool:
        """Whether there is a file of a name."""
        return self.path(name).is_file()

    def get(self, name: str, max_bytes: int) -> bytes | None:
        """Content of a file, of which more than `max_bytes` is cut off; None if there is none or it cannot be read."""
        try:
            with self.path(name).open("rb") as file:
                return file.read(max_bytes)
        except OSError:
            return None

    def put(self, name: str, content: bytes) -> None:
        """Store bytes in place of what the name had; a BackendError if they cannot be written."""
        write_atomically(self._target(name), content)

    def add(self, name: str, path: Path) -> None:
        """Move a file into place, by a copy from another file system."""
        target = self._target(name)
        if path.stat().st_dev == target.parent.stat().st_dev:
            path.replace(target)
        else:
            with Temporary(target) as temporary:
                shutil.copyfile(path, temporary.path)
                temporary.replace(target)

    def draft(self) -> Temporary:
        """A new file that `keep` stores; as a context it is removed in the end unless it was kept."""
        self.folder.mkdir(parents=True, exist_ok=True)
        return Temporary(self.folder / "new")

    def remove_drafts(self) -> None:
        """Remove the drafts of processes that have ended."""
        remove_left_behind(self.folder / "new")

    def keep(self, draft: Temporary, name: str) -> None:
        """Store a complete draft."""
        draft.replace(self._target(name))

    def lend(self, name: str, copy: Path) -> Path:
        """Path of a file, which must not be changed; FileNotFoundError if there is none."""
        if not self.has(name):
            raise FileNotFoundError(self.path(name))
        return self.path(name)

    def delete(self, name: str) -> None:
        """Remove a file, if there is one."""
        self.path(name).unlink(missing_ok=True)

    def entries(self) -> Iterator[Stored]:
        """All files in the order of their names, without unfinished ones."""
        for name, status in self._files():
            yield Stored(name, status.st_size, status.st_mtime)

    def scratch(self) -> Path:
        """Folder in which files are written that `add` then moves into place."""
        folder = self.folder / "scratch"
        folder.mkdir(exist_ok=True)
        return folder

    def touch(self, name: str) -> None:
        """Note that a file is used now; when it was stored stays."""
        path = self.path(name)
        os.utime(path, ns=(time.time_ns(), path.stat().st_mtime_ns))

    def prune(
        self,
        *,
        max_bytes: float = float("inf"),
        max_files: float = float("inf"),
        least_age_s: float = 0.0,
        kept: Collection[str] = (),
    ) -> int:
        """Remove the files that were not used for longest; the bytes of the others.

        Parameters
        ----------
        max_bytes, max_files
            What all together may have afterwards.
        least_age_s
            Seconds since the last use of what may be removed.
        kept
            Names that stay.
        """
        files = [(max(status.st_atime_ns, status.st_mtime_ns), status.st_size, name) for name, status in self._files()]
        n_bytes = n_removed = 0
        for number, (used_ns, size, name) in enumerate(sorted(files, reverse=True), start=1):
            n_bytes += size
            is_over = n_bytes > max_bytes or number > max_files
            if is_over and name not in kept and time.time_ns() - used_ns >= least_age_s * 1e9:
                self.delete(name)
                n_removed += size
        return n_bytes - n_removed

    def _target(self, name: str) -> Path:
        target = self.path(name)
        target.parent.mkdir(parents=True, exist_ok=True)
        return target

    def _files(self, within: str = "") -> Iterator[tuple[str, os.stat_result]]:
        try:
            found = sorted(os.scandir(self.folder / within), key=lambda entry: entry.name)
        except FileNotFoundError:
            return
        for entry in found:
            # folders named by the first two letters of the hash
            if not within and len(entry.name) == len("ab") and entry.is_dir():
                yield from self._files(f"{entry.name}/")
            elif NAME_INFIX not in entry.name and entry.is_file():
                with suppress(FileNotFoundError):  # another process has removed it
                    yield f"{within}{entry.name}", entry.stat()


ContentStore = FolderStore | BucketStore  # their methods are the same, except for those of caches


def content_hash(path: Path) -> str:
    """SHA-256 of a file in hexadecimal digits, kept while its size and time do not change; OSError if there is none."""
    status = path.stat()
    return _content_hash(path, status.st_size, status.st_mtime_ns)


@lru_cache(maxsize=4096)
def _content_hash(path: Path, _size: int, _time: int) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
