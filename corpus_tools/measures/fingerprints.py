"""Fingerprints of recordings: curves of sound and motion by which a recording is recognised after re-encoding.

The sound is compared where its file is at hand. Talkers and tracks hold no sound: there the motion of face and head is
compared, and the durations of the phones. `tests/bench/bench_fingerprints.py` measures the margins;
docs/decisions/140-fingerprints.md has the table.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from corpus_tools.recordings.observation import TRACK_SUFFIX, Observation
from corpus_tools.recordings.sound import SOUND_RATE
from lexicon.errors import InputError
from lexicon.sequence import SILENCE, PhoneSequence
from tts2face.models.talker import Talker
from tts2face.models.talker_file import load_talker
from tts2face.numeric.arrays import Float32Array, interpolate_columns
from tts2face.types import Waveform
from tts2face.video.media import read_sound

MOTION_RATE_HZ = 25.0  # of most recordings, which are then not interpolated
N_MOUTH_MODES, N_OTHER_MODES = 4, 4  # of the shipped talker's shape model
SMOOTHING = np.array([1.0, 4.0, 6.0, 4.0, 1.0]) / 16  # of motion: jitter of the tracker in small or dark pictures
LOUDNESS_RANGE_DB = 30.0  # below the loudest frame; what is quieter depends on the noise
WINDOW_SAMPLES, STEP_SAMPLES = 1024, 256  # of `SOUND_RATE`: 64 ms, 16 ms; a shift by half a step changes little
BAND_EDGES_HZ = np.geomspace(200.0, 4000.0, 13)  # within what low bit rates keep
# Between the most similar different recordings (.68, .66) and the same ones re-encoded (.83, .74 and above).
# similarities of one recording twice lie above, of two below (decision 140)
SAME_SOUND, SAME_MOTION = 0.76, 0.71
# Recordings of the same phones are the same from a lower similarity of motion on, if the durations agree so well:
# repetitions of the same words differ by 22 ms, the closest of 611 pairs by 5.9 ms.
SAME_DURATIONS_S, SAME_MOTION_OF_PHONES = 0.005, 0.5
MIN_OVERLAP = 0.8  # of the shorter recording, at a lag
MIN_PHONES = 8  # whose durations tell recordings apart
MAX_LISTED = 5  # names in a warning
BLOCK = 64  # recordings compared at once with all others, which bounds the memory
TINY = 1e-9  # in place of 0, where a curve is constant


@dataclass(frozen=True, slots=True, eq=False)
class Fingerprint:
    """Changes of bands of the ``sound`` (T, 12), or None, and of the ``motion`` (T, 15), and the ``phones``."""

    name: str
    sound: Float32Array | None
    motion: Float32Array
    phones: PhoneSequence


def fingerprint_observations(observations: Sequence[Observation]) -> tuple[Fingerprint, ...]:
    """Fingerprints of observed recordings, with the sound of those whose files are at hand.

    Raises
    ------
    DataError
        A file cannot be read any more.
    """
    return tuple(
        Fingerprint(
            observation.name,
            None if (sound := _sound(observation)) is None else sound_changes(sound),
            motion_changes(face_modes(observation.landmarks), observation.head, observation.intensity, observation.fps),
            observation.phones,
        )
        for observation in observations
    )


def fingerprint_talker(talker: Talker) -> tuple[Fingerprint, ...]:
    """Fingerprints of the utterances in a talker, among them those of its base."""
    offset = face_modes(talker.model.mean[None])
    turn = face_modes(talker.model.mean + talker.model.basis) - offset  # both models are linear
    return tuple(
        Fingerprint(
            utterance.name,
            None,
            motion_changes(utterance.shape @ turn + offset, utterance.head, utterance.intensity, talker.fps),
            utterance.phones,
        )
        for utterance in talker.utterances
    )


def find_same(known: Sequence[Fingerprint], tested: Sequence[Fingerprint]) -> tuple[tuple[str, str], ...]:
    """Names of the tested recordings that are known, each with the name of the most similar known one."""
    if not known or not tested:
        return ()
    motion = similarities([recording.motion for recording in tested], [recording.motion for recording in known])
    excess = np.maximum(motion - SAME_MOTION, _sound_similarities(tested, known) - SAME_SOUND)
    for at, recording in enumerate(tested):
        for candidate in np.flatnonzero(motion[at] >= SAME_MOTION_OF_PHONES).tolist():
            if _have_same_durations(recording.phones, known[candidate].phones):
                excess[at, candidate] = max(excess[at, candidate], 0.0)
    best: list[int] = excess.argmax(axis=1).tolist()
    return tuple(
        (recording.name, known[best[at]].name) for at, recording in enumerate(tested) if excess[at, best[at]] >= 0
    )


def check_no_same(known: Sequence[Fingerprint], tested: Sequence[Fingerprint], places: str, remedy: str) -> None:
    """Check that no recording is in both lists, re-encoded or renamed.

    Parameters
    ----------
    places, remedy
        Where the lists are from, and what to do, for the message.
    """
    if same := find_same(known, tested):
        name, other = same[0]
        renamed = "" if other == name else f", there as {other}"
        raise InputError(f"{name} is in both {places}{renamed} ({len(same)} in all); {remedy}")


def same_name_warnings(known: Iterable[str], tested: Iterable[str], places: str) -> tuple[str, ...]:
    """A warning about equal names of different recordings, if there are any."""
    names = sorted(set(known) & set(tested))
    if not names:
        return ()
    listed = ", ".join(names[:MAX_LISTED]) + (", ..." if len(names) > MAX_LISTED else "")
    count = "1 name is" if len(names) == 1 else f"{len(names)} names are"
    return (f"{count} in both {places}, though the contents differ ({listed}); check that none is a copy",)


def similarities(ones: Sequence[Float32Array], others: Sequence[Float32Array]) -> NDArray[np.float64]:
    """Highest correlation of changes over lags.

    Parameters
    ----------
    ones, others
        N and M arrays (T, C) of equal C. At each lag at least `MIN_OVERLAP` of the shorter one overlaps.

    Returns
    -------
    (N, M)
        At most 1.
    """
    right = _Table.of(others)
    blocks = [_Table.of(ones[start : start + BLOCK]) for start in range(0, len(ones), BLOCK)]
    return np.concatenate([_block_similarities(left, right) for left in blocks])


def _block_similarities(left: "_Table", right: "_Table") -> NDArray[np.float64]:
    shorter = np.minimum(left.lengths[:, None], right.lengths[None])
    best = np.full(shorter.shape, -1.0)
    for lag in range(-left.longest, right.longest):  # frame t of one is frame t + lag of the other
        start, end = max(0, -lag), min(left.longest, right.longest - lag)
        stop = np.maximum(np.minimum(left.lengths[:, None], right.lengths[None] - lag), start)
        is_long = (stop > start) & (stop - start >= MIN_OVERLAP * shorter)
        if not is_long.any():
            continue
        product = np.tensordot(
            left.values[:, start:end], right.values[:, start + lag : end + lag], axes=([1, 2], [1, 2])
        )
        size = left.energy(start, stop) * right.energy(start + lag, (stop + lag).T).T
        found = np.where(size > TINY, product / np.sqrt(np.maximum(size, TINY)), 0.0)
        best = np.where(is_long, np.maximum(best, found), best)
    return best


@dataclass(frozen=True, slots=True, eq=False)
class _Table:
    """Changes (N, L, C) continued by zeros, and running sums (N, L + 1) of their squares."""

    lengths: NDArray[np.int64]
    values: Float32Array
    squares: NDArray[np.float64]

    @classmethod
    def of(cls, changes: Sequence[Float32Array]) -> "_Table":
        lengths = np.array([len(change) for change in changes])
        values = np.zeros((len(changes), int(lengths.max()), changes[0].shape[1]), np.float32)
        for at, change in enumerate(changes):
            values[at, : len(change)] = change
        squares = np.square(values, dtype=np.float64).sum(axis=2).cumsum(axis=1)
        return cls(lengths, values, np.concatenate([np.zeros((len(changes), 1)), squares], axis=1))

    @property
    def longest(self) -> int:
        """Length L of the longest."""
        return int(self.values.shape[1])

    def energy(self, start: int, stop: NDArray[np.int64]) -> NDArray[np.float64]:
        """Sums (N, K) of the squares from a frame to frames (N, K)."""
        return np.take_along_axis(self.squares, stop, axis=1) - self.squares[:, start, None]


def _sound_similarities(ones: Sequence[Fingerprint], others: Sequence[Fingerprint]) -> NDArray[np.float64]:
    """(N, M) similarities of the sounds; -1 where there is none."""
    found = np.full((len(ones), len(others)), -1.0)
    rows = [at for at, item in enumerate(ones) if item.sound is not None]
    columns = [at for at, other in enumerate(others) if other.sound is not None]
    if rows and columns:
        left, right = ([item.sound for item in some if item.sound is not None] for some in (ones, others))
        found[np.ix_(rows, columns)] = similarities(left, right)
    return found


def _have_same_durations(own: PhoneSequence, other: PhoneSequence) -> bool:
    """Whether both are the same phones and last equally long, apart from the silence at the ends."""
    spoken = [
        (sequence.phones[start:stop], sequence.durations[start:stop])
        for sequence in (own, other)
        for start, stop in [(sequence.phones[0] == SILENCE, len(sequence) - (sequence.phones[-1] == SILENCE))]
    ]
    (labels, durations), (others, other_durations) = spoken
    if labels != others or len(labels) < MIN_PHONES:
        return False
    return bool(np.abs(durations - other_durations).mean() <= SAME_DURATIONS_S)


def _sound(observation: Observation) -> Waveform | None:
    """Sound of an observation, None without a file of sound."""
    # tracks without sound are compared by their motion
    if observation.video.suffix == TRACK_SUFFIX or not observation.video.is_file():
        return None
    whole = _read_sound(observation.video)
    start = round((observation.quality.cut + observation.quality.lag) * SOUND_RATE)
    samples = whole.samples[max(start, 0) :][: round(len(observation.landmarks) / observation.fps * SOUND_RATE)]
    return Waveform(samples, SOUND_RATE) if len(samples) >= WINDOW_SAMPLES + STEP_SAMPLES else None


@lru_cache(maxsize=1)
def _read_sound(path: Path) -> Waveform:
    return read_sound(path, SOUND_RATE)


def sound_changes(sound: Waveform) -> Float32Array:
    """(T, 12) changes of the amplitudes of frequency bands, each of unit variance, of a sound at `SOUND_RATE`."""
    frames = np.lib.stride_tricks.sliding_window_view(sound.samples, WINDOW_SAMPLES)[::STEP_SAMPLES]
    power = np.square(np.abs(np.fft.rfft(frames * np.hanning(WINDOW_SAMPLES), axis=1)))
    edges = np.round(BAND_EDGES_HZ * WINDOW_SAMPLES / SOUND_RATE).astype(int)
    bands = np.add.reduceat(power, edges, axis=1)[:, :-1]
    return _unit_changes(np.sqrt(bands))


def face_modes(landmarks: NDArray[np.floating]) -> Float32Array:
    """(T, 8) parameters of landmarks (T, 478, 3) in the shipped talker's shape model: mouth, and rest of the face."""
    mean, modes = _shipped_modes()
    return np.asarray((landmarks - mean).reshape(len(landmarks), -1) @ modes, np.float32)


