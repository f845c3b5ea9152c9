"""Who speaks the spans of a text that name another voice or language."""

from collections.abc import Callable

from lexicon.errors import InputError
from lexicon.sentences import Phrase
from tts2face.request import Request
from tts2face.voice.engine import ENGLISH_CODES, VOICE_NAMES, Voice

Voices = Callable[[str | None, str], Voice]  # a voice by name (None: the best one) and language


def speaker_of(part: Phrase, voice: Voice, request: Request, voices: Voices | None) -> Voice:
    """Voice of a phrase: the request's, or for a span with a voice or language of its own, the matching one.

    Raises
    ------
    InputError
        `voices` is None and the phrase needs another voice, or no voice has this name or language.
    """
    if part.voice is None and part.language is None:
        return voice
    if voices is None:
        raise InputError("a text with spans of other voices or languages needs voices to speak them")
    return voices(voice_in(part.voice or request.voice, part.language), part.language or request.language)


def voice_in(name: str | None, language: str | None) -> str | None:
    """`name` if that voice speaks `language` (None: the language of the text), else None for the default voice."""
    if language is None or (name in VOICE_NAMES and (name != "heart" or language in ENGLISH_CODES)):
        return name
    return None
