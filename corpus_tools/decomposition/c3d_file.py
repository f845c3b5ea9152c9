"""C3D files: markers and analogue channels of motion capture, in the formats of all three kinds of processors.

Source: The C3D File Format User Guide (Motion Lab Systems, 2021). A file consists of blocks of 512 bytes: one of the
header, some of the parameters, then the frames. A frame has four numbers for each marker (its place, then cameras and
residual in one, negative where it is hidden), then its samples of all channels; all numbers are floats, or all are
integers, whose unit is POINT:SCALE.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from tts2face.numeric.arrays import FloatArray

# C3D counts places in blocks of 512 bytes, from 1
BLOCK_BYTES = 512
HEADER_KEY = 80  # second byte of a file, and of its parameters where a writer sets it
DEC, BIG_ENDIAN = 85, 86  # of the processors; 84 is that of Intel
CHARACTERS, FLOATS = -1, 4  # types of parameters; 1 and 2 are whole numbers of as many bytes
TRIAL_FIELDS = ("TRIAL:ACTUAL_START_FIELD", "TRIAL:ACTUAL_END_FIELD")  # of Vicon
LARGEST_COUNT = 2**16 - 1  # of frames, in words of 16 bits; longer recordings say their number elsewhere

Parameters = Mapping[str, Any]  # by names such as POINT:RATE: a list of texts, or an array of numbers


@dataclass(frozen=True, slots=True, eq=False)
class C3dFile:
    """Contents of a file.

    Parameters
    ----------
    points : (T, M, 3)
        In the file's unit, NaN where a marker is hidden.
    channels : (T k, C)
        Analogue channels with k samples in a frame, as stored: neither scaled nor without their offset.
    parameters
        Its parameters by group and name.
    n_lost
        Frames that it states but does not hold, as it breaks off.
    """

    points: FloatArray
    channels: FloatArray
    parameters: Parameters
    n_lost: int = 0

    def labels(self, group: str) -> list[str]:
        """Names of the markers (POINT) or channels (ANALOG); more than 255 are divided among several parameters."""
        found: list[str] = []
        # LABELS, LABELS2, LABELS3: a parameter holds at most 255 texts
        for number in range(1, 256):
            found += self.parameters.get(f"{group}:LABELS{number if number > 1 else ''}", [])
        return found

    def number(self, name: str) -> float:
        """The first value of a parameter (KeyError, IndexError: there is none)."""
        return float(self.parameters[name][0])


def read_c3d_file(path: Path) -> C3dFile:
    """Contents of a file."""
    with path.open("rb") as file:
        header = file.read(BLOCK_BYTES)
        if len(header) < BLOCK_BYTES or header[1] != HEADER_KEY:
            raise ValueError("it does not begin as one")
        file.seek(BLOCK_BYTES * (header[0] - 1))
        section = file.read(4)
        section += file.read(max(BLOCK_BYTES * section[2] - 4, 0))
        processor = section[3]
        words = np.frombuffer(header, ">u2" if processor == BIG_ENDIAN else "<u2")
        parameters = _read_parameters(section, processor)
        return _read_frames(file, words, parameters, processor)


def _read_frames(file: BinaryIO, words: NDArray[Any], parameters: Parameters, processor: int) -> C3dFile:
    scale = float(parameters["POINT:SCALE"][0])
    n_points, n_samples, per_frame = int(parameters["POINT:USED"][0]), int(words[2]), int(words[9])
    if n_points < 1:
        raise ValueError("it has no marker")
    width = 4 * n_points + n_samples
    start, kind = BLOCK_BYTES * (int(words[8]) - 1), _type(processor, FLOATS if scale < 0 else 2)
    n_held = (file.seek(0, 2) - start) // (width * kind.itemsize)
    n_frames = _count_frames(words, parameters, n_held)
    if n_frames < 1 or n_held < 1:
        raise ValueError(f"it has {n_held} of {n_frames} frames")
    n_lost = max(n_frames - n_held, 0)
    n_frames -= n_lost
    file.seek(start)
    values = _decode(file.read(n_frames * width * kind.itemsize), kind, processor).reshape(n_frames, width)
    quads = values[:, : 4 * n_points].reshape(n_frames, n_points, 4).astype(np.float64)
    # a negative scale says that the points are floats
    points = quads[..., :3] * (1.0 if scale < 0 else scale)
    points[quads[..., 3] < 0] = np.nan
    channels = values[:, 4 * n_points :]
    if scale > 0 and "".join(parameters.get("ANALOG:FORMAT", [])).strip().upper() == "UNSIGNED":
        channels = channels.astype(np.uint16)
    n_channels = n_samples // per_frame if per_frame else 0
    return C3dFile(points, channels.reshape(n_frames * per_frame, n_channels).astype(np.float64), parameters, n_lost)


def _count_frames(words: NDArray[Any], parameters: Parameters, n_held: int) -> int:
    """Number of frames: the header's, or one beyond 16 bits that a parameter states, of which the header has the rest.

    Header words count to 65,535 and stay there, or begin again at 0; of a file that says no more, what it holds counts.
    """
    first, last = int(words[3]), int(words[4])
    stated = [float(parameters[name][0]) for name in ("POINT:LONG_FRAMES", "POINT:FRAMES") if name in parameters]
    if parameters.keys() >= set(TRIAL_FIELDS):  # two words each, the lower one first
        start, end = (int(parameters[name].astype(np.uint16) @ (1, 2**16)) for name in TRIAL_FIELDS)
        stated.append(end - start + 1)
    n_frames = last - first + 1
    for count in stated:
        if count >= n_frames and (last == LARGEST_COUNT or (count - n_frames) % 2**16 == 0):
            return int(count)
    return n_held if last == LARGEST_COUNT else n_frames


def _read_parameters(section: bytes, processor: int) -> Parameters:
    """Parameters of a section, from records of a name, a group's number, and the way to the next record."""
    groups: dict[int, str] = {}
    found: list[tuple[int, str, Any]] = []
    word, at = _type(processor, 2), 4
    while at + 2 < len(section):
        n_characters, group = np.frombuffer(section, np.int8, 2, at).tolist()
        at += 2 + abs(n_characters)  # negative: locked
        name = section[at - abs(n_characters) : at].decode("ascii").upper()
        step = int(np.frombuffer(section, word, 1, at)[0])
        if group < 0:
            groups[-group] = name
        elif name:
            found.append((group, name, _read_values(section, at + 2, processor)))
        # a pointer of 0 ends the list of parameters
        if step <= 0 or not name:
            break
        at += step
    return {f"{groups[group]}:{name}": values for group, name, values in found if group in groups}


