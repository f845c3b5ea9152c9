"""Live pictures of a camera; pictures that arrive while the consumer is busy are dropped."""

import threading
import time
from collections.abc import Iterator
from types import TracebackType
from typing import Any

from lexicon.errors import InputError, import_of_extra
from tts2face.video.media import TimedFrame

FRAME_TIMEOUT_S = 10.0  # longest time without a picture, after which the capture ends


class CaptureDevice:
    """Live pictures of a camera (by number), of a network stream (by URL), or of a file at its frame rate.

    Raises
    ------
    InputError
        The source cannot be opened.
    BackendError
        OpenCV is not installed.
    """

    def __init__(self, source: str) -> None:
        with import_of_extra("a camera needs opencv-python-headless: pip install 'tts2face[capture]'"):
            import cv2
        cv2.utils.logging.setLogLevel(cv2.utils.logging.LOG_LEVEL_SILENT)  # OpenCV's warnings repeat our message
        self._device: Any = cv2.VideoCapture(int(source) if source.isdecimal() else source)
        if not self._device.isOpened():
            raise InputError(f"there is no camera {source!r}; give a camera's number (0 is the first) or its address")
        stated = float(self._device.get(cv2.CAP_PROP_FPS) or 0.0)
        # many cameras and streams state 0 or the rate of their time base
        self.fps = stated if 0 < stated <= 120 else 30.0
        self._pace = 0.0 if source.isdecimal() or "://" in source else 1.0 / self.fps
        self._newest: TimedFrame | None = None
        self._frame_arrived = threading.Condition()
        self._ended = False
        self._thread = threading.Thread(target=self._read_frames, name="camera", daemon=True)

    def __enter__(self) -> "CaptureDevice":
        """Start the capture."""
        self._began = time.monotonic()
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Stop the capture and release the camera."""
        self._ended = True
        self._thread.join()
        self._device.release()

    def pictures(self) -> Iterator[TimedFrame]:
        """Yield the newest picture, with seconds since the start of the capture, until the capture ends."""
        while True:
            with self._frame_arrived:
                self._frame_arrived.wait_for(lambda: self._newest is not None or self._ended, FRAME_TIMEOUT_S)
                picture, self._newest = self._newest, None
            if picture is None:
                return
            yield picture

    def _read_frames(self) -> None:
        import cv2

        n_read = 0
        while not self._ended:
            is_read, pixels = self._device.read()
            if not is_read:
                break
            n_read += 1
            # a file would be read at once: it is shown at its own rate
            time.sleep(max(0.0, self._began + n_read * self._pace - time.monotonic()) if self._pace else 0.0)
            upright = cv2.cvtColor(pixels, cv2.COLOR_BGR2RGB)
            with self._frame_arrived:
                self._newest = TimedFrame(time.monotonic() - self._began, upright)
                self._frame_arrived.notify()
        with self._frame_arrived:
            self._ended = True
            self._frame_arrived.notify()
