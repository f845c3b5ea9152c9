"""Data types shared by all packages: waveform, trajectory, speech and clip, and the clock of frames and samples.

Units: seconds, millimetres, radians. Frame i is the instant i / fps.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lexicon.errors import InputError
from lexicon.sequence import SILENCE, PhoneSequence, WordSpan, concatenate_phones
from lexicon.values.checks import check_limits, check_type
from lexicon.values.fields import check_fields
from tts2face.numeric.arrays import interpolate_columns
from tts2face.request import FPS_LIMITS

MAX_RATE_HZ = 1e6  # of samples or frames; the fastest converters of sound have 768 kHz
SOUND_RATE = 48_000  # Hz, of clips and films; the usual rate of players and editors, required by Opus
HEAD_CHANNELS = ("pitch", "yaw", "roll", "x", "y", "z")  # radians (nod down, turn to own left, tilt) and mm
Progress = Callable[[int, int], None]  # number of finished steps, number of all steps
StageCallback = Callable[[str], Progress]  # name of a stage -> its progress callback
YieldTurn = Callable[[], None]  # called between the steps of a computation, so that another one can run
NTSC_NOMINAL_RATES = (24, 30, 48, 60, 120)  # nominal rates whose broadcast form is 1000/1001 of them (SMPTE 12M)


def frame_count(duration_s: float, fps: float) -> int:
    """Smallest number of frames that covers a duration in seconds, at least 1.

    All conversions from seconds to frame counts use this function. An excess of up to 0.01 frames counts as rounding,
    since durations are multiples of the sampling interval.
    """
    return max(1, math.ceil(duration_s * fps - 0.01))


def _checked_read_only(values: ArrayLike, what: str, ndim: int) -> NDArray[np.float32]:
    try:
        array = np.array(values, dtype=np.float32)
    except (TypeError, ValueError) as wrong:
        raise InputError(f"{what} must be numbers ({wrong})") from wrong
    if array.ndim != ndim:
        raise InputError(f"{what} must have {ndim} dimension(s), not shape {array.shape}")
    if not np.isfinite(array).all():
        raise InputError(f"{what} must be finite; it holds NaN or infinity")
    array.setflags(write=False)
    return array


def keep_on() -> None:
    """Yield to nothing: `YieldTurn` of a computation that runs alone."""


def ignore_progress(_done: int, _of: int) -> None:
    """Report to nobody: `Progress` of a computation that nobody watches."""


def ignore_stage(_name: str) -> Progress:
    """`StageCallback` of a computation that nobody watches."""
    return ignore_progress


@dataclass(frozen=True, slots=True)
class Chunk:
    """A part of a file that is sent while it is made: its bytes, often none, and the seconds of the clip it adds."""

    content: bytes
    seconds: float = 0.0


@dataclass(frozen=True, slots=True, eq=False)
class Waveform:
    """Mono sound.

    Parameters
    ----------
    samples : (n,)
        Finite float32 values in [-1, 1].
    rate
        Sample rate in Hz.

    Raises
    ------
    InputError
        The samples are not a finite vector in [-1, 1], or the rate is not above 0 and at most `MAX_RATE_HZ`.
    """

    samples: NDArray[np.float32]
    rate: int

    def __init__(self, samples: ArrayLike, rate: int) -> None:
        locked = _checked_read_only(samples, "samples", 1)
        if not 0 < check_type("rate", rate, float) <= MAX_RATE_HZ:
            raise InputError(f"a waveform's rate must be above 0 and at most {MAX_RATE_HZ:g} Hz, not {rate:g}")
        if locked.size and float(np.abs(locked).max()) > 1.0:
            raise InputError(f"samples must lie in [-1, 1]; the largest is {float(np.abs(locked).max()):.3f}")
        object.__setattr__(self, "samples", locked)
        object.__setattr__(self, "rate", int(rate))

    @property
    def duration(self) -> float:
        """Duration in seconds."""
        return len(self.samples) / self.rate

    def part(self, first: int, last: int) -> "Waveform":
        """Samples from index `first` up to `last`, or up to the end of the sound."""
        return Waveform(self.samples[first:last], self.rate)

    def padded(self, n_samples: int) -> "Waveform":
        """The sound, followed by silence up to at least `n_samples` samples."""
        samples = np.zeros(max(n_samples, len(self.samples)), np.float32)
        samples[: len(self.samples)] = self.samples
        return Waveform(samples, self.rate)

    def resampled(self, rate: int) -> "Waveform":
        """The sound at `rate` Hz, clipped to full scale.

        Source: soxr, quality HQ (De Jong, the SoX resampler library).
        """
        if rate == self.rate:
            return self
        import soxr

        return Waveform(np.clip(soxr.resample(self.samples, self.rate, rate), -1.0, 1.0), rate)


@dataclass(frozen=True, slots=True, eq=False)
class Trajectory:
    """Named channels over time.

    Parameters
    ----------
    channels
        D different names.
    values : (T, D)
        Finite float32 values; row i belongs to the time i / fps.
    fps
        Frames per second.

    Raises
    ------
    InputError
        The values are not a finite matrix with one column for each channel, names repeat, or `fps` is not above 0
        and at most `MAX_RATE_HZ`.
    """

    channels: tuple[str, ...]
    values: NDArray[np.float32]
    fps: float

    def __init__(self, channels: Sequence[str], values: ArrayLike, fps: float) -> None:
        locked = _checked_read_only(values, "trajectory values", 2)
        if len(set(channels)) != len(channels):
            raise InputError("trajectory channels must have different names")
        if locked.shape[1] != len(channels):
            raise InputError(f"{len(channels)} channels need {len(channels)} columns, not {locked.shape[1]}")
        if not 0 < check_type("fps", fps, float) <= MAX_RATE_HZ:
            raise InputError(f"frames per second must be above 0 and at most {MAX_RATE_HZ:g}, not {fps}")
        object.__setattr__(self, "channels", tuple(channels))
        object.__setattr__(self, "values", locked)
        object.__setattr__(self, "fps", float(fps))

    def __len__(self) -> int:
        """Return the number of frames."""
        return len(self.values)

    @property
    def duration(self) -> float:
        """Duration in seconds."""
        return len(self) / self.fps

    @property
    def times(self) -> NDArray[np.float64]:
        """(T,) seconds of the frames."""
        return np.arange(len(self)) / self.fps

    def columns(self, names: Sequence[str]) -> NDArray[np.float32]:
        """Values (T, N) of N channels."""
        return self.values[:, [self.channels.index(name) for name in names]]

    def part(self, first: int, last: int) -> "Trajectory":
        """Frames from index `first` up to `last`, or up to the end."""
        return Trajectory(self.channels, self.values[first:last], self.fps)

    def at(self, seconds: NDArray[np.float64]) -> NDArray[np.float32]:
        """Values (N, D) at N seconds, linear between frames; constant before and after."""
        return interpolate_columns(self.values, self.times, seconds).astype(np.float32)


def resting_head(n_frames: int, fps: float) -> Trajectory:
    """Head pose (`n_frames`, 6) of a head that does not move: all zeros."""
    return Trajectory(HEAD_CHANNELS, np.zeros((n_frames, len(HEAD_CHANNELS)), np.float32), fps)


@dataclass(frozen=True, slots=True, eq=False)
class Speech:
    """Synthesised or recorded speech: sound with its phones and words.

    ``phones`` starts at 0 s and ends at the duration of the sound, exact to half a sample. ``is_recorded``: the
    sound is that of a recording, which files say.

    Raises
    ------
    InputError
        A part has another type, the phones do not cover the sound, or a word reaches beyond the last phone.
    """

    waveform: Waveform
    phones: PhoneSequence
    words: tuple[WordSpan, ...]
    is_recorded: bool = False

    def __post_init__(self) -> None:
        """Reject other types, phones that do not cover the sound exactly, and words beyond the phones."""
        check_fields(self)
        if self.phones.start != 0.0 or abs(self.phones.end - self.waveform.duration) > 0.5 / self.waveform.rate:
            raise InputError(
                f"phones cover {self.phones.start}-{self.phones.end} s but the sound lasts {self.waveform.duration} s"
            )
        if any(word.last > len(self.phones) for word in self.words):
            raise InputError("a word reaches beyond the last phone")

    @classmethod
    def without_phones(cls, sound: Waveform) -> "Speech":
        """Sound whose phones are not known, or that has none: it is one silence."""
        return cls(sound, PhoneSequence([SILENCE], [0.0, sound.duration]), ())


@dataclass(frozen=True, slots=True, eq=False)
class Clip:
    """Motion, head pose and speech of a face on a common time axis.

    Parameters
    ----------
    motion : (T, K)
        Weights of the face's named shapes.
    head : (T, 6)
        `HEAD_CHANNELS`, relative to the face at rest.
    speech
        Sound, phones and words; the T frames cover the sound and exceed it by less than one frame.

    Raises
    ------
    InputError
        A part has another type, they differ in frame rate or length, or the head pose has other channels.
    """

    motion: Trajectory
    head: Trajectory
    speech: Speech

    def __post_init__(self) -> None:
        """Reject other types, and parts that differ in frame rate or length."""
        check_fields(self)
        if self.head.channels != HEAD_CHANNELS:
            raise InputError(f"head pose needs the channels {HEAD_CHANNELS}, not {self.head.channels}")
        if (len(self.motion), self.motion.fps) != (len(self.head), self.head.fps):
            raise InputError("face motion and head pose must have the same frames")
        expected = frame_count(self.speech.waveform.duration, self.motion.fps)
        if len(self.motion) != expected:
            raise InputError(f"the sound needs {expected} frames, the motion has {len(self.motion)}")

    @classmethod
    def at_rest(cls, n_frames: int, fps: float, speech: Speech) -> "Clip":
        """Speech of a face that has no channels and does not move its head."""
        return cls(Trajectory((), np.zeros((n_frames, 0), np.float32), fps), resting_head(n_frames, fps), speech)

    @property
    def fps(self) -> float:
        """Frames per second."""
        return self.motion.fps


def concatenate_speech(parts: Sequence[Speech]) -> Speech:
    """Concatenate speech in time.

    Raises
    ------
    InputError
        The sample rates differ.
    """
    rate = parts[0].waveform.rate
    if any(part.waveform.rate != rate for part in parts):
        raise InputError("speech of different sample rates cannot be concatenated; resample it first")
    phones, words = concatenate_phones([part.phones for part in parts], [part.words for part in parts])
    samples = np.concatenate([part.waveform.samples for part in parts])
    edges = phones.edges.copy()
    edges[-1] = len(samples) / rate
    is_recorded = any(part.is_recorded for part in parts)
    return Speech(Waveform(samples, rate), PhoneSequence(phones.phones, edges), words, is_recorded)


def concatenate_clips(clips: Sequence[Clip]) -> Clip:
    """Concatenate clips in time; all but the last must end on a frame, as those of `Session.stream` do."""
    first = clips[0]
    motion = np.concatenate([clip.motion.values for clip in clips])
    head = np.concatenate([clip.head.values for clip in clips])
    return Clip(
        replace(first.motion, values=motion),
        replace(first.head, values=head),
        concatenate_speech([clip.speech for clip in clips]),
    )


def exact_rate(fps: float) -> Fraction:
    """Frame rate as an exact fraction; 23.976, 29.97, 59.94 and the like become multiples of 1000/1001.

    Raises
    ------
    InputError
        The rate lies outside `FPS_LIMITS`.
    """
    check_limits("fps", fps, FPS_LIMITS)
    for nominal in NTSC_NOMINAL_RATES:
        if abs(fps - nominal * 1000 / 1001) < 0.006:
            return Fraction(nominal * 1000, 1001)
    return Fraction(fps).limit_denominator(1000)


def first_sample(frame: int, rate: int, fps: Fraction) -> int:
    """Index of the audio sample, at `rate` Hz, that coincides with the start of a frame."""
    return round(Fraction(frame) * rate / fps)
