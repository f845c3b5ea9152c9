"""One channel from all channels of a recording: which of them it holds, and at which level.

Channels are added by the weights of ITU-R BS.775-3, annex 4, and the sum is brought to the level of the loudest one:
a voice in the centre, on one side or on both sides keeps the level that it has. Channels that cancel each other, as
where one is wired inversely, are not added: the loudest one is taken alone.
"""

from collections.abc import Iterable, Sequence
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
DIGITS = 6  # of weights: equal channels get equal ones, whatever the last bit of their powers is


@dataclass(frozen=True, slots=True, eq=False)
class ChannelMix:
    """Weights (C,) of the channels of a recording.

    `taken` is the number of the channel that stands for all, from 1, where they cancel each other; 0 otherwise. `track`
    is the index of the sound track, the first one that is not silent, of `n_tracks`.
    """

    weights: FloatArray
    taken: int = 0
    is_silent: bool = False
    track: int = 0
    n_tracks: int = 1

    def note(self, name: str) -> str:
        """A sentence for the user about what is guessed of the channels of a file; empty where nothing is."""
        track = (
            f"sound track {self.track + 1} of {self.n_tracks} of {name} is taken, as what precedes it is silent; "
            "give a file with one track to use another one"
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


def choose_mix(frames: Iterable["AudioFrame"]) -> ChannelMix:
    """The mix of a recording, from all its frames."""
    products: FloatArray = np.zeros((0, 0))
    names: tuple[str, ...] = ()
    for frame in frames:
        samples = channel_samples(frame)
        if not len(products):
            names = tuple(channel.name for channel in frame.layout.channels)
            products = np.zeros((len(samples), len(samples)))
        if len(samples) == len(products) and samples.shape[1]:
            samples = samples - samples.mean(axis=1, keepdims=True)  # a constant offset is no sound
            products += samples @ samples.T
    return mix_of_products(products, names)


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
