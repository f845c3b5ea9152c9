"""Protocol of all voices, and the choice of a voice by name and language."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import InputError
from lexicon.ipa import Segment
from lexicon.languages import language_code
from tts2face.types import Speech

ENGLISH_CODES = ("en", "en-us", "en-gb")
VOICE_NAMES: Mapping[str, str] = {
    "heart": "neural, American English, female",
    "espeak": "formant synthesis, every language of espeak-ng",
    "espeak-female": "the same, female",
}


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


class Voice(Protocol):
    """A voice that synthesises text or phones."""

    @property
    def sample_rate(self) -> int:
        """Sample rate in Hz."""

    def speak(self, content: SpeechInput, *, rate: float = 1.0, volume: float = 1.0, seed: int = 0) -> Speech:
        """Synthesise a sentence.

        Parameters
        ----------
        content
            Text, or words with their phones.
        rate
            Factor of the speaking rate.
        volume
            Factor of the samples; they are scaled as a whole to stay within full scale.
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


def load_voice(name: str | None, language: str, own_words: PronunciationMap | None = None) -> Voice:
    """Load a voice by name, or the default voice of a language.

    Parameters
    ----------
    name
        One of `VOICE_NAMES`, the path of a Piper voice (``.onnx``), or None for the default.
    language
        Code, tag or English name, see `lexicon.languages.language_code`.
    own_words
        A user's pronunciations, which take precedence over those of the voice.

    Raises
    ------
    InputError
        The voice does not exist or does not speak the language.
    DataError
        The file of a Piper voice or its settings is damaged.
    BackendError
        A package that the voice needs is not installed.
    """
    language = language_code(language)
    chosen = name or ("heart" if language in ENGLISH_CODES[:2] else "espeak")
    if chosen == "heart":
        if language not in ENGLISH_CODES:
            raise InputError(f"the voice heart speaks English, not {language}; choose --voice espeak")
        from tts2face.voice.neural import NeuralVoice

        return NeuralVoice(own_words or {})
    if chosen in {"espeak", "espeak-female"}:
        from tts2face.voice.espeak import EspeakVoice

        return EspeakVoice(language, own_words or {}, is_female=chosen == "espeak-female")
    if chosen.endswith(".onnx"):
        from tts2face.voice.piper import PiperVoice

        return PiperVoice(Path(chosen), language, own_words or {})
    raise InputError(
        f"there is no voice {chosen!r}; give {', '.join(VOICE_NAMES)}, or the path of a Piper voice (.onnx)"
    )


def apply_volume(samples: NDArray[np.floating], volume: float) -> NDArray[np.float32]:
    """Samples (n,) times a factor, scaled as a whole to [-1, 1] if they exceed full scale."""
    amplified = np.asarray(samples, np.float32) * np.float32(volume)
    peak = float(np.abs(amplified).max(initial=0.0))
    scaled: NDArray[np.float32] = amplified / np.float32(max(peak, 1.0))
    return np.clip(scaled, -1.0, 1.0)
