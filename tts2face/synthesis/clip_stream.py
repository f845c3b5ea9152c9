"""A prepared request becomes clips, piece by piece: spoken text, a recording, or an idle face."""

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, ExitStack
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path

import numpy as np

from tts2face.clock import pad_to_frame
from tts2face.exemplar.explanation import PhoneExplanation, explain_selection
from tts2face.exemplar.synthesis import ExemplarModel, TokenSelection, select_tokens
from tts2face.gesture.timeline import Timeline
from tts2face.models.talker import Talker
from tts2face.speech.text_fit import TextMismatch
from tts2face.synthesis.animated_face import AnimatedFace, resting_head
from tts2face.synthesis.audio_input import (
    TimedTranscript,
    align_transcript,
    map_audio_to_motion,
    recording_clips,
    select_audio_map,
)
from tts2face.synthesis.gesture_layer import GestureLayer
from tts2face.synthesis.marked_speech import (
    MarkTime,
    SpokenSentence,
    resolve_recording_marks,
    silent_sentences,
    speak_sentence,
)
from tts2face.synthesis.prepared_request import IDLE_STEPS, RECORDING_STEPS, PreparedRequest
from tts2face.types import Clip, Speech, Trajectory, Waveform, frame_count
from tts2face.voice.engine import Voice


@dataclass(frozen=True, slots=True, eq=False)
class Piece:
    """A part of a clip: a sentence of a text, or some seconds of a recording or of an idle face.

    Parameters
    ----------
    clip
        Motion, head pose and speech of this part, on its own clock.
    begin
        Second of the whole clip at which the part begins.
    n_steps
        How much of the whole it is: characters of the text, or thousandths of the recording.
    timeline, marks
        What the text's marks ask for in this part, and its named marks; on the clock of the whole clip.
    shown
        For each phone, the recorded tokens that move the lips; on the clock of the whole clip. Empty for an idle face
        and for a recording without words; the first piece of a recording holds those of the whole.
    mismatches
        Words that the recording probably does not say, where they begin in this part; on the clock of the whole clip.
    """

    clip: Clip
    begin: float
    n_steps: int
    timeline: Timeline = field(default_factory=Timeline)
    marks: tuple[MarkTime, ...] = ()
    shown: Callable[[], tuple[PhoneExplanation, ...]] = tuple
    mismatches: tuple[TextMismatch, ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class Performers:
    """Who performs a request: the talker, the talker's exemplars, the face, and voices.

    ``voice`` lends the voice of a name and a language for the time of a ``with`` block.
    """

    talker: Talker
    exemplars: ExemplarModel
    face: AnimatedFace
    voice: Callable[[str | None, str], AbstractContextManager[Voice]]


def pieces(prepared: PreparedRequest, performers: Performers, layer: GestureLayer | None) -> Iterator[Piece]:
    """The clip of a request, piece by piece.

    Each piece ends on a frame, so that a text or recording of any length stays in step in bounded memory. Those of a
    text begin and end at rest.

    Parameters
    ----------
    layer
        The gestures of this one clip; without them face and head do not move beside the lips.
    """
    if prepared.request.audio is not None:
        yield from _recording_pieces(prepared, prepared.request.audio, performers, layer)
    else:
        yield from _spoken_pieces(prepared, performers, layer)
    if layer is not None:
        layer.finish()


def _spoken_pieces(prepared: PreparedRequest, performers: Performers, layer: GestureLayer | None) -> Iterator[Piece]:
    fps, first_frame = prepared.fps, 0
    for said, n_steps in _sentences(prepared, performers):
        speech, begin = pad_to_frame(said.speech, first_frame, fps), float(first_frame / fps)
        timeline = said.timeline.restrict(0.0, speech.waveform.duration).shifted(begin)
        n_frames = frame_count(speech.waveform.duration, float(fps))
        selection = select_tokens(speech.phones, performers.exemplars, prepared.options)
        lips = performers.face.motion_of_tokens(selection, fps=float(fps), n_frames=n_frames)
        clip = _with_sound(_with_gestures(speech, lips, timeline, layer), said.sound)
        first_frame += n_frames
        marks = tuple(replace(mark, seconds=mark.seconds + begin) for mark in said.marks)
        yield Piece(clip, begin, n_steps, timeline, marks, _explanation(selection, performers.exemplars, begin))


def _sentences(prepared: PreparedRequest, performers: Performers) -> Iterator[tuple[SpokenSentence, int]]:
    """Sentences of a text, and the characters of each; parts of an idle clip."""
    request = prepared.request
    if request.idle is not None:
        yield from silent_sentences(request.idle, prepared.fps, IDLE_STEPS)
        return
    with ExitStack() as held:

        @cache
        def voice_of(name: str | None, language: str) -> Voice:
            return held.enter_context(performers.voice(name, language))

        voice = voice_of(request.voice, request.language)
        for sentence in prepared.sentences():
            yield speak_sentence(voice, sentence, request, voice_of), sentence.n_characters


def _recording_pieces(
    prepared: PreparedRequest, audio: Path, performers: Performers, layer: GestureLayer | None
) -> Iterator[Piece]:
    """A recording in pieces: lips by examples where its words are known, else by an audio map."""
    said, motion, shown = _recording_motion(prepared, audio, performers)
    timeline, marks = resolve_recording_marks(prepared.text, said.phones, said.words, prepared.request.language)
    fps, before = float(prepared.fps), 0
    for clip in recording_clips(audio, said, motion, volume=prepared.request.volume):
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
            shown if before == 0 else tuple,
            tuple(one for one in said.mismatches if begin <= one.begin < end),
        )
        before = after


def _recording_motion(
    prepared: PreparedRequest, audio: Path, performers: Performers
) -> tuple[TimedTranscript, Trajectory, Callable[[], tuple[PhoneExplanation, ...]]]:
    fps, request = float(prepared.fps), prepared.request
    if not request.text.strip():
        said, lips = map_audio_to_motion(audio, select_audio_map(request, performers.talker), performers.talker, fps)
        return said, performers.face.motion_of_parameters(lips), tuple
    said = align_transcript(replace(request, text=prepared.text.text), audio)
    selection = select_tokens(said.phones, performers.exemplars, prepared.options)
    motion = performers.face.motion_of_tokens(selection, fps=fps, n_frames=frame_count(said.duration, fps))
    return said, motion, _explanation(selection, performers.exemplars, 0.0)


def _with_gestures(speech: Speech, lips: Trajectory, timeline: Timeline, layer: GestureLayer | None) -> Clip:
    """A clip with its gestures; the head rests where there are none."""
    if layer is not None:
        return layer.add(speech, lips, timeline)
    return Clip(lips, resting_head(len(lips), lips.fps), speech)


def _with_sound(clip: Clip, sound: Waveform) -> Clip:
    """The clip with its final sound; the sound that its motion follows may be longer by a silence."""
    speech = clip.speech
    samples = np.zeros_like(speech.waveform.samples)
    samples[: len(sound.samples)] = sound.samples
    return replace(clip, speech=replace(speech, waveform=Waveform(samples, sound.rate)))


def _explanation(
    selection: TokenSelection, exemplars: ExemplarModel, begin: float
) -> Callable[[], tuple[PhoneExplanation, ...]]:
    """The explanation of a selection on the clock of the whole clip, made when it is called for."""

    def shown() -> tuple[PhoneExplanation, ...]:
        phones = explain_selection(selection, exemplars)
        return tuple(replace(phone, start=phone.start + begin, end=phone.end + begin) for phone in phones)

    return shown
