"""Reader of weights of ARKit's shapes as this project and Audio2Face write them: .a2f.json and .curves.jsonl."""

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from lexicon.errors import DataError, InputError
from lexicon.values.checks import is_number
from lexicon.values.files import read_text
from lexicon.values.json_text import parse_json
from tts2face.types import HEAD_CHANNELS, Trajectory
from tts2face.video.capture_values import LARGEST_VALUE
from tts2face.video.livelink import MAX_CAPTURE_FPS, FaceCapture

MAX_BYTES = 1 << 28  # an hour of curves at 60 frames a second is 110 MB
TRACK_FORMAT = "tts2face-track"


def read_weight_file(path: Path) -> FaceCapture:
    """Read weights, and the head's pose if the file has it.

    Raises
    ------
    InputError
        The file does not exist.
    DataError
        The file holds something else, or is damaged.
    """
    if not path.is_file():
        raise InputError(f"there is no capture {path}; check the path")
    return READERS[path.suffix.lower()](path)


def _read_audio2face(path: Path) -> FaceCapture:
    content = parse_json(read_text(path, MAX_BYTES), str(path))
    if isinstance(content, dict) and content.get("format") == TRACK_FORMAT:
        raise DataError(
            f"{path} is a track, which is exact and needs no transfer: tts2face render draws it, and tts2face convert "
            "makes other files of it"
        )
    if not isinstance(content, dict) or not {"exportFps", "facsNames", "weightMat"} <= set(content):
        raise DataError(
            f"{path} holds no weights of shapes: JSON of Audio2Face has exportFps, facsNames and weightMat; give such "
            "a file, .curves.jsonl, a .csv of Live Link Face, or a video"
        )
    return _capture(path, content["exportFps"], content["facsNames"], content["weightMat"], [])


def _read_curves(path: Path) -> FaceCapture:
    lines = [line for line in read_text(path, MAX_BYTES).splitlines() if line.strip()]
    rows = [parse_json(line, f"line {number} of {path}") for number, line in enumerate(lines, start=1)]
    if not rows or not isinstance(rows[0], dict) or not {"fps", "weights"} <= set(rows[0]):
        raise DataError(
            f"{path} holds no weights of shapes: the first line of .curves.jsonl has fps, weights and head; give such "
            "a file, .a2f.json, a .csv of Live Link Face, or a video"
        )
    frames = [row if isinstance(row, dict) else {} for row in rows[1:]]
    if rows[0].get("head", []) not in ([], list(HEAD_CHANNELS)):
        raise DataError(f"{path} names the head {rows[0]['head']}, not {list(HEAD_CHANNELS)}; export it again")
    head = [row.get("head") for row in frames] if rows[0].get("head") else []
    return _capture(path, rows[0]["fps"], rows[0]["weights"], [row.get("weights") for row in frames], head)


READERS: Mapping[str, Callable[[Path], FaceCapture]] = MappingProxyType(
    {".json": _read_audio2face, ".jsonl": _read_curves}
)


def _capture(path: Path, fps: Any, names: Any, weights: Any, head: Sequence[Any]) -> FaceCapture:
    """A capture of frames whose values are checked."""
    if not is_number(fps) or not 0 < fps <= MAX_CAPTURE_FPS:
        raise DataError(f"{path} has {fps} frames per second, not up to {MAX_CAPTURE_FPS:g}; export it again")
    if not isinstance(names, list) or not names or not all(isinstance(name, str) and name for name in names):
        raise DataError(f"{path} does not name its shapes; export it again")
    channels = tuple(name[0].lower() + name[1:] for name in names)
    if twice := [name for name, count in Counter(channels).items() if count > 1]:
        raise DataError(f"{path} names the shape {twice[0]} twice; export it again")
    if not isinstance(weights, list) or not weights:
        raise DataError(f"{path} has no frame; export a longer clip")
    for number, row in enumerate(weights):
        _check_row(f"frame {number} of {path}", row, len(names))
    for number, row in enumerate(head):
        _check_row(f"the head in frame {number} of {path}", row, len(HEAD_CHANNELS))
    pose = np.array(head, np.float64) if head else np.zeros((len(weights), len(HEAD_CHANNELS)))
    return FaceCapture(
        Trajectory(channels, np.array(weights, np.float64), float(fps)), Trajectory(HEAD_CHANNELS, pose, float(fps))
    )


def _check_row(place: str, row: Any, length: int) -> None:
    if not isinstance(row, list) or len(row) != length or not all(map(is_number, row)):
        raise DataError(f"{place} does not have {length} numbers; export it again")
    if beyond := [value for value in row if abs(value) > LARGEST_VALUE]:
        raise DataError(f"{place} has a value of {beyond[0]:g}, which no face has; export it again")
