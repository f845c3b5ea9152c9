"""Gaze in conversation: looks at the partner's face and away by a person's habits, and the head that follows.

The viewer is the partner, to whom a silent face listens. Habits are drawn from what 15 people did
(`tts2face.models.gaze`); what was not recorded there follows published figures, which stand beside the constants.
"""

import math
from collections.abc import Iterator, Mapping
from copy import copy, deepcopy
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tts2face.gestures.presentation import FrameContext
from tts2face.gestures.prosody import PAUSE_DB
from tts2face.models.gaze import FACE_DEG, LISTENING, SPEAKING, GazeHabit, GazeModel, LogNormal
from tts2face.models.palette import GESTURE_FPS
from tts2face.numeric.arrays import Float32Array, FloatArray, smoothstep

# Saccades last 21 ms and 2.2 ms a degree (Carpenter 1988, Movements of the Eyes; Bahill et al. 1975).
# duration of a jump: a constant, and what grows with its size
SACCADE_S, SACCADE_S_PER_DEG = 0.021, 0.0022
LEAST_JUMP_DEG = 1.5  # smaller shifts are those of microsaccades, or the noise of the recordings
LIMITS_DEG = np.array([[-18.0, 22.0], [-32.0, 32.0]])  # down and left; farther, the eyes of faces have no shapes
DIRECTION_SPREAD_DEG = 20.0  # of looks about the side, up and down
# In speech people look away as a phrase begins and back as it ends, and at the end of what they say (Kendon 1967):
# looks at the face end at the beginning of a phrase, looks away at the end of one, a little before or after their time.
NEAR_S = 0.1  # of an edge
EARLY_S, PATIENCE_S = 0.6, 0.6
LAST_S, BACK_S = 1.0, 0.4  # before the end of a sentence, in which no look away begins, and from which on none lasts
N_TRIES = 8  # for a place that differs visibly from the one before
# At the beginning of a turn people look away: seven in ten long utterances (Kendon 1967, Acta Psychologica 26; the same
# share in the rule of Cassell, Torres and Prevost 1999), and when they think, mostly up (Andrist et al. 2014, HRI).
TURN_AWAY, TURN_UP = 0.7, 0.6
TURN_END_S = 1.5  # of silence that ends a turn; pauses within one are shorter
RETURN_S = 0.3  # in which a look away ends where the state changes
SHORTEST_S = 0.1  # of a look and a fixation: what the recordings could show
# Head: beyond an eye-only range, which differs between people from nothing to 40 degrees, it has .8 of a shift (Stahl
# 1999, Experimental Brain Research 126), so on average half of what lies beyond 10 degrees; and less where the gaze is
# about to return (Oommen, Smith and Stahl 2004, Vision Research 44), as in conversation. Eyes go first.
# with a share of .75 the head's yaw spread 6.1 degrees, filmed people about 2.9 (decision 188)
HEAD_ONSET_DEG, HEAD_SHARE = 10.0, 0.4
HEAD_RATE = 7.0  # 1/s of a critically damped follower: half of the way after .24 s


@dataclass(frozen=True, slots=True)
class Fixation:
    """The eyes rest at a place, degrees down and to the person's left of the partner's face, from `time` seconds on."""

    time: float
    down_deg: float
    left_deg: float

    @property
    def place(self) -> FloatArray:
        """(2,) degrees down and left."""
        return np.array([self.down_deg, self.left_deg])

    @property
    def is_on_face(self) -> bool:
        """Whether it is on the partner's face."""
        return math.hypot(self.down_deg, self.left_deg) < FACE_DEG


@dataclass(slots=True)
class _Rest:
    """Seconds that are left of the look and of the fixation."""

    look_s: float
    fixation_s: float


class _Place(NamedTuple):
    """Place of a frame in speech.

    Whether a phrase begins or ends about it, whether the sentence is for the partner (a question, a list, a contrast),
    and seconds to its end; infinite in silence.
    """

    is_start: bool
    is_end: bool
    is_addressed: bool
    left_s: float


