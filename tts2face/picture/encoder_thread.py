"""An encoder that runs in its own thread behind a bounded queue."""

import contextlib
import queue
from concurrent.futures import Future, ThreadPoolExecutor, wait
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

QUEUE_LENGTH = 8  # pictures that may be queued
POLL_INTERVAL_S = 0.05  # interval at which the state of the encoder is checked
Pixels = NDArray[np.uint8] | None
SoundBlock = NDArray[np.float32] | None


class Sink(Protocol):
    """Receiver of pictures and sound in order of time."""

    def picture(self, pixels: NDArray[np.uint8]) -> None:
        """Append one picture (H, W, 3 or 4)."""

    def sound(self, samples: NDArray[np.float32]) -> None:
        """Append mono samples (n,)."""

    def finish(self) -> None:
        """Complete and close the output."""

    def abandon(self) -> None:
        """Close the output without completing it."""


class EncoderThread:
    """Feeds a sink from a thread; an error in the thread is raised by the next call of `put` or `finish`."""

    def __init__(self, sink: Sink) -> None:
        self._sink, self._stopped = sink, False
        self._queue: queue.Queue[tuple[Pixels, SoundBlock] | None] = queue.Queue(QUEUE_LENGTH)
        self._pool = ThreadPoolExecutor(1, "encode")
        try:
            self._work: Future[None] = self._pool.submit(self._run)
        except BaseException:  # an interruption, after which the thread runs or not
            self._queue.put_nowait(None)
            raise

    def _run(self) -> None:
        while (item := self._queue.get()) is not None and not self._stopped:
            pixels, samples = item
            if pixels is not None:
                self._sink.picture(pixels)
            if samples is not None and len(samples):
                self._sink.sound(samples)

    def put(self, pixels: Pixels = None, samples: SoundBlock = None) -> None:
        """Append a picture and the samples of its frame; blocks while the queue is full."""
        self._put((pixels, samples))

    def _put(self, item: tuple[Pixels, SoundBlock] | None) -> None:
        while not self._work.done():
            try:
                return self._queue.put(item, timeout=POLL_INTERVAL_S)
            # asked again, whether the encoder has ended meanwhile
            except queue.Full:
                continue
        return self._work.result()

    def finish(self) -> None:
        """Wait for the encoder, then complete the output."""
        self._put(None)
        self._work.result()
        self._pool.shutdown()
        self._sink.finish()

    def abandon(self) -> None:
        """Stop the encoder at once and close the output without completing it."""
        self._stopped = True
        while not self._work.done():  # the queue may be full and the thread ended by an error
            with contextlib.suppress(queue.Full):
                self._queue.put_nowait(None)
            wait([self._work], POLL_INTERVAL_S)
        self._pool.shutdown()
        self._sink.abandon()
