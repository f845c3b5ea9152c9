"""Frames of a made live face, sent at their times to targets."""

import itertools
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from tests.running import eventually
from tts2face.interchange.exports.arkit import ARKIT_SHAPES
from tts2face.targets.live_targets import LiveTargets
from tts2face.targets.states import TargetState
from tts2face.targets.table import make_target, parse_target
from tts2face.targets.target import Target
from tts2face.targets.tick import LiveFormat, Tick
from tts2face.types import SOUND_RATE

FORMAT = LiveFormat(Fraction(30), 64, 48)
TONE_HZ = 1000
JAW = ARKIT_SHAPES.index("jawOpen")


@dataclass(frozen=True)
class Frame:
    """A frame of a live face."""

    number: int
    pixels: NDArray[np.uint8] | None
    sound: NDArray[np.float32]
    weights: NDArray[np.float32]
    head: NDArray[np.float32]


def made_tick(number: int, format: LiveFormat = FORMAT) -> Tick:
    """A tick whose grey level, tone and weights follow its number."""
    at = np.arange(format.sample(number), format.sample(number + 1))
    sound = (0.3 * np.sin(2 * np.pi * TONE_HZ * at / SOUND_RATE)).astype(np.float32)
    pixels = np.full((format.height, format.width, 3), 60 + number % 128, np.uint8) if format.width else None
    weights = np.linspace(0, 1, len(ARKIT_SHAPES), dtype=np.float32)
    weights[JAW] = number % 10 / 10
    head = np.array([0.1, 0.2, 0.3, 0, 0, 0], np.float32)
    seconds = float(number / format.fps)
    return Tick(number, seconds, pixels, sound, weights, head, weights, np.arange(6, dtype=np.float32) / 10)


class States:
    """What targets have reported."""

    def __init__(self) -> None:
        self.all: list[TargetState] = []

    def __call__(self, state: TargetState) -> None:
        self.all.append(state)

    def names(self, target: str = "") -> list[str]:
        return [one.state for one in self.all if target in one.target]

    def wait_for(self, state: str, target: str = "", seconds: float = 60.0) -> TargetState:
        def find() -> TargetState | None:
            return next((one for one in self.all if one.state == state and target in one.target), None)

        found: TargetState = eventually(find, seconds, lambda: f"{state} in {self.all}")
        return found


@contextmanager
def sending(texts: Sequence[str], format: LiveFormat = FORMAT) -> Iterator[tuple[States, LiveTargets, list[int]]]:
    """Targets that get ticks from a clock, until the block ends; the list has the numbers that were sent."""
    targets: list[Target] = [make_target(parse_target(text), format) for text in texts]
    states, sent, ended = States(), list[int](), threading.Event()

    def run(live: LiveTargets) -> None:
        began = time.monotonic()
        for number in itertools.count():
            if ended.wait(max(0.0, began + float(number / format.fps) - time.monotonic())):
                return
            live.send(made_tick(number, format))
            sent.append(number)

    with LiveTargets(targets, [target.address.shown for target in targets], states) as live:
        clock = threading.Thread(target=run, args=(live,))
        clock.start()
        try:
            yield states, live, sent
        finally:
            ended.set()
            clock.join()
