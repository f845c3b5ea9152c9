"""Motion of a face that follows the pictures of a camera, in a process with limits and without a network.

``python -m tts2face.service.synthesis.camera_process``: standard input holds pictures, each a header (seconds as a
64-bit float, number of bytes as a 32-bit integer, little-endian) and a JPEG; it ends with the parent process. Each is
answered by one line of JSON on standard output: ``time`` of the picture, ``state`` (``calibrating``, ``live`` or ``no
face``), ``ms`` of work, ``share`` of the calibration that is done, and while it is live ``weights`` and ``head``. The
first line has the ``channels`` of the weights; an ``error`` with its ``message`` ends the process.
"""

import json
import os
import struct
import sys
import time
from collections.abc import Iterator, Mapping
from typing import Any, BinaryIO

import numpy as np

from lexicon.errors import DataError, Tts2faceError
from tts2face.child_process import claim_standard_output
from tts2face.limited_process import ProcessLimits, limit_process
from tts2face.video.media import TimedFrame

HEADER = struct.Struct("<dI")
LIMITS = ProcessLimits(memory_bytes=4 << 30, cpu_s=7200, file_bytes=0, n_files=128)
MAX_PICTURE_BYTES = 1 << 20
MAX_SIDE_PX = 1280
FPS = 20.0  # about; of the averages over time
DIGITS = 4  # of weights and angles
CALIBRATING, LIVE, NO_FACE = "calibrating", "live", "no face"


class Pictures:
    """Pictures of standard input, with the time at which work on the last one began."""

    def __init__(self, file: BinaryIO) -> None:
        self._file = file
        self.last: TimedFrame | None = None
        self.began = 0.0

    def __iter__(self) -> Iterator[TimedFrame]:
        """Yield each picture as soon as it is asked for and there."""
        while len(head := self._file.read(HEADER.size)) == HEADER.size:
            seconds, n_bytes = HEADER.unpack(head)
            if n_bytes > MAX_PICTURE_BYTES:
                raise DataError(f"a picture has {n_bytes} bytes, limit {MAX_PICTURE_BYTES}; send smaller ones")
            content = self._file.read(n_bytes)
            self.began = time.perf_counter()
            self.last = TimedFrame(seconds, decode_picture(content))
            yield self.last


def decode_picture(content: bytes) -> np.ndarray[Any, np.dtype[np.uint8]]:
    """(H, W, 3) RGB pixels of a JPEG.

    Raises
    ------
    DataError
        It cannot be decoded or is too large.
    """
    import io

    from PIL import Image

    try:
        with Image.open(io.BytesIO(content), formats=["JPEG"]) as picture:
            if max(picture.size) > MAX_SIDE_PX:
                raise DataError(f"a picture has {picture.width} x {picture.height} pixels; send smaller ones")
            return np.asarray(picture.convert("RGB"))
    except (OSError, ValueError, SyntaxError) as wrong:
        raise DataError("a picture of the camera is no JPEG that can be decoded; reload the page") from wrong


def follow(file: BinaryIO, out: BinaryIO) -> None:
    """Answer pictures until they end.

    Raises
    ------
    DataError
        A picture cannot be decoded.
    BackendError
        The landmark models or a package are missing.
    """
    from tts2face.models.face_loading import load_face
    from tts2face.synthesis.live_capture import CALIBRATION_S, track_poses
    from tts2face.video.blendshapes import BlendshapeReader
    from tts2face.video.track import FaceTracker

    face, pictures = load_face("head"), Pictures(file)
    tracker, reader = FaceTracker(), BlendshapeReader()
    _write(out, {"channels": list(face.shape_names)})
    is_calibrated, first = False, None
    for pose in track_poses(pictures, face, tracker, reader, FPS):
        assert pictures.last is not None
        now = pictures.last.time
        answer: dict[str, Any] = {"time": now, "ms": round(1000 * (time.perf_counter() - pictures.began), 1)}
        if pose is not None:
            is_calibrated = True
            answer |= {
                "state": LIVE, "share": 1.0, "weights": np.round(pose.weights, DIGITS).tolist(),
                "head": np.round(pose.head, DIGITS).tolist(),
            }  # fmt: skip
        elif is_calibrated:
            answer |= {"state": NO_FACE, "share": 1.0}
        else:
            first = now if first is None else first
            answer |= {"state": CALIBRATING, "share": round(min((now - first) / CALIBRATION_S, 0.99), 2)}
        _write(out, answer)


def _write(out: BinaryIO, content: Mapping[str, Any]) -> None:
    out.write(json.dumps(content).encode() + b"\n")
    out.flush()


def main() -> None:
    """Follow one camera."""
    out = claim_standard_output()
    limit_process(LIMITS)
    try:
        follow(sys.stdin.buffer, out)
    except Tts2faceError as error:
        _write(out, {"error": type(error).__name__, "message": " ".join(str(error).split())})


if __name__ == "__main__":
    try:
        main()
    except BrokenPipeError:
        sys.stderr.close()
        os._exit(0)
