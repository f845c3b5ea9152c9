"""Artificial utterances in which every phone has one mouth opening, and a voice with other durations."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from corpus_tools.recordings.observation import Observation, Quality
from lexicon.normalize import normalize
from lexicon.sequence import SILENCE, PhoneSequence, WordSpan
from tts2face.types import Speech, Waveform

OPENINGS = {"p": 0.0, "b": 0.0, "m": 0.0, "s": 4.0, "t": 5.0, "i": 7.0, "ɑ": 15.0, SILENCE: 0.0}
FPS = 25.0


def observation(number: int, gain: float = 1.0, name: str = "u") -> Observation:
    """An utterance of eight phones; `gain` is a factor of the mouth opening."""
    stream = np.random.default_rng(number)
    names = [label for label in OPENINGS if label != SILENCE]
    labels = [SILENCE, *(names[at] for at in stream.integers(0, len(names), 8)), SILENCE]
    edges = np.concatenate([[0.0], np.cumsum([0.5, *stream.uniform(0.1, 0.2, 8), 0.5])])
    phones = PhoneSequence(labels, edges)
    times = np.arange(int(edges[-1] * FPS)) / FPS
    opening = np.interp(times, (edges[:-1] + edges[1:]) / 2, [gain * OPENINGS[label] for label in labels])
    points = np.tile(np.random.default_rng(0).normal(0, 30, (478, 3)), (len(times), 1, 1))
    points += stream.normal(0, 0.01, points.shape)
    points[:, 13] = (0.0, -40.0, 0.0)
    points[:, 14] = np.stack([np.zeros_like(times), -40.0 - opening, np.zeros_like(times)], axis=1)
    points[:, 291, 0] = 25.0 - 0.3 * opening
    points[:, [33, 263]] = ((-45.0, 0.0, 0.0), (45.0, 0.0, 0.0))
    head = np.zeros((len(times), 6), np.float32)
    quality = Quality(0.0, 1.0, 0, 0.0)
    return Observation(
        f"{name}{number:02d}", FPS, points.astype(np.float32), head, phones, (), head[:, 0], quality, Path("u.mkv")
    )


def with_words(seen: Observation) -> Observation:
    """The utterance with a word for every two phones; its first word occurs in no other utterance."""
    first = "".join("abcdefghij"[int(digit)] for digit in seen.name if digit.isdigit())
    texts = (f"{first}um", "alpha", "beta", "gamma")
    return replace(seen, words=tuple(WordSpan(text, 1 + 2 * at, 3 + 2 * at) for at, text in enumerate(texts)))


def track_arrays(one: Observation) -> dict[str, Any]:
    """Arrays of a file of tracks that holds the utterance."""
    labels = ["sil" if label == SILENCE else label for label in one.phones.phones]
    arrays = {"landmarks": one.landmarks, "head": one.head, "fps": one.fps, "phones": labels, "edges": one.phones.edges}
    if one.words:
        arrays["words"] = [word.text for word in one.words]
        arrays["word_first"] = [word.first for word in one.words]
        arrays["word_last"] = [word.last for word in one.words]
    return arrays


class OwnVoice:
    """Speech of an observation, the duration of each phone changed by `stretch` (seconds, by number of the phone)."""

    sample_rate = 1000

    def __init__(self, observations: Sequence[Observation], stretch: Callable[[np.ndarray], np.ndarray]) -> None:
        self._known = {normalize(" ".join(word.text for word in one.words)): one for one in observations}
        self._stretch = stretch

    def speak(self, spoken: str, *, rate: float = 1.0, seed: int = 0) -> Speech:
        one = self._known[spoken]
        edges = np.concatenate([[0.0], np.cumsum(self._stretch(one.phones.durations))])
        edges[-1] = np.ceil(edges[-1] * self.sample_rate) / self.sample_rate
        samples = np.zeros(round(edges[-1] * self.sample_rate))
        return Speech(Waveform(samples, self.sample_rate), PhoneSequence(one.phones.phones, edges), one.words)
