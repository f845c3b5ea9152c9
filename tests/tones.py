"""Voices that say a tone or a constant for each phone, of known lengths."""

import re
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from lexicon.languages import language_code
from lexicon.sequence import SILENCE, PhoneSequence, WordSpan
from tts2face.sound.prosody import PLAIN_PROSODY, Prosody
from tts2face.sound.retuned import intention, retuned
from tts2face.sound.voice import (
    PronunciationMap,
    SpeechInput,
    Voice,
    VoiceInfo,
    VoiceSetting,
    pronounce_content,
)
from tts2face.sound.voice_pool import VoicePool, default_voice
from tts2face.types import Speech, Waveform

VOICE = "tones"
RATE_HZ = 8000  # the lowest at which loudness is measured
LEAD_S, TRAIL_S, PHONE_S, LEVEL = 0.2, 0.3, 0.1, 0.25
LOWEST_HZ, STEP_HZ, N_TONES = 200.0, 40.0, 61


class ToneVoice:
    """A tone of 0.1 s for each phone, a silence of 0.2 s before and of 0.3 s after the words; of equal level."""

    def __init__(self, setting: VoiceSetting | None = None) -> None:
        self._setting = setting or VoiceSetting("en-us")

    @property
    def sample_rate(self) -> int:
        return RATE_HZ

    def speak(self, content: SpeechInput, *, rate: float = 1.0, seed: int = 0) -> Speech:
        words = pronounce_content(content, self._setting.language, self._setting.own_words)
        return spoken([(word.text + word.mark, word.phones) for word in words if word.phones], rate)

    def sound(self, content: SpeechInput, *, rate: float = 1.0, seed: int = 0) -> Waveform:
        return self.speak(content, rate=rate, seed=seed).waveform

    def deliver(self, content: SpeechInput, prosody: Prosody, seed: int) -> Speech:
        speech = self.speak(content, rate=prosody.rate, seed=seed)
        others = replace(prosody, rate=1.0)
        return speech if others == PLAIN_PROSODY else retuned(speech, others, intention("", ""))

    def deliver_sound(self, content: SpeechInput, prosody: Prosody, seed: int) -> Waveform:
        return self.deliver(content, prosody, seed).waveform


class LetterVoice:
    """A phone of 0.1 s and of constant level for each letter; `splits` words at hyphens, as some voices do."""

    def __init__(self, splits: bool = False, rate: int = RATE_HZ) -> None:
        self.said: list[tuple[str, float]] = []
        self._splits, self._rate = splits, rate

    @property
    def sample_rate(self) -> int:
        return self._rate

    def sound(self, content: SpeechInput, *, rate: float = 1.0, seed: int = 0) -> Waveform:
        return self.speak(content, rate=rate, seed=seed).waveform

    def deliver(self, content: SpeechInput, prosody: Prosody, seed: int) -> Speech:
        return self.speak(content, rate=prosody.rate, seed=seed)

    def deliver_sound(self, content: SpeechInput, prosody: Prosody, seed: int) -> Waveform:
        return self.deliver(content, prosody, seed).waveform

    def speak(self, content: SpeechInput, *, rate: float = 1.0, seed: int = 0) -> Speech:
        text = content if isinstance(content, str) else " ".join(word.text + word.after for word in content)
        self.said.append((text, rate))
        words = re.findall(r"\w+" if self._splits else r"[\w'-]+", text)
        return spoken([(word, ["a"] * len(word)) for word in words], rate, self._rate, has_tones=False)


def spoken(
    words: Sequence[tuple[str, Sequence[str]]], rate: float = 1.0, rate_hz: int = RATE_HZ, *, has_tones: bool = True
) -> Speech:
    """Speech of words with their phones, each a tone of its own, or a constant."""
    phones = [phone for _, said in words for phone in said]
    edges = np.concatenate([[0.0], LEAD_S + np.arange(len(phones) + 1) * PHONE_S / rate, [0.0]])
    n_samples = round((edges[-2] + TRAIL_S) * rate_hz)
    edges[-1] = n_samples / rate_hz
    bounds = np.rint(edges * rate_hz).astype(int)
    samples = np.zeros(n_samples, np.float32)
    for phone, first, last in zip(phones, bounds[1:-2], bounds[2:-1], strict=True):
        tone_hz = LOWEST_HZ + STEP_HZ * (sum(map(ord, phone)) % N_TONES)
        tone = np.sin(2 * np.pi * tone_hz / rate_hz * np.arange(last - first))
        samples[first:last] = LEVEL * (tone if has_tones else 1.0)
    firsts = 1 + np.cumsum([0, *(len(said) for _, said in words)])
    spans = tuple(WordSpan(text, int(firsts[k]), int(firsts[k + 1])) for k, (text, _) in enumerate(words))
    return Speech(Waveform(samples, rate_hz), PhoneSequence([SILENCE, *phones, SILENCE], edges), spans)


class WorldVoices(VoicePool):
    """Voices of which the default one is that of tones."""

    def voice(
        self,
        name: str | None,
        language: str,
        dictionary: PronunciationMap,
        *,
        prosody: Prosody = PLAIN_PROSODY,
        keeps_utterances: bool = False,
    ) -> Voice:
        code = language_code(language)
        if name in (None, default_voice(code)):
            return ToneVoice(VoiceSetting(code, dictionary))
        return super().voice(name, language, dictionary, prosody=prosody, keeps_utterances=keeps_utterances)


TONES = VoiceInfo("a tone for each phone", ToneVoice, "none", "numpy", "-", "none")
