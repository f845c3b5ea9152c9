"""Choice and loading of a voice by name and language."""

import importlib.util
from pathlib import Path

from lexicon.errors import BackendError, InputError
from lexicon.languages import language_code
from tts2face.speech.forced_alignment import SpeechAligner
from tts2face.voice.engine import (
    ENGLISH_CODES,
    ENGLISH_VOICES,
    VOICE_NAMES,
    VOICE_PROFILES,
    NativeRun,
    PronunciationMap,
    Voice,
)


def load_voice(
    name: str | None,
    language: str,
    own_words: PronunciationMap | None = None,
    aligner: SpeechAligner | None = None,
    run: NativeRun | None = None,
) -> Voice:
    """Load a voice by name, or the default voice of a language.

    Parameters
    ----------
    name
        One of `VOICE_NAMES`, the path of a Piper voice (``.onnx``), or None for the default.
    language
        Code, tag or English name, see `lexicon.languages.language_code`.
    own_words
        A user's pronunciations, which take precedence over those of the voice.
    aligner
        Aligns the sound of voices that report no edges; None for an aligner of each voice.
    run
        Runs the model of the voice heart; None: within the call.

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
    if chosen in ENGLISH_VOICES and language not in ENGLISH_CODES:
        raise InputError(f"the voice {chosen} speaks English, not {language}; choose --voice espeak")
    if chosen == "heart":
        from tts2face.voice.neural import NeuralVoice

        return NeuralVoice(own_words or {}, aligner, run)
    if chosen in {"espeak", "espeak-female"}:
        from tts2face.voice.espeak import EspeakVoice

        return EspeakVoice(language, own_words or {}, is_female=chosen == "espeak-female")
    if chosen == "joe" or chosen.endswith(".onnx"):
        from tts2face.voice.piper import PiperVoice

        path = _packaged_voice(chosen) if chosen == "joe" else Path(chosen)
        return PiperVoice(path, language, own_words or {}, aligner)
    raise InputError(
        f"there is no voice {chosen!r}; give {', '.join(VOICE_NAMES)}, or the path of a Piper voice (.onnx)"
    )


def _packaged_voice(name: str) -> Path:
    """Path of a Piper voice that a package carries.

    Raises
    ------
    BackendError
        The package is not installed, or carries no voice.
    """
    package = VOICE_PROFILES[name].package
    found = importlib.util.find_spec(package)
    folders = [] if found is None else list(found.submodule_search_locations or ())
    models = sorted(path for folder in folders for path in Path(folder).rglob("*.onnx"))
    if not models:
        raise BackendError(f"the voice {name} is not installed; run: pip install 'tts2face[voices]'")
    return models[0]
