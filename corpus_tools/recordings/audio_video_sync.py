"""One clock for all recordings: how far sound and picture are apart, and the frame rate that most of them have.

What is compared is how fast lips open and how fast the sound rises. Opening and loudness themselves agree at many lags,
for speech has a rhythm: of 51 s in a row of GRID s1 they name lags from -0.26 to 0.3 s, their rates -0.02 to 0.05 s.
"""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from corpus_tools.recordings.observation import Observation, Timing
from tts2face.models.landmarks import LOWER_LIP_INNER_MID, UPPER_LIP_INNER_MID

MAX_LAG_S = 0.3  # lags from minus to plus this are looked at
LAG_STEP_S = 0.01
LAGS_S = np.arange(-round(MAX_LAG_S / LAG_STEP_S), round(MAX_LAG_S / LAG_STEP_S) + 1) * LAG_STEP_S
MIN_FRAMES = 25  # that sound and picture must share
# Lips open before they are heard: by this in GRID s1, whose sound and picture are taken to be together.
LIP_LEAD_S = 0.01
# Of sentences of GRID s1 in a row, a lag read from 51 s is off by 15 ms (standard deviation), from 96 s by 14 ms.
MIN_DURATION_S = 48.0
MIN_LAG_S = 0.045  # three deviations for `MIN_DURATION_S`; it falls with the square root of the time
# Of 400 samples of 51 s of GRID s1 1 % lie below .38; of its sounds on other sentences 1 % lie above .21.
MIN_CORRELATION = 0.28


@dataclass(frozen=True, slots=True)
class SyncEstimate:
    """Seconds of ``lag`` by which the sound comes late, how well lips and loudness then agree, and of how much."""

    lag: float
    correlation: float
    seconds: float

    @property
    def lag_correction_s(self) -> float:
        """The lag to take out: 0 where it cannot be told from none."""
        least = MIN_LAG_S * np.sqrt(MIN_DURATION_S / self.seconds) if self.seconds >= MIN_DURATION_S else np.inf
        return round(self.lag, 3) if abs(self.lag) >= least else 0.0

    @property
    def problem(self) -> str | None:
        """Why sound and picture do not belong together, None where they do or where too little tells."""
        if self.seconds < MIN_DURATION_S:
            return None
        if self.correlation < MIN_CORRELATION:
            return f"the lips do not move with the sound (correlation {self.correlation:.2f}); give the original sound"
        if abs(self.lag) > MAX_LAG_S - 2 * LAG_STEP_S:
            return f"sound and picture are {MAX_LAG_S:g} s or more apart; put them together with an editor"
        return None


def estimate_sync_by_video(observations: Sequence[Observation]) -> Mapping[Path, SyncEstimate]:
    """How sound and picture of each video agree; videos of less than `MIN_DURATION_S` are taken together."""
    together: dict[Path, list[Observation]] = {}
    for observation in observations:
        together.setdefault(observation.video, []).append(observation)
    short = [video for video, group in together.items() if _total_duration(group) < MIN_DURATION_S]
    of_short = estimate_sync([seen for video in short for seen in together[video]])
    return {video: of_short if video in short else estimate_sync(group) for video, group in together.items()}


def corrected_timings(observations: Sequence[Observation], found: Mapping[Path, SyncEstimate]) -> Mapping[Path, Timing]:
    """How the videos must be read that were read otherwise: at the rate that most frames have, without a lag."""
    frames: Counter[float] = Counter()
    rates = {}
    for seen in observations:
        frames[seen.fps] += len(seen.landmarks)
        rates[seen.video] = seen.fps
    common = min(frames, key=lambda fps: (-frames[fps], fps), default=None)
    wanted = {
        video: Timing(common if rates[video] != common else None, found[video].lag_correction_s) for video in rates
    }
    return {video: timing for video, timing in wanted.items() if timing != Timing()}


def estimate_sync(observations: Iterable[Observation]) -> SyncEstimate:
    """The lag at which lips and loudness of recordings agree best; 0 and 0 where nothing moves."""
    found = [(curve, seen) for seen in observations if (curve := lag_correlations(seen)) is not None]
    if not found:
        return SyncEstimate(0.0, 0.0, 0.0)
    lengths = [len(seen.landmarks) for _, seen in found]
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
        _total_duration([seen for _, seen in found]),
    )


def lag_correlations(seen: Observation) -> NDArray[np.float64] | None:
    """Correlations of the lips' speed with the rise of the loudness `LAGS_S` later; None with too little to compare."""
    apart = seen.landmarks[:, UPPER_LIP_INNER_MID] - seen.landmarks[:, LOWER_LIP_INNER_MID]
    times = np.arange(len(apart)) / seen.fps
    within = (times >= MAX_LAG_S) & (times <= times[-1] - MAX_LAG_S)
    if within.sum() < MIN_FRAMES:
        return None
    speed = np.gradient(np.linalg.norm(apart.astype(np.float64), axis=1))
    rise = np.gradient(seen.intensity.astype(np.float64))
    if speed[within].std() == 0:
        return None
    rows = np.array([np.interp(times[within] + lag, times, rise) for lag in LAGS_S])
    rows -= rows.mean(axis=1, keepdims=True)
    lips = speed[within] - speed[within].mean()
    size = np.linalg.norm(rows, axis=1) * np.linalg.norm(lips)
    correlations: NDArray[np.float64] = rows @ lips / np.maximum(size, 1e-9)
    return correlations


def _total_duration(observations: Sequence[Observation]) -> float:
    return float(sum(len(seen.landmarks) / seen.fps for seen in observations))
