"""Who speaks the spans of a text that name another voice or language."""

from collections.abc import Callable

from lexicon.errors import InputError
from lexicon.sentences import Phrase
from tts2face.request import Request
from tts2face.voice.engine import ENGLISH_CODES, VOICE_NAMES, Voice

Voices = Callable[[str | None, str], Voice]  # a voice by name (None: the best one) and language


def speaker_of(part: Phrase, voice: Voice, request: Request, voices: Voices | None) -> Voice:
    """The request's voice; for a span the voice that it names, or one that speaks its language.

    Raises
    ------
    InputError
        There are no other voices to choose from, or none of this name or language.
    """
    if part.voice is None and part.language is None:
        return voice
    if voices is None:
        raise InputError("a text with spans of other voices or languages needs voices to speak them")
    return voices(voice_in(part.voice or request.voice, part.language), part.language or request.language)


def voice_in(name: str | None, language: str | None) -> str | None:
    """The voice asked for where it speaks the language of a span (None: that of the text), else None: the best one."""
    if language is None or (name in VOICE_NAMES and (name != "heart" or language in ENGLISH_CODES)):
        return name
    return None
