"""Movements of named gestures: what each adds to the channels of a face over time.

``movements.tsv`` has a row for each channel of a gesture: keys ``seconds:value``, between which it moves with the least
jerk (Flash and Hogan 1985, J. Neuroscience 5); a gesture that is held has `` ; `` where it is, and its ``seconds`` make
the hold longer or shorter. ``hz`` and ``depth`` are those of bursts: shares by which the value falls between them.
Units: degrees of the head, mm of brows and of the gap of the lips, closure of lids, weights of expressions and of
squints of the cheeks, share of a breath, and shares of the gesture's direction that eyes and head take.
"""

import functools
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from importlib.resources import files
from itertools import pairwise
from types import MappingProxyType

import numpy as np
from numpy.typing import ArrayLike

from lexicon.gesture_names import DIRECTIONS
from tts2face.gestures.elements import Gesture
from tts2face.numeric.arrays import FloatArray

# Degrees a second of the head: quick turns of 20 degrees reach 100 to 150 (Zangemeister and Stark 1982); a movement
# that would be faster, as of a large or short gesture, takes longer.
MAX_HEAD_SPEED = 126.0  # that of a nod of size 2
SHORTENED = 0.7  # share of the shortest hold of a gesture that is left out at most, before its movements are faster
LEAST_PACE = 0.6  # share of its usual time in which a movement is done at least: a wink closes in .06 s
MINIMUM_JERK_PEAK = 1.875  # of the velocity, relative to the mean one
# Degrees down, and to the own left, of gestures with a direction that state none: up and aside are looks of thinking
# (Kendon 1967; Andrist et al. 2014); winks, tilts and looks away go to one side, so that a text shows what it says.
USUAL_DIRECTIONS: Mapping[str, tuple[float, float]] = MappingProxyType({
    "look_at": (0.0, 0.0), "listen": (0.0, 0.0), "look_away": (4.0, 15.0), "think": (-12.0, 14.0),
    "wink": DIRECTIONS["left"], "tilt": DIRECTIONS["left"],
})  # fmt: skip


@dataclass(frozen=True, slots=True)
class Movement:
    """Movement of one channel: keys (K, 2) before and behind the hold, in seconds and units of the channel."""

    channel: str
    before: FloatArray
    behind: FloatArray
    hz: float = 0.0
    depth: float = 0.0

    @property
    def hold(self) -> float:
        """Seconds of the hold; 0 where nothing is held."""
        return float(self.behind[0, 0] - self.before[-1, 0]) if len(self.behind) else 0.0

    @property
    def duration(self) -> float:
        """Seconds from the beginning to rest."""
        return float((self.behind if len(self.behind) else self.before)[-1, 0])

    def keys(self, longer: float, slower: float) -> FloatArray:
        """Keys with a hold that is `longer` by so many seconds, `slower` by a factor."""
        behind = self.behind + np.array([longer, 0.0])
        return np.asarray(np.vstack([self.before, behind]) * (slower, 1.0), np.float64)

    def values(self, times: FloatArray, keys: FloatArray) -> FloatArray:
        """(T,) values at seconds of the gesture."""
        found = minimum_jerk(times, keys)
        if not self.hz:
            return found
        bursts = 0.5 - 0.5 * np.cos(2.0 * np.pi * self.hz * np.maximum(times, 0.0))
        return np.asarray(found * (1.0 - self.depth + self.depth * bursts), np.float64)


@functools.cache
def movement_table() -> Mapping[str, tuple[Movement, ...]]:
    """Movements of each gesture."""
    lines = files("tts2face.gestures").joinpath("movements.tsv").read_text(encoding="utf-8").splitlines()[1:]
    found = dict[str, list[Movement]]()
    for gesture, channel, keys, hz, depth, _ in (line.split("\t") for line in lines):
        parts = [
            np.array([[float(number) for number in key.split(":")] for key in part.split()]) for part in keys.split(";")
        ]
        behind = parts[1] if len(parts) > 1 else np.zeros((0, 2))
        found.setdefault(gesture, []).append(Movement(channel, parts[0], behind, float(hz or 0.0), float(depth or 0.0)))
    return MappingProxyType({name: tuple(rows) for name, rows in found.items()})


def minimum_jerk(times: ArrayLike, keys: FloatArray) -> FloatArray:
    """(T,) values through keys (K, 2) of seconds and values, at rest at each; constant outside."""
    seconds = np.asarray(times, np.float64)
    at, values = keys.T
    behind = np.clip(np.searchsorted(at, seconds, side="right"), 1, len(at) - 1)
    before = behind - 1
    share = np.clip((seconds - at[before]) / np.maximum(at[behind] - at[before], 1e-9), 0.0, 1.0)
    eased = share**3 * (10.0 - 15.0 * share + 6.0 * share**2)
    return np.asarray(values[before] + (values[behind] - values[before]) * eased, np.float64)


