"""A voice with a known answer: 0.1 s for every letter, a silence of 0.2 s before and of 0.3 s after the words."""

import re
from collections.abc import Sequence

import numpy as np

from lexicon.sequence import SILENCE, PhoneSequence, WordSpan
from tts2face.types import Speech, Waveform

RATE = 8000  # Hz: the lowest at which loudness is measured
LEAD, TRAIL, LETTER, LEVEL = 0.2, 0.3, 0.1, 0.25


class FakeVoice:
    """Splits words at hyphens if ``splits`` is set, as some voices do."""

    def __init__(self, splits: bool = False, rate: int = RATE) -> None:
        self.said: list[tuple[str, float]] = []
        self._splits, self._rate = splits, rate

    @property
    def sample_rate(self) -> int:
        return self._rate

    def sound(self, spoken: str | Sequence, *, rate: float = 1.0, seed: int = 0) -> Waveform:
        return self.speak(spoken, rate=rate, seed=seed).waveform

    def speak(self, spoken: str | Sequence, *, rate: float = 1.0, seed: int = 0) -> Speech:
        self.said.append((str(spoken), rate))
        words = re.findall(r"\w+" if self._splits else r"[\w'-]+", str(spoken))
        n = sum(map(len, words))
        edges = np.concatenate([[0.0], LEAD + np.arange(n + 1) * LETTER / rate, [0.0]])
        edges[-1] = edges[-2] + TRAIL
        samples = np.zeros(round(edges[-1] * self._rate), np.float32)
        samples[round(edges[1] * self._rate) : round(edges[-2] * self._rate)] = LEVEL
        edges[-1] = len(samples) / self._rate
        firsts = 1 + np.concatenate([[0], np.cumsum([len(word) for word in words])])
        spans = tuple(WordSpan(word, int(firsts[k]), int(firsts[k + 1])) for k, word in enumerate(words))
        return Speech(Waveform(samples, self._rate), PhoneSequence([SILENCE, *["a"] * n, SILENCE], edges), spans)
