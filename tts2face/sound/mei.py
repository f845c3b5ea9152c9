"""The Japanese voice Mei (Nagoya Institute of Technology), 48 kHz, by Open JTalk in the package of readings."""

import threading

import numpy as np

from lexicon.errors import SilentTextError
from lexicon.japanese import load_reader
from tts2face.sound.aligned_speech import aligned_speech, written_text
from tts2face.sound.alignment import Align, Aligner
from tts2face.sound.voice import SpeechInput, VoiceSetting, apply_volume, pronounce_content
from tts2face.types import Speech, Waveform

SAMPLE_RATE = 48_000
FULL_SCALE = 32768.0  # of the library's samples
_TURN = threading.Lock()  # the library has one engine for a process


class MeiVoice:
    """A woman's voice by hidden Markov models. Its library reports no times: phones are aligned.

    Its readings and accents are the library's own; a user's pronunciations change the lips, not the sound.
    """

    def __init__(self, setting: VoiceSetting) -> None:
        self._library = load_reader()
        self._setting = setting
        self._align: Align = setting.align or Aligner().align

    @property
    def sample_rate(self) -> int:
        """Sample rate in Hz."""
        return SAMPLE_RATE

    def speak(self, content: SpeechInput, *, rate: float = 1.0, seed: int = 0) -> Speech:
        """Synthesise a sentence; see `tts2face.sound.voice.Voice`. The voice is deterministic: `seed` is unused."""
        spoken = pronounce_content(content, self._setting.language, self._setting.own_words)
        words = [(word.text, [tuple(word.phones)]) for word in spoken]
        return aligned_speech(self.sound(content, rate=rate), words, self._align)

    def sound(self, content: SpeechInput, *, rate: float = 1.0, seed: int = 0) -> Waveform:
        """Sound without the alignment of its phones."""
        with _TURN:
            samples, _ = self._library.tts(written_text(content), speed=rate)
        if not np.abs(samples).max(initial=0.0):
            raise SilentTextError("there is nothing to say in the text; give at least one word")
        return Waveform(apply_volume(samples / FULL_SCALE), SAMPLE_RATE)
