"""Comparison of two motions of one face: how alike its lips and its channels move."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import InputError
from lexicon.sequence import SILENCE, PhoneSequence
from tts2face.lips.motion_measures import DTW_BAND_S, pearson, speech_frames, warping_cost
from tts2face.models.landmarks import lip_opening, lip_width
from tts2face.numeric.arrays import RealArray
from tts2face.session.animated_face import AnimatedFace
from tts2face.types import Trajectory

LIPS = ("opening", "width")
LEAST_SPREAD = 1e-3  # standard deviation below which a channel counts as still: a thousandth of its range
LIP_SPREAD = 1e-4  # the same for opening and width, over the distance of the eyes


@dataclass(frozen=True, slots=True, eq=False)
class MotionPart:
    """A sentence or some seconds of two motions (T, K) and (U, K) of the same channels, from their beginnings.

    ``phones`` are those of the second; with `is_same_time` frame i of both is the same instant, and T is U.
    """

    reference: RealArray
    motion: RealArray
    phones: PhoneSequence
    is_same_time: bool = True


@dataclass(frozen=True, slots=True)
class SeriesMeasure:
    """Pearson's r of two series, and the standard deviation of the second over that of the first.

    None where a series is still, and for r where the motions have different times.
    """

    name: str
    r: float | None
    ratio: float | None


@dataclass(frozen=True, slots=True)
class MotionComparison:
    """How alike two motions are.

    Parameters
    ----------
    lips
        Opening and width of the lips over the distance of the eyes, within speech.
    dtw_cost
        Mean distance of opening and width along the cheapest warp, in standard deviations of the first motion; within
        `DTW_BAND_S` if times are the same. None if the lips of the first are still.
    channels
        All channels that move in one of the motions, those that move most first.
    seconds
        Compared time of the second motion.
    """

    lips: tuple[SeriesMeasure, ...]
    dtw_cost: float | None
    channels: tuple[SeriesMeasure, ...]
    is_same_time: bool
    seconds: float


def compare_motion(parts: Sequence[MotionPart], face: AnimatedFace, channels: Sequence[str], fps: float, *,
                   n_face: int) -> MotionComparison:  # fmt: skip
    """Compare two motions part by part.

    Parameters
    ----------
    channels
        Names (K,), of which the first `n_face` are channels of the face, in its order.

    Raises
    ------
    InputError
        There is no part, or parts with the same and with different times.
    DataError
        The face lacks landmarks of the lips or eyes.
    """
    if not parts or len({part.is_same_time for part in parts}) > 1:
        raise InputError("two motions are compared at the same instants or by their sentences, at least by one")
    names = tuple(channels[:n_face])
    seen = [(_lips(face, names, part.reference, fps), _lips(face, names, part.motion, fps)) for part in parts]
    speech = [_speech(part, fps) for part in parts]
    is_same_time = parts[0].is_same_time
    pairs = [(a[here] if is_same_time else a, b[here]) for (a, b), here in zip(seen, speech, strict=True)]
    lips = (np.concatenate([a for a, _ in pairs]), np.concatenate([b for _, b in pairs]))
    whole = (np.concatenate([part.reference for part in parts]), np.concatenate([part.motion for part in parts]))
    return MotionComparison(
        tuple(_series(name, lips[0][:, k], lips[1][:, k], LIP_SPREAD, is_same_time) for k, name in enumerate(LIPS)),
        _dtw_cost(pairs, lips[0].std(axis=0), round(DTW_BAND_S * fps) if is_same_time else None),
        _moving(whole, channels, is_same_time),
        is_same_time,
        len(whole[1]) / fps,
    )


def map_channels(motion: Trajectory, channels: Sequence[str]) -> NDArray[np.float32]:
    """Values (T, K) of a motion for other channels by their names; 0 for those that it lacks.

    Raises
    ------
    InputError
        It has none of them.
    """
    common = [name for name in channels if name in motion.channels]
    if not common:
        raise InputError("the two motions have no channel in common: one is that of a talker's own face; compare faces "
                         "of one kind")  # fmt: skip
    values = np.zeros((len(motion), len(channels)), np.float32)
    for name in common:
        values[:, list(channels).index(name)] = motion.values[:, motion.channels.index(name)]
    return values


def _lips(face: AnimatedFace, names: tuple[str, ...], motion: RealArray, fps: float) -> NDArray[np.float64]:
    """(T, 2) opening and width."""
    landmarks = face.landmarks(Trajectory(names, motion[:, : len(names)].astype(np.float32), fps))
    return np.stack([lip_opening(landmarks), lip_width(landmarks)], axis=1)


def _speech(part: MotionPart, fps: float) -> slice:
    if all(label == SILENCE for label in part.phones.phones):
        return slice(0, len(part.motion))
    return speech_frames(part.phones, len(part.motion), fps)


def _series(name: str, reference: RealArray, other: RealArray, least: float, is_same_time: bool) -> SeriesMeasure:
    moves = reference.std() > least and other.std() > least
    r = pearson(reference.astype(np.float64), other.astype(np.float64)) if moves and is_same_time else None
    return SeriesMeasure(name, r, float(other.std() / reference.std()) if reference.std() > least else None)


def _moving(
    whole: tuple[RealArray, RealArray], channels: Sequence[str], is_same_time: bool
) -> tuple[SeriesMeasure, ...]:
    spread = np.maximum(*(values.std(axis=0) for values in whole))
    order = [int(k) for k in np.argsort(-spread, kind="stable") if spread[k] > LEAST_SPREAD]
    return tuple(_series(channels[k], whole[0][:, k], whole[1][:, k], LEAST_SPREAD, is_same_time) for k in order)


def _dtw_cost(pairs: Sequence[tuple[RealArray, RealArray]], spread: RealArray, band: int | None) -> float | None:
    """Mean over the frames of the second motion."""
    pairs = [(a, b) for a, b in pairs if len(a) and len(b)]
    # a channel that stands still has no deviations to count in
    if not pairs or (spread < LIP_SPREAD).any():
        return None
    costs = [warping_cost(a, b, spread, band) for a, b in pairs]
    return float(np.average(costs, weights=[len(b) for _, b in pairs]))
