"""Blinks: onsets, durations and speeds, interpolated linearly between frames."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tts2face.numeric.arrays import FloatArray

SHUT = 0.5  # closure from which lids count as shut (as in tts2face.gestures.noise)
OPEN = 0.2  # closure below which lids count as open; trackers measure about 0.1 for narrowed eyes


@dataclass(frozen=True, slots=True, eq=False)
class Blinks:
    """Blinks of some recordings.

    Parameters
    ----------
    n, seconds
        Number of blinks and duration of the recordings.
    intervals : (I,)
        Seconds from onset to onset within a recording; an onset is an upward crossing of `SHUT`.
    closing, opening : (B,)
        Seconds from `OPEN` to the instant of the greatest closure, and from there to `OPEN`.
    closing_speeds, opening_speeds : (B,)
        Highest speed of each, shares per second.

    Blinks that begin or end outside their recording contribute only their onsets.
    """

    n: int
    seconds: float
    intervals: FloatArray
    closing: FloatArray
    opening: FloatArray
    closing_speeds: FloatArray
    opening_speeds: FloatArray

    @property
    def durations(self) -> FloatArray:
        """(B,) seconds from open to open."""
        return self.closing + self.opening

    @property
    def per_minute(self) -> float:
        """Blinks per minute."""
        return 60 * self.n / self.seconds


def find_blinks(shut: NDArray[np.floating], lengths: NDArray[np.int32], fps: float) -> Blinks:
    """Blinks in concatenated recordings of `lengths` (R,) frames, from lid closures (T, 2) or (T,) in 0..1."""
    lids = np.asarray(shut, np.float64).reshape(len(shut), -1).mean(axis=1)
    parts = np.split(lids, np.cumsum(lengths)[:-1])
    onsets = [blink_onsets(part) / fps for part in parts]
    intervals = np.concatenate([np.diff(times) for times in onsets])
    phases = np.concatenate([_blink_phases(part, fps) for part in parts]).T
    return Blinks(sum(map(len, onsets)), float(np.sum(lengths)) / fps, intervals, *phases)


def blink_onsets(lids: FloatArray) -> FloatArray:
    """(B,) fractional frames at which lid closures (T,) cross `SHUT` upwards."""
    shut = lids > SHUT
    last = np.flatnonzero(~shut[:-1] & shut[1:])
    return np.asarray(last + (SHUT - lids[last]) / (lids[last + 1] - lids[last]))


def _blink_phases(lids: FloatArray, fps: float) -> FloatArray:
    """(B, 4) closing time, opening time, closing speed and opening speed of the blinks within a recording."""
    rows = []
    closed = lids > OPEN
    starts = np.flatnonzero(~closed[:-1] & closed[1:])
    for start in starts:
        after = np.flatnonzero(~closed[start + 1 :])
        # the recording ends while they are closed
        if not len(after):
            break
        end = start + 1 + int(after[0])  # the first open frame
        top = start + int(np.argmax(lids[start : end + 1]))
        # lids that only narrow are no blink
        if lids[top] <= SHUT:
            continue
        first = start + (OPEN - lids[start]) / (lids[start + 1] - lids[start])
        last = end - (OPEN - lids[end]) / (lids[end - 1] - lids[end])
        speeds = np.diff(lids[start : end + 1]) * fps
        rows.append(((top - first) / fps, (last - top) / fps, speeds.max(), -speeds.min()))
    return np.array(rows, np.float64).reshape(-1, 4)
