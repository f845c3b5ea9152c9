"""What every voice does, and how one is chosen."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from lexicon.ipa import Segment
from tts2face.types import Speech

ENGLISH_CODES = ("en", "en-us", "en-gb")
VOICE_NAMES: Mapping[str, str] = {
    "heart": "neural, American English, female",
    "espeak": "formant synthesis, every language of espeak-ng",
    "espeak-female": "the same, female",
}


@dataclass(frozen=True, slots=True)
class SpokenWord:
    """A written word and how it is spoken; `after` is the punctuation that follows it.

    A word without segments is read by the voice, as it reads text.
    """

    text: str
    segments: tuple[Segment, ...]
    after: str = ""


SpeechInput = str | Sequence[SpokenWord]  # text, or phones word by word
PronunciationMap = Mapping[str, tuple[Segment, ...]]  # a user's words, lower case, and how they are spoken


class Voice(Protocol):
    """Speaks text or phones."""

    @property
    def sample_rate(self) -> int:
        """Hz."""

    def speak(self, spoken: SpeechInput, *, rate: float = 1.0, volume: float = 1.0, seed: int = 0) -> Speech:
        """Sound, phones and words of a sentence; the phones' edges sum to the sound's length to the sample.

        The same arguments give the same bytes.

        Raises
        ------
        InputError
            There is nothing to say, or something that this voice cannot say.
        """


def apply_volume(samples: NDArray[np.floating], volume: float) -> NDArray[np.float32]:
    """Samples times a factor, turned down as a whole where they would exceed full scale."""
    louder = np.asarray(samples, np.float32) * np.float32(volume)
    peak = float(np.abs(louder).max(initial=0.0))
    scaled: NDArray[np.float32] = louder / np.float32(max(peak, 1.0))
    return np.clip(scaled, -1.0, 1.0)
