"""Any Piper voice by its path (extra ``[piper]``), with phone edges found in its own sound."""

import re
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import BackendError, DataError, InputError
from lexicon.g2p import parse_espeak_word, phonemize
from lexicon.inputs import read_json
from lexicon.writing_systems import check_script
from tts2face.speech.forced_alignment import Aligner
from tts2face.telemetry import disable_telemetry
from tts2face.types import Speech, Waveform
from tts2face.voice.engine import PronunciationMap, SpeechInput, SpokenWord, apply_volume

WORD = re.compile(r"[^\W_]+(?:['’-][^\W_]+)*")
STRESS_MARKS = MappingProxyType({1: "ˈ", 2: "ˌ"})


class PiperVoice:
    """A Piper voice (VITS in ONNX) with the settings file that lies beside it."""

    def __init__(self, path: Path, language: str, own_words: PronunciationMap) -> None:
        if not path.is_file():
            raise InputError(f"there is no Piper voice {path}; check the path")
        settings = path.with_name(path.name + ".json")
        if not settings.is_file():
            raise DataError(f"the Piper voice {path} lacks its settings; put {settings.name} beside it")
        disable_telemetry()
        try:
            read_json(settings)  # piper itself reads it without limits
        except OSError as refused:
            raise DataError(f"{settings} cannot be read ({refused.strerror}); check the file") from refused
        try:
            from piper import PiperVoice as Loaded
        except ImportError as missing:
            raise BackendError("a Piper voice needs piper-tts; run: pip install 'tts2face[piper]'") from missing
        try:
            self._model: Any = Loaded.load(str(path), config_path=str(settings))
        except (ValueError, KeyError, RuntimeError) as broken:
            raise DataError(f"{path} is no Piper voice ({broken}); download it again") from broken
        self._language = str(self._model.config.espeak_voice or language)
        self._own_words, self._aligner = own_words, Aligner()

    @property
    def sample_rate(self) -> int:
        """Hz."""
        return int(self._model.config.sample_rate)

    def speak(self, spoken: SpeechInput, *, rate: float = 1.0, volume: float = 1.0, seed: int = 0) -> Speech:
        """Speech of a sentence; see `tts2face.voice.engine.Voice`. Spoken without noise: `seed` changes nothing."""
        words = self._words(spoken)
        if not words:
            raise InputError("there is nothing to say in the text; give at least one word")
        text = self._marked(spoken) if isinstance(spoken, str) else " ".join(_bracketed_ipa(word) for word in words)
        sound = Waveform(apply_volume(self._sound(text, rate), 1.0), self.sample_rate)
        ways = [(word.text, [tuple(segment.phone for segment in word.segments)]) for word in words]
        found = self._aligner.align(sound, ways)
        return Speech(Waveform(apply_volume(sound.samples, volume), self.sample_rate), found.phones, found.words)

    def _words(self, spoken: SpeechInput) -> list[SpokenWord]:
        if not isinstance(spoken, str):
            return [part for word in spoken for part in ([word] if word.segments else self._read(word))]
        check_script(spoken, self._language)
        written = WORD.findall(spoken)
        own = {word: self._own_words.get(word.lower()) for word in written}
        words = []
        for text, spoken_parts in zip(written, phonemize(written, self._language), strict=True):
            read = [segment for part in spoken_parts for segment in parse_espeak_word(part, self._language)]
            words.append(SpokenWord(text, own[text] or tuple(read)))
        return [word for word in words if word.segments]

    def _read(self, word: SpokenWord) -> list[SpokenWord]:
        """The words of a text whose phones nobody gives."""
        *others, last = self._words(word.text) or [SpokenWord("", ())]
        behind = "".join(re.findall("[.,;:!?]+$", word.text)) + word.after
        return [*others, SpokenWord(last.text, last.segments, behind)] if last.segments else []

    def _marked(self, text: str) -> str:
        """The text with a user's words as ``[[IPA]]``, which Piper says as it stands."""

        def marked(match: "re.Match[str]") -> str:
            segments = self._own_words.get(match[0].lower())
            return match[0] if segments is None else _bracketed_ipa(SpokenWord(match[0], segments))

        return WORD.sub(marked, text)

    def _sound(self, text: str, rate: float) -> NDArray[np.float32]:
        from piper import SynthesisConfig

        config = SynthesisConfig(length_scale=1.0 / rate, noise_scale=0.0, noise_w_scale=0.0)
        chunks = [chunk.audio_float_array for chunk in self._model.synthesize(text, syn_config=config)]
        return np.concatenate([np.zeros(0), *chunks]).astype(np.float32)


def _bracketed_ipa(word: SpokenWord) -> str:
    phones = "".join(STRESS_MARKS.get(segment.stress, "") + segment.phone for segment in word.segments)
    return f"[[{phones}]]{word.after}"
