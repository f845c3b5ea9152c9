"""Synthesis of a prepared request piece by piece: text, a recording, or idle animation."""

from collections.abc import Callable, Hashable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

from lexicon.sequence import PhoneSequence
from tts2face.gestures.timeline import Timeline
from tts2face.lips.exemplar import ExemplarModel, TokenSelection, select_tokens
from tts2face.lips.explanation import PhoneExplanation, explain_selection
from tts2face.models.talker import Talker
from tts2face.session.animated_face import AnimatedFace
from tts2face.session.gesture_layer import GestureLayer
from tts2face.session.prepared import RECORDING, RECORDING_STEPS, PreparedRequest, correct_phones
from tts2face.session.recording import (
    TimedTranscript,
    align_transcript,
    map_audio_to_motion,
    recording_clips,
    select_audio_map,
)
from tts2face.session.speech import resolve_recording_marks
from tts2face.session.speech_stream import Piece, SpeechModels, dictionary_entries, shifted, speak_sentences
from tts2face.types import Clip, Speech, Trajectory, Waveform, frame_count, pad_to_frame, resting_head

TRANSCRIPT_BYTES = 10_000  # of a transcript besides its phones


@dataclass(frozen=True, slots=True, eq=False)
class SynthesisModels:
    """Models from which clips are synthesised: talker, the talker's exemplars, face, and what speaks."""

    talker: Talker
    exemplars: ExemplarModel
    face: AnimatedFace
    speech: SpeechModels


def pieces(prepared: PreparedRequest, models: SynthesisModels, layer: GestureLayer | None) -> Iterator[Piece]:
    """Synthesise the clip of a request piece by piece.

    Each piece ends on a frame boundary, so that sound and picture stay synchronous at any length, in bounded memory.
    The pieces of a text begin and end with the face at rest.

    Parameters
    ----------
    layer
        Gestures of this clip; None for lip motion only.
    """
    if prepared.request.audio is not None:
        yield from _recording_pieces(prepared, prepared.request.audio, models, layer)
    else:
        yield from pieces_from(prepared, models, layer)
    if layer is not None:
        layer.finish()


def pieces_from(
    prepared: PreparedRequest, models: SynthesisModels, layer: GestureLayer | None, first_frame: int = 0
) -> Iterator[Piece]:
    """Pieces of a text or of idle animation that begins at a frame of a longer clip."""
    fps = prepared.fps
    for spoken, n_steps, text in speak_sentences(prepared, models.speech):
        speech, begin = pad_to_frame(spoken.speech, first_frame, fps), float(first_frame / fps)
        timeline = spoken.timeline.restrict(0.0, speech.waveform.duration).shift(begin)
        n_frames = frame_count(speech.waveform.duration, float(fps))
        models.speech.yield_turn()
        selection, lips = _sentence_lips(speech.phones, n_frames, prepared, models)
        models.speech.yield_turn()
        clip = _with_sound(_with_gestures(speech, lips, timeline, layer), spoken.sound)
        first_frame += n_frames
        explain = _explanation(selection, models.exemplars, begin)
        yield Piece(clip, begin, n_steps, timeline, shifted(spoken.marks, begin), explain, text=text)


def _sentence_lips(
    phones: PhoneSequence, n_frames: int, prepared: PreparedRequest, models: SynthesisModels
) -> tuple[TokenSelection, Trajectory]:
    """Selected tokens of a sentence and their lip motion (n_frames, K)."""
    fps = float(prepared.fps)

    def key() -> Hashable:
        timed = (phones.phones, phones.edges.tobytes(), n_frames, fps)
        return ("lips", timed, prepared.options, prepared.excluded, prepared.request.has_gestures)

    def make() -> tuple[TokenSelection, Trajectory]:
        selection = select_tokens(phones, models.exemplars, prepared.options)
        models.speech.yield_turn()
        lips = models.face.motion_of_tokens(selection, fps=fps, n_frames=n_frames, yield_turn=models.speech.yield_turn)
        return selection, lips

    return models.speech.memory.recall(key, make, lambda made: made[1].values.nbytes + made[0].found.tokens.nbytes * 3)


