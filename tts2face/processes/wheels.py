"""Wheels of pip's configured index, downloaded by pip: the only step that needs a network."""

import subprocess
import sys
from pathlib import Path

from lexicon.errors import BackendError

# of one wheel, on a slow line
MAX_DOWNLOAD_S = 600.0


def download_wheel(requirement: str, folder: Path) -> None:
    """Download a wheel, without those that it needs, into a folder.

    Raises
    ------
    BackendError
        pip ends with an error or does not end.
    """
    command = [sys.executable, "-m", "pip", "download", "--quiet", "--no-input", "--disable-pip-version-check"]
    command += ["--no-deps", "--only-binary", ":all:", "--dest", str(folder), requirement]
    try:
        subprocess.run(command, check=True, capture_output=True, text=True, timeout=MAX_DOWNLOAD_S)
    except subprocess.CalledProcessError as failed:
        lines = failed.stderr.strip().splitlines() or [f"pip ended with {failed.returncode}"]
        raise BackendError(f"{requirement}: {lines[-1]}") from failed
    except subprocess.TimeoutExpired as late:
        raise BackendError(f"{requirement}: no response within {MAX_DOWNLOAD_S:.0f} s") from late
