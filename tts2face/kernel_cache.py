"""A place for compiled kernels where neither the installed package nor the user's cache folder can be written."""

import os
import stat
import tempfile
from pathlib import Path

VARIABLE = "NUMBA_CACHE_DIR"  # numba refuses to import a kernel that it cannot keep anywhere


def settle_kernel_cache(package: Path) -> None:
    """Point numba to a private folder among the temporary files when it has no better place."""
    if VARIABLE in os.environ or _can_write(package / "__pycache__") or _can_write(_user_cache()):
        return
    os.environ[VARIABLE] = str(_private_folder())


def _user_cache() -> Path:
    return Path(os.environ.get("XDG_CACHE_HOME") or Path("~/.cache").expanduser()) / "numba"


def _can_write(folder: Path) -> bool:
    """Whether a folder can be written; it is made where it is missing, as numba would make it."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        return False
    return os.access(folder, os.W_OK | os.X_OK)


def _private_folder() -> Path:
    """A folder of this user alone, the same for every process; a new one where somebody else took the name.

    What lies in it is loaded as code.
    """
    owner = os.getuid() if hasattr(os, "getuid") else 0
    folder = Path(tempfile.gettempdir()) / f"tts2face-kernels-{owner}"
    try:
        folder.mkdir(mode=0o700, exist_ok=True)
        status = folder.lstat()
    except OSError:
        return Path(tempfile.mkdtemp(prefix="tts2face-kernels-"))
    is_private = stat.S_ISDIR(status.st_mode) and not status.st_mode & 0o077
    if hasattr(os, "getuid") and (status.st_uid != owner or not is_private):
        return Path(tempfile.mkdtemp(prefix="tts2face-kernels-"))
    return folder
