"""Breathing of a face: shoulders that rise before a phrase and sink while it is spoken, and lips that part for it.

A face has it if it has the shape `BREATH_SHAPE`, whose weight is the share of a full breath. Sources: Winkworth et al.
1995 (breath groups of speech begin with a quick breath), Conrad and Schönle 1979 (in of a tenth of the cycle in speech,
nearly half at rest).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from lexicon.sequence import SILENCE, PhoneSequence
from tts2face.numeric.arrays import FloatArray
from tts2face.types import Trajectory

BREATH_SHAPE = "breath"
LEAST_PAUSE_S = 0.18  # of silence before a phrase that begins with a breath
IN_S, REST_IN_S = 0.45, 1.5  # length of a breath in before a phrase, and at rest
OUT_S = 2.4  # in which the shoulders sink to a third of the way
REST_CYCLE_S = (3.4, 4.8)  # between breaths at rest: 12 to 18 a minute
REST_DEPTH = 0.7  # of a breath at rest
# share of the lungs below which the shoulders do not sink
LOWEST = 0.1
JAW_SHAPE, PARTED = "jawOpen", 0.07  # weight at which a mouth that was closed draws breath
PARTS_S, CLOSES_S = 0.3, 0.05  # before the first phone: start and end, so that its closure is the phone's own


@dataclass(frozen=True, slots=True)
class Breath:
    """Lungs after a frame: how full they are, how full they become, until when, and when the next breath at rest is.

    Times are in seconds of the whole clip; ``number`` counts the breaths at rest.
    """

    level: float = 0.4
    goal: float = 0.4
    until_s: float = 0.0
    next_s: float = 2.0
    clock_s: float = 0.0
    number: int = 0


@dataclass(frozen=True, slots=True)
class Breathing:
    """Column of the breath among the channels of a face."""

    column: int

    @classmethod
    def of_channels(cls, channels: Sequence[str]) -> "Breathing | None":
        """None for a face whose shoulders are still."""
        return cls(channels.index(BREATH_SHAPE)) if BREATH_SHAPE in channels else None

    def apply(
        self,
        face: Trajectory,
        phones: PhoneSequence,
        seed: int,
        before: Breath | None,
        least: FloatArray | None = None,
    ) -> tuple[Trajectory, Breath]:
        """Motion (T, K) that breathes with the phones of its piece, after `before`; `least` (T,) holds a breath."""
        now = before or Breath()
        starts, step = phrase_starts(phones), 1.0 / face.fps
        weights = face.values.copy()
        for frame in range(len(face)):
            time = frame * step
            ahead = [start - time for start in starts if 0 < start - time <= IN_S]
            now = _next(now, min(ahead, default=0.0), step, seed)
            weights[frame, self.column] = now.level
        if least is not None:
            weights[:, self.column] = np.maximum(weights[:, self.column], least)
        return replace(face, values=weights), now


def phrase_starts(phones: PhoneSequence) -> list[float]:
    """Seconds at which speech begins after a pause, or at the beginning of a piece."""
    starts, silence = [], math.inf
    for number, phone in enumerate(phones.phones):
        start, end = float(phones.edges[number]), float(phones.edges[number + 1])
        if phone == SILENCE:
            silence = (silence if number == 0 else 0.0) + end - start
        else:
            if silence >= LEAST_PAUSE_S:
                starts.append(start)
            silence = 0.0
    return starts


def _next(now: Breath, ahead_s: float, step: float, seed: int) -> Breath:
    """Lungs one frame later; `ahead_s` is the time to the next phrase if it is near, else 0."""
    clock = now.clock_s + step
    goal, until, following, number = now.goal, now.until_s, now.next_s, now.number
    if ahead_s > 0 and goal < 1.0:
        goal, until = 1.0, now.clock_s + ahead_s
    # no breath at rest shortly before a phrase, which begins with its own
    elif now.clock_s >= following and ahead_s == 0:
        goal, until, number = max(REST_DEPTH, now.level), now.clock_s + REST_IN_S, number + 1
    if until > now.clock_s:
        share = min(step / (until - now.clock_s), 1.0)
        level = now.level + (goal - now.level) * min(1.6 * share, 1.0)  # fast at first, then slower
        low, high = REST_CYCLE_S
        wait = np.random.default_rng((seed, number)).uniform(low, high)
        return Breath(level, goal, until, until - (REST_IN_S if goal < 1.0 else IN_S) + wait, clock, number)
    level = LOWEST + (now.level - LOWEST) * math.exp(-step / OUT_S)
    return Breath(level, 0.0, until, following, clock, number)


def part_lips(face: Trajectory, turns: Sequence[float]) -> Trajectory:
    """Motion (T, K) with lips that part before `turns` (s); as it is for a face without `JAW_SHAPE`."""
    # a face without a jaw breathes by its shoulders alone
    if not turns or JAW_SHAPE not in face.channels:
        return face
    weights, column, times = face.values.copy(), face.channels.index(JAW_SHAPE), face.times
    for turn in turns:
        share = np.clip((turn - CLOSES_S - times) / (PARTS_S - CLOSES_S), 0.0, 1.0)
        weights[:, column] = np.maximum(weights[:, column], PARTED * np.square(np.sin(np.pi * share)))
    return replace(face, values=weights)
