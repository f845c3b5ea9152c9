"""Speech of a prepared request piece by piece: text or idle animation, without motion."""

from collections import Counter
from collections.abc import Callable, Hashable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cache
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from lexicon.errors import InputError
from lexicon.sentences import Sentence
from lexicon.sequence import SILENCE, PhoneSequence
from tts2face.gestures.timeline import Timeline
from tts2face.numeric.reuse import NO_MEMORY, SentenceMemory
from tts2face.request import Request
from tts2face.session.prepared import IDLE_STEPS, PreparedRequest, correct_phones
from tts2face.session.speech import (
    NO_DELIVERIES,
    Deliveries,
    MarkTime,
    SpokenSentence,
    Voices,
    sentence_sound,
    silent_sentences,
    speak_sentence,
)
from tts2face.sound.transcript import TextMismatch
from tts2face.sound.voice import Voice
from tts2face.types import (
    Clip,
    Speech,
    Trajectory,
    Waveform,
    YieldTurn,
    first_sample,
    frame_count,
    keep_on,
    pad_to_frame,
    resting_head,
)

if TYPE_CHECKING:
    from tts2face.lips.explanation import PhoneExplanation


Spoken = TypeVar("Spoken")
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
    explain: "Callable[[], tuple[PhoneExplanation, ...]]" = tuple
    mismatches: tuple[TextMismatch, ...] = ()
    text: str = ""
    transcript: PhoneSequence | None = None


@dataclass(frozen=True, slots=True, eq=False)
class SpeechModels:
    """What speaks: ``voice`` returns the voice of a name and a language.

    ``yield_turn`` is called between the steps of a piece; ``memory`` keeps the speech and the lip motion of sentences;
    ``deliveries`` are those of the styles of a palette.
    """

    voice: Voices
    yield_turn: YieldTurn = keep_on
    memory: SentenceMemory = NO_MEMORY
    deliveries: Deliveries = field(default_factory=lambda: NO_DELIVERIES)


@dataclass(frozen=True, slots=True)
class SpeechSpan:
    """Seconds of a clip at which its first word begins, its last word ends, and its sound ends."""

    begin: float
    end: float
    total: float


def measure_speech(prepared: PreparedRequest, models: SpeechModels) -> SpeechSpan:
    """Span of the speech of a text in its clip, without synthesis of motion."""
    fps, first_frame, begin, end, total = float(prepared.fps), 0, 0.0, 0.0, 0.0
    for spoken, _, _ in speak_sentences(prepared, models):
        at, phones = first_frame / fps, spoken.speech.phones
        voiced = [number for number, phone in enumerate(phones.phones) if phone != SILENCE]
        if voiced:
            begin = begin if end else at + float(phones.edges[voiced[0]])
            end = at + float(phones.edges[voiced[-1] + 1])
        total = at + spoken.speech.waveform.duration
        first_frame += frame_count(spoken.speech.waveform.duration, fps)
    return SpeechSpan(begin, end, total)


@dataclass(frozen=True, slots=True, eq=False)
class TimedSpeech:
    """Speech of a sentence with its final sound; its start and its named marks in seconds of the whole.

    ``n_steps`` and ``text`` are as for `Piece`.
    """

    speech: Speech
    begin: float
    marks: tuple[MarkTime, ...] = ()
    n_steps: int = 0
    text: str = ""


def timed_speech(prepared: PreparedRequest, models: SpeechModels) -> Iterator[TimedSpeech]:
    """Speech of each piece of a text or of idle animation, without motion.

    Raises
    ------
    InputError
        The request has a recording.
    """
    if prepared.request.audio is not None:
        raise InputError("a recording is not spoken; remove it, or stream its clip")
    return _timed_sentences(prepared, models)


def _timed_sentences(prepared: PreparedRequest, models: SpeechModels) -> Iterator[TimedSpeech]:
    fps, first_frame = prepared.fps, 0
    for spoken, n_steps, text in speak_sentences(prepared, models):
        speech, begin = pad_to_frame(spoken.speech, first_frame, fps), float(first_frame / fps)
        sound = spoken.sound.padded(len(speech.waveform.samples))
        yield TimedSpeech(replace(speech, waveform=sound), begin, shifted(spoken.marks, begin), n_steps, text)
        first_frame += frame_count(speech.waveform.duration, float(fps))


