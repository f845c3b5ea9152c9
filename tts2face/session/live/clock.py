"""The clock of a reader of frames."""

import time
from collections.abc import Callable

MAX_LAG_S = 0.25  # by which a reader may be late; beyond it the clock goes on from then, so that no burst follows


class FrameClock:
    """Instants at which the frames of one reader are due: frame n ``n / fps`` seconds after the first one.

    Parameters
    ----------
    now
        Monotonic seconds.
    """

    def __init__(self, fps: float, now: Callable[[], float] = time.monotonic) -> None:
        self._fps, self._now = fps, now
        self._n_frames, self._start = 0, 0.0

    @property
    def is_new(self) -> bool:
        """Whether no frame has been read."""
        return self._n_frames == 0

    def wait_s(self) -> float:
        """Seconds until the frame after the present one is due, 0 or more."""
        now = self._now()
        if self.is_new:
            self._start = now
        self._n_frames += 1
        wait = self._start + self._n_frames / self._fps - now
        if wait < -MAX_LAG_S:
            self._start -= wait
        return max(wait, 0.0)
