"""Choice and loading of a voice by name and language."""

from pathlib import Path

from lexicon.errors import InputError
from lexicon.languages import language_code
from tts2face.speech.forced_alignment import SpeechAligner
from tts2face.voice.engine import ENGLISH_CODES, VOICE_NAMES, NativeRun, PronunciationMap, Voice


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
    if chosen == "heart":
        if language not in ENGLISH_CODES:
            raise InputError(f"the voice heart speaks English, not {language}; choose --voice espeak")
        from tts2face.voice.neural import NeuralVoice

        return NeuralVoice(own_words or {}, aligner, run)
    if chosen in {"espeak", "espeak-female"}:
        from tts2face.voice.espeak import EspeakVoice

        return EspeakVoice(language, own_words or {}, is_female=chosen == "espeak-female")
    if chosen.endswith(".onnx"):
        from tts2face.voice.piper import PiperVoice

        return PiperVoice(Path(chosen), language, own_words or {}, aligner)
    raise InputError(
        f"there is no voice {chosen!r}; give {', '.join(VOICE_NAMES)}, or the path of a Piper voice (.onnx)"
    )
