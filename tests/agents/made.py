"""A face stream with a known answer: its pictures hold their number and utterance, its sound is what was pushed."""

import asyncio
from collections.abc import AsyncIterator
from typing import Any

import numpy as np
import soxr

from lexicon.errors import InputError
from tts2face.session.live.frames import Frame
from tts2face.types import SOUND_RATE

SIZE, FPS = 64, 100.0
TICK = round(SOUND_RATE / FPS)  # samples
BAD = -0.5  # no samples below are spoken


class FakeStream:
    """Speaks at its own pace, a tick in each turn of the event loop that has slept for a tick."""

    def __init__(self, depth: int = 3, size: int = SIZE) -> None:
        self._shape = (size, size, depth)
        self._spoken: list[tuple[int, np.ndarray, bool]] = []  # utterance, samples, whether they are all
        self._n_utterances = self._open = self._number = 0
        self.is_closed = False
        self.heard: list[int] = []

    def push_sound(self, samples: np.ndarray, rate: int) -> int:
        if not self._open:
            self._n_utterances += 1
            self._open = self._n_utterances
            self._spoken.append((self._open, np.zeros(0, np.float32), False))
        samples = soxr.resample(samples, rate, SOUND_RATE) if rate != SOUND_RATE else samples
        number, before, _ = self._spoken[-1]
        self._spoken[-1] = number, np.concatenate([before, samples]).astype(np.float32), False
        return self._open

    def end_sound(self) -> None:
        if self._open:
            number, samples, _ = self._spoken[-1]
            self._spoken[-1], self._open = (number, samples, True), 0

    def push_text(self, part: str) -> int:
        """Speak a tone of a tick for each character."""
        if not self._open:
            self.push_sound(np.zeros(0, np.float32), SOUND_RATE)
        return self.push_sound(np.full(TICK * len(part), 0.25, np.float32), SOUND_RATE)

    def end_text(self) -> None:
        self.end_sound()

    def interrupt(self) -> float:
        self._spoken, self._open = [], 0
        return 0.0

    def close(self) -> None:
        self.is_closed = True

    async def __aiter__(self) -> AsyncIterator[Frame]:
        while not self.is_closed:
            yield self._next()
            await asyncio.sleep(1 / FPS)

    def _next(self) -> Frame:
        number, samples, is_whole = self._spoken[0] if self._spoken else (0, np.zeros(0, np.float32), False)
        ends = False
        if len(samples) < TICK and not is_whole:
            number, sound = 0, np.zeros(TICK, np.float32)
        else:
            sound, rest = samples[:TICK], samples[TICK:]
            if len(sound) and sound.min() < BAD:
                self._spoken[0] = number, np.zeros(0, np.float32), is_whole
                raise InputError("this cannot be spoken")
            ends = is_whole and not len(rest)
            sound = np.pad(sound, (0, TICK - len(sound)))
            self._spoken[0] = number, rest, is_whole
            if ends:
                del self._spoken[0]
        pixels = np.full(self._shape, number, np.uint8)
        pixels[0, :, 0] = self._number % 256
        self._number += 1
        drawn = None if self._number % 5 == 0 else pixels  # some come too late
        pose = np.zeros(0, np.float32)
        return Frame(self._number, drawn, sound, pose, pose, "speaking" if number else "idle", number, ends)


class FakeSession:
    """A session whose face streams are `FakeStream`."""

    def __init__(self, **options: Any) -> None:
        self._options, self.asked = options, dict[str, Any]()

    def face_stream(self, **asked: Any) -> FakeStream:
        self.asked = asked
        return FakeStream(**self._options)


def tone(seconds: float, rate: int) -> bytes:
    """16-bit samples of a tone that is nowhere silent for a tick."""
    times = np.arange(round(seconds * rate)) / rate
    return (8000 * np.sin(2 * np.pi * 220 * times) + 9000).astype("<i2").tobytes()
