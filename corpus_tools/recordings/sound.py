"""Sound and aligned phones of recordings, stored in a cache folder.

Suppression of stationary noise before phones are aligned or recognised; the recordings themselves do not change.

With noise 10 dB below the speech, forced alignment displaces words by 97 ms on average; after suppression by 32 ms
(docs/decisions/129-recording-limits.md).
"""

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from corpus_tools.recordings.folder import PronouncedTranscript
from corpus_tools.recordings.video import content_key
from lexicon.errors import DataError
from lexicon.sequence import PhoneSequence, WordSpan
from tts2face.sound.pauses import Span, cut_at_pauses, cut_sound, sound_windows
from tts2face.storage.tensors import read_kept, write_tensors
from tts2face.types import Waveform
from tts2face.video.media import read_sound

if TYPE_CHECKING:
    from tts2face.sound.alignment import Aligner
    from tts2face.sound.listener import PhoneRecogniser


MIN_RANGE_DB = 20.0  # level range below which noise is suppressed; recordings of GRID s1 have 22.9 or more
LEVEL_WINDOW_S = 0.02
RANGE_QUANTILES = (0.1, 0.95)  # of the windows' levels: noise, loud speech
WINDOW, STEP = 512, 128  # samples of the short-time spectrum at 16 kHz: 32 and 8 ms
QUIET_SHARE = 0.2  # of the windows, the quietest, whose mean spectrum is that of the noise
QUIET_SMOOTHING = 5  # windows over which levels are averaged before the quietest are chosen
PRIOR_WEIGHT = 0.98  # of the previous window in the estimated signal-to-noise ratio (Ephraim and Malah 1984)
MIN_GAIN = 0.03  # 0.1 and 0.25 leave 40 and 52 ms of error
MIN_POWER = 1e-12

Floats = NDArray[np.float64]


def level_range_db(sound: Waveform) -> float:
    """Level of loud speech over that of the quietest parts in dB; infinite if these are silent or there is no sound."""
    windows = sound_windows(sound, LEVEL_WINDOW_S)
    if not len(windows):
        return float("inf")
    low, high = np.quantile(np.square(windows, dtype=np.float64).mean(axis=1), RANGE_QUANTILES)
    return float(10.0 * np.log10(high / low)) if low > 0 else float("inf")


def suppress_noise(sound: Waveform) -> Waveform:
    """The sound with stationary noise suppressed; unchanged if its level range is at least `MIN_RANGE_DB`.

    Notes
    -----
    Wiener gains per frequency with the decision-directed estimate of the signal-to-noise ratio. Source: Ephraim and
    Malah 1984, "Speech enhancement using a minimum mean-square error short-time spectral amplitude estimator", eq. 51.
    """
    if len(sound.samples) < WINDOW or level_range_db(sound) >= MIN_RANGE_DB:
        return sound
    from scipy.signal import istft, stft

    samples, overlap = sound.samples.astype(np.float64), WINDOW - STEP
    spectrum = stft(samples, fs=sound.rate, nperseg=WINDOW, noverlap=overlap)[2]
    gains = wiener_gains(np.square(np.abs(spectrum)))
    cleaned = np.real(istft(spectrum * gains, fs=sound.rate, nperseg=WINDOW, noverlap=overlap)[1])
    return Waveform(np.clip(cleaned[: len(samples)], -1.0, 1.0).astype(np.float32), sound.rate)


def wiener_gains(power: Floats) -> Floats:
    """Gains (F, T) for the power (F, T) of a short-time spectrum whose quietest windows are noise."""
    from scipy.ndimage import uniform_filter1d

    level = uniform_filter1d(10.0 * np.log10(power.sum(axis=0) + MIN_POWER), QUIET_SMOOTHING)
    noise = np.maximum(power[:, level <= np.quantile(level, QUIET_SHARE)].mean(axis=1), MIN_POWER)
    ratio = power / noise[:, None]
    gains = np.zeros_like(power)
    before = np.zeros(len(power))
    for at in range(power.shape[1]):
        expected = PRIOR_WEIGHT * before + (1.0 - PRIOR_WEIGHT) * np.maximum(ratio[:, at] - 1.0, 0.0)
        gains[:, at] = np.maximum(expected / (1.0 + expected), MIN_GAIN)
        before = np.square(gains[:, at]) * ratio[:, at]
    return gains


ALIGNMENT_KIND = "alignment"
ALIGNMENT_VERSION = 4  # increased when alignment gives other edges, which invalidates cached ones
RECOGNITION_KIND = "hearing"
RECOGNITION_VERSION = 1  # increased when other phones are recognised
SOUND_RATE = 16_000  # Hz; input of the aligner and the recogniser
SUPPRESSED = "n"  # in names of cache entries: of the sound after suppression of noise
MAX_UTTERANCE_S = 20.0  # longer recordings are cut at pauses


@dataclass(frozen=True, slots=True, eq=False)
class AlignedSpeech:
    """Phones, words, the alignment's confidence, and the sound.

    ``is_recognised`` if there is no transcript: the words are then recognised phones between slashes.
    """

    phones: PhoneSequence
    words: tuple[WordSpan, ...]
    confidence: float
    sound: Waveform
    is_recognised: bool


