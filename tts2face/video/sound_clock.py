"""The clock of a sound track beside the count of its samples: gaps between stretches, and drift within them.

The crystal of a converter of sound and that of the clock beside it differ by up to some .1 %, which is seconds in an
hour; and recorders lose samples. The times of a file decide, in both directions: where they drift from the samples, a
stretch is resampled to them, by windowed sinc interpolation between the samples (Smith and Gossett, ICASSP 1984).
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from tts2face.numeric.arrays import FloatArray

if TYPE_CHECKING:
    from av.audio.frame import AudioFrame

MAX_DELAY_S = 60.0  # of the sound behind the pictures, and of a gap in it; beyond, a clock was set anew
LEAST_GAP_S = 0.1  # between two frames that is silence; less is rounding of the file's clock, or a part of its drift
BIN_S = 2.0  # over which times are averaged: rounding to milliseconds and the jitter of a live recording are no drift
LEAST_DRIFT_S = 0.01  # of a mean from the count of samples; a sound within it stays as it is
MAX_DRIFT = 0.2  # of the speed; 44.1 kHz counted as 48 kHz are .09, and beyond these the times are wrong
N_TAPS, N_PHASES = 32, 1024  # of the interpolation: -70 dB at a quarter of the rate
KAISER_BETA = 9.0


@dataclass(frozen=True, slots=True, eq=False)
class Stretch:
    """Knots (K,) of a stretch without a gap: positions in samples, and the places, in samples too, of their times.

    None where the samples stand where the times say.
    """

    n_samples: int
    knots: tuple[FloatArray, FloatArray] | None = None

    @property
    def n_resampled(self) -> int:
        """Samples after it is resampled."""
        return self.n_samples if self.knots is None else max(round(float(self.knots[1][-1])), 0)

    def place_of(self, at: FloatArray) -> FloatArray:
        """Positions (n,) in samples of resampled ones; below 0 before the first one."""
        assert self.knots is not None
        positions, places = self.knots
        found: FloatArray = np.interp(at, places, positions)
        return np.where(at < places[0], at - places[0], found)


@dataclass(frozen=True, slots=True, eq=False)
class SoundClock:
    """Stretches of a sound track, and its gaps: spans (seconds from the first sample, length)."""

    stretches: tuple[Stretch, ...] = ()
    gaps: tuple[tuple[float, float], ...] = ()
    rate: int = 1

    def notes(self, name: str) -> tuple[str, ...]:
        """Sentences for the user on what is filled and resampled in the sound of a file."""
        notes = []
        if self.gaps:
            at, seconds = self.gaps[0][0], sum(length for _, length in self.gaps)
            where = f"a gap at {at:.2f} s" if len(self.gaps) == 1 else f"{len(self.gaps)} gaps, the first at {at:.2f} s"
            notes.append(f"the sound of {name} has {where} ({seconds:.2f} s): silence is there, so that times are kept")
        drift = sum(abs(stretch.n_resampled - stretch.n_samples) for stretch in self.stretches) / self.rate
        if any(stretch.knots for stretch in self.stretches):
            notes.append(
                f"the sound of {name} drifts by {drift:.2f} s from the times that the file states: it is resampled to "
                "them; give a file of the sound alone to keep its samples"
            )
        return tuple(notes)


class FrameTimes:
    """Times of frames one after another, and whether a stretch begins with one."""

    def __init__(self) -> None:
        self.end: float | None = None

    def add(self, frame: "AudioFrame") -> tuple[float, bool]:
        """Seconds of the file's clock at which a frame begins, and whether it does not follow the one before."""
        before = self.end
        time = float(before or 0.0) if frame.time is None else float(frame.time)
        self.end = time + frame.samples / frame.sample_rate
        return time, before is None or abs(time - before) > LEAST_GAP_S


