"""Motion of a face that follows the pictures of a camera, in a child process with limits and without a network.

Inputs are pictures, each with its ``time`` and a JPEG. Each is answered by an event: ``time`` of the picture, ``state``
(``calibrating``, ``live`` or ``no face``), ``ms`` of work, ``share`` of the calibration that is done, and while it is
live ``weights`` and ``head``. The first event has the ``channels`` of the weights.
"""

import time
from collections.abc import Iterator, Mapping
from types import MappingProxyType
from typing import Any

import numpy as np

from lexicon.errors import DataError
from tts2face.processes.child import Call, Handler
from tts2face.processes.program import ProcessLimits
from tts2face.video.media import TimedFrame

FOLLOW = "follow"  # name of the call
LIMITS = ProcessLimits(memory_bytes=4 << 30, cpu_s=7200, file_bytes=0, n_files=128)
# as `tts2face.video.streaming.MAX_SIDE_PX`
MAX_SIDE_PX = 1280
FPS = 20.0  # about; of the averages over time
DIGITS = 4  # of weights and angles
CALIBRATING = "calibrating"
LIVE = "live"
NO_FACE = "no face"


class Pictures:
    """Pictures that a call gets, with the time at which work on the last one began."""

    def __init__(self, call: Call) -> None:
        self._call = call
        self.last: TimedFrame | None = None
        self.began = 0.0

    def __iter__(self) -> Iterator[TimedFrame]:
        """Yield each picture as soon as it is asked for and there."""
        while True:
            given = self._call.more()
            self.began = time.perf_counter()
            self.last = TimedFrame(given.content["time"], decode_picture(given.payload))
            yield self.last


def decode_picture(content: bytes) -> np.ndarray[Any, np.dtype[np.uint8]]:
    """(H, W, 3) RGB pixels of a JPEG."""
    import io

    from PIL import Image

    try:
        with Image.open(io.BytesIO(content), formats=["JPEG"]) as picture:
            if max(picture.size) > MAX_SIDE_PX:
                raise DataError(f"a picture has {picture.width} x {picture.height} pixels; send smaller ones")
            return np.asarray(picture.convert("RGB"))
    except (OSError, ValueError, SyntaxError) as wrong:
        raise DataError("a picture of the camera is no JPEG that can be decoded; reload the page") from wrong


def follow(call: Call) -> dict[str, Any]:
    """Answer pictures until they end.

    Raises
    ------
    DataError
        A picture cannot be decoded.
    BackendError
        The landmark models or a package are missing.
    """
    from tts2face.models.face_loading import load_face
    from tts2face.session.live_capture import CALIBRATION_S, track_poses
    from tts2face.video.blendshapes import BlendshapeReader
    from tts2face.video.tracking import FaceTracker

    face, pictures = load_face("head"), Pictures(call)
    tracker, reader = FaceTracker(), BlendshapeReader()
    call.event({"channels": list(face.shape_names)})
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
            # never 1 before it is done
            answer |= {"state": CALIBRATING, "share": round(min((now - first) / CALIBRATION_S, 0.99), 2)}
        call.event(answer)
    return {}


HANDLERS: Mapping[str, Handler] = MappingProxyType({FOLLOW: follow})