class CachedAligner:
    """Aligner of recordings with a cache; models are loaded on first use, and the last file's sound stays in memory.

    In noisy files, words and phones are found after `suppress_noise`; the sound that is returned is that of the file.
    """

    def __init__(self, cache: Path) -> None:
        self._cache = cache
        self._aligner: Aligner | None = None
        self._recogniser: PhoneRecogniser | None = None
        self._last: tuple[str, Waveform, Waveform] | None = None  # key, sound, sound without noise

    def sound(self, video: Path, span: Span | None = None) -> Waveform:
        """Sound of a file, or of a span of its seconds.

        Raises
        ------
        DataError
            There is no sound, or it cannot be decoded.
        """
        whole = self._read(video)[0]
        return whole if span is None else cut_sound(whole, span)

    def _read(self, video: Path) -> tuple[Waveform, Waveform]:
        """Sound of a file, and the same with noise suppressed: the same object if there is little noise."""
        key = content_key(video)
        if self._last is None or self._last[0] != key:
            self._last = None  # frees the memory before the next sound is read
            sound = read_sound(video, SOUND_RATE)
            self._last = key, sound, suppress_noise(sound)
        return self._last[1:]

    def align(self, video: Path, words: PronouncedTranscript | None, span: Span | None = None) -> AlignedSpeech:
        """Phones of a recording's sound, from the cache if the same sound and words have been aligned.

        Parameters
        ----------
        words
            The transcript; phones are recognised from the sound if None.
        span
            Seconds of the file to align, from which the phones' time starts; the whole file by default.

        Raises
        ------
        DataError
            There is no sound, it does not match these words, or it contains no speech.
        BackendError
            No phone recogniser is installed.
        """
        sound = self.sound(video, span)
        whole, clean = self._read(video)
        asked: list[object] = [words, span, *([SUPPRESSED] if clean is not whole else [])]
        request = hashlib.sha256(json.dumps(asked).encode()).hexdigest()[:8]
        cached = self._cache / f"{content_key(video)}-{request}-{ALIGNMENT_VERSION}.{ALIGNMENT_KIND}"
        found = _read_cached_alignment(cached, sound, is_recognised=words is None)
        return found or replace(
            self._align_words(clean if span is None else cut_sound(clean, span), words, cached), sound=sound
        )

    def utterances(
        self, video: Path, words: PronouncedTranscript | None
    ) -> tuple[tuple[Span, PronouncedTranscript | None], ...]:
        """A long recording cut at pauses: spans in seconds, and the words in each.

        Raises
        ------
        DataError
            There is no sound.
        BackendError
            No phone recogniser, which locates the words, is installed.
        """
        from tts2face.sound.transcript import assign_words

        spans = cut_at_pauses(self._read(video)[1], MAX_UTTERANCE_S)
        if words is None:
            return tuple((span, None) for span in spans)

        recognised = [
            [phone for word in span_words for phone in word] for span_words in self._recognise_spans(video, spans)
        ]
        places = assign_words([pronunciations[0] for _, pronunciations in words], recognised)
        words_of_spans = [
            tuple(word for word, place in zip(words, places, strict=True) if place == at) for at in range(len(spans))
        ]
        return tuple((span, found) for span, found in zip(spans, words_of_spans, strict=True) if found)

    def _align_words(self, sound: Waveform, words: PronouncedTranscript | None, cached: Path) -> AlignedSpeech:
        from tts2face.sound.alignment import Aligner

        self._aligner = self._aligner or Aligner()
        transcript = (
            words
            if words is not None
            else tuple((f"/{''.join(word)}/", (word,)) for word in self._recognise_words(sound))
        )
        if not transcript:
            raise DataError("the sound contains no speech; give recordings of a person speaking")
        found = self._aligner.align(sound, transcript)
        header = {
            "phones": found.phones.phones,
            "words": [[word.text, word.first, word.last] for word in found.words],
            "confidence": found.confidence,
        }
        write_tensors(cached, ALIGNMENT_KIND, ALIGNMENT_VERSION, {"edges": found.phones.edges}, header)
        return AlignedSpeech(found.phones, found.words, found.confidence, sound, words is None)

    def _recognise_spans(self, video: Path, spans: Sequence[Span]) -> list[list[tuple[str, ...]]]:
        """Recognised phones of the words in each span, from the cache if available."""
        whole, clean = self._read(video)
        kind = f"{RECOGNITION_VERSION}{'' if clean is whole else SUPPRESSED}"
        cached = self._cache / f"{content_key(video)}-{kind}.{RECOGNITION_KIND}"
        stored = read_kept(cached, RECOGNITION_KIND, RECOGNITION_VERSION, lambda _, header: header["words"])
        if stored is not None and len(stored) == len(spans):
            return [[tuple(word) for word in words] for words in stored]
        found = [list(self._recognise_words(cut_sound(clean, span))) for span in spans]
        write_tensors(cached, RECOGNITION_KIND, RECOGNITION_VERSION, {"spans": np.array(spans)}, {"words": found})
        return found

    def _recognise_words(self, sound: Waveform) -> tuple[tuple[str, ...], ...]:
        from tts2face.sound.listener import MAX_SOUND_S, PhoneRecogniser

        self._recogniser = self._recogniser or PhoneRecogniser()
        parts = [cut_sound(sound, span) for span in cut_at_pauses(sound, MAX_SOUND_S)]
        return tuple(word for part in parts for word in self._recogniser.words(part))


def _read_cached_alignment(cached: Path, sound: Waveform, *, is_recognised: bool) -> AlignedSpeech | None:
    """The cached alignment; None if it is missing or damaged."""

    def build(arrays: Mapping[str, NDArray[Any]], header: Mapping[str, Any]) -> AlignedSpeech:
        words = tuple(WordSpan(text, first, last) for text, first, last in header["words"])
        phones = PhoneSequence(header["phones"], arrays["edges"])
        return AlignedSpeech(phones, words, float(header["confidence"]), sound, is_recognised)

    return read_kept(cached, ALIGNMENT_KIND, ALIGNMENT_VERSION, build)
