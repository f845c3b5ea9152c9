"""Temporary files in the folder of their target, which a later run removes after a process was killed.

The process that writes a temporary file holds a lock on it (``flock``), which the system releases when the process
ends in any way; an unlocked temporary file is abandoned. On systems without such locks (Windows) abandoned files are
not removed.
"""

import contextlib
import errno
import os
import secrets
import shutil
from pathlib import Path
from types import TracebackType

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None  # type: ignore[assignment]

NAME_INFIX = ".tts2face-"  # part of the names of all temporary files
LOCK_ERRORS = (BlockingIOError, FileNotFoundError)
_HELD: set[Path] = set()  # temporary files and folders of this process
MAX_NAME_BYTES = 100  # of the target's name; file systems allow 255 in total


class Temporary:
    """New, empty, hidden file or folder in the folder of a target, locked by this process.

    Creating one removes the abandoned temporary files of the same target.

    Parameters
    ----------
    target
        Path that it replaces when complete.

    Raises
    ------
    OSError
        The folder cannot be written.
    """

    def __init__(self, target: Path, *, is_folder: bool = False) -> None:
        remove_left_behind(target)
        self._lock: int | None = None
        self.path = _create(target, is_folder)
        while fcntl is not None:
            try:
                self._lock = _lock_file(self.path)
                break
            except LOCK_ERRORS:  # another process removed it before it was locked
                self.path = _create(target, is_folder)
            except OSError:  # a file system without locks, where it is not removed
                break

    def __enter__(self) -> "Temporary":
        """Return itself."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Remove it unless it was renamed to its target."""
        self.remove()

    def replace(self, target: Path) -> None:
        """Rename it to the target; a folder replaces an existing folder, which stays whole until then."""
        if self.path.is_dir() and target.is_dir():
            with Temporary(target, is_folder=True) as earlier:
                os.replace(target, earlier.path)  # onto an empty folder
                try:
                    os.replace(self.path, target)
                except BaseException:
                    # back to its place: the folder stays whole whatever happens
                    os.replace(earlier.path, target)
                    raise
        else:
            os.replace(self.path, target)
        self._release()

    def remove(self) -> None:
        """Remove it unless it was renamed to its target."""
        _remove(self.path)
        self._release()

    def _release(self) -> None:
        _HELD.discard(self.path)
        if self._lock is not None:
            os.close(self._lock)
            self._lock = None


def remove_held() -> None:
    """Remove all temporary files and folders of this process, which ends without further clean-up."""
    for path in tuple(_HELD):
        _remove(path)


def remove_left_behind(target: Path) -> None:
    """Remove the temporary files and folders of a target that no process has locked."""
    if fcntl is None:
        return
    for abandoned_path in _temporaries_of(target):
        with contextlib.suppress(OSError):  # another process writes it, or it cannot be removed
            lock = _lock_file(abandoned_path)
            try:
                _remove(abandoned_path)
            finally:
                os.close(lock)


def _temporaries_of(target: Path) -> list[Path]:
    prefix = _name_prefix(target)
    try:
        with os.scandir(target.parent) as entries:
            return [Path(entry.path) for entry in entries if entry.name.startswith(prefix)]
    except OSError:
        return []


def _name_prefix(target: Path) -> str:
    return f".{os.fsencode(target.name)[:MAX_NAME_BYTES].decode(errors='ignore')}{NAME_INFIX}"


def _create(target: Path, is_folder: bool) -> Path:
    """A new file or folder; another process that takes it for abandoned may remove it before it is locked."""
    while True:
        try:
            return _create_once(target, is_folder)
        except FileNotFoundError:
            if not target.parent.is_dir():
                raise


def _create_once(target: Path, is_folder: bool) -> Path:
    path = target.parent / f"{_name_prefix(target)}{secrets.token_hex(8)}"
    _HELD.add(path)  # before it exists: an interruption may come between any two statements
    if is_folder:
        path.mkdir()
    else:
        path.touch(exist_ok=False)
    path.chmod(0o755 if is_folder else 0o644)
    return path


def _lock_file(path: Path) -> int:
    """File descriptor that holds a lock on a path."""
    handle = os.open(path, os.O_RDONLY | os.O_NOFOLLOW)
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        if not os.path.samestat(os.fstat(handle), os.stat(path)):
            raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), str(path))
    except OSError:
        os.close(handle)
        raise
    return handle


def _remove(path: Path) -> None:
    if path.is_dir():
        shutil.rmtree(path, ignore_errors=True)
    else:
        path.unlink(missing_ok=True)