def motion_changes(
    modes: NDArray[np.floating], head: NDArray[np.floating], intensity: NDArray[np.floating], fps: float
) -> Float32Array:
    """(T, 15) changes of `face_modes`, head pose and loudness, each of unit variance."""
    loudness = np.maximum(intensity, intensity.max() - LOUDNESS_RANGE_DB)
    curves = np.column_stack([modes, head, loudness]).astype(np.float64)
    times = np.arange(len(curves)) / fps
    curves = interpolate_columns(curves, times, np.arange(int(times[-1] * MOTION_RATE_HZ + TINY) + 1) / MOTION_RATE_HZ)
    edge = len(SMOOTHING) // 2
    padded = np.pad(curves, ((edge, edge), (0, 0)), mode="edge")
    return _unit_changes(np.lib.stride_tricks.sliding_window_view(padded, len(SMOOTHING), axis=0) @ SMOOTHING)


def _unit_changes(curves: NDArray[np.float64]) -> Float32Array:
    """Differences (T, C) of curves divided by their deviation; 0 for a constant curve."""
    changes = np.diff(curves, axis=0)
    return np.asarray(changes / np.maximum(np.sqrt(np.square(changes).mean(axis=0)), TINY), np.float32)


@lru_cache(maxsize=1)
def _shipped_modes() -> tuple[Float32Array, Float32Array]:
    """Mean (478, 3) and modes (1434, 8) of the shipped talker."""
    model = load_talker("grid_s1").model
    chosen = [*range(N_MOUTH_MODES), *range(model.n_speech, model.n_speech + N_OTHER_MODES)]
    return model.mean, model.basis[chosen].reshape(len(chosen), -1).T.copy()