class GazeProcess:
    """Fixations of a person in conversation, frame by frame at `GESTURE_FPS`.

    Parameters
    ----------
    habits
        By state.
    seed
        Of everything that is drawn.
    """

    def __init__(self, habits: Mapping[str, GazeHabit], seed: list[int]) -> None:
        self._habits, self._generator = habits, np.random.default_rng(seed)
        self._state, self._quiet_s = SPEAKING, 0.0
        self._fixations = [Fixation(-1.0, 0.0, 0.0)]  # at first the viewer is looked at
        self._rest = _Rest(self._length("face"), self._length("face_fixation"))

    @classmethod
    def of_person(cls, model: GazeModel, seed: list[int]) -> "GazeProcess":
        """Process of the person whom the seed draws."""
        return cls(model.draw(np.random.default_rng([*seed, 1])), seed)

    def copy(self) -> "GazeProcess":
        """A process that continues as this one, independently of it."""
        new = copy(self)
        new._generator, new._fixations = deepcopy(self._generator), self._fixations.copy()
        new._rest = copy(self._rest)
        return new

    def extend(self, frames: FrameContext) -> None:
        """Draw fixations for the next frames, each 1 / `GESTURE_FPS` long."""
        quiet = frames.intensity < PAUSE_DB
        for time, is_quiet, listens, place in zip(
            frames.times.tolist(), quiet.tolist(), frames.is_listening.tolist(), _places(frames), strict=True
        ):
            self._quiet_s = self._quiet_s + 1.0 / GESTURE_FPS if is_quiet and not listens else 0.0
            state = LISTENING if listens or self._quiet_s > TURN_END_S else SPEAKING
            if state != self._state:
                self._change(state, time)
            self._rest.look_s -= 1.0 / GESTURE_FPS
            self._rest.fixation_s -= 1.0 / GESTURE_FPS
            if self._is_over(place):
                self._look(time, is_away=self._fixations[-1].is_on_face)
            elif self._rest.fixation_s <= 0.0:
                self._shift(time)

    def _is_over(self, place: "_Place") -> bool:
        """Whether the look ends at a place in speech."""
        left = self._rest.look_s
        if place.left_s == math.inf or self._state == LISTENING:
            # between sentences and behind the last one, a speaker who looks at the partner goes on
            is_kept = self._state == SPEAKING and self._quiet_s > 0.0 and self._fixations[-1].is_on_face
            return left <= 0.0 and not is_kept
        if self._fixations[-1].is_on_face:
            return place.is_start and left <= EARLY_S and place.left_s > LAST_S and not place.is_addressed
        return (
            place.is_addressed or place.left_s < BACK_S or left <= -PATIENCE_S or (place.is_end and left <= EARLY_S / 2)
        )

    def at(self, times: FloatArray) -> Float32Array:
        """Gaze (T, 2) in radians down and left at increasing times (T,); earlier fixations are forgotten."""
        places, starts = (
            np.array([fixation.place for fixation in self._fixations]),
            np.array([fixation.time for fixation in self._fixations]),
        )
        jumps = np.diff(places, axis=0, prepend=places[:1])
        lasts = np.minimum(SACCADE_S + SACCADE_S_PER_DEG * np.linalg.norm(jumps, axis=1), SHORTEST_S)
        now = np.maximum(np.searchsorted(starts, times, side="right") - 1, 0)
        share = smoothstep((times - starts[now]) / lasts[now])
        self._fixations = self._fixations[max(0, *now[-1:] - 1) :]  # the last may still be approached
        return np.radians(places[now] + (share - 1.0)[:, None] * jumps[now]).astype(np.float32)

    @property
    def fixations(self) -> tuple[Fixation, ...]:
        """Those that are not yet forgotten."""
        return tuple(self._fixations)

    @property
    def _habit(self) -> GazeHabit:
        return self._habits[self._state]

    def _length(self, name: str) -> float:
        """Seconds of a look or a fixation."""
        lengths: LogNormal = getattr(self._habit, name)
        return max(lengths.draw(self._generator), SHORTEST_S)

    def _change(self, state: str, time: float) -> None:
        """Go on in another state: a turn begins with a look away or goes on, and a listener looks at the partner."""
        self._state = state
        if not self._fixations[-1].is_on_face:
            # who looks away when the state changes comes back soon
            self._rest.look_s = min(self._rest.look_s, RETURN_S)
        elif state == SPEAKING and self._generator.random() < TURN_AWAY:
            self._look(time, is_away=True, up=TURN_UP)
        else:
            self._rest.look_s = self._length("face")

    def _look(self, time: float, *, is_away: bool, up: float | None = None) -> None:
        """Begin a look; `up` is the chance of one upwards, if it is not the person's."""
        name = "away" if is_away else "face"
        self._rest = _Rest(self._length(name), self._length(f"{name}_fixation"))
        self._fixate(time, self._place_away(up) if is_away else self._spot())

    def _shift(self, time: float) -> None:
        """Move within a look."""
        now = self._fixations[-1]
        self._rest.fixation_s = self._length("face_fixation" if now.is_on_face else "away_fixation")
        for _ in range(N_TRIES):
            place = self._spot() if now.is_on_face else self._roamed(now.place)
            if np.linalg.norm(place - now.place) >= LEAST_JUMP_DEG:
                self._fixate(time, place)
                return

    def _fixate(self, time: float, place: FloatArray) -> None:
        self._fixations.append(Fixation(time, float(place[0]), float(place[1])))

    def _spot(self) -> FloatArray:
        """A place on the partner's face."""
        place: FloatArray = self._generator.normal(size=2) * self._habit.spot_deg
        return place * min(1.0, 0.9 * FACE_DEG / max(float(np.linalg.norm(place)), 1e-9))

    def _place_away(self, up: float | None) -> FloatArray:
        """Where a look away lands."""
        habit, (way, side, turn) = self._habit, self._generator.random(3)
        to_side, upward = (habit.directions[0], habit.directions[1]) if up is None else (1.0 - up, up)
        if way < to_side:
            angle = 0.0 if side < habit.left else math.pi
        else:
            angle = -math.pi / 2 if way < to_side + upward else math.pi / 2
        angle += math.radians(DIRECTION_SPREAD_DEG) * (2.0 * turn - 1.0)
        far = FACE_DEG + habit.beyond.draw(self._generator)
        return self._limited(far * np.array([math.sin(angle), math.cos(angle)]))

    def _roamed(self, place: FloatArray) -> FloatArray:
        """Another place away from the face."""
        angle = 2.0 * math.pi * self._generator.random()
        jump = max(self._habit.roam.draw(self._generator), LEAST_JUMP_DEG)
        moved = self._limited(place + jump * np.array([math.sin(angle), math.cos(angle)]))
        return moved if np.linalg.norm(moved) > FACE_DEG else place

    def _limited(self, place: FloatArray) -> FloatArray:
        limited: FloatArray = np.clip(place, *LIMITS_DEG.T)
        return limited


