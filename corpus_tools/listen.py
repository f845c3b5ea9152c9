"""Phones and loudness of a recording; the phones are aligned once and kept in a cache folder."""

import hashlib
import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from corpus_tools.recordings import Ways
from corpus_tools.watch import content_key
from lexicon.errors import DataError
from lexicon.sequence import PhoneSequence, WordSpan
from tts2face.tensors import read_tensors, write_tensors
from tts2face.types import Waveform
from tts2face.video.media import read_sound

if TYPE_CHECKING:
    from tts2face.speech.align import Aligner, Alignment

KIND = "alignment"
ALIGNMENT_VERSION = 3  # rises when alignment gives other edges, so that cached ones are made again
SOUND_RATE = 16_000  # Hz; what the aligner hears
LOWEST_PITCH_HZ = 100.0  # of a voice: intensity is averaged over 3.2 periods of it, 32 ms (parselmouth's rule)
QUIETEST_DB = 0.0  # digital silence has no level; it counts as the threshold of hearing


@dataclass(frozen=True, slots=True, eq=False)
class Heard:
    """What the microphone heard: phones, words, the alignment's confidence, and the sound."""

    phones: PhoneSequence
    words: tuple[WordSpan, ...]
    confidence: float
    sound: Waveform


def heard(
    video: Path,
    words: Sequence[tuple[str, Ways]],
    cache: Path,
    aligner: "Aligner",
    span: tuple[float, float] | None = None,
) -> Heard:
    """Phones of a recording's sound, from the cache when the same sound and words were aligned before.

    Parameters
    ----------
    span
        Seconds of the file that are listened to, the clock of the phones beginning with them; all without it.

    Raises
    ------
    DataError
        There is no sound, or it does not hold these words.
    """
    sound = read_sound(video, SOUND_RATE)
    if span is not None:
        first, last = (round(second * SOUND_RATE) for second in span)
        sound = Waveform(sound.samples[first:last], SOUND_RATE)
    asked = json.dumps(words) if span is None else json.dumps([words, span])
    said = hashlib.sha256(asked.encode()).hexdigest()[:8]
    kept = cache / f"{content_key(video)}-{said}-{ALIGNMENT_VERSION}.{KIND}"
    if kept.is_file():
        try:
            arrays, header = read_tensors(kept, KIND, ALIGNMENT_VERSION)
            spans = tuple(WordSpan(text, first, last) for text, first, last in header["words"])
            return Heard(PhoneSequence(header["phones"], arrays["edges"]), spans, float(header["confidence"]), sound)
        except (DataError, KeyError):
            pass  # damaged: made again
    found: Alignment = aligner.align(sound, words)
    header = {
        "phones": found.phones.phones,
        "words": [[word.text, word.first, word.last] for word in found.words],
        "confidence": found.confidence,
    }
    write_tensors(kept, KIND, ALIGNMENT_VERSION, {"edges": found.phones.edges}, header)
    return Heard(found.phones, found.words, found.confidence, sound)


def intensity(sound: Waveform, times: NDArray[np.float64]) -> NDArray[np.float32]:
    """(T,) level of a sound in dB at instants (T,) in seconds.

    Raises
    ------
    DataError
        The sound is too short to have a level.
    """
    import parselmouth

    praat = parselmouth.Sound(sound.samples.astype(np.float64), sampling_frequency=sound.rate)
    try:
        levels = praat.to_intensity(minimum_pitch=LOWEST_PITCH_HZ, subtract_mean=True)
    except parselmouth.PraatError as refused:
        raise DataError(
            f"a sound of {sound.duration:.3f} s is too short to measure; give a longer recording"
        ) from refused
    values = np.maximum(np.nan_to_num(levels.values[0], nan=QUIETEST_DB, neginf=QUIETEST_DB), QUIETEST_DB)
    at_times: NDArray[np.float64] = np.interp(times, levels.xs(), values)
    return at_times.astype(np.float32)
