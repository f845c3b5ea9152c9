"""Files that hold the sound and phones of a clip, written without talker, face and palette."""

from lexicon.marked_text import NameMark
from tts2face.gesture.timeline import Timeline
from tts2face.synthesis.mark_styles import marked_styles
from tts2face.synthesis.output_files import OutputFiles
from tts2face.synthesis.prepared_request import PreparedRequest
from tts2face.synthesis.speech_stream import SpeechModels, speech_pieces
from tts2face.synthesis.written_clip import RequestSteps, WrittenClip, ahead, write_pieces
from tts2face.types import Progress
from tts2face.voice.pool import VoicePool


def is_speech_only(prepared: PreparedRequest, outputs: OutputFiles) -> bool:
    """Whether no output holds motion, and the request asks for nothing that a talker, face or palette could lack."""
    asks_for_motion = prepared.timeline != Timeline() or marked_styles(prepared.text) or prepared.excluded
    holds_motion = outputs.out is not None or any(file.format.has_motion for file in outputs.exports)
    return prepared.request.audio is None and not asks_for_motion and not holds_motion


def write_speech(
    prepared: PreparedRequest, outputs: OutputFiles, voices: VoicePool, on_progress: Progress | None
) -> WrittenClip:
    """Write outputs for which `is_speech_only` holds: the same files as those of a session.

    Raises
    ------
    InputError, DataError, BackendError
        As `Session.export`.
    """
    models = SpeechModels(lambda name, language: voices.voice(name, language, prepared.dictionary), voices.give_way)
    has_phones = any(not file.format.is_sound for file in outputs.exports)
    has_names = any(isinstance(mark, NameMark) for mark in prepared.text.marks)
    pieces = speech_pieces(prepared, models, has_phones=has_phones or has_names)
    with outputs.open(None, None, None) as files, ahead(pieces) as spoken:
        return write_pieces(spoken, files, outputs, RequestSteps(prepared.n_steps, on_progress), None)
