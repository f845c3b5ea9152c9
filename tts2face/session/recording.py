"""Lip motion for recorded speech, by forced alignment of its transcript or by an audio map.

Long recordings are read in blocks, once each for their level, their features and the sound of the clips, so that memory
use is bounded.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lexicon.dictionary import Dictionary
from lexicon.errors import DataError, InputError
from lexicon.ipa import IpaPhone
from lexicon.sequence import SILENCE, PhoneSequence, WordSpan
from tts2face.lips.explanation import PhoneExplanation
from tts2face.models.audio_map import AudioMap
from tts2face.models.talker import Talker, speech_channels
from tts2face.numeric.arrays import interpolate_cubic
from tts2face.sound.alignment import TextMismatch
from tts2face.sound.features import FEATURE_RATE
from tts2face.sound.listener import StreamingFeatures
from tts2face.sound.pauses import speech_level
from tts2face.sound.transcript import align_recording, pronounce_transcript, recognise_phones
from tts2face.source_options import RECOGNISED
from tts2face.types import (
    SOUND_RATE,
    Clip,
    Progress,
    Speech,
    Trajectory,
    Waveform,
    first_sample,
    frame_count,
    ignore_progress,
)
from tts2face.video.media import sound_blocks

MAX_CLIP_FRAMES = 300  # frames of each clip into which a recording is divided
MIN_RECORDING_S = 0.1  # shorter recordings contain no phone
SILENCE_LEVEL = 1e-4  # peak amplitude, relative to full scale, below which a recording counts as silent
DEFAULT_AUDIO_MAPS = ("voices", "network")  # the first that a talker has


@dataclass(frozen=True, slots=True, eq=False)
class TimedTranscript:
    """Phones and words of a recording with their times; a single silence if the words are unknown.

    ``mismatches`` are spans in which the recording probably contains other words; ``gain`` brings its sound to the
    level of an audio map.
    """

    phones: PhoneSequence
    words: tuple[WordSpan, ...]
    mismatches: tuple[TextMismatch, ...] = ()
    gain: float = 1.0

    @property
    def duration(self) -> float:
        """Duration in seconds."""
        return self.phones.end

    def with_confidence(self, phone: PhoneExplanation) -> PhoneExplanation:
        """The explanation of a phone with the confidence of its word."""
        at = self.phones.index_at((phone.start + phone.end) / 2)
        sure = next((word.confidence for word in self.words if word.first <= at < word.last), 1.0)
        return replace(phone, confidence=sure)


def select_audio_map(name: str | None, talker: Talker) -> AudioMap:
    """Audio map of a talker by its name; None: the first of `DEFAULT_AUDIO_MAPS` that it has."""
    name = name or next((known for known in DEFAULT_AUDIO_MAPS if known in talker.audio_maps), DEFAULT_AUDIO_MAPS[-1])
    if name == RECOGNISED:
        raise InputError(
            "phones are recognised in whole recordings; for live sound choose the audio map voices, network or linear"
        )
    if name not in talker.audio_maps:
        raise InputError(
            f"the talker {talker.metadata.get('name', '')} has no {name} audio map because its recordings were too few "
            "to learn one; leave out --audio-map, or choose another talker"
        )
    return talker.audio_maps[name]


def align_transcript(
    text: str,
    language: str,
    path: Path,
    dictionary: Mapping[str, tuple[IpaPhone, ...]],
    on_progress: Progress = ignore_progress,
) -> TimedTranscript:
    """Align a text with a recording of it; `dictionary` holds the user's pronunciations by `word_key`."""
    words = pronounce_transcript(text, language, Dictionary(dictionary) if dictionary else None)
    return TimedTranscript(*align_recording(_sound_of(path), words, on_progress))


def recognise_transcript(path: Path, on_progress: Progress = ignore_progress) -> TimedTranscript:
    """Phones that are heard in a recording; its words are not known."""
    return TimedTranscript(recognise_phones(_sound_of(path), on_progress), ())


def _sound_of(path: Path) -> Waveform:
    return Waveform(np.concatenate(list(_read_audible_blocks(path))), FEATURE_RATE)


def map_audio_to_motion(
    path: Path, audio_map: AudioMap, talker: Talker, fps: float
) -> tuple[TimedTranscript, Trajectory]:
    """Speech parameters (T, S) of a recording without a transcript, at `fps` frames per second.

    Raises
    ------
    InputError, DataError
        The recording cannot be read, is silent or too short.
    """
    heard = measure_recording(path, audio_map)
    return heard, mapped_motion(path, audio_map, talker, fps, heard)


def measure_recording(path: Path, audio_map: AudioMap) -> TimedTranscript:
    """Duration of a recording and its gain for an audio map; errors as `map_audio_to_motion`."""
    levels, duration = _features(path, "level", audio_map.fps, 1.0)
    silence = PhoneSequence([SILENCE], [0.0, duration])
    return TimedTranscript(
        silence, (), gain=audio_map.gain_for(speech_level(levels, 1.0 / audio_map.fps, is_recording=True))
    )


def mapped_motion(path: Path, audio_map: AudioMap, talker: Talker, fps: float, heard: TimedTranscript) -> Trajectory:
    """Speech parameters of a recording that is measured; as `map_audio_to_motion`."""
    features, duration = _features(path, audio_map.feature, audio_map.fps, heard.gain)
    lips = resample_motion(audio_map.parameters(features), audio_map.fps, fps, frame_count(duration, fps))
    return Trajectory(speech_channels(talker.model), lips, fps)