class ClockMeter:
    """Measures the clock of a track from its frames."""

    def __init__(self) -> None:
        self._times = FrameTimes()
        self._stretches: list[Stretch] = []
        self._gaps: list[tuple[float, float]] = []
        self._start = self._first = 0.0
        self._rate, self._n = 1, 0
        self._bins: list[tuple[int, float, float]] = []  # frames of each, sums of their positions and drifts

    def add(self, frame: "AudioFrame") -> None:
        """Count the next frame."""
        end = self._times.end
        time, is_new = self._times.add(frame)
        if is_new:
            if end is None:
                self._start = time
            elif 0 < time - end <= MAX_DELAY_S:
                self._gaps.append((end - self._start, time - end))
            self._close()
            self._first, self._rate = time, frame.sample_rate
        number = int(self._n / self._rate / BIN_S)
        if number >= len(self._bins):  # a frame may be longer than one
            self._bins.append((0, 0.0, 0.0))
        count, position, drift = self._bins[-1]
        late = (time - self._first) * self._rate - self._n
        self._bins[-1] = count + 1, position + self._n, drift + late
        self._n += frame.samples

    def clock(self) -> SoundClock:
        """The clock of the frames that are added."""
        self._close()
        return SoundClock(tuple(self._stretches), tuple(self._gaps), self._rate)

    def _close(self) -> None:
        if self._n:
            self._stretches.append(Stretch(self._n, _drift_knots(self._bins, self._n, self._rate)))
        self._bins, self._n = [], 0


def _drift_knots(
    bins: list[tuple[int, float, float]], n_samples: int, rate: int
) -> tuple[FloatArray, FloatArray] | None:
    """Knots of a stretch, from its first sample to its end; None without a drift."""
    if len(bins) > 1 and bins[-1][0] < bins[-2][0] / 2:  # too few for a mean
        bins = bins[:-1]
    counts, positions, drifts = np.array(bins, np.float64).T
    positions, drifts = positions / counts, drifts / counts
    if len(bins) < 2 or np.abs(drifts).max() <= LEAST_DRIFT_S * rate:
        return None
    slopes = np.diff(drifts) / np.diff(positions)
    if np.abs(slopes).max() > MAX_DRIFT:
        return None
    first = drifts[0] - slopes[0] * positions[0]
    last = drifts[-1] + slopes[-1] * (n_samples - positions[-1])
    positions = np.concatenate([[0.0], positions, [float(n_samples)]])
    return positions, positions + np.concatenate([[first], drifts, [last]])


def resample_stretch(blocks: Iterator[NDArray[np.float32]], stretch: Stretch) -> Iterator[NDArray[np.float32]]:
    """Yield the samples of a stretch where its times say; they are `Stretch.n_resampled`."""
    if stretch.knots is None:
        yield from blocks
        return
    half = N_TAPS // 2
    held, first = np.zeros(N_TAPS, np.float32), -N_TAPS  # samples, and the position of the first of them
    n_read = done = 0
    is_last = False
    while not is_last:
        block = next(blocks, None)
        is_last = block is None
        block = np.zeros(N_TAPS, np.float32) if block is None else block
        held, n_read = np.concatenate([held, block]), n_read + len(block) * (not is_last)
        reached = float(np.interp(n_read - half, *stretch.knots))
        last = stretch.n_resampled if is_last else min(int(np.floor(reached)), stretch.n_resampled)
        if last <= done:
            continue
        at = stretch.place_of(np.arange(done, last, dtype=np.float64))
        yield _interpolate(held, np.clip(at - first, half, len(held) - half - 1))
        done = last
        n_old = max(int(at[-1]) - half - first, 0)
        held, first = held[n_old:], first + n_old


def _interpolate(samples: NDArray[np.float32], at: FloatArray) -> NDArray[np.float32]:
    """Values (n,) of samples at places between them, half of the taps away from both ends at least."""
    phases = np.rint(at * N_PHASES).astype(np.int64)
    whole, phase = phases // N_PHASES, phases % N_PHASES
    windows = np.lib.stride_tricks.sliding_window_view(samples, N_TAPS)[whole - N_TAPS // 2 + 1]
    found: NDArray[np.float32] = np.einsum("nt,nt->n", windows, _kernel()[phase])
    return found


@lru_cache(maxsize=1)
def _kernel() -> NDArray[np.float32]:
    """(P, taps) weights of the samples around a place, for each phase of it between two."""
    offsets = np.arange(N_TAPS) - N_TAPS // 2 + 1
    distance = offsets[None] - np.arange(N_PHASES)[:, None] / N_PHASES
    share = np.clip(1.0 - np.square(distance / (N_TAPS / 2)), 0.0, None)
    weights = np.sinc(distance) * np.i0(KAISER_BETA * np.sqrt(share))
    found: NDArray[np.float32] = (weights / weights.sum(axis=1, keepdims=True)).astype(np.float32)
    return found