@dataclass(slots=True)
class HeadFollower:
    """Head that follows the eyes to places far from the middle, after them."""

    _angle: FloatArray = field(default_factory=lambda: np.zeros(2))
    _rate: FloatArray = field(default_factory=lambda: np.zeros(2))

    def copy(self) -> "HeadFollower":
        """A follower that continues as this one, independently of it."""
        return HeadFollower(self._angle.copy(), self._rate.copy())

    def next(self, gaze: NDArray[np.floating], fps: float) -> FloatArray:
        """Radians (T, 2) down and left by which the head turns, for the next frames of a gaze (T, 2) in the scene."""
        far = np.linalg.norm(gaze, axis=1)
        beyond = HEAD_SHARE * np.maximum(far - math.radians(HEAD_ONSET_DEG), 0.0)
        goals = np.asarray(gaze, np.float64) * (beyond / np.maximum(far, 1e-9))[:, None]
        step = 1.0 / fps
        decay, turned = math.exp(-HEAD_RATE * step), np.zeros(goals.shape)
        for at, goal in enumerate(goals):  # exact for a goal that holds for the frame
            turned[at] = self._angle
            gap = self._angle - goal
            push = self._rate + HEAD_RATE * gap
            self._angle = goal + (gap + push * step) * decay
            self._rate = (self._rate - HEAD_RATE * push * step) * decay
        return turned


# Micro-saccades: eyes that rest on a place jump a little about it, and drift back (Martinez-Conde et al. 2004: one to
# two a second, below a degree, more along than across the horizon).
CELL_S, JUMP_SHARE = 0.75, 0.85  # at most one jump a cell, in a share of them: 1.1 a second
MARGIN = 0.1  # of a cell, between jumps of neighbours
SPREAD_RAD = np.radians([0.12, 0.28])  # of places in pitch and yaw
DRIFT_S = 0.8  # in which two thirds of a jump are taken back


def microsaccades(times: FloatArray, seed: int) -> FloatArray:
    """Offset (T, 2) of pitch and yaw in radians at times (T,) of the whole clip, whatever its pieces."""
    cells = np.floor(times / CELL_S).astype(np.int64)
    found = np.zeros((len(times), 2))
    for cell in range(int(cells.min(initial=0)) - 1, int(cells.max(initial=-1)) + 1):
        if cell < 0:
            continue
        draws = np.random.default_rng((seed, cell))
        jumps, start = draws.uniform() < JUMP_SHARE, CELL_S * (cell + draws.uniform(MARGIN, 1 - MARGIN))
        place = draws.normal(size=2) * SPREAD_RAD
        if jumps:
            later = times >= start
            found[later] = place * np.exp(-(times[later, None] - start) / DRIFT_S)
    return found


def _places(frames: FrameContext) -> Iterator[_Place]:
    """The place in speech of each frame."""
    times, left = frames.times, np.full(len(frames.times), np.inf)
    at_start, at_end, addressed = np.zeros((3, len(times)), bool)
    for sentence in frames.plan.sentences:
        inside = (times >= sentence.span.start - NEAR_S) & (times < sentence.span.end)
        left[inside] = sentence.span.end - times[inside]
        addressed |= inside & bool(sentence.question is not None or sentence.items or sentence.sides)
        for phrase in sentence.phrases:
            at_start |= np.abs(times - phrase.start) < NEAR_S
            at_end |= np.abs(times - phrase.end) < NEAR_S
    return map(_Place, at_start.tolist(), at_end.tolist(), addressed.tolist(), left.tolist())
