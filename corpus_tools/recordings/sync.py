"""Audio-video synchronisation: the lag of the sound, whether the lips follow it, and the most common frame rate.

The speed of the lips is correlated with the speed that a shipped talker shows for the phones aligned to the sound. For
other people this separates right from wrong sound and finds lags far better than the change of loudness
(docs/decisions/129-recording-limits.md).
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from corpus_tools.recordings.expected_opening import EXPECTED_RATE_HZ, ExpectedOpening, shipped_talker_opening
from corpus_tools.recordings.limits import check_limits, limit_warnings
from corpus_tools.recordings.observation import Observation, Timing
from lexicon.errors import DataError
from tts2face.models.landmarks import lip_opening

MAX_LAG_S = 0.5  # lags between minus and plus this are compared
# seconds between the lags that are tried
LAG_STEP_S = 0.01
LAGS_S = np.arange(-round(MAX_LAG_S / LAG_STEP_S), round(MAX_LAG_S / LAG_STEP_S) + 1) * LAG_STEP_S
MIN_FRAMES = 25
MIN_DURATION_S = 12.0  # shorter videos take the lag of all short ones: of 3 s it has an error of 25 ms, of 12 s 10 ms
NEAR_S = 0.05  # a short video may differ from this lag by as much
# Lags found in five synchronous talkers lie from -0.04 to 0 s.
MIN_LAG_S = 0.045
RELIABLE_S = 8.0  # duration from which lags of `MIN_LAG_S` are significant; in less they must be larger
Parts = Sequence[tuple[NDArray[np.float64], float]]  # correlations at `LAGS_S`, and seconds of each observation


@dataclass(frozen=True, slots=True)
class SyncEstimate:
    """Estimated ``lag`` of the sound in seconds, and correlations of the lips with the expected ones at it.

    ``correlation`` and ``seconds`` are those of the video, ``pooled`` and ``pooled_seconds`` those of the material
    from which the lag was estimated.
    """

    lag: float
    correlation: float
    seconds: float
    pooled: float
    pooled_seconds: float

    @property
    def lag_correction_s(self) -> float:
        """The lag to correct: 0 if it is not significant."""
        if self.pooled_seconds <= 0 or self.problem or self._has_no_peak:
            return 0.0
        least = MIN_LAG_S * np.sqrt(max(1.0, RELIABLE_S / self.pooled_seconds))
        return round(self.lag, 3) if abs(self.lag) >= least else 0.0

    @property
    def measures(self) -> dict[str, float]:
        """The correlations, under the names of the limits that apply to the durations."""
        long = {"sync": self.pooled} if self.pooled_seconds >= MIN_DURATION_S else {}
        return {**long, **({"sync_of_short": self.correlation} if 0 < self.seconds < MIN_DURATION_S else {})}

    @property
    def problem(self) -> str | None:
        """Why sound and picture do not match; None if they do or if there is no motion to compare."""
        try:
            check_limits(self.measures)
        except DataError as reason:
            return str(reason)
        if self._has_no_peak and self.pooled_seconds >= MIN_DURATION_S:
            return f"sound and picture are out of sync by {MAX_LAG_S:g} s or more; synchronise them with an editor"
        return None

    @property
    def warnings(self) -> tuple[str, ...]:
        """Messages about weak agreement, and about material that is too short for a comparison."""
        if not self.seconds:
            return (f"it has fewer than {MIN_FRAMES} frames, too few to compare lips and sound; record longer parts",)
        found = limit_warnings(self.measures)
        if self._has_no_peak and self.pooled_seconds < MIN_DURATION_S:
            found = (
                *found,
                f"{self.pooled_seconds:.1f} s are too short to tell whether sound and picture are in step; record "
                f"{MIN_DURATION_S:g} s or more",
            )
        return found

    @property
    def _has_no_peak(self) -> bool:
        """Whether the correlation is highest at the end of the lags that are compared."""
        return abs(self.lag) > MAX_LAG_S - 2 * LAG_STEP_S


def estimate_sync_by_video(
    observations: Sequence[Observation], expected: ExpectedOpening = shipped_talker_opening
) -> Mapping[Path, SyncEstimate]:
    """Synchronisation of each video; videos shorter than `MIN_DURATION_S` are pooled, and compared at their lag.

    Parameters
    ----------
    expected
        Lip opening for phones, as `corpus_tools.recordings.expected_opening.shipped_talker_opening` returns it.
    """
    together: dict[Path, list[tuple[NDArray[np.float64], float]]] = {
        observation.video: [] for observation in observations
    }
    for observation in observations:
        curve = lag_correlations(observation, expected)
        if curve is not None:
            together[observation.video].append((curve, len(observation.landmarks) / observation.fps))
    short = [video for video, group in together.items() if _total_seconds(group) < MIN_DURATION_S]
    pool = [part for video in short for part in together[video]]
    return {video: _estimate(group, pool if video in short else group) for video, group in together.items()}


def corrected_timings(observations: Sequence[Observation], found: Mapping[Path, SyncEstimate]) -> Mapping[Path, Timing]:
    """Timing of the videos that must be read again: at the most common frame rate, with their lag corrected."""
    frames: Counter[float] = Counter()
    rates = {}
    for observation in observations:
        frames[observation.fps] += len(observation.landmarks)
        rates[observation.video] = observation.fps
    common = min(frames, key=lambda fps: (-frames[fps], fps), default=None)
    wanted = {
        video: Timing(common if rates[video] != common else None, found[video].lag_correction_s) for video in rates
    }
    return {video: timing for video, timing in wanted.items() if timing != Timing()}


def lag_correlations(observation: Observation, expected: ExpectedOpening) -> NDArray[np.float64] | None:
    """Correlations of the lips' speed with the expected one `LAGS_S` later; None with too few frames.

    Beyond the phones the expected lips are at rest. Lips that do not move correlate by 0.
    """
    n_frames = len(observation.landmarks)
    if n_frames < MIN_FRAMES:
        return None
    times = np.arange(n_frames) / observation.fps
    speed = np.gradient(lip_opening(observation.landmarks).astype(np.float64))
    wanted = np.gradient(expected(observation.phones))
    known = np.arange(len(wanted)) / EXPECTED_RATE_HZ
    rows = np.array([np.interp(times + lag, known, wanted, left=0.0, right=0.0) for lag in LAGS_S])
    rows -= rows.mean(axis=1, keepdims=True)
    speed -= speed.mean()
    size = np.linalg.norm(rows, axis=1) * np.linalg.norm(speed)
    correlations: NDArray[np.float64] = rows @ speed / np.maximum(size, 1e-9)
    return correlations


def _estimate(own: Parts, pool: Parts) -> SyncEstimate:
    if not pool:
        return SyncEstimate(0.0, 0.0, 0.0, 0.0, 0.0)
    total = _mean_curve(pool)
    lag = _peak_lag(total)
    near = np.abs(LAGS_S - lag) <= NEAR_S
    correlation = float(_mean_curve(own)[near].max()) if own else 0.0
    return SyncEstimate(lag, correlation, _total_seconds(own), float(total.max()), _total_seconds(pool))


def _mean_curve(parts: Parts) -> NDArray[np.float64]:
    return np.asarray(np.average([curve for curve, _ in parts], axis=0, weights=[seconds for _, seconds in parts]))


def _peak_lag(curve: NDArray[np.float64]) -> float:
    """Lag of the highest correlation, interpolated by a parabola; 0 for lips that do not move."""
    if not curve.any():
        return 0.0
    at, offset = int(curve.argmax()), 0.0
    # a parabola through the peak and its neighbours
    if 0 < at < len(LAGS_S) - 1:
        before, peak, behind = curve[at - 1 : at + 2]
        bend = before - 2 * peak + behind
        offset = 0.5 * (before - behind) / bend if bend else 0.0
    return float(LAGS_S[at] + offset * LAG_STEP_S)


def _total_seconds(parts: Parts) -> float:
    return float(sum(seconds for _, seconds in parts))