def _read_values(section: bytes, at: int, processor: int) -> Any:
    """Texts or numbers of a parameter: its type, the number of its dimensions, these, and its values."""
    kind, n_dimensions = np.frombuffer(section, np.int8, 2, at).tolist()
    shape = section[at + 2 : at + 2 + n_dimensions]
    n_values = int(np.prod(np.frombuffer(shape, np.uint8), dtype=np.int64))
    at += 2 + n_dimensions
    if kind == CHARACTERS:
        length = shape[0] if shape else 1
        texts = [section[at + k : at + k + length] for k in range(0, n_values, max(length, 1))]
        return [text.decode("utf-8", errors="replace").rstrip(" \0") for text in texts]
    dtype = _type(processor, kind)
    return _decode(section[at : at + n_values * dtype.itemsize], dtype, processor)


def _type(processor: int, size: int) -> np.dtype[Any]:
    """Type of whole numbers of 1 or 2 bytes, or of floats of 4, of a processor."""
    return np.dtype({1: "i1", 2: "i2", FLOATS: "f4"}[size]).newbyteorder(">" if processor == BIG_ENDIAN else "<")


def _decode(content: bytes, kind: np.dtype[Any], processor: int) -> NDArray[Any]:
    """Numbers; floats of DEC are four times as large as those with the same bits, and their halves are exchanged."""
    if processor == DEC and kind.itemsize == FLOATS:
        halves = np.frombuffer(content, "<u2").reshape(-1, 2)
        # DEC's floats: words of 16 bits exchanged, exponent larger by two
        return np.ascontiguousarray(halves[:, ::-1]).view("<f4").ravel() / 4
    return np.frombuffer(content, kind)
