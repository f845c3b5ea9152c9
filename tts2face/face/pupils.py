"""Pupils that are never quite still: slow fluctuations, and wider ones while the face speaks.

A face has them if it has the shape `PUPIL_SHAPE`, which moves no vertex: at weight 1 a pupil is `DILATION` wider.
Sources: Stark et al. 1958 (fluctuations of a tenth of the diameter, below 0.5 Hz), Kahneman and Beatty 1966 (pupils
widen with effort, within a second).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from lexicon.sequence import SILENCE, PhoneSequence
from tts2face.types import Trajectory

PUPIL_SHAPE = "pupilDilate"
DILATION = 0.25  # share of its diameter by which a pupil is wider at weight 1
WAVES_HZ, WAVE_SIZES = np.array([0.06, 0.13, 0.29]), np.array([0.22, 0.16, 0.10])
SPEECH, FOLLOW_S = 0.4, 0.9  # weight while speaking, and the time in which two thirds of it are reached


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
