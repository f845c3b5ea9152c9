"""What every voice does, and how one is chosen."""

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


def load_voice(name: str | None, language: str, own_words: PronunciationMap | None = None) -> Voice:
    """The voice of a name, or the best one for a language.

    Parameters
    ----------
    name
        One of `VOICE_NAMES`, or the path of a Piper voice (``.onnx``).
    language
        As `lexicon.languages.language_code` reads it.
    own_words
        A user's pronunciations, which win over the voice's own.

    Raises
    ------
    InputError
        There is no such voice, or it does not speak the language.
    BackendError
        What the voice needs is not installed.
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
    """Samples times a factor, turned down as a whole where they would exceed full scale."""
    louder = np.asarray(samples, np.float32) * np.float32(volume)
    peak = float(np.abs(louder).max(initial=0.0))
    scaled: NDArray[np.float32] = louder / np.float32(max(peak, 1.0))
    return np.clip(scaled, -1.0, 1.0)
