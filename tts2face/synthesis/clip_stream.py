"""Synthesis of a prepared request piece by piece: text, a recording, or idle animation."""

from collections import Counter
from collections.abc import Callable, Hashable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path
from types import MappingProxyType
from typing import Any, TypeVar

import numpy as np

from lexicon.errors import InputError
from lexicon.sentences import Sentence
from lexicon.sequence import SILENCE, PhoneSequence
from tts2face.clock import first_sample, pad_to_frame
from tts2face.exemplar.explanation import PhoneExplanation, explain_selection
from tts2face.exemplar.synthesis import ExemplarModel, TokenSelection, select_tokens
from tts2face.gesture.timeline import Timeline
from tts2face.models.talker import Talker
from tts2face.request import Request
from tts2face.speech.text_fit import TextMismatch
from tts2face.synthesis.animated_face import AnimatedFace
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
    Voices,
    resolve_recording_marks,
    sentence_sound,
    silent_sentences,
    speak_sentence,
)
from tts2face.synthesis.phone_edges import RECORDING, correct_phones
from tts2face.synthesis.prepared_request import IDLE_STEPS, RECORDING_STEPS, PreparedRequest
from tts2face.synthesis.sentence_memory import NO_MEMORY, SentenceMemory
from tts2face.types import Clip, GiveWay, Speech, Trajectory, Waveform, frame_count, keep_on, resting_head
from tts2face.voice.engine import Voice

Spoken = TypeVar("Spoken")
TRANSCRIPT_BYTES = 10_000  # of a transcript besides its phones
# Options of a request that do not affect the speech of its sentences.
NOT_SPOKEN: Mapping[str, Any] = MappingProxyType(
    {"expression": None, "gain": None, "timeline": None, "pitch": False, "context": None, "exemplars": None}
)


@dataclass(frozen=True, slots=True, eq=False)
class Piece:
    """A part of a clip: a sentence of a text, or some seconds of a recording or of idle animation.

    Parameters
    ----------
    clip
        Motion, head pose and speech; times are relative to the start of the piece.
    begin
        Start of the piece in seconds of the whole clip.
    n_steps
        Size of the piece: characters of the text, or thousandths of the recording or of the idle animation.
    timeline, marks
        Gestures requested by the marks of the text, and its named marks; in seconds of the whole clip.
    explain
        Returns for each phone the recorded tokens of its lip motion, in seconds of the whole clip. Empty for idle
        animation and for a recording without words; the first piece of a recording returns those of all pieces.
    mismatches
        Words that the recording probably does not contain and that start in this piece; in seconds of the whole clip.
    text
        Written sentence without its marks; empty for a recording and for idle animation.
    transcript
        Phones of the whole recording, with its first piece; None for all other pieces.
    """

    clip: Clip
    begin: float
    n_steps: int
    timeline: Timeline = field(default_factory=Timeline)
    marks: tuple[MarkTime, ...] = ()
    explain: Callable[[], tuple[PhoneExplanation, ...]] = tuple
    mismatches: tuple[TextMismatch, ...] = ()
    text: str = ""
    transcript: PhoneSequence | None = None


@dataclass(frozen=True, slots=True, eq=False)
class SynthesisModels:
    """Models from which clips are synthesised: talker, the talker's exemplars, face, and voices.

    ``voice`` returns the voice of a name and a language; ``give_way`` is called between the steps of a piece;
    ``memory`` keeps the speech and the lip motion of sentences.
    """

    talker: Talker
    exemplars: ExemplarModel
    face: AnimatedFace
    voice: Voices
    give_way: GiveWay = keep_on
    memory: SentenceMemory = NO_MEMORY


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


@dataclass(frozen=True, slots=True)
class SpeechSpan:
    """Seconds of a clip at which its first word begins, its last word ends, and its sound ends."""

    begin: float
    end: float
    total: float


def measure_speech(prepared: PreparedRequest, models: SynthesisModels) -> SpeechSpan:
    """Span of the speech of a text in its clip, without synthesis of motion."""
    fps, first_frame, begin, end, total = float(prepared.fps), 0, 0.0, 0.0, 0.0
    for spoken, _, _ in _sentences(prepared, models):
        at, phones = first_frame / fps, spoken.speech.phones
        voiced = [number for number, phone in enumerate(phones.phones) if phone != SILENCE]
        if voiced:
            begin = begin if end else at + float(phones.edges[voiced[0]])
            end = at + float(phones.edges[voiced[-1] + 1])
        total = at + spoken.speech.waveform.duration
        first_frame += frame_count(spoken.speech.waveform.duration, fps)
    return SpeechSpan(begin, end, total)


def pieces_from(
    prepared: PreparedRequest, models: SynthesisModels, layer: GestureLayer | None, first_frame: int = 0
) -> Iterator[Piece]:
    """Pieces of a text or of idle animation that begins at a frame of a longer clip."""
    fps = prepared.fps
    for spoken, n_steps, text in _sentences(prepared, models):
        speech, begin = pad_to_frame(spoken.speech, first_frame, fps), float(first_frame / fps)
        timeline = spoken.timeline.restrict(0.0, speech.waveform.duration).shift(begin)
        n_frames = frame_count(speech.waveform.duration, float(fps))
        models.give_way()
        selection, lips = _sentence_lips(speech.phones, n_frames, prepared, models)
        models.give_way()
        clip = _with_sound(_with_gestures(speech, lips, timeline, layer), spoken.sound)
        first_frame += n_frames
        explain = _explanation(selection, models.exemplars, begin)
        yield Piece(clip, begin, n_steps, timeline, _shifted(spoken.marks, begin), explain, text=text)


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
        models.give_way()
        lips = models.face.motion_of_tokens(selection, fps=fps, n_frames=n_frames, give_way=models.give_way)
        return selection, lips

    return models.memory.recall(key, make, lambda made: made[1].values.nbytes + made[0].found.tokens.nbytes * 3)


