"""Responses of a listener: nods and raised brows at the other's cues, or at intervals where nothing is heard.

Cues are those of Ward and Tsukahara 2000 (Journal of Pragmatics 32) for English: a region of low pitch, after enough
speech; and pauses, at which listeners respond as well (Dittmann and Llewellyn 1968).
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tts2face.gestures.elements import Gesture, ListeningSpan
from tts2face.gestures.prosody import PAUSE_DB, prosody_features, speech_intensity
from tts2face.gestures.timeline import Timeline
from tts2face.types import Waveform

# Ward and Tsukahara 2000, section 4: pitch below its 26th percentile for 110 ms, after 700 ms of speech; the response
# follows 700 ms later.
# Ward and Tsukahara's rule for English: pitch below this percentile ... (decision 189)
LOW_PITCH_SHARE = 0.26
# ... for so many seconds ...
LOW_PITCH_S = 0.11
# ... after so many seconds of speech ...
SPOKEN_S = 0.7
# ... is answered after so many seconds
WAIT_S = 0.7
PAUSE_S = 0.3  # of silence that is a cue; shorter ones are closures of plosives
# Between responses: their rule has .8 s, and responds far more often than their listeners did. Six to twelve a minute
# look natural (Poppe, Truong and Heylen 2011, IVA).
# seconds between responses: 10.5 a minute, of which six to twelve look natural (Poppe et al. 2011)
LEAST_GAP_S = 4.5
STEP_S, CUE_RATE = 0.01, 16_000  # s, and Hz of the sound in which cues are looked for
# Without the other's sound: one response in each cell of time, away from its ends, so 6.7 a minute.
CELL_S, MARGIN = 9.0, 0.15
NOD_SHARE, RAISE_SHARE = 0.75, 0.4  # of responses; one without a nod raises the brows
NOD_SIZES, RAISE_SIZES = (0.35, 0.8), (0.4, 0.9)
SECOND_NOD = 0.5  # share of nods that a smaller one follows
SECOND_S = 0.42  # after the first
SECOND_SIZE = 0.6  # of the first
LASTS_S = 1.0  # a response
KEPT_S, LOOK_S = 5.0, 0.4  # of arriving sound in which cues are looked for (20 ms), and between two looks


def responses(times: Sequence[float], seed: int) -> Timeline:
    """Nods and brow raises of responses that begin at times in seconds of the clip; each depends on its time alone."""
    found = list[Gesture]()
    for time in times:
        # by the time alone, so that pieces of .2 s agree with a whole clip (decision 189)
        draws = np.random.default_rng((seed, round(time * 1000))).random(5)
        has_nod = draws[0] < NOD_SHARE
        if has_nod:
            size = float(np.interp(draws[1], (0.0, 1.0), NOD_SIZES))
            found.append(Gesture(time, "nod", size))
            if draws[2] < SECOND_NOD:
                found.append(Gesture(time + SECOND_S, "nod", SECOND_SIZE * size))
        if not has_nod or draws[3] < RAISE_SHARE:
            found.append(Gesture(time, "brows_up", float(np.interp(draws[4], (0.0, 1.0), RAISE_SIZES))))
    return Timeline(gestures=tuple(found))


def with_responses(timeline: Timeline, start: float, end: float, seed: int) -> Timeline:
    """A timeline with the responses that its listening spans have at intervals and that show in [start, end)."""
    spans = [span for span in timeline.listens if span.reacts]
    if not spans:
        return timeline
    due = [time for time in drawn_times(start - LASTS_S, end, seed) if any(_holds(span, time) for span in spans)]
    return responses(due, seed).merge(timeline)


def _holds(span: ListeningSpan, time: float) -> bool:
    return span.start <= time < span.end


def drawn_times(start: float, end: float, seed: int) -> list[float]:
    """Times of responses at intervals in [start, end), the same whatever the pieces of a clip."""
    found = []
    for cell in range(max(int(start // CELL_S), 0), int(end // CELL_S) + 1):
        time = CELL_S * (cell + np.random.default_rng((seed, cell, 1)).uniform(MARGIN, 1.0 - MARGIN))
        if start <= time < end:
            found.append(float(time))
    return found


def cue_times(sound: Waveform, *, last: float = -LEAST_GAP_S, earliest: float = 0.0) -> list[float]:
    """Seconds of a partner's sound at which a listener responds, at least `LEAST_GAP_S` apart.

    `last` is the time of the response before them, `earliest` the least one.
    """
    track = speech_intensity(sound)
    if track is None:
        return []
    times = np.arange(0.0, sound.duration, STEP_S)
    level, pitch = prosody_features(sound, times, track, with_pitch=True).astype(np.float64).T
    speaks, voiced = level >= PAUSE_DB, pitch != 0.0
    if not voiced.any():
        return []
    is_low = voiced & (pitch <= np.quantile(pitch[voiced], LOW_PITCH_SHARE))
    spoken = 0.0
    low = 0.0
    silent = 0.0
    found: list[float] = []
    for time, talks, deep in zip(times.tolist(), speaks.tolist(), is_low.tolist(), strict=True):
        low = low + STEP_S if deep else 0.0
        silent = 0.0 if talks else silent + STEP_S
        spoken += STEP_S if talks else 0.0
        has_paused = abs(silent - PAUSE_S) < STEP_S / 2
        due = time if has_paused else time + WAIT_S
        is_cue = spoken >= SPOKEN_S and (low >= LOW_PITCH_S or has_paused) and due >= earliest
        if is_cue and due - [last, *found][-1] >= LEAST_GAP_S:
            found.append(due)
            spoken = 0.0
    return found


class PartnerSound:
    """Cues in a partner's sound that arrives in blocks.

    Parameters
    ----------
    rate
        Of its samples, in Hz.
    """

    def __init__(self, rate: int) -> None:
        # numbers of samples at `CUE_RATE`
        self._rate = rate
        self._n_samples = 0
        self._n_seen = 0
        self._kept = np.zeros(0, np.float32)
        self._last = -LEAST_GAP_S

    def add(self, samples: NDArray[np.float32]) -> None:
        """Hear samples (m,) in [-1, 1]."""
        heard = Waveform(samples, self._rate).resampled(CUE_RATE).samples
        self._n_samples += len(heard)
        self._kept = np.concatenate([self._kept, heard])[-round(KEPT_S * CUE_RATE) :]

    def new_cues(self) -> list[float]:
        """Seconds from the end of the sound, 0 or more, of responses that are not returned yet."""
        seen, end = self._n_seen / CUE_RATE, self._n_samples / CUE_RATE
        if end - seen < LOOK_S:
            return []
        start, self._n_seen = end - len(self._kept) / CUE_RATE, self._n_samples
        sound = Waveform(self._kept, CUE_RATE)
        found = [start + time for time in cue_times(sound, last=self._last - start, earliest=seen - start)]
        self._last = found[-1] if found else self._last
        return [max(time - end, 0.0) for time in found]