@dataclass(frozen=True, slots=True)
class TimedGesture:
    """A gesture with the times of its movements: keys (K, 2) of each, in seconds from its beginning."""

    gesture: Gesture
    movements: tuple[tuple[Movement, FloatArray], ...]

    @classmethod
    def of(cls, gesture: Gesture) -> "TimedGesture":
        """The gesture as long as it says, but no faster than a face and a head move."""
        rows = movement_table()[gesture.name]
        usual = max(row.duration for row in rows)
        asked, hold = gesture.seconds or usual, min((row.hold for row in rows if row.hold), default=0.0)
        longer = max(asked - usual, -SHORTENED * hold) if hold else 0.0
        slower = max(min(asked / (usual + longer), 1.0) if hold else asked / usual, LEAST_PACE)
        turning = [row for row in rows if row.channel in {"head_pitch", "head_yaw", "head_roll"}]
        fastest = max((gesture.size * _speed(row.keys(longer, slower)) for row in turning), default=0.0)
        slower *= max(fastest / MAX_HEAD_SPEED, 1.0)
        return cls(gesture, tuple((row, row.keys(longer, slower)) for row in rows))

    @property
    def direction(self) -> tuple[float, float]:
        """Degrees down and to the own left; its left or right is its side."""
        usual = USUAL_DIRECTIONS.get(self.gesture.name, (0.0, 1.0))
        down, left = self.gesture.down_deg, self.gesture.left_deg
        if down is None and left is None:
            return usual
        return (down or 0.0, left or 0.0)

    @property
    def side(self) -> float:
        """1 to the own left, -1 to the own right."""
        return -1.0 if self.direction[1] < 0.0 else 1.0

    @property
    def duration(self) -> float:
        """Seconds from its beginning to rest."""
        return max(float(keys[-1, 0]) for _, keys in self.movements)

    def share(self, channel: str, times: FloatArray) -> FloatArray | None:
        """(T,) values of a channel at seconds of the clip, without size and side; None for one that does not move."""
        found = [row.values(times - self.gesture.time, keys) for row, keys in self.movements if row.channel == channel]
        return found[0] if found else None


def gesture_end(gesture: Gesture) -> float:
    """Second of the clip at which a gesture is at rest again."""
    return gesture.time + TimedGesture.of(gesture).duration


def _speed(keys: FloatArray) -> float:
    """Largest speed between keys, units a second."""
    return max(
        (MINIMUM_JERK_PEAK * abs(to - value) / max(end - start, 1e-3) for (start, value), (end, to) in pairwise(keys)),
        default=0.0,
    )


def timed(gestures: Iterable[Gesture], times: FloatArray) -> list[TimedGesture]:
    """The gestures that move a face at some of T times."""
    if not len(times):
        return []
    begun = [TimedGesture.of(gesture) for gesture in gestures if gesture.time <= times[-1]]
    return [moving for moving in begun if moving.gesture.time + moving.duration > times[0]]


def channel_values(gestures: Sequence[TimedGesture], channel: str, times: FloatArray, side: float = 0.0) -> FloatArray:
    """(T,) what gestures add to a channel at T times: of overlapping ones the larger applies, in either direction.

    Parameters
    ----------
    side
        1 and -1 for the own left and right eye, of which only gestures of that side move it.
    """
    high, low = np.zeros(len(times)), np.zeros(len(times))
    for moving in gestures:
        moved = moving.share(channel, times)
        if moved is None or (side and moving.side != side):
            continue
        # roll is positive to the own right (`tts2face.video.pose.head_angles`)
        signed = moving.gesture.size * moved * (-moving.side if channel == "head_roll" else 1.0)
        # overlapping gestures are not added: a sum of nods would be a bow
        high, low = np.maximum(high, signed), np.minimum(low, signed)
    return high + low


def pair_values(gestures: Sequence[TimedGesture], channel: str, times: FloatArray) -> FloatArray:
    """(T, 2) values of the left and the right side of a channel with an ``s`` for both and without for one."""
    both = channel_values(gestures, f"{channel}s", times)
    return np.stack([np.maximum(both, channel_values(gestures, channel, times, side)) for side in (1.0, -1.0)], axis=1)


def turned_gaze(gestures: Sequence[TimedGesture], times: FloatArray, gaze: FloatArray) -> FloatArray:
    """(T, 2) gaze in radians down and left of the scene, moved to the directions of gestures."""
    moved = np.array(gaze, np.float64)
    for moving in gestures:
        share = moving.share("gaze", times)
        if share is not None:
            moved += share[:, None] * (np.radians(moving.direction) * moving.gesture.size - moved)
    return moved


def head_turn(gestures: Sequence[TimedGesture], times: FloatArray) -> FloatArray:
    """(T, 3) radians of pitch, yaw and roll that gestures add to the head."""
    found = np.stack([channel_values(gestures, f"head_{name}", times) for name in ("pitch", "yaw", "roll")], axis=1)
    for moving in gestures:
        share = moving.share("head_share", times)
        if share is not None:
            found[:, :2] += share[:, None] * np.array(moving.direction) * moving.gesture.size
    return np.asarray(np.radians(found), np.float64)
