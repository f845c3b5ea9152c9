"""Folders of the current user for cached files and for data, and messages without the names of folders."""

import os
import re
import sys
from collections.abc import Iterable
from pathlib import Path

_FOLDERS = re.compile(r"(?<![\w.:/])/(?:[^/\s'\"]+/)+")  # of a path, not of a URL


def user_cache() -> Path:
    """Cache folder of the current user."""
    if sys.platform == "win32":
        base = os.environ.get("LOCALAPPDATA") or str(Path.home() / "AppData" / "Local")
    elif sys.platform == "darwin":
        base = str(Path.home() / "Library" / "Caches")
    else:
        base = os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache")
    return Path(base) / "tts2face"


def user_data() -> Path:
    """Folder of the current user for data that programs keep."""
    if sys.platform == "win32":
        base = os.environ.get("LOCALAPPDATA") or str(Path.home() / "AppData" / "Local")
    elif sys.platform == "darwin":
        base = str(Path.home() / "Library" / "Application Support")
    else:
        base = os.environ.get("XDG_DATA_HOME") or str(Path.home() / ".local" / "share")
    return Path(base) / "tts2face"


def without_folders(message: str, folders: Iterable[Path]) -> str:
    """A message that names files of these folders by their names alone, for readers on other machines."""
    for folder in sorted(folders, reverse=True):  # a folder after those within it
        message = message.replace(f"{folder}/", "")
    return message


def without_paths(message: str) -> str:
    """A message that names all files by their names alone."""
    return _FOLDERS.sub("", message)
