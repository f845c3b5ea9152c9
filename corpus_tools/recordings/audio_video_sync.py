"""Audio-video synchronisation: the lag of the sound, and the most common frame rate.

The lag is estimated from the derivatives of lip opening and loudness. The signals themselves correlate at many lags
because speech is rhythmic: over 51 s of GRID s1 they give lags from -0.26 to 0.3 s, their derivatives -0.02 to 0.05 s.
"""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from corpus_tools.recordings.observation import Observation, Timing
from tts2face.models.landmarks import LOWER_LIP_INNER_MID, UPPER_LIP_INNER_MID

MAX_LAG_S = 0.3  # lags between minus and plus this are compared
LAG_STEP_S = 0.01
LAGS_S = np.arange(-round(MAX_LAG_S / LAG_STEP_S), round(MAX_LAG_S / LAG_STEP_S) + 1) * LAG_STEP_S
MIN_FRAMES = 25  # common to sound and picture
# Lip motion precedes the sound by this in GRID s1, whose sound and picture are assumed to be synchronous.
LIP_LEAD_S = 0.01
# Standard error of the lag in sequences of GRID s1: 15 ms from 51 s, 14 ms from 96 s.
MIN_DURATION_S = 48.0
MIN_LAG_S = 0.045  # three standard errors for `MIN_DURATION_S`; it falls with the square root of the duration
# 1 % of 400 samples of 51 s of GRID s1 lie below 0.38; with the sound of other sentences 1 % lie above 0.21.
MIN_CORRELATION = 0.28


@dataclass(frozen=True, slots=True)
class SyncEstimate:
    """Estimated ``lag`` of the sound in seconds, correlation of lips and loudness at it, and duration of the data."""

    lag: float
    correlation: float
    seconds: float

    @property
    def lag_correction_s(self) -> float:
        """The lag to correct: 0 if it is not significant."""
        least = MIN_LAG_S * np.sqrt(MIN_DURATION_S / self.seconds) if self.seconds >= MIN_DURATION_S else np.inf
        return round(self.lag, 3) if abs(self.lag) >= least else 0.0

    @property
    def problem(self) -> str | None:
        """Why sound and picture do not match; None if they do or if there is too little data."""
        if self.seconds < MIN_DURATION_S:
            return None
        if self.correlation < MIN_CORRELATION:
            return f"lip motion does not match the sound (correlation {self.correlation:.2f}); give the original sound"
        if abs(self.lag) > MAX_LAG_S - 2 * LAG_STEP_S:
            return f"sound and picture are out of sync by {MAX_LAG_S:g} s or more; synchronise them with an editor"
        return None


def estimate_sync_by_video(observations: Sequence[Observation]) -> Mapping[Path, SyncEstimate]:
    """Synchronisation of each video; videos shorter than `MIN_DURATION_S` are pooled."""
    together: dict[Path, list[Observation]] = {}
    for observation in observations:
        together.setdefault(observation.video, []).append(observation)
    short = [video for video, group in together.items() if _total_duration(group) < MIN_DURATION_S]
    of_short = estimate_sync([observation for video in short for observation in together[video]])
    return {video: of_short if video in short else estimate_sync(group) for video, group in together.items()}


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


def estimate_sync(observations: Iterable[Observation]) -> SyncEstimate:
    """Lag of the highest correlation of lips and loudness; lag and correlation are 0 without motion."""
    found = [
        (curve, observation) for observation in observations if (curve := lag_correlations(observation)) is not None
    ]
    if not found:
        return SyncEstimate(0.0, 0.0, 0.0)
    lengths = [len(observation.landmarks) for _, observation in found]
    total = np.average([curve for curve, _ in found], axis=0, weights=lengths)
    at = int(total.argmax())
    offset = 0.0
    if 0 < at < len(LAGS_S) - 1:
        before, peak, behind = total[at - 1 : at + 2]
        bend = before - 2 * peak + behind
        offset = 0.5 * (before - behind) / bend if bend else 0.0
    return SyncEstimate(
        float(LAGS_S[at] + offset * LAG_STEP_S - LIP_LEAD_S),
        float(total[at]),
        _total_duration([observation for _, observation in found]),
    )


def lag_correlations(observation: Observation) -> NDArray[np.float64] | None:
    """Correlations of the lips' speed with the change of loudness `LAGS_S` later; None with too few frames."""
    opening = observation.landmarks[:, UPPER_LIP_INNER_MID] - observation.landmarks[:, LOWER_LIP_INNER_MID]
    times = np.arange(len(opening)) / observation.fps
    within = (times >= MAX_LAG_S) & (times <= times[-1] - MAX_LAG_S)
    if within.sum() < MIN_FRAMES:
        return None
    speed = np.gradient(np.linalg.norm(opening.astype(np.float64), axis=1))
    rise = np.gradient(observation.intensity.astype(np.float64))
    if speed[within].std() == 0:
        return None
    rows = np.array([np.interp(times[within] + lag, times, rise) for lag in LAGS_S])
    rows -= rows.mean(axis=1, keepdims=True)
    lips = speed[within] - speed[within].mean()
    size = np.linalg.norm(rows, axis=1) * np.linalg.norm(lips)
    correlations: NDArray[np.float64] = rows @ lips / np.maximum(size, 1e-9)
    return correlations


def _total_duration(observations: Sequence[Observation]) -> float:
    return float(sum(len(observation.landmarks) / observation.fps for observation in observations))
