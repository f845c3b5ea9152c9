"""Piper voices from files (extra ``[piper]``), with phone edges by forced alignment of their sound."""

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
    """A Piper voice (VITS in ONNX) with its settings file ``NAME.onnx.json`` in the same folder.

    Raises
    ------
    InputError
        The voice does not exist.
    DataError
        The settings are missing, or a file is damaged.
    BackendError
        piper-tts is not installed.
    """

    def __init__(self, path: Path, language: str, own_words: PronunciationMap) -> None:
        if not path.is_file():
            raise InputError(f"there is no Piper voice {path}; check the path")
        settings = path.with_name(path.name + ".json")
        if not settings.is_file():
            raise DataError(f"the Piper voice {path} lacks its settings; put {settings.name} into the same folder")
        disable_telemetry()
        try:
            read_json(settings)  # checks size and nesting, which piper does not limit
        except OSError as refused:
            raise DataError(f"{settings} cannot be read ({refused.strerror}); check the file") from refused
        try:
            from piper import PiperVoice as Loaded
        except ImportError as missing:
            raise BackendError("a Piper voice needs piper-tts; run: pip install 'tts2face[piper]'") from missing
        try:
            self._model: Any = Loaded.load(str(path), config_path=str(settings))
        except (ValueError, KeyError, RuntimeError) as broken:
            raise DataError(f"{path} is not a Piper voice ({broken}); download it again") from broken
        self._language = str(self._model.config.espeak_voice or language)
        self._own_words, self._aligner = own_words, Aligner()

    @property
    def sample_rate(self) -> int:
        """Sample rate in Hz."""
        return int(self._model.config.sample_rate)

    def speak(self, content: SpeechInput, *, rate: float = 1.0, seed: int = 0) -> Speech:
        """Synthesise a sentence; see `tts2face.voice.engine.Voice`. The model runs without noise: `seed` is unused."""
        words = self._words(content)
        if not words:
            raise InputError("there is nothing to say in the text; give at least one word")
        if isinstance(content, str):
            text = self._insert_own_words(content)
        else:
            text = " ".join(_bracketed_ipa(word) for word in words)
        sound = Waveform(apply_volume(self._synthesise(text, rate), 1.0), self.sample_rate)
        pronunciations = [(word.text, [tuple(segment.phone for segment in word.segments)]) for word in words]
        found = self._aligner.align(sound, pronunciations)
        return Speech(sound, found.phones, found.words)

    def _words(self, content: SpeechInput) -> list[SpokenWord]:
        """Words with phones: those given, of the user's dictionary, or of espeak-ng."""
        if not isinstance(content, str):
            return [part for word in content for part in ([word] if word.segments else self._pronounce(word))]
        check_script(content, self._language)
        written = WORD.findall(content)
        own = {word: self._own_words.get(word.lower()) for word in written}
        words = []
        for text, parts in zip(written, phonemize(written, self._language), strict=True):
            segments = [segment for part in parts for segment in parse_espeak_word(part, self._language)]
            words.append(SpokenWord(text, own[text] or tuple(segments)))
        return [word for word in words if word.segments]

    def _pronounce(self, word: SpokenWord) -> list[SpokenWord]:
        """The spoken words of a written one without given phones."""
        *others, last = self._words(word.text) or [SpokenWord("", ())]
        after = "".join(re.findall("[.,;:!?]+$", word.text)) + word.after
        return [*others, SpokenWord(last.text, last.segments, after)] if last.segments else []

    def _insert_own_words(self, text: str) -> str:
        """Replace a user's words by ``[[IPA]]``, Piper's notation for given pronunciations."""

        def replace_with_ipa(match: "re.Match[str]") -> str:
            segments = self._own_words.get(match[0].lower())
            return match[0] if segments is None else _bracketed_ipa(SpokenWord(match[0], segments))

        return WORD.sub(replace_with_ipa, text)

    def _synthesise(self, text: str, rate: float) -> NDArray[np.float32]:
        from piper import SynthesisConfig

        config = SynthesisConfig(length_scale=1.0 / rate, noise_scale=0.0, noise_w_scale=0.0)
        chunks = [chunk.audio_float_array for chunk in self._model.synthesize(text, syn_config=config)]
        return np.concatenate([np.zeros(0), *chunks]).astype(np.float32)


def _bracketed_ipa(word: SpokenWord) -> str:
    phones = "".join(STRESS_MARKS.get(segment.stress, "") + segment.phone for segment in word.segments)
    return f"[[{phones}]]{word.after}"
