"""Files that are written beside their place, and removed by the next run where a process was killed.

Every one is locked by the process that writes it (``flock``), for as long as that process lives; one that nobody locks
was left behind. The system releases the lock however a process ends. Where there are no such locks (Windows) nothing
that was left behind is removed.
"""

import contextlib
import errno
import os
import shutil
import tempfile
from pathlib import Path
from types import TracebackType

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None  # type: ignore[assignment]

OURS = ".tts2face-"  # in the names of all of them
TAKEN = (BlockingIOError, FileNotFoundError)
MOST_BYTES = 100  # of the target's name; file systems allow 255 for a whole name


class Temporary:
    """A new, empty, hidden file or folder beside a target, locked by this process.

    Making one removes what killed processes left beside the same target.

    Parameters
    ----------
    target
        What it is going to be.

    Raises
    ------
    OSError
        The folder cannot be written.
    """

    def __init__(self, target: Path, *, is_folder: bool = False) -> None:
        remove_left_behind(target)
        self._lock: int | None = None
        self.path = _made(target, is_folder)
        while fcntl is not None:
            try:
                self._lock = _locked(self.path)
                break
            except TAKEN:  # by another process, which took it for left behind before it was locked
                self.path = _made(target, is_folder)
            except OSError:  # a file system without locks, on which nobody removes it either
                break

    def __enter__(self) -> "Temporary":
        """Give itself."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Remove it unless it is in its place."""
        self.remove()

    def replace(self, target: Path) -> None:
        """Rename it to the target; a folder replaces the folder that is there."""
        if self.path.is_dir() and target.is_dir():
            shutil.rmtree(target)
        os.replace(self.path, target)
        self._release()

    def remove(self) -> None:
        """Remove it unless it is in its place."""
        _remove(self.path)
        self._release()

    def _release(self) -> None:
        if self._lock is not None:
            os.close(self._lock)
            self._lock = None


def remove_left_behind(target: Path) -> None:
    """Remove temporary files and folders of a target whose process is dead; those of living processes stay."""
    if fcntl is None:
        return
    for found in _beside(target):
        with contextlib.suppress(OSError):  # somebody writes it, or it may not be removed
            lock = _locked(found)
            try:
                _remove(found)
            finally:
                os.close(lock)


def _beside(target: Path) -> list[Path]:
    beginning = _beginning(target)
    try:
        with os.scandir(target.parent) as entries:
            return [Path(entry.path) for entry in entries if entry.name.startswith(beginning)]
    except OSError:
        return []


def _beginning(target: Path) -> str:
    return f".{os.fsencode(target.name)[:MOST_BYTES].decode(errors='ignore')}{OURS}"


def _made(target: Path, is_folder: bool) -> Path:
    if is_folder:
        folder = Path(tempfile.mkdtemp(prefix=_beginning(target), dir=target.parent))
        folder.chmod(0o755)
        return folder
    handle, name = tempfile.mkstemp(prefix=_beginning(target), dir=target.parent)
    os.close(handle)
    os.chmod(name, 0o644)
    return Path(name)


def _locked(path: Path) -> int:
    """An open file that locks a path.

    Raises
    ------
    OSError
        One of `TAKEN` where another process holds or has removed it.
    """
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
