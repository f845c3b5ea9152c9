"""Loading of a request's voice ahead of its use; a module without heavy imports."""

from lexicon.dictionary import read_dictionary
from tts2face.request import Request
from tts2face.voice.pool import VoicePool


def preload_voice(voices: VoicePool, request: Request) -> None:
    """Load the voice of a request's text in a thread; none for a recording or a request without text.

    Raises
    ------
    InputError, DataError
        The dictionary of the request cannot be read.
    """
    if request.text and not request.audio:
        dictionary = read_dictionary(request.dictionary).entries if request.dictionary else {}
        voices.preload(request.voice, request.language, dictionary)
