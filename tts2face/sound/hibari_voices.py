"""Voices that the installed package hibari-tts lists, of which all but ``heart`` are added by the user.

Its list has the name, size and SHA-256 of each model of 8 MB; its cache folder keeps those that were downloaded, by
this program or by itself.
"""

import hashlib
import http.client
import importlib.util
import urllib.error
import urllib.request
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from types import ModuleType
from typing import Any

from lexicon.errors import BackendError, DataError, InputError
from tts2face.types import Progress, ignore_progress

PACKAGE = "hibari"
USUAL_VOICE = "heart"  # in the package itself
SILENCE_S = 60.0  # without a byte of a download
BLOCK_BYTES = 1 << 18
PART = ".part"  # after the name of a file whose download is not complete


@dataclass(frozen=True, slots=True)
class HibariVoice:
    """A voice of the list: its model's place, size and hash, and its language."""

    name: str
    path: Path
    n_bytes: int
    sha256: str
    is_british: bool
    url: str

    @property
    def language(self) -> str:
        """Code of the language that it was trained in."""
        return "en-gb" if self.is_british else "en-us"

    @property
    def is_there(self) -> bool:
        """Whether its model lies in the package or in the cache; its content is checked when it is loaded."""
        return self.path.is_file() and self.path.stat().st_size == self.n_bytes


def hibari_voice(name: str) -> HibariVoice:
    """A voice of the list.

    A name that the list lacks is refused (`InputError`), as is a missing package (`BackendError`).
    """
    module = _registry()
    listed: Mapping[str, Any] = module.VOICES
    if name not in listed:
        raise InputError(f"there is no voice {name[:40]!r} to add or remove; choose {', '.join(addable_names())}")
    about = listed[name]
    folder = Path(module.ASSETS if about.get("bundled") else module.cache_dir())
    place = folder / about["file"]
    return HibariVoice(
        name, place, about["bytes"], about["sha256"], about["british"], f"{module.BASE_URL}{about['file']}"
    )


def addable_names() -> tuple[str, ...]:
    """Names of the voices of the list that are not in the package."""
    return tuple(name for name, about in _registry().VOICES.items() if not about.get("bundled"))


def has_model(name: str) -> bool:
    """Whether the model of a voice of `SHIPPED_VOICES` is there, of a list that may lack it."""
    return name in _registry().VOICES and hibari_voice(name).is_there


def read_model(name: str) -> bytes:
    """Content of the model of a voice.

    Raises
    ------
    BackendError
        It has not been added.
    DataError
        It is damaged.
    """
    voice = hibari_voice(name)
    if not voice.path.is_file():
        raise BackendError(f"the voice {name} is not installed; run: tts2face voices add {name}")
    content = voice.path.read_bytes()
    if name != USUAL_VOICE and hashlib.sha256(content).hexdigest() != voice.sha256:
        raise DataError(f"the model {voice.path} of the voice {name} is damaged; run: tts2face voices add {name}")
    return content


def add_voice(name: str, file: Path | None = None, on_progress: Progress = ignore_progress) -> Path:
    """Put the model of a voice into the cache of the package; its place.

    Parameters
    ----------
    file
        The model, from elsewhere; None: it is downloaded, from where an earlier try has ended.
    on_progress
        Called with the bytes that are there and all.

    Raises
    ------
    InputError
        There is no such voice or file.
    DataError
        The content is not that of the list.
    BackendError
        It cannot be downloaded or written.
    """
    voice = hibari_voice(name)
    if name not in addable_names():
        raise InputError(f"the voice {name} is part of the package {PACKAGE}-tts; there is nothing to add")
    part = voice.path.with_name(voice.path.name + PART)
    try:
        voice.path.parent.mkdir(parents=True, exist_ok=True)
        if voice.is_there and hashlib.sha256(voice.path.read_bytes()).hexdigest() == voice.sha256:
            return voice.path
        if file is not None:
            content = _read_given(file, voice)
            part.write_bytes(content)
        else:
            _download(voice, part, on_progress)
        if hashlib.sha256(part.read_bytes()).hexdigest() != voice.sha256:
            part.unlink()
            where = voice.url if file is None else file
            raise DataError(f"{where} is not the model of the voice {name} that {PACKAGE}-tts lists; it was not kept")
        part.replace(voice.path)
    except OSError as refused:
        raise BackendError(f"cannot write {voice.path} ({refused.strerror}); check the folder") from refused
    return voice.path


def remove_voice(name: str) -> Path:
    """Remove the model of a voice from the cache; the place where it was.

    Raises
    ------
    InputError
        There is no such voice, it is part of the package, or it is not there.
    """
    voice = hibari_voice(name)
    if name not in addable_names():
        raise InputError(f"the voice {name} is part of the package {PACKAGE}-tts and stays")
    found = [path for path in (voice.path, voice.path.with_name(voice.path.name + PART)) if path.is_file()]
    if not found:
        raise InputError(f"the voice {name} is not installed; there is no {voice.path}")
    for path in found:
        path.unlink()
    return voice.path


def _read_given(file: Path, voice: HibariVoice) -> bytes:
    if file.is_dir():
        raise InputError(f"{file} is a folder; give the file {voice.path.name}")
    try:
        size = file.stat().st_size
        if size != voice.n_bytes:
            raise DataError(
                f"{file} has {size} bytes, and the model of the voice {voice.name} {voice.n_bytes}; give the file "
                f"{voice.path.name}"
            )
        return file.read_bytes()
    except OSError as refused:
        raise InputError(f"cannot read {file}: {refused.strerror}; check the path") from refused


def _download(voice: HibariVoice, part: Path, on_progress: Progress) -> None:
    """Append what lacks of a model to the part that is there."""
    done = part.stat().st_size if part.is_file() else 0
    if done > voice.n_bytes:
        done = 0
    request = urllib.request.Request(voice.url, headers={"Range": f"bytes={done}-"} if done else {})
    if done == voice.n_bytes:
        return
    try:
        with urllib.request.urlopen(request, timeout=SILENCE_S) as response:
            if done and response.status != 206:  # a server without parts sends all
                done = 0
            with part.open("ab" if done else "wb") as file:
                while done < voice.n_bytes and (block := response.read(BLOCK_BYTES)):
                    file.write(block[: voice.n_bytes - done])
                    done += len(block)
                    on_progress(min(done, voice.n_bytes), voice.n_bytes)
    except urllib.error.HTTPError as refused:
        raise BackendError(f"{voice.url} answers {refused.code}; add the voice from a file, by --from") from refused
    except (urllib.error.URLError, http.client.HTTPException, TimeoutError, ConnectionError) as failed:
        reason = getattr(failed, "reason", failed)
        raise BackendError(
            f"cannot download {voice.url} ({reason}); the same command continues, or add the voice by --from FILE"
        ) from failed
    if done < voice.n_bytes:
        raise BackendError(f"the download of {voice.url} broke off; the same command continues")


@lru_cache(maxsize=1)
def _registry() -> ModuleType:
    """The package's module of its list, without the rest of the package, whose import takes long."""
    found = importlib.util.find_spec(PACKAGE)
    path = None if found is None or found.origin is None else Path(found.origin).with_name("voices.py")
    if path is None or not path.is_file():
        raise BackendError("the voice heart needs hibari-tts; run: pip install hibari-tts")
    spec = importlib.util.spec_from_file_location("_hibari_voices", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
