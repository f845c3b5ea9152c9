"""An encoder at work in a thread of its own, behind a short queue."""

import contextlib
import queue
from concurrent.futures import Future, ThreadPoolExecutor, wait
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

QUEUE_LENGTH = 8  # pictures that may wait
POLL_INTERVAL_S = 0.05  # between looks at whether the encoder still works

Pixels = NDArray[np.uint8] | None
SoundBlock = NDArray[np.float32] | None


class Sink(Protocol):
    """Something that takes pictures and sound in turn."""

    def picture(self, pixels: NDArray[np.uint8]) -> None:
        """Append one picture."""

    def sound(self, samples: NDArray[np.float32]) -> None:
        """Append mono samples."""

    def finish(self) -> None:
        """Complete what is written."""

    def abandon(self) -> None:
        """Let go of what is written so far."""


class EncoderThread:
    """Feeds a sink from a thread; what goes wrong there is raised by the next call here."""

    def __init__(self, sink: Sink) -> None:
        self._sink, self._stopped = sink, False
        self._queue: queue.Queue[tuple[Pixels, SoundBlock] | None] = queue.Queue(QUEUE_LENGTH)
        self._pool = ThreadPoolExecutor(1, "encode")
        self._work: Future[None] = self._pool.submit(self._run)

    def _run(self) -> None:
        while (item := self._queue.get()) is not None and not self._stopped:
            pixels, samples = item
            if pixels is not None:
                self._sink.picture(pixels)
            if samples is not None and len(samples):
                self._sink.sound(samples)

    def put(self, pixels: Pixels = None, samples: SoundBlock = None) -> None:
        """Append a picture, and the sound that belongs to it; waits while the queue is full."""
        self._put((pixels, samples))

    def _put(self, item: tuple[Pixels, SoundBlock] | None) -> None:
        while not self._work.done():
            try:
                return self._queue.put(item, timeout=POLL_INTERVAL_S)
            except queue.Full:
                continue
        return self._work.result()

    def finish(self) -> None:
        """Wait for the encoder, then complete the file."""
        self._put(None)
        self._work.result()
        self._pool.shutdown()
        self._sink.finish()

    def abandon(self) -> None:
        """Stop the encoder where it is and let go of the file."""
        self._stopped = True
        while not self._work.done():  # it may end by an error of its own with a full queue that nobody empties
            with contextlib.suppress(queue.Full):
                self._queue.put_nowait(None)
            wait([self._work], POLL_INTERVAL_S)
        self._pool.shutdown()
        self._sink.abandon()
