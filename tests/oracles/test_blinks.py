"""Blinks of recorded lids, found with arrays, against a loop over recordings and frames."""

from collections.abc import Iterator
from itertools import pairwise
from types import SimpleNamespace
from typing import Any

import numpy as np

from tts2face.gestures.blinks import (
    FULL,
    HALF_OPEN,
    MAX_EDGE,
    N_TAPER_FRAMES,
    OPEN,
    PROFILE_LIMITS_S,
    SHUT,
    blink_profiles,
    lids_without_blinks,
)
from tts2face.models.palette import GESTURE_FPS


def recorded_style(seed: int) -> Any:
    """Lids of up to 30 recordings, some of a few frames: noise, and blinks of various depths and lengths."""
    generator = np.random.default_rng(seed)
    lengths = generator.integers(1, 90, generator.integers(1, 30)).astype(np.int32)
    lids = generator.uniform(0.0, 0.3, (int(lengths.sum()), 2))
    for at in range(0, len(lids), 17):
        part = lids[at : at + int(generator.integers(1, 12))]
        part[:] = np.maximum(part, generator.uniform(0.4, 1.0) * np.hanning(len(part) + 2)[1:-1, None])
    return SimpleNamespace(motion={"blink": np.round(lids, seed % 3 + 1).astype(np.float32)}, lengths=lengths)


def recordings(style: Any) -> Iterator[np.ndarray]:
    for first, end in pairwise([0, *np.cumsum(style.lengths).tolist()]):
        yield style.motion["blink"][first:end].astype(np.float64)


def find_slowly(lids: np.ndarray) -> Iterator[tuple[int, int]]:
    for begin in range(1, len(lids)):
        if lids[begin - 1] > OPEN or lids[begin] <= OPEN:
            continue
        end = next((at for at in range(begin, len(lids)) if lids[at] <= OPEN), None)
        if end is None or lids[begin:end].max() <= SHUT:
            continue
        first, last = begin - 1, end
        while first > max(0, begin - MAX_EDGE) and lids[first - 1] < lids[first]:
            first -= 1
        while last < min(len(lids) - 1, end + MAX_EDGE) and lids[last + 1] < lids[last]:
            last += 1
        yield first, last + 1


def profiles_slowly(style: Any) -> list[np.ndarray]:
    taper = np.linspace(0.0, 1.0, N_TAPER_FRAMES + 1)[:-1, None]
    found = []
    for part in recordings(style):
        is_open = part.mean(axis=1) < OPEN
        rest = np.median(part[is_open], axis=0) if is_open.any() else np.zeros(2)
        for first, end in find_slowly(part.mean(axis=1)):
            blink = np.clip((part[first:end] - rest) / (1.0 - rest), 0.0, 1.0)
            profile = np.concatenate([taper * blink[0], blink, taper[::-1] * blink[-1]])
            closure = profile.mean(axis=1)
            n_closings = (np.diff((closure > SHUT).astype(int)) > 0).sum()
            seconds = (closure > OPEN).sum() / GESTURE_FPS
            if n_closings == 1 and closure.max() >= FULL and PROFILE_LIMITS_S[0] <= seconds <= PROFILE_LIMITS_S[1]:
                found.append(profile)
    return found


def opened_slowly(style: Any) -> np.ndarray:
    opened = []
    for part in recordings(style):
        lids = part.copy()
        for first, end in find_slowly(part.mean(axis=1)):
            lids[first:end] = np.linspace(part[first], part[end - 1], end - first)
        opened.append(np.minimum(lids, HALF_OPEN))
    return np.concatenate(opened).astype(np.float32)


def test_blinks_are_those_that_a_loop_finds() -> None:
    n_profiles = 0
    for seed in range(20):
        style = recorded_style(seed)
        found, wanted = blink_profiles(style), profiles_slowly(style)
        n_profiles += len(wanted)
        assert [one.tobytes() for one in found] == [one.tobytes() for one in wanted], seed
        assert lids_without_blinks(style).tobytes() == opened_slowly(style).tobytes(), seed
    assert n_profiles > 30