@dataclass(frozen=True, slots=True, eq=False)
class TimedSpeech:
    """Speech of a sentence with its final sound; its start and its named marks in seconds of the whole."""

    speech: Speech
    begin: float
    marks: tuple[MarkTime, ...] = ()


def timed_speech(prepared: PreparedRequest, models: SynthesisModels) -> Iterator[TimedSpeech]:
    """Speech of each piece of a text or of idle animation, without motion.

    Raises
    ------
    InputError
        The request has a recording.
    """
    if prepared.request.audio is not None:
        raise InputError("a recording is not spoken; remove it, or stream its clip")
    return _timed_sentences(prepared, models)


def _timed_sentences(prepared: PreparedRequest, models: SynthesisModels) -> Iterator[TimedSpeech]:
    fps, first_frame = prepared.fps, 0
    for spoken, _, _ in _sentences(prepared, models):
        speech, begin = pad_to_frame(spoken.speech, first_frame, fps), float(first_frame / fps)
        sound = _padded(spoken.sound, len(speech.waveform.samples))
        yield TimedSpeech(replace(speech, waveform=sound), begin, _shifted(spoken.marks, begin))
        first_frame += frame_count(speech.waveform.duration, float(fps))


def sounds(prepared: PreparedRequest, models: SynthesisModels) -> Iterator[Waveform]:
    """Sound of each piece of a text or of idle animation, without motion; the same samples as those of `pieces`."""
    fps, first_frame = prepared.fps, 0
    if prepared.request.idle is not None:
        found: Iterator[Waveform] = (spoken.sound for spoken, _, _ in _sentences(prepared, models))
    else:
        found = _spoken(prepared, models, sentence_sound)
    for sound in found:
        last_frame = first_frame + frame_count(sound.duration, float(fps))
        n_samples = first_sample(last_frame, sound.rate, fps) - first_sample(first_frame, sound.rate, fps)
        first_frame = last_frame
        yield _padded(sound, max(n_samples, len(sound.samples)))


def _spoken(
    prepared: PreparedRequest, models: SynthesisModels, speak: Callable[[Voice, Sentence, Request, Voices], Spoken]
) -> Iterator[Spoken]:
    """Result of `speak` for each sentence of a text."""
    request, voice_of = prepared.request, cache(models.voice)
    voice = voice_of(request.voice, request.language)
    for sentence in prepared.sentences():
        yield speak(voice, sentence, request, voice_of)


def _sentences(prepared: PreparedRequest, models: SynthesisModels) -> Iterator[tuple[SpokenSentence, int, str]]:
    """Spoken sentences with numbers of characters and texts, or parts of idle animation with steps and no text."""
    request = prepared.request
    if request.idle is not None:
        yield from ((silent, steps, "") for silent, steps in silent_sentences(request.idle, prepared.fps, IDLE_STEPS))
        return

    said: Counter[str] = Counter()
    spoken_with = cache(lambda: (replace(request, text="", **NOT_SPOKEN), _entries(prepared)))  # of all sentences

    def speak(voice: Voice, sentence: Sentence, request: Request, voices: Voices) -> tuple[SpokenSentence, int, str]:
        text = " ".join(phrase.source for phrase in sentence.utterances)
        spoken = models.memory.recall(
            lambda: ("speech", sentence.relative(), spoken_with()),
            lambda: speak_sentence(voice, sentence, request, voices, models.give_way),
            lambda made: made.sound.samples.nbytes + made.speech.waveform.samples.nbytes,
        )
        speech = spoken.speech
        phones = correct_phones(speech.phones, text, said[text], prepared.edges)
        said[text] += 1
        return replace(spoken, speech=replace(speech, phones=phones)), sentence.n_characters, text

    yield from _spoken(prepared, models, speak)


def _file_identity(path: Path) -> Hashable:
    found = path.stat()
    return (str(path.resolve()), found.st_mtime_ns, found.st_size)


def _entries(prepared: PreparedRequest) -> Hashable:
    return frozenset(prepared.dictionary.items())


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
    transcript = models.memory.recall(
        lambda: ("transcript", _file_identity(audio), prepared.text.text, request.language, _entries(prepared)),
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
    return replace(clip, speech=replace(speech, waveform=_padded(sound, len(speech.waveform.samples))))


def _shifted(marks: tuple[MarkTime, ...], seconds: float) -> tuple[MarkTime, ...]:
    return tuple(replace(mark, seconds=mark.seconds + seconds) for mark in marks)


def _padded(sound: Waveform, n_samples: int) -> Waveform:
    """Sound followed by silence up to a number of samples."""
    samples = np.zeros(n_samples, np.float32)
    samples[: len(sound.samples)] = sound.samples
    return Waveform(samples, sound.rate)


def _explanation(
    selection: TokenSelection, exemplars: ExemplarModel, begin: float
) -> Callable[[], tuple[PhoneExplanation, ...]]:
    """Function that explains a selection in seconds of the whole clip; it is evaluated only when called."""

    def explain() -> tuple[PhoneExplanation, ...]:
        phones = explain_selection(selection, exemplars)
        return tuple(replace(phone, start=phone.start + begin, end=phone.end + begin) for phone in phones)

    return explain
