"""A recording of a voice drives the lips: by its words where they are known, else by its sound alone.

Long recordings are read in blocks, once for their loudness, once for their features and once for the sound of the
clips, so that memory stays small.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lexicon.dictionary import read_dictionary
from lexicon.errors import DataError, InputError
from lexicon.sequence import SILENCE, PhoneSequence, WordSpan
from tts2face.clock import exact_rate, first_sample
from tts2face.interpolation import interpolate_cubic
from tts2face.models.audio_map import AudioMap
from tts2face.models.talker import Talker, speech_channels
from tts2face.request import Request
from tts2face.speech.features import FEATURE_RATE, speech_level
from tts2face.speech.streaming_listener import StreamingFeatures
from tts2face.speech.text_fit import TextMismatch
from tts2face.speech.transcript_alignment import align_recording, pronounce_transcript
from tts2face.types import HEAD_CHANNELS, Clip, Speech, Trajectory, Waveform, frame_count
from tts2face.video.media import sound_blocks

CLIP_RATE = 48_000  # Hz, of the sound in the clip
MAX_CLIP_FRAMES = 300  # of the clips that a long recording is given on in
MIN_RECORDING_S = 0.1  # shorter sounds hold no phone
SILENCE_LEVEL = 1e-4  # of full scale: nobody is heard below
DEFAULT_AUDIO_MAP = "network"


@dataclass(frozen=True, slots=True, eq=False)
class TimedTranscript:
    """What a recording says: its phones and words on its own clock; one silence where the words are not known.

    ``mismatches`` are the spans in which it probably says something else.
    """

    phones: PhoneSequence
    words: tuple[WordSpan, ...]
    mismatches: tuple[TextMismatch, ...] = ()

    @property
    def duration(self) -> float:
        """Seconds."""
        return self.phones.end


def select_audio_map(request: Request, talker: Talker) -> AudioMap:
    """The drive that a request asks for, the talker's best by default.

    Raises
    ------
    InputError
        The talker was learnt without it.
    """
    name = request.drive or DEFAULT_AUDIO_MAP
    if name not in talker.audio_maps:
        raise InputError(
            f"the talker {talker.metadata.get('name', '')} has no {name} drive, for it was learnt with too little "
            "sound; say what is spoken with --text, or choose another talker"
        )
    return talker.audio_maps[name]


def align_transcript(request: Request, path: Path) -> TimedTranscript:
    """Phones and words of a recording whose words are in the request.

    Raises
    ------
    InputError, DataError
        The recording cannot be read, is silent or too short, or does not hold the words.
    BackendError
        It is longer than a minute, and nothing on this machine recognises phones.
    """
    own = read_dictionary(request.dictionary) if request.dictionary else None
    words = pronounce_transcript(request.text, request.language, own)
    sound = Waveform(np.concatenate(list(_read_audible_blocks(path))), FEATURE_RATE)
    return TimedTranscript(*align_recording(sound, words, is_english=request.language.startswith("en")))


def map_audio_to_motion(path: Path, drive: AudioMap, talker: Talker, fps: float) -> tuple[TimedTranscript, Trajectory]:
    """A recording whose words are not known, and the lips that go with its sound, at any frame rate.

    Raises
    ------
    InputError, DataError
        The recording cannot be read, is silent or too short.
    """
    levels, _ = _features(path, "level", talker.fps, 1.0)
    gain = drive.gain_for(speech_level(levels))
    features, duration = _features(path, drive.feature, talker.fps, gain)
    lips = resample_motion(drive.parameters(features), talker.fps, fps, frame_count(duration, fps))
    phones = PhoneSequence([SILENCE], [0.0, duration])
    return TimedTranscript(phones, ()), Trajectory(speech_channels(talker.model), lips, fps)


def _features(path: Path, kind: str, fps: float, gain: float) -> tuple[NDArray[np.float32], float]:
    """(T, D) features of a recording made louder by a factor, and its seconds."""
    ear = StreamingFeatures(kind, fps)
    found = [ear.hear(np.clip(gain * block, -1.0, 1.0)) for block in _read_audible_blocks(path)]
    return np.concatenate([*found, ear.finish()]), ear.n_samples / FEATURE_RATE


def resample_motion(values: NDArray[np.float32], rate: float, fps: float, n_frames: int) -> NDArray[np.float32]:
    """(n_frames, D) values at another rate than (T, D) ones."""
    return interpolate_cubic(values, np.minimum(np.arange(n_frames) / fps * rate, len(values) - 1))


def recording_clips(path: Path, said: TimedTranscript, motion: Trajectory, *, volume: float) -> Iterator[Clip]:
    """A recording's motion and sound as clips of at most `MAX_CLIP_FRAMES` frames, each with its phones."""
    fps = exact_rate(motion.fps)
    sound = _SampleReader(sound_blocks(path, CLIP_RATE))
    for first in range(0, len(motion), MAX_CLIP_FRAMES):
        last = min(first + MAX_CLIP_FRAMES, len(motion))
        begin, end = (first_sample(frame, CLIP_RATE, fps) for frame in (first, last))
        samples = np.clip(volume * sound.next(end - begin), -1.0, 1.0)
        seconds = (float(Fraction(first) / fps), len(samples) / CLIP_RATE)
        phones, words = _phones_within(said, *seconds)
        head = np.zeros((last - first, len(HEAD_CHANNELS)), np.float32)
        yield Clip(
            Trajectory(motion.channels, motion.values[first:last], motion.fps),
            Trajectory(HEAD_CHANNELS, head, motion.fps),
            Speech(Waveform(samples, CLIP_RATE), phones, words),
        )


def _phones_within(said: TimedTranscript, begin: float, duration: float) -> tuple[PhoneSequence, tuple[WordSpan, ...]]:
    """Phones of a span of seconds, on its own clock, and the words that lie in it with their first phone."""
    edges = said.phones.edges - begin
    inside = [at for at in range(len(said.phones)) if edges[at] < duration - 1e-6 and edges[at + 1] > 1e-6]
    if not inside:  # behind the end of the sound
        return PhoneSequence([SILENCE], [0.0, duration]), ()
    first, last = inside[0], inside[-1] + 1
    cut = edges[first : last + 1].copy()
    cut[0], cut[-1] = 0.0, duration
    words = tuple(
        WordSpan(word.text, word.first - first, min(word.last, last) - first)
        for word in said.words
        if first <= word.first < last
    )
    return PhoneSequence(said.phones.phones[first:last], cut), words


class _SampleReader:
    """Sound that is read on and on; silence behind its end."""

    def __init__(self, blocks: Iterator[NDArray[np.float32]]) -> None:
        self._blocks, self._kept = blocks, np.zeros(0, np.float32)

    def next(self, n_samples: int) -> NDArray[np.float32]:
        """The next samples."""
        parts, n = [self._kept], len(self._kept)
        while n < n_samples and (block := next(self._blocks, None)) is not None:
            parts.append(block)
            n += len(block)
        whole = np.concatenate([*parts, np.zeros(max(n_samples - n, 0), np.float32)])
        self._kept = whole[n_samples:]
        return whole[:n_samples]


def _read_audible_blocks(path: Path) -> Iterator[NDArray[np.float32]]:
    """Blocks of a recording at `FEATURE_RATE`; refused at its end when nobody could be heard."""
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
        raise DataError(f"{path} is silent; check the microphone, or give another recording")
