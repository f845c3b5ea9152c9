"""Loading of a request's voice ahead of its use; a module without heavy imports."""

from tts2face.synthesis.prepared_request import PreparedRequest
from tts2face.voice.pool import VoicePool


def preload_voice(voices: VoicePool, prepared: PreparedRequest) -> None:
    """Load the voice of a request's text in a thread; none for a recording or a request without text."""
    request = prepared.request
    if request.text and not request.audio:
        voices.preload(request.voice, request.language, prepared.dictionary)