def _features(path: Path, kind: str, fps: float, gain: float) -> tuple[NDArray[np.float32], float]:
    """(T, D) features of a recording multiplied by `gain`, and its duration in seconds."""
    stream = StreamingFeatures(kind, fps)
    features = [stream.add_samples(np.clip(gain * block, -1.0, 1.0)) for block in _read_audible_blocks(path)]
    return np.concatenate([*features, stream.finish()]), stream.n_samples / FEATURE_RATE


def resample_motion(values: NDArray[np.float32], rate: float, fps: float, n_frames: int) -> NDArray[np.float32]:
    """Resample (T, D) values at `rate` Hz to (n_frames, D) values at `fps` Hz; the last value is held."""
    return interpolate_cubic(values, np.minimum(np.arange(n_frames) / fps * rate, len(values) - 1))


def clip_bounds(n_frames: int, fps: Fraction, rate: int) -> Iterator[tuple[int, int, int, int]]:
    """First frame, frame after the last, and the same of samples, of clips of at most `MAX_CLIP_FRAMES` frames."""
    for first in range(0, n_frames, MAX_CLIP_FRAMES):
        last = min(first + MAX_CLIP_FRAMES, n_frames)
        yield first, last, first_sample(first, rate, fps), first_sample(last, rate, fps)


def recording_clips(
    path: Path, transcript: TimedTranscript, n_frames: int, fps: Fraction, *, volume: float
) -> Iterator[Clip]:
    """Divide a recording into clips of at most `MAX_CLIP_FRAMES` frames, each with its phones and the face at rest."""
    sound = _SampleReader(sound_blocks(path, SOUND_RATE))
    first = 0
    while first < n_frames:
        last = _last_frame(first, n_frames, transcript.phones, fps)
        start, end = first_sample(first, SOUND_RATE, fps), first_sample(last, SOUND_RATE, fps)
        samples = np.clip(volume * sound.next(end - start), -1.0, 1.0)
        seconds = (float(Fraction(first) / fps), len(samples) / SOUND_RATE)
        phones, words = _phones_within(transcript, *seconds)
        yield Clip.at_rest(
            last - first, float(fps), Speech(Waveform(samples, SOUND_RATE), phones, words, is_recorded=True)
        )
        first = last


def _last_frame(first: int, n_frames: int, phones: PhoneSequence, fps: Fraction) -> int:
    """Frame after the clip that begins at a frame: the last one that is allowed and in a silence, so in no word."""
    longest = min(first + MAX_CLIP_FRAMES, n_frames)
    if longest == n_frames:
        return longest
    frames = np.arange(longest, first + MAX_CLIP_FRAMES // 2, -1)
    within = np.searchsorted(phones.edges, frames / float(fps), side="right") - 1
    labels = [phones.phones[min(at, len(phones) - 1)] for at in within.tolist()]
    return int(frames[labels.index(SILENCE)]) if SILENCE in labels else longest


def _phones_within(
    transcript: TimedTranscript, start: float, duration: float
) -> tuple[PhoneSequence, tuple[WordSpan, ...]]:
    """Phones of a time span, relative to its start, and the words whose first phone lies in the span."""
    edges = transcript.phones.edges - start
    inside = [at for at in range(len(transcript.phones)) if edges[at] < duration - 1e-6 and edges[at + 1] > 1e-6]
    if not inside:  # after the end of the sound
        return PhoneSequence([SILENCE], [0.0, duration]), ()
    first, last = inside[0], inside[-1] + 1
    cut = edges[first : last + 1].copy()
    cut[0], cut[-1] = 0.0, duration
    words = tuple(
        replace(word.shift(-first), last=min(word.last, last) - first)
        for word in transcript.words
        # a word belongs to the clip in which it begins
        if first <= word.first < last and edges[word.first] > -1e-6  # else it began in the span before
    )
    return PhoneSequence(transcript.phones.phones[first:last], cut), words


class _SampleReader:
    """Sequential reader of sound blocks; returns silence after their end."""

    def __init__(self, blocks: Iterator[NDArray[np.float32]]) -> None:
        self._blocks, self._rest = blocks, np.zeros(0, np.float32)

    def next(self, n_samples: int) -> NDArray[np.float32]:
        """The next `n_samples` samples."""
        parts, n = [self._rest], len(self._rest)
        while n < n_samples and (block := next(self._blocks, None)) is not None:
            parts.append(block)
            n += len(block)
        whole = np.concatenate([*parts, np.zeros(max(n_samples - n, 0), np.float32)])
        self._rest = whole[n_samples:]
        return whole[:n_samples]


def _read_audible_blocks(path: Path) -> Iterator[NDArray[np.float32]]:
    """Yield blocks of a recording at `FEATURE_RATE`; DataError after the last one if it is silent or too short."""
    n_samples, peak = 0, 0.0
    for block in sound_blocks(path, FEATURE_RATE):
        n_samples += len(block)
        peak = max(peak, float(np.abs(block).max(initial=0.0)))
        yield block
    if n_samples < MIN_RECORDING_S * FEATURE_RATE:
        raise DataError(
            f"{path} lasts {n_samples / FEATURE_RATE:.3f} s; give a recording of {MIN_RECORDING_S} s or more"
        )
    if peak < SILENCE_LEVEL:
        loudest = f"no sample is above {20 * np.log10(SILENCE_LEVEL):.0f} dB of full scale in any channel"
        raise DataError(f"{path} is silent: {loudest}; check the microphone, or give another recording")
