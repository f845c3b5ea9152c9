"""Content addresses: a hash of everything that determines a segment."""

import hashlib
import json
from collections.abc import Mapping
from functools import lru_cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from lexicon.errors import DataError, InputError
from tts2face import __version__
from tts2face.storage.content_store import content_hash
from tts2face.storage.shipped import find_file

SEGMENT_FORMAT = 6  # raised when equal requests give other segments
VOICE_PACKAGES = ("hibari-tts", "onnxruntime", "espeakng-loader", "piper-tts", "hama", "pyopenjtalk-plus", "av")


def content_address(content: Mapping[str, Any]) -> str:
    """SHA-256 of a JSON object, in hexadecimal digits; the order of its names does not matter."""
    text = json.dumps(content, sort_keys=True, ensure_ascii=False, separators=(",", ":"), allow_nan=False)
    return hashlib.sha256(text.encode("utf-8", "surrogatepass")).hexdigest()


def file_hash(path: Path) -> str:
    """SHA-256 of a file, kept while its size and time do not change.

    Raises
    ------
    InputError
        The file does not exist or cannot be read.
    """
    try:
        return content_hash(path)
    except OSError as refused:
        raise InputError(f"cannot read {path}: {refused.strerror}; check the path") from refused


def model_hash(name: str, kind: str) -> str:
    """Hash of a talker, face or palette by name or path; errors as `file_hash`."""
    try:
        return file_hash(find_file(name, kind))
    except DataError as wrong:
        raise InputError(str(wrong)) from wrong


@lru_cache(maxsize=1)
def program_version() -> dict[str, str]:
    """Versions of the program and of the packages that determine sound and pictures."""
    found = {"tts2face": __version__, "format": str(SEGMENT_FORMAT)}
    for package in VOICE_PACKAGES:
        try:
            found[package] = version(package)
        # an extra that is not installed determines nothing
        except PackageNotFoundError:
            continue
    return found
