"""One recording as a corpus needs it: pose-free landmarks, head pose, phones and loudness on one clock."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from corpus_tools.listen import Heard, heard, intensity
from corpus_tools.recordings import Recording, spoken_words
from corpus_tools.watch import Watched, watched
from lexicon.errors import DataError
from lexicon.sequence import SILENCE, PhoneSequence, WordSpan
from tts2face.video.pose import Posed, head_angles, remove_pose

if TYPE_CHECKING:
    from tts2face.speech.align import Aligner
    from tts2face.video.track import FaceTracker

LONGEST_GAP_S = 0.12  # frames without a face that are filled in; lips make no full movement in less
# Log likelihood per second of speech below which the words are not those of the sound. Of 804 GRID recordings the worst
# reached -6020; other sentences of its small grammar lie at -7300 (median), unrelated text at -10500 or is not found.
LEAST_CONFIDENCE = -6500.0
SAME_INSTANT_S = 0.001  # times in a file are rounded to milliseconds


@dataclass(frozen=True, slots=True)
class Quality:
    """How well a recording could be read.

    ``confidence`` of the alignment (0 is perfect, log likelihood per second), lowest face ``score``, ``n_filled``
    frames filled in, seconds ``cut`` from the beginning because they show no face.
    """

    confidence: float
    score: float
    n_filled: int
    cut: float


@dataclass(frozen=True, slots=True, eq=False)
class Observation:
    """One recording; frame i is the instant ``i / fps`` of the clock of ``phones``, ``quality.cut`` later in ``video``.

    Parameters
    ----------
    landmarks : (T, 478, 3)
        Millimetres, head pose removed; axes as in `tts2face.landmarks`.
    head : (T, 6)
        `HEAD_CHANNELS`: angles against the camera, place against the recording's middle.
    intensity : (T,)
        Level of the sound in dB.
    """

    name: str
    fps: float
    landmarks: NDArray[np.float32]
    head: NDArray[np.float32]
    phones: PhoneSequence
    words: tuple[WordSpan, ...]
    intensity: NDArray[np.float32]
    quality: Quality
    video: Path


def observed(recording: Recording, cache: Path, tracker: "FaceTracker", aligner: "Aligner") -> Observation:
    """One recording, read and measured.

    Raises
    ------
    DataError
        The recording cannot serve; the message says why.
    """
    words = spoken_words(recording)
    sound = heard(recording.video, words, cache, aligner)
    if sound.confidence < LEAST_CONFIDENCE:
        raise DataError(f"the sound does not fit the transcript (confidence {sound.confidence:.0f}); correct the words")
    seen = watched(recording.video, cache, tracker)
    points, first = on_grid(seen.tracking.points, seen.times, seen.fps)
    if np.isnan(points).all():
        raise DataError("no frame shows a face")
    start, end = face_span(points)
    filled, n_filled = filled_gaps(points[start:end], seen.fps)
    begin, stop = (first + start) / seen.fps, (first + end) / seen.fps
    phones, spans = trimmed(sound, begin, stop)
    posed = remove_pose(filled, seen.fps)
    times = begin + np.arange(end - start) / seen.fps
    quality = Quality(sound.confidence, _lowest_score(seen), n_filled, begin)
    loudness = intensity(sound.sound, times)
    return Observation(
        recording.name, seen.fps, posed.landmarks, _head(posed), phones, spans, loudness, quality, recording.video
    )


def on_grid(points: NDArray[np.float32], times: NDArray[np.float64], fps: float) -> tuple[NDArray[np.float32], int]:
    """Points at the instants i / fps between the first time and the last, and the first i.

    Parameters
    ----------
    points : (T, ...)
        Values at `times`.
    times : (T,)
        Seconds; they must increase.

    Raises
    ------
    DataError
        Times do not increase.
    """
    if (np.diff(times) <= 0).any():
        raise DataError("frames do not follow each other in time; convert the recording with ffmpeg")
    first = int(np.ceil((times[0] - SAME_INSTANT_S) * fps))
    last = int(np.floor((times[-1] + SAME_INSTANT_S) * fps))
    instants = np.arange(first, last + 1) / fps
    if len(instants) == len(times) and np.abs(instants - times).max() <= SAME_INSTANT_S:
        return points, first
    after = np.clip(np.searchsorted(times, instants), 1, len(times) - 1)
    share = np.clip((instants - times[after - 1]) / (times[after] - times[after - 1]), 0.0, 1.0)
    share = share.reshape(-1, *[1] * (points.ndim - 1)).astype(np.float32)
    between = points[after - 1] * (1 - share) + points[after] * share
    return between.astype(np.float32), first


def face_span(points: NDArray[np.float32]) -> tuple[int, int]:
    """Half-open range from the first frame with a face to the last, of (T, L, 3) points that are NaN without one."""
    present = np.flatnonzero(~np.isnan(points[:, 0, 0]))
    return int(present[0]), int(present[-1]) + 1


def filled_gaps(points: NDArray[np.float32], fps: float) -> tuple[NDArray[np.float32], int]:
    """Points with short gaps bridged by straight lines, and the number of frames filled.

    Raises
    ------
    DataError
        A gap is longer than `LONGEST_GAP_S`.
    """
    missing = np.isnan(points[:, 0, 0])
    if not missing.any():
        return points, 0
    present = np.flatnonzero(~missing)
    longest = int(np.diff(present).max()) - 1
    if longest > round(LONGEST_GAP_S * fps):
        raise DataError(f"the face is out of sight for {longest / fps:.2f} s")
    grid, _ = on_grid(points[present], present / fps, fps)
    return grid, int(missing.sum())


def trimmed(sound: Heard, begin: float, stop: float) -> tuple[PhoneSequence, tuple[WordSpan, ...]]:
    """Phones and words on a clock that starts at `begin`, the silence outside [begin, stop] cut away.

    Raises
    ------
    DataError
        Speech lies outside.
    """
    phones = list(sound.phones.phones)
    edges = sound.phones.edges.copy()
    lead = 1 if phones[0] == SILENCE and edges[1] <= begin else 0
    tail = len(phones) - (1 if phones[-1] == SILENCE and edges[-2] >= stop else 0)
    phones, edges = phones[lead:tail], np.clip(edges[lead : tail + 1], None, stop)
    spoken = [i for i, phone in enumerate(phones) if phone != SILENCE]
    if edges[spoken[0]] < begin or sound.phones.edges[lead + spoken[-1] + 1] > stop:
        raise DataError(f"words are spoken while no face is seen (it is seen from {begin:.2f} s to {stop:.2f} s)")
    edges[0] = max(edges[0], begin)
    words = tuple(WordSpan(word.text, word.first - lead, word.last - lead) for word in sound.words)
    return PhoneSequence(phones, edges - begin), words


def _head(posed: Posed) -> NDArray[np.float32]:
    place = posed.shifts - np.median(posed.shifts, axis=0)
    return np.column_stack([head_angles(posed.rotations), place]).astype(np.float32)


def _lowest_score(seen: Watched) -> float:
    return float(seen.tracking.scores[~seen.tracking.is_missing].min())