def _file_identity(path: Path) -> Hashable:
    found = path.stat()
    return (str(path.resolve()), found.st_mtime_ns, found.st_size)


def _recording_pieces(
    prepared: PreparedRequest, audio: Path, models: SynthesisModels, layer: GestureLayer | None
) -> Iterator[Piece]:
    """Pieces of a recording: lip motion from exemplars if its words are known, else from an audio map."""
    transcript, motion, explain = _recording_motion(prepared, audio, models)
    language = prepared.request.language
    timeline, marks = resolve_recording_marks(prepared.text, transcript.phones, transcript.words, language)
    fps, before = float(prepared.fps), 0
    for clip in recording_clips(audio, transcript, motion, volume=prepared.request.volume):
        after = before + len(clip.motion)
        n_steps = RECORDING_STEPS * after // len(motion) - RECORDING_STEPS * before // len(motion)
        begin, end = before / fps, after / fps
        marked = timeline.restrict(begin, end)
        yield Piece(
            _with_gestures(clip.speech, clip.motion, marked, layer),
            begin,
            n_steps,
            marked,
            tuple(mark for mark in marks if begin <= mark.seconds < end),
            explain if before == 0 else tuple,
            tuple(mismatch for mismatch in transcript.mismatches if begin <= mismatch.begin < end),
            transcript=transcript.phones if before == 0 else None,
        )
        before = after


def _recording_motion(
    prepared: PreparedRequest, audio: Path, models: SynthesisModels
) -> tuple[TimedTranscript, Trajectory, Callable[[], tuple[PhoneExplanation, ...]]]:
    fps, request = float(prepared.fps), prepared.request
    if not request.text.strip():
        audio_map = select_audio_map(request, models.talker)
        transcript, lips = map_audio_to_motion(audio, audio_map, models.talker, fps)
        return transcript, models.face.motion_of_parameters(lips), tuple
    transcript = models.speech.memory.recall(
        lambda: (
            "transcript",
            _file_identity(audio),
            prepared.text.text,
            request.language,
            dictionary_entries(prepared),
        ),
        lambda: align_transcript(prepared.text.text, request.language, audio, prepared.dictionary),
        lambda made: TRANSCRIPT_BYTES + made.phones.edges.nbytes * 8,
    )
    transcript = replace(transcript, phones=correct_phones(transcript.phones, RECORDING, 0, prepared.edges))
    selection, motion = _sentence_lips(transcript.phones, frame_count(transcript.duration, fps), prepared, models)
    return transcript, motion, _explanation(selection, models.exemplars, 0.0)


def _with_gestures(speech: Speech, lips: Trajectory, timeline: Timeline, layer: GestureLayer | None) -> Clip:
    """Clip of lip motion with gestures, or with a resting head if there is no gesture layer."""
    if layer is not None:
        return layer.add(speech, lips, timeline)
    return Clip(lips, resting_head(len(lips), lips.fps), speech)


def _with_sound(clip: Clip, sound: Waveform) -> Clip:
    """Replace the sound of a clip by its final sound, padded with silence to the same length."""
    speech = clip.speech
    return replace(clip, speech=replace(speech, waveform=sound.padded(len(speech.waveform.samples))))


def _explanation(
    selection: TokenSelection, exemplars: ExemplarModel, begin: float
) -> Callable[[], tuple[PhoneExplanation, ...]]:
    """Function that explains a selection in seconds of the whole clip; it is evaluated only when called."""

    def explain() -> tuple[PhoneExplanation, ...]:
        phones = explain_selection(selection, exemplars)
        return tuple(replace(phone, start=phone.start + begin, end=phone.end + begin) for phone in phones)

    return explain
