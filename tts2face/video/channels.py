"""One channel from all channels and tracks of a recording: which of them it holds, and at which level.

Channels are added by the weights of ITU-R BS.775-3, annex 4, and the sum is brought to the level of the loudest one:
a voice in the centre, on one side or on both sides keeps the level that it has. Channels that cancel each other, as
where one is wired inversely, are not added: the loudest one is taken alone. Of tracks the first with speech is taken.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from tts2face.numeric.arrays import FloatArray

if TYPE_CHECKING:
    from av.audio.frame import AudioFrame

FRONT, SURROUND = 0.5**0.5, 0.5  # weights beside a centre of 1 (BS.775-3, annex 4)
WEIGHTS = {
    "FC": 1.0, "FL": FRONT, "FR": FRONT, "FLC": FRONT, "FRC": FRONT, "DL": FRONT, "DR": FRONT, "WL": FRONT, "WR": FRONT,
    "BIL": FRONT, "BIR": FRONT, "AMBI0": 1.0, "LFE": 0.0, "LFE2": 0.0,
}  # fmt: skip
DIRECTIONS = "AMBI"  # channels of Ambisonics but the first are differences of directions
CANCELLED = 0.25  # of the power that channels have together: what their sum keeps if they correlate by less than -.75
EQUAL = 0.99  # of the largest power: channels that are inverted copies differ by rounding
LEVEL_S = 0.02  # of a window whose level counts
LOUD_S = 0.5  # which the level of a track is exceeded for in all
SILENCE_DB = 60.0  # below that level: no sound of a track
HEARD_DB = -80.0  # of full scale: softer are dither and the noise of a converter
SOFTER_DB = 40.0  # below the loudest track: what a microphone that is off picks up, no speech
STEADY_DB = 8.0  # range of levels below which a track is hum or noise: noise has 5 in windows of 20 ms, speech 20
CERTAIN_DB = -45.0  # of full scale: no track is so much louder that this one is none
DIGITS = 6  # of weights: equal channels get equal ones, whatever the last bit of their powers is


@dataclass(frozen=True, slots=True, eq=False)
class ChannelMix:
    """Weights (C,) of the channels of a recording.

    `taken` is the number of the channel that stands for all, from 1, where they cancel each other; 0 otherwise. `track`
    is the index of the sound track, the first one with speech, of `n_tracks`; `passed` says what those before it are.
    """

    weights: FloatArray
    taken: int = 0
    is_silent: bool = False
    track: int = 0
    n_tracks: int = 1
    passed: str = "silent"

    def note(self, name: str) -> str:
        """A sentence for the user about what is guessed of the channels of a file; empty where nothing is."""
        track = (
            f"sound track {self.track + 1} of {self.n_tracks} of {name} is taken, as what precedes it is {self.passed}"
            "; give a file with one track to use another one"
        )
        cancelled = (
            f"the {len(self.weights)} channels of {name} cancel each other, as one is inverted: channel {self.taken} "
            "is taken alone; give a file with one channel to use another one"
        )
        return "; ".join([track] * (self.track > 0) + [cancelled] * (self.taken > 0))

    def mono(self, frame: "AudioFrame") -> NDArray[np.float32]:
        """(n,) samples of one channel from a decoded frame."""
        samples = channel_samples(frame)
        # channels may come or go in the middle of a broadcast
        mixed = self.weights @ samples if len(samples) == len(self.weights) else samples.mean(axis=0)
        found: NDArray[np.float32] = mixed.astype(np.float32)
        return found


@dataclass(frozen=True, slots=True)
class TrackLevel:
    """Level of a track in dB of full scale, -inf of silence, and the range of the levels of what sounds in it in dB."""

    level_db: float
    range_db: float

    @property
    def is_silent(self) -> bool:
        """Whether nothing sounds in it."""
        return self.level_db == -np.inf

    def has_speech(self, loudest_db: float = -np.inf) -> bool:
        """Whether it can be speech, beside a track of a level."""
        return self.range_db >= STEADY_DB and self.level_db > max(HEARD_DB, loudest_db - SOFTER_DB)

    @property
    def is_certain(self) -> bool:
        """Whether it can be speech beside any other track."""
        return self.has_speech() and self.level_db > CERTAIN_DB


def choose_track(levels: Sequence[TrackLevel]) -> tuple[int, str]:
    """Index of the first track with speech, or else of the first one with sound, and what those before it are."""
    loudest = max(level.level_db for level in levels)
    spoken = [at for at, level in enumerate(levels) if level.has_speech(loudest)]
    chosen = (spoken or [at for at, level in enumerate(levels) if not level.is_silent] or [0])[0]
    is_silent = all(level.is_silent for level in levels[:chosen])
    return chosen, "silent" if is_silent else "noise without speech"


class ChannelMeter:
    """Measures the channels of a recording from all its frames."""

    def __init__(self) -> None:
        self._products: FloatArray = np.zeros((0, 0))
        self._names: tuple[str, ...] = ()
        self._powers: list[FloatArray] = []

    def add(self, frame: "AudioFrame") -> None:
        """Count the next frame."""
        samples = channel_samples(frame)
        if not len(self._products):
            self._names = tuple(channel.name for channel in frame.layout.channels)
            self._products = np.zeros((len(samples), len(samples)))
        if not samples.shape[1]:
            return
        samples = samples - samples.mean(axis=1, keepdims=True)  # a constant offset is no sound
        if len(samples) == len(self._products):
            self._products += samples @ samples.T
        power, window = np.square(samples).max(axis=0), max(round(LEVEL_S * frame.sample_rate), 1)
        starts = np.arange(0, max(len(power) - window // 2, 1), window)  # what is left over is no window
        self._powers.append(np.add.reduceat(power, starts) / np.diff([*starts, len(power)]))

    def mix(self) -> ChannelMix:
        """The mix of the frames that are added."""
        return mix_of_products(self._products, self._names)

    def level(self) -> TrackLevel:
        """The level of the frames that are added."""
        powers = np.sort(np.concatenate(self._powers or [np.zeros(1)]))
        if not powers[-1] > 0:
            return TrackLevel(-np.inf, 0.0)
        levels = 10.0 * np.log10(np.maximum(powers, 1e-30))
        loudest = float(levels[-min(round(LOUD_S / LEVEL_S), (len(levels) + 1) // 2)])
        # of a track that is silent for the most part
        loudest = max(loudest, float(levels[-1]) - SILENCE_DB)
        sounding = levels[levels > loudest - SILENCE_DB]
        low, high = np.quantile(sounding, (0.05, 0.95))
        return TrackLevel(loudest, float(high - low))


def mix_of_products(products: FloatArray, names: Sequence[str]) -> ChannelMix:
    """The mix of channels.

    Parameters
    ----------
    products : (C, C)
        Sums of the products of each two channels; on the diagonal their powers.
    names
        C names as FFmpeg has them; channels without a place have equal weights.
    """
    powers = np.diag(products)
    weights = _weights_of(names)
    if not (weights @ powers) > 0:  # only what a layout leaves out, or nothing, has sound
        weights = np.full(len(powers), FRONT)
    heard = np.where(weights > 0, powers, 0.0)
    loudest = float(heard.max(initial=0.0))
    if loudest <= 0:
        return ChannelMix(np.full(len(powers), 1.0 / max(len(powers), 1)), is_silent=True)
    mixed = float(weights @ products @ weights)
    if mixed < CANCELLED * float(np.square(weights) @ powers):
        taken = int(np.argmax(heard >= EQUAL * loudest))
        return ChannelMix(np.eye(len(powers))[taken], taken + 1)
    return ChannelMix(np.round(weights * np.sqrt(loudest / mixed), DIGITS))


def _weights_of(names: Sequence[str]) -> FloatArray:
    """Weights (C,) of the channels of a layout; of all channels alike where it names no place."""
    if not any(name in WEIGHTS for name in names):
        return np.full(len(names), FRONT)
    # whatever else a layout has is beside, behind, above or below the listener
    others = {name: 0.0 if name.startswith(DIRECTIONS) else SURROUND for name in names}
    return np.array([(others | WEIGHTS)[name] for name in names])


def channel_samples(frame: "AudioFrame") -> FloatArray:
    """(C, n) samples of a decoded frame, full scale from -1 to 1."""
    samples: NDArray[Any] = frame.to_ndarray()
    if not frame.format.is_planar:
        samples = samples.reshape(-1, frame.layout.nb_channels).T
    found = samples.astype(np.float64)
    if samples.dtype == np.uint8:
        return (found - 128.0) / 128.0
    if np.issubdtype(samples.dtype, np.integer):
        return found / -float(np.iinfo(samples.dtype).min)
    return found