def sounds(prepared: PreparedRequest, models: SpeechModels) -> Iterator[Waveform]:
    """Sound of each piece of a text or of idle animation, without motion; the same samples as those of `pieces`."""
    return (timed.speech.waveform for timed in _sounds(prepared, models))


def _sounds(prepared: PreparedRequest, models: SpeechModels) -> Iterator[TimedSpeech]:
    """Pieces of which only the sound is that of `timed_speech`: it is not aligned with its phones."""
    fps, first_frame = prepared.fps, 0

    def speak(voice: Voice, sentence: Sentence, request: Request, voices: Voices) -> tuple[Waveform, int]:
        sound = sentence_sound(voice, sentence, request, voices, deliveries=models.deliveries)
        return sound, sentence.n_characters

    found: Iterator[tuple[Waveform, int]] = _spoken(prepared, models, speak)
    if prepared.request.idle is not None:
        found = ((spoken.sound, n_steps) for spoken, n_steps, _ in speak_sentences(prepared, models))
    for sound, n_steps in found:
        last_frame = first_frame + frame_count(sound.duration, float(fps))
        n_samples = first_sample(last_frame, sound.rate, fps) - first_sample(first_frame, sound.rate, fps)
        speech = Speech.without_phones(sound.padded(n_samples))
        yield TimedSpeech(speech, float(first_frame / fps), n_steps=n_steps)
        first_frame = last_frame


def speech_pieces(prepared: PreparedRequest, models: SpeechModels, *, has_phones: bool) -> Iterator[Piece]:
    """Pieces of a text or of idle animation with the sound, phones, words and marks of its clip, and without motion.

    Parameters
    ----------
    has_phones
        Whether more than the sound is wanted; otherwise it is not aligned with its phones.
    """
    fps = float(prepared.fps)
    for timed in (timed_speech if has_phones else _sounds)(prepared, models):
        n_frames = frame_count(timed.speech.waveform.duration, fps)
        still = Trajectory((), np.zeros((n_frames, 0), np.float32), fps)
        clip = Clip(still, resting_head(n_frames, fps), timed.speech)
        yield Piece(clip, timed.begin, timed.n_steps, marks=timed.marks, text=timed.text)


def _spoken(
    prepared: PreparedRequest, models: SpeechModels, speak: Callable[[Voice, Sentence, Request, Voices], Spoken]
) -> Iterator[Spoken]:
    """Result of `speak` for each sentence of a text."""
    request, voice_of = prepared.request, cache(models.voice)
    voice = voice_of(request.voice, request.language)
    for sentence in prepared.sentences():
        yield speak(voice, sentence, request, voice_of)


def speak_sentences(prepared: PreparedRequest, models: SpeechModels) -> Iterator[tuple[SpokenSentence, int, str]]:
    """Spoken sentences with numbers of characters and texts, or parts of idle animation with steps and no text."""
    request = prepared.request
    if request.idle is not None:
        yield from ((silent, steps, "") for silent, steps in silent_sentences(request.idle, prepared.fps, IDLE_STEPS))
        return

    said: Counter[str] = Counter()
    spoken_with = cache(
        lambda: (replace(request, text="", **NOT_SPOKEN), dictionary_entries(prepared))
    )  # of all sentences

    def speak(voice: Voice, sentence: Sentence, request: Request, voices: Voices) -> tuple[SpokenSentence, int, str]:
        text = " ".join(phrase.source for phrase in sentence.utterances)
        spoken = models.memory.recall(
            lambda: ("speech", sentence.relative(), spoken_with()),
            lambda: speak_sentence(voice, sentence, request, voices, models.yield_turn, deliveries=models.deliveries),
            lambda made: made.sound.samples.nbytes + made.speech.waveform.samples.nbytes,
        )
        speech = spoken.speech
        phones = correct_phones(speech.phones, text, said[text], prepared.edges)
        said[text] += 1
        return replace(spoken, speech=replace(speech, phones=phones)), sentence.n_characters, text

    yield from _spoken(prepared, models, speak)


def dictionary_entries(prepared: PreparedRequest) -> Hashable:
    """Pronunciations of the user, as part of a key."""
    return frozenset(prepared.dictionary.items())


def shifted(marks: tuple[MarkTime, ...], seconds: float) -> tuple[MarkTime, ...]:
    """Marks with later times."""
    return tuple(replace(mark, seconds=mark.seconds + seconds) for mark in marks)
