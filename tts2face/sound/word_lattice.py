"""Segments of which the sound of known words may consist, with all pronunciations and the pauses between words."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from lexicon.phones import nearest_phones
from lexicon.sequence import SILENCE
from tts2face.models.phone_classifier import PhoneClassifier
from tts2face.numeric.arrays import FloatArray
from tts2face.sound.pauses import Span
from tts2face.sound.recogniser import FRAME_S
from tts2face.sound.segments import STEP_S, Segments

# Chosen on a voice that the classifier has not heard, in noise; docs/decisions/193-alignment.md
SPIKE_WEIGHT = 2.0
SPIKE_SPREAD_S = 0.02
STRAY_SPIKE = 0.05
TAIL = 0.02  # of a spike, on either side: joints of segments lie between the tails, and a reach around them
REACH_S = 0.3
PAUSE, LEADING_PAUSE = -2.0, -0.5  # log probabilities of a silence between words, and at the ends
SHORTEST, SHORTEST_PAUSE = 4, 6  # frames
LEAST_SPIKE, LEAST_SHARE = 1e-4, 1e-3  # of probabilities
LONGEST_S = 0.45
LEAST_DURATION = -6.0  # log probability of any duration up to the longest
Pronunciations = Sequence[tuple[str, ...]]  # alternatives of one word, in phones of the table
PronouncedWords = Sequence[tuple[str, Pronunciations]]


@dataclass(frozen=True, slots=True, eq=False)
class PlacedPhone:
    """A phone of a pronunciation.

    Its word, its column of the classifier, probabilities (T,) that its middle lies at times (T,), and, at the first
    phone, the log probability of the pronunciation.
    """

    word: int
    label: str
    column: int
    spike: NDArray[np.floating]
    times: NDArray[np.floating]
    share: float

    @property
    def tails(self) -> tuple[float, float]:
        """Seconds between which the middle of the phone lies."""
        first, last = np.searchsorted(np.cumsum(self.spike), (TAIL, 1.0 - TAIL))
        return float(self.times[first]), float(self.times[min(int(last), len(self.times) - 1)])

    def passed(self, times: FloatArray) -> FloatArray:
        """Probability that the middle lies before given times."""
        from scipy.special import ndtr

        heavy = np.flatnonzero(self.spike > LEAST_SPIKE)
        share: FloatArray = self.spike[heavy] @ ndtr((times - self.times[heavy, None]) / SPIKE_SPREAD_S)
        return np.minimum(share, 1.0)


def place_phones(
    classifier: PhoneClassifier, words: Sequence[Pronunciations], spikes: FloatArray
) -> list[list[list[PlacedPhone]]]:
    """Phones of the pronunciations of words, with their spikes."""
    known = sounding(classifier)
    moments = np.arange(0.5, len(spikes)) * FRAME_S
    found: list[list[list[PlacedPhone]]] = []
    at = 0
    for word, alternatives in enumerate(words):
        found.append([])
        for phones in alternatives:
            found[-1].append([])
            for place, label in enumerate(phones):
                column = classifier.inventory.index(nearest_phones(label, known)[0])
                total = float(spikes[:, at].sum())
                spike = spikes[:, at] / total if total > 0.0 else np.full(len(spikes), 1.0 / len(spikes))
                share = 0.0 if place else float(np.log(max(total, LEAST_SHARE)))
                found[-1][-1].append(
                    PlacedPhone(word, label, column, spike, moments - float(classifier.delays[column]), share)
                )
                at += 1
    return found


def word_segments(
    classifier: PhoneClassifier,
    words: Sequence[Sequence[Sequence[PlacedPhone]]],
    n_frames: int,
    times: Sequence[Span] | None,
) -> tuple[Segments, list[PlacedPhone | None]]:
    """Segments of which the sound of words may consist, and their phones, None for silences.

    Joints are the start of the sound, the start of each word, those between its phones, its end, and the end.
    """
    end = n_frames * STEP_S
    bounds, joints = [(0.0, 0.0)], list[tuple[int, int]]()
    phones: list[PlacedPhone | None] = []
    firsts = [_range([spoken[0].tails for spoken in word]) for word in words] + [(end, end)]
    lasts = [(0.0, 0.0)] + [_range([spoken[-1].tails for spoken in word]) for word in words]
    for word, alternatives in enumerate(words):
        reached = len(bounds) - 1
        known = times[word] if times else None
        start = (lasts[word][0] - REACH_S, firsts[word][1] + REACH_S) if known is None else (known[0], known[0])
        bounds.append(start)
        first = len(bounds) - 1
        joints.append((reached, first))
        phones.append(None)
        inner = []
        for alternative in alternatives:
            inner.append([first])
            for phone, other in pairwise(alternative):
                bounds.append((phone.tails[0] - REACH_S, other.tails[1] + REACH_S))
                inner[-1].append(len(bounds) - 1)
        bounds.append(
            (lasts[word + 1][0] - REACH_S, firsts[word + 1][1] + REACH_S) if known is None else (known[1], known[1])
        )
        for alternative, places in zip(alternatives, inner, strict=True):
            joints += pairwise([*places, len(bounds) - 1])
            phones += alternative
    joints.append((len(bounds) - 1, len(bounds)))
    phones.append(None)
    frames = np.clip(np.round(np.array([*bounds, (end, end)]) / STEP_S).astype(np.int64), 0, n_frames)
    frames[:, 1] = np.maximum(frames[:, 0], frames[:, 1])
    return _weighted(classifier, phones, np.array(joints), frames), phones


def _weighted(
    classifier: PhoneClassifier,
    phones: Sequence[PlacedPhone | None],
    joints: NDArray[np.int64],
    bounds: NDArray[np.int64],
) -> Segments:
    """Segments with their log probabilities."""
    seconds = np.maximum(np.arange(round(LONGEST_S / STEP_S) + 1), 1) * STEP_S
    apart = (np.log(seconds) - classifier.durations[:, :1]) / classifier.durations[:, 1:]
    durations = np.maximum(-0.5 * np.square(apart), LEAST_DURATION)
    silence = classifier.inventory.index(SILENCE)
    columns = np.array([silence if phone is None else phone.column for phone in phones])
    likely = durations[columns]
    offsets = np.arange((bounds[:, 1] - bounds[:, 0]).max() + 1)
    starts, ends = np.zeros((2, len(phones), len(offsets)))
    taken = np.full(len(phones), PAUSE)
    taken[[0, -1]] = LEADING_PAUSE
    for at, phone in enumerate(phones):
        # a positive value marks a segment of any duration (`segments._search`)
        likely[at, 0] = 1.0 if phone is None else LEAST_DURATION
        if phone is None:
            continue
        taken[at] = phone.share
        edges = (bounds[joints[at], :1] + offsets - 0.5) * STEP_S
        starts[at] = SPIKE_WEIGHT * np.log(1.0 - phone.passed(edges[0]) + STRAY_SPIKE)
        ends[at] = SPIKE_WEIGHT * np.log(phone.passed(edges[1]) + STRAY_SPIKE)
    is_silence = columns == silence
    return Segments(
        labels=columns,
        joints=joints,
        shortest=np.where(is_silence, SHORTEST_PAUSE, SHORTEST),
        passed=np.where(is_silence, 0.0, -np.inf),
        taken=taken,
        durations=likely,
        bounds=bounds,
        starts=starts,
        ends=ends,
    )


def _range(tails: Sequence[tuple[float, float]]) -> tuple[float, float]:
    return min(low for low, _ in tails), max(high for _, high in tails)


def sounding(classifier: PhoneClassifier) -> tuple[str, ...]:
    """Phones of a classifier but silence."""
    return tuple(label for label in classifier.inventory if label != SILENCE)
