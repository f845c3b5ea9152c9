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
from tts2face.video.grid import face_span, filled_gaps, on_grid
from tts2face.video.media import media_facts
from tts2face.video.pose import Posed, head_angles, remove_pose

if TYPE_CHECKING:
    from tts2face.speech.align import Aligner
    from tts2face.video.track import FaceTracker

# Log likelihood per second of speech below which the words are not those of the sound. Of 804 GRID recordings the worst
# reached -6020; other sentences of its small grammar lie at -7300 (median), unrelated text at -10500 or is not found.
LEAST_CONFIDENCE = -6500.0


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
    span = _on_frames(recording)
    sound = heard(recording.video, words, cache, aligner, span)
    if sound.confidence < LEAST_CONFIDENCE:
        raise DataError(f"the sound does not fit the transcript (confidence {sound.confidence:.0f}); correct the words")
    seen = watched(recording.video, cache, tracker)
    points, first = on_grid(seen.tracking.points, seen.times, seen.fps)
    if span is not None:
        points, first = _within(points, first, seen.fps, span)
    origin = span[0] if span is not None else 0.0
    if np.isnan(points).all():
        raise DataError("no frame shows a face")
    start, end = face_span(points)
    filled, n_filled = filled_gaps(points[start:end], seen.fps)
    begin, stop = (first + start) / seen.fps, (first + end) / seen.fps
    phones, spans = trimmed(sound, begin, stop)
    posed = remove_pose(filled, seen.fps)
    times = begin + np.arange(end - start) / seen.fps
    quality = Quality(sound.confidence, _lowest_score(seen), n_filled, origin + begin)
    loudness = intensity(sound.sound, times)
    return Observation(
        recording.name, seen.fps, posed.landmarks, _head(posed), phones, spans, loudness, quality, recording.video
    )


def _on_frames(recording: Recording) -> tuple[float, float] | None:
    """The span of a recording from the instant of a frame to that of another."""
    if recording.span is None:
        return None
    fps = media_facts(recording.video).fps
    begin, end = int(np.ceil(recording.span[0] * fps)), int(np.floor(recording.span[1] * fps))
    return begin / fps, max(end, begin) / fps


def _within(
    points: NDArray[np.float32], first: int, fps: float, span: tuple[float, float]
) -> tuple[NDArray[np.float32], int]:
    """The frames of a span of the video, and the number of the first of them counted from the span's beginning."""
    begin, end = (round(second * fps) for second in span)
    here = points[max(begin - first, 0) : max(end - first, 0)]
    if not len(here):
        raise DataError(f"the video shows nothing from {span[0]:.2f} s to {span[1]:.2f} s; check the subtitles' times")
    return here, max(first - begin, 0)


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
