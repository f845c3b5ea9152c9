"""Edges of the phones in the sound of a voice that says how long each of them is.

What a voice's network states is exact to a step of it, 25 ms, and its pauses are where punctuation is. The edges are
those of the segments that fit the sound best: a `PhoneClassifier` gives the probability of each phone in frames of
5 ms, and a search over all divisions of the sound adds to them how well each segment keeps the stated duration and
start (segmental Viterbi search, after Ostendorf et al. 1996).
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from lexicon.phones import nearest_phones
from lexicon.sequence import SILENCE, enforce_increasing
from tts2face.models.phone_classifier import PhoneClassifier
from tts2face.numeric.arrays import FloatArray, IntArray, ordered_product
from tts2face.numeric.kernels import kernel
from tts2face.sound.features import mel_bands
from tts2face.sound.pauses import is_near_sound, is_near_speech
from tts2face.types import Waveform

RATE = 16_000  # Hz
STEP = 80  # samples between frames
WINDOW = 320  # samples of a frame
TRANSFORM = 512  # samples of its spectrum
STEP_S = STEP / RATE
N_BANDS, BAND_LIMITS_HZ = 40, (60.0, 7800.0)
LEAST_POWER = 1e-7
LOUD_SHARE, BAND_SPREAD = 0.5, 3.0  # frames whose mean is the level of a sound; spread of log powers
OFFSETS = (-16, -11, -8, -5, -3, -1, 0, 1, 3, 5, 8, 11, 16)  # frames of the window of a classifier
SCORE_WEIGHT = 0.5  # of log probabilities: those of neighbouring frames are not independent
DURATION_SPREAD = 0.35  # of log durations around the stated ones
START_SPREAD_S = 0.03  # of starts around the stated ones; a Cauchy distribution, since some are far off
UNMARKED_PAUSE = -3.0  # log probability of a silence between words without punctuation
SHORTEST, SHORTEST_SILENCE = 3, 6  # frames
LONGEST_SHARE = 5  # of the longest stated duration
REACH = 80  # frames around the stated start, at the usual rate
USUAL_DURATION_S = 0.08  # of phones; what is stated for slower speech is less exact


@dataclass(frozen=True, slots=True)
class StatedPhone:
    """A phone, or a silence between words, as a voice states it.

    Parameters
    ----------
    start, duration
        In seconds.
    may_be_skipped
        Whether it is a silence that the sound may lack.
    is_marked
        Whether punctuation stands at a silence.
    """

    label: str
    start: float
    duration: float = 0.0
    may_be_skipped: bool = False
    is_marked: bool = False


class Segments(NamedTuple):
    """N segments of which a sound may consist, in the order of time, between J joints.

    Parameters
    ----------
    labels : (N,)
        Columns of the frames' log probabilities.
    joints : (N, 2)
        Joints at which each segment begins and ends. The first joint is where the sound begins, the last one its end.
    shortest : (N,)
        Least frames of each segment.
    passed, taken : (N,)
        Log probabilities that a segment is missing, and that it is there.
    durations : (N, D)
        Log probabilities of durations of 0 to D - 1 frames; there is no limit where the first one is above zero.
    bounds : (J, 2)
        Earliest and latest frame of each joint.
    starts, ends : (N, W)
        Log probabilities that a segment begins and ends in each frame after the earliest one of its joint.
    """

    labels: IntArray
    joints: IntArray
    shortest: IntArray
    passed: FloatArray
    taken: FloatArray
    durations: FloatArray
    bounds: IntArray
    starts: FloatArray
    ends: FloatArray


class Divisions(NamedTuple):
    """The best division of a sound up to each joint at each frame.

    Parameters
    ----------
    score : (J, W)
        Its log probability.
    entered, before : (J, W)
        Its last segment, and the frame at which that begins.
    """

    score: FloatArray
    entered: IntArray
    before: IntArray


class Endings(NamedTuple):
    """Ways through one segment: the score at each start (W,), the best at each end (W,), and the start that has it."""

    starts: FloatArray
    reached: FloatArray
    start: IntArray


def divide(log_probabilities: NDArray[np.floating], segments: Segments) -> list[tuple[int, int, int]]:
    """The most probable division of a sound: each segment that is there, with its first frame and that after its last.

    Parameters
    ----------
    log_probabilities : (T, P)
        Of labels in each frame.

    Returns
    -------
    divisions
        Empty if there are fewer frames than the segments need.
    """
    sums = np.zeros((len(log_probabilities) + 1, log_probabilities.shape[1]))
    np.cumsum(log_probabilities, axis=0, out=sums[1:])
    bounds = segments.bounds
    shape = (len(bounds), int((bounds[:, 1] - bounds[:, 0]).max()) + 1)
    best = Divisions(np.full(shape, -np.inf), np.full(shape, -1), np.zeros(shape, np.int64))
    best.score[0, 0] = 0.0
    _search(sums, segments, best, Endings(np.zeros(shape[1]), np.zeros(shape[1]), np.zeros(shape[1], np.int64)))
    joint = len(bounds) - 1
    frame = int(bounds[-1, 1])
    found = []
    while joint > 0:
        segment = int(best.entered[joint, frame - bounds[joint, 0]])
        if segment < 0:
            return []
        start = int(best.before[joint, frame - bounds[joint, 0]])
        if start < frame:
            found.append((segment, start, frame))
        joint, frame = int(segments.joints[segment, 0]), start
    return found[::-1]


@kernel
def _search(sums, segments, found, space):  # type: ignore[no-untyped-def]
    """Write the best divisions up to each joint; `space` is overwritten."""
    bounds, score = segments.bounds, found.score
    for n in range(len(segments.labels)):
        label = segments.labels[n]
        source, target = segments.joints[n, 0], segments.joints[n, 1]
        (earliest, latest), (low, high) = bounds[source], bounds[target]
        so_far = score[source, : latest - earliest + 1]
        starts = space.starts[: len(so_far)]
        for at in range(len(starts)):  # whole arrays would take long to compile
            starts[at] = so_far[at] + segments.taken[n] + segments.starts[n, at] - sums[earliest + at, label]
        # no log probability is positive: this marks a segment of any duration
        if segments.durations[n, 0] > 0.0:
            _end_unlimited(starts, (earliest, low, high), segments.shortest[n], space)
        else:
            _end_limited(starts, (earliest, low, high), segments.shortest[n], segments.durations[n], space)
        for end in range(low, high + 1):
            at = end - low
            value, start = space.reached[at] + sums[end, label] + segments.ends[n, at], space.start[at]
            if earliest <= end <= latest and so_far[end - earliest] + segments.passed[n] > value:
                value, start = so_far[end - earliest] + segments.passed[n], end
            if value > score[target, at]:
                score[target, at] = value
                found.entered[target, at] = n
                found.before[target, at] = start


@kernel
def _end_limited(starts, frames, shortest, durations, out):  # type: ignore[no-untyped-def]
    """Write the best score of a segment that ends in each frame from `low` to `high`, and the start that gives it."""
    earliest, low, high = frames
    for end in range(low, high + 1):
        out.reached[end - low], out.start[end - low] = -np.inf, 0
        first, last = max(end - len(durations) + 1, earliest), min(end - shortest, earliest + len(starts) - 1)
        for at in range(first, last + 1):
            value = starts[at - earliest] + durations[end - at]
            if value > out.reached[end - low]:
                out.reached[end - low], out.start[end - low] = value, at


@kernel
def _end_unlimited(starts, frames, shortest, out):  # type: ignore[no-untyped-def]
    """As `_end_limited`, of a segment of any duration."""
    earliest, low, high = frames
    best, best_at = -np.inf, earliest
    at = earliest
    for end in range(low, high + 1):
        while at <= min(end - shortest, earliest + len(starts) - 1):
            if starts[at - earliest] > best:
                best, best_at = starts[at - earliest], at
            at += 1
        out.reached[end - low], out.start[end - low] = best, best_at


def find_edges(sound: Waveform, stated: Sequence[StatedPhone], classifier: PhoneClassifier) -> FloatArray:
    """(N + 1,) starts of N stated phones in seconds, and the end of the sound; a skipped one begins with the next one.

    Parameters
    ----------
    stated
        The first and the last one are silences.
    """
    probabilities = classifier.log_probabilities(frame_features(sound))[:-1]
    starts = np.array([0.0, *(phone.start for phone in stated[1:])])
    found = divide(SCORE_WEIGHT * probabilities, _stated_segments(stated, starts, len(probabilities), classifier))
    if not found:
        return enforce_increasing(np.append(starts, sound.duration))
    edges = np.full(len(stated) + 1, sound.duration)
    for segment, start, _ in found:
        # an edge lies between the last frame of a phone and the first of the next one
        edges[segment] = max((start - 0.5) * STEP_S, 0.0)
    # backwards: what follows a skipped one may be skipped, too
    for segment in range(len(stated) - 1, 0, -1):
        if stated[segment].may_be_skipped and segment not in {number for number, *_ in found}:
            edges[segment] = edges[segment + 1]
    return edges


def _stated_segments(
    stated: Sequence[StatedPhone], starts: FloatArray, n_frames: int, classifier: PhoneClassifier
) -> Segments:
    """Segments one after another, near the stated starts and durations."""
    number = {label: at for at, label in enumerate(classifier.inventory)}
    durations = np.array([phone.duration for phone in stated])
    is_silence = np.array([phone.label == SILENCE for phone in stated])
    slowness = max(1.0, float(durations[durations > 0].mean()) / USUAL_DURATION_S)
    reach = round(REACH * slowness)
    frames = np.clip(np.round(starts / STEP_S).astype(np.int64), 0, n_frames)
    bounds = np.stack([np.maximum(frames - reach, 0), np.minimum(frames + reach, n_frames)], axis=1)
    bounds = np.concatenate([[[0, 0]], bounds[1:], [[n_frames, n_frames]]])
    expected = np.maximum(durations, STEP_S)
    seconds = np.maximum(np.arange(round(LONGEST_SHARE * expected.max() / STEP_S) + 1), 1) * STEP_S
    likely = -0.5 * np.square(np.log(seconds / expected[:, None]) / DURATION_SPREAD)
    # marks silences as segments of any duration
    likely[is_silence, 0] = 1.0
    times = bounds[:-1, :1] + np.arange((bounds[:, 1] - bounds[:, 0]).max() + 1)
    apart = (times - frames[:, None]) / (START_SPREAD_S * slowness / STEP_S)
    # a Cauchy distribution, as some stated starts are far off
    near = np.where(is_silence[:, None], 0.0, -np.log1p(0.5 * apart * apart))
    shortest = np.where(is_silence, SHORTEST_SILENCE, SHORTEST)
    # the sound may start and end with a phone: the outer silences last a frame at least
    shortest[[0, -1]] = 1
    numbers = np.arange(len(stated))
    return Segments(
        np.array([number[_known(phone.label, number)] for phone in stated]),
        np.stack([numbers, numbers + 1], axis=1),
        shortest,
        np.array([0.0 if phone.may_be_skipped else -np.inf for phone in stated]),
        np.array([UNMARKED_PAUSE if phone.may_be_skipped and not phone.is_marked else 0.0 for phone in stated]),
        likely,
        bounds,
        near,
        np.zeros_like(near),
    )


def _known(label: str, inventory: Collection[str]) -> str:
    """A phone of an inventory: the phone itself, or the nearest one, for instance of a British vowel."""
    return label if label in inventory else nearest_phones(label, [own for own in inventory if own != SILENCE])[0]


def frame_features(sound: Waveform, *, is_recording: bool = False) -> NDArray[np.float32]:
    """Log powers of mel bands (T, K) in a window around each frame of 5 ms, relative to the level of the sound.

    A recording may be silent for most of its time: its level is that of its speech and of its pauses.
    """
    import soxr

    samples = sound.samples if sound.rate == RATE else soxr.resample(sound.samples, sound.rate, RATE)
    padded = np.pad(samples.astype(np.float32), (WINDOW // 2, WINDOW))
    windows = sliding_window_view(padded, WINDOW)[::STEP][: len(samples) // STEP + 1] * np.hanning(WINDOW)
    powers = np.square(np.abs(np.fft.rfft(windows, TRANSFORM)))
    bands = np.log(ordered_product(powers, mel_bands(N_BANDS, BAND_LIMITS_HZ, TRANSFORM)) + LEAST_POWER)
    counted = _is_counted(powers) if is_recording else np.ones(len(bands), bool)
    loud = counted & (bands.mean(axis=1) >= np.quantile(bands[counted].mean(axis=1), 1.0 - LOUD_SHARE))
    bands = ((bands - bands[loud].mean(axis=0)) / BAND_SPREAD).astype(np.float32)
    rows = np.clip(np.arange(len(bands))[:, None] + np.array(OFFSETS), 0, len(bands) - 1)
    features: NDArray[np.float32] = bands[rows].reshape(len(bands), -1)
    return features


def _is_counted(powers: FloatArray) -> NDArray[np.bool_]:
    """Whether frames with spectra (T, F) are of speech or of its pauses, and not of the silence beyond."""
    levels: FloatArray = 10.0 * np.log10(powers.sum(axis=1) + np.finfo(np.float64).tiny)
    return is_near_speech(levels, STEP_S) & is_near_sound(levels, STEP_S)
