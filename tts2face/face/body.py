"""What moves on a face by itself, whatever it says or mimics: hair, shoulders and pupils, if it has shapes for them.

Breathing: shoulders that rise before a phrase and sink while it is spoken.

A face has it if it has the shape `BREATH_SHAPE`, whose weight is the share of a full breath. Sources: Winkworth et al.
1995 (breath groups of speech begin with a quick breath), Conrad and Schönle 1979 (in of a tenth of the cycle in speech,
nearly half at rest).

Hair that lags behind the head: a damped spring about each axis of the head's rotation.

A face has it if it has the shapes `SWING_SHAPES`; their weights are the angles in radians by which the loose ends lag.

Pupils that are never quite still: slow fluctuations, and wider ones while the face speaks.

A face has them if it has the shape `PUPIL_SHAPE`, which moves no vertex: at weight 1 a pupil is `DILATION` wider.
Sources: Stark et al. 1958 (fluctuations of a tenth of the diameter, below 0.5 Hz), Kahneman and Beatty 1966 (pupils
widen with effort, within a second).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from lexicon.sequence import SILENCE, PhoneSequence
from tts2face.models.lit_hair import SWING_SHAPES
from tts2face.types import Trajectory

BREATH_SHAPE = "breath"
LEAST_PAUSE_S = 0.18  # of silence before a phrase that begins with a breath
IN_S, REST_IN_S = 0.45, 1.5  # length of a breath in before a phrase, and at rest
OUT_S = 2.4  # in which the shoulders sink to a third of the way
REST_CYCLE_S = (3.4, 4.8)  # between breaths at rest: 12 to 18 a minute
REST_DEPTH = 0.7  # of a breath at rest
LOWEST = 0.1
FloatArray = NDArray[np.float64]
FREQUENCY_HZ, DAMPING = 1.9, 0.32  # of loose ends: they come to rest in about half a second
LIMIT_RAD = 0.15  # of a lag, towards which larger ones bend
PUPIL_SHAPE = "pupilDilate"
DILATION = 0.25  # share of its diameter by which a pupil is wider at weight 1
WAVES_HZ, WAVE_SIZES = np.array([0.06, 0.13, 0.29]), np.array([0.22, 0.16, 0.10])
SPEECH, FOLLOW_S = 0.4, 0.9  # weight while speaking, and the time in which two thirds of it are reached
JAW_SHAPE, PARTED = "jawOpen", 0.07  # weight at which a mouth that was closed draws breath
PARTS_S, CLOSES_S = 0.3, 0.05  # before the first phone: begin and end, so that its closure is the phone's own


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
        self, face: Trajectory, phones: PhoneSequence, seed: int, before: Breath | None
    ) -> tuple[Trajectory, Breath]:
        """Motion (T, K) that breathes with the phones of its piece, after `before`."""
        now = before or Breath()
        starts, step = phrase_starts(phones), 1.0 / face.fps
        weights = face.values.copy()
        for frame in range(len(face)):
            time = frame * step
            ahead = [start - time for start in starts if 0 < start - time <= IN_S]
            now = _next(now, min(ahead, default=0.0), step, seed)
            weights[frame, self.column] = now.level
        return replace(face, values=weights), now


def phrase_starts(phones: PhoneSequence) -> list[float]:
    """Seconds at which speech begins after a pause, or at the beginning of a piece."""
    starts, silence = [], math.inf
    for number, phone in enumerate(phones.phones):
        begin, end = float(phones.edges[number]), float(phones.edges[number + 1])
        if phone == SILENCE:
            silence = (silence if number == 0 else 0.0) + end - begin
        else:
            if silence >= LEAST_PAUSE_S:
                starts.append(begin)
            silence = 0.0
    return starts


def _next(now: Breath, ahead_s: float, step: float, seed: int) -> Breath:
    """Lungs one frame later; `ahead_s` is the time to the next phrase if it is near, else 0."""
    clock = now.clock_s + step
    goal, until, following, number = now.goal, now.until_s, now.next_s, now.number
    if ahead_s > 0 and goal < 1.0:
        goal, until = 1.0, now.clock_s + ahead_s
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


@dataclass(frozen=True, slots=True, eq=False)
class Swing:
    """Hair after a frame: angles (3,) and their rates (3,) of the head, and the state (2, 3) of the springs."""

    angles: FloatArray
    rates: FloatArray
    springs: FloatArray


@dataclass(frozen=True, slots=True)
class HairSwing:
    """Columns of the swinging shapes among the channels of a face."""

    columns: tuple[int, ...]

    @classmethod
    def of_channels(cls, channels: Sequence[str]) -> "HairSwing | None":
        """None for a face whose hair does not swing."""
        found = [channels.index(name) for name in SWING_SHAPES if name in channels]
        return cls(tuple(found)) if len(found) == len(SWING_SHAPES) else None

    def apply(self, face: Trajectory, head: Trajectory, before: Swing | None) -> tuple[Trajectory, Swing]:
        """Motion (T, K) with hair that follows a head (T, 6), after `before`; None begins at rest.

        The spring is solved exactly between frames, at which the head's rate jumps.
        """
        angles = head.values[:, :3].astype(np.float64)
        if before is None:
            before = Swing(angles[0], np.zeros(3), np.zeros((2, 3)))
        rates = np.diff(angles, axis=0, prepend=before.angles[None]) * head.fps
        pushes = -np.diff(rates, axis=0, prepend=before.rates[None])
        angular, step = 2 * math.pi * FREQUENCY_HZ, 1.0 / head.fps
        damped = angular * math.sqrt(1 - DAMPING**2)
        decay = math.exp(-DAMPING * angular * step)
        gain = decay * math.sin(damped * step) / damped
        turn = 2 * decay * math.cos(damped * step)
        lags = np.empty_like(pushes)
        now, later = before.springs
        for lag, push in zip(lags, pushes, strict=True):  # a recursion of two poles; scipy.signal takes long to import
            lag[:] = gain * push + now
            now, later = turn * lag + later, -(decay**2) * lag
        springs = np.stack([now, later])
        weights = face.values.copy()
        weights[:, self.columns] += (LIMIT_RAD * np.tanh(lags / LIMIT_RAD)).astype(weights.dtype)
        return replace(face, values=weights), Swing(angles[-1], rates[-1], springs)


@dataclass(frozen=True, slots=True)
class Dilation:
    """Pupils after a frame: the time in the whole clip, and the weight that speech gives them."""

    clock_s: float = 0.0
    effort: float = 0.0


@dataclass(frozen=True, slots=True)
class Pupils:
    """Column of the pupils among the channels of a face."""

    column: int

    @classmethod
    def of_channels(cls, channels: Sequence[str]) -> "Pupils | None":
        """None for a face whose pupils are painted."""
        return cls(channels.index(PUPIL_SHAPE)) if PUPIL_SHAPE in channels else None

    def apply(
        self, face: Trajectory, phones: PhoneSequence, seed: int, before: Dilation | None
    ) -> tuple[Trajectory, Dilation]:
        """Motion (T, K) with pupils that follow the phones of its piece, after `before`."""
        now = before or Dilation()
        times = face.times
        at = np.clip(np.searchsorted(phones.edges, times, side="right") - 1, 0, len(phones.phones) - 1)
        speaks = np.array([phone != SILENCE for phone in phones.phones])[at]
        follow, effort, efforts = 1 - math.exp(-1 / (FOLLOW_S * face.fps)), now.effort, np.zeros(len(face))
        for frame, goal in enumerate(np.where(speaks, SPEECH, 0.0)):
            effort += follow * (goal - effort)
            efforts[frame] = effort
        phases = np.random.default_rng(seed).uniform(0, 2 * np.pi, len(WAVES_HZ))
        turns = 2 * np.pi * WAVES_HZ * (now.clock_s + times)[:, None] + phases
        weights = face.values.copy()
        weights[:, self.column] = efforts + np.sin(turns) @ WAVE_SIZES
        return replace(face, values=weights), Dilation(now.clock_s + face.duration, effort)


def part_lips(face: Trajectory, turns: Sequence[float]) -> Trajectory:
    """Motion (T, K) with lips that part before `turns` (s); as it is for a face without `JAW_SHAPE`."""
    if not turns or JAW_SHAPE not in face.channels:
        return face
    weights, column, times = face.values.copy(), face.channels.index(JAW_SHAPE), face.times
    for turn in turns:
        share = np.clip((turn - CLOSES_S - times) / (PARTS_S - CLOSES_S), 0.0, 1.0)
        weights[:, column] = np.maximum(weights[:, column], PARTED * np.square(np.sin(np.pi * share)))
    return replace(face, values=weights)


class Body:
    """Hair, shoulders and pupils of a face with some channels, piece by piece of a clip."""

    def __init__(self, channels: Sequence[str], seed: int) -> None:
        self._hair = HairSwing.of_channels(channels)
        self._breathing = Breathing.of_channels(channels)
        self._pupils = Pupils.of_channels(channels)
        self._seed = seed
        self._swing: Swing | None = None  # after the last piece
        self._breath: Breath | None = None
        self._dilation: Dilation | None = None

    def move(
        self, face: Trajectory, head: Trajectory, phones: PhoneSequence, turns: Sequence[float] = ()
    ) -> Trajectory:
        """Motion (T, K) of the next piece with these, from that of the face and the head (T, 6).

        Before `turns`, seconds of the piece at which speech begins after listening, the lips part for the breath.
        """
        if not len(face):
            return face
        face = part_lips(face, turns)
        if self._hair is not None:
            face, self._swing = self._hair.apply(face, head, self._swing)
        if self._breathing is not None:
            face, self._breath = self._breathing.apply(face, phones, self._seed, self._breath)
        if self._pupils is not None:
            face, self._dilation = self._pupils.apply(face, phones, self._seed, self._dilation)
        return face
