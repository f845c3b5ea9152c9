"""Pieces of a clip, and the first step of a text and of idle animation: speech in whole frames, the face at rest."""

from collections import Counter, deque
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from fractions import Fraction
from functools import cache, partial
from itertools import chain
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from lexicon.errors import InputError, SilentTextError
from lexicon.given_phones import TextWord
from lexicon.marked_text import NameMark
from lexicon.sentence_length import n_letters
from lexicon.sentences import Sentence, text_prefix
from lexicon.sequence import SILENCE, PhoneSequence
from tts2face.gestures.speech_plan import SpeechPlan
from tts2face.gestures.timeline import Timeline
from tts2face.request import CONVERSATION, TURN_S, Idle, Listening, Recorded, Spoken
from tts2face.session.joining import JOIN_LEAD_S, Excerpt, excerpt_of_speech, shift_start, silent_speech, word_bounds
from tts2face.session.phrase_delivery import NO_DELIVERIES, Deliveries, text_of
from tts2face.session.prepared import IDLE_STEPS, PreparedRequest
from tts2face.session.speech import (
    MarkTime,
    Shortened,
    SpokenPart,
    SpokenSentence,
    Voices,
    expect_sentence,
    long_silence,
    script_of,
    sentence_sound,
    silent_sentences,
    speak_sentence,
    without_long_silence,
)
from tts2face.session.whole_frames import FramedPart, WholeFrames
from tts2face.sound.pauses import speech_onset
from tts2face.sound.voice import Voice
from tts2face.sound.voice_pool import require_installed
from tts2face.storage.memory import NO_MEMORY, ResultMemory
from tts2face.types import (
    Clip,
    Speech,
    Waveform,
    YieldTurn,
    concatenate_speech,
    keep_on,
)

if TYPE_CHECKING:
    from concurrent.futures import Future

    from tts2face.lips.explanation import PhoneExplanation
    from tts2face.sound.alignment import TextMismatch

AHEAD_S = 60.0  # of speech in memory, 12 MB, while the latest time of a timeline is not reached
# Options of a request that do not affect the speech of its sentences.
NOT_SPOKEN: Mapping[str, Any] = MappingProxyType(
    {"expression": None, "gain": None, "timeline": None, "pitch": False, "context": None, "exemplars": None}
    | {"gaze": CONVERSATION}
)
_FIRST, _LAST = "excerpt-begin", "excerpt-end"  # names of the marks at the onsets of an excerpt and of what follows it


@dataclass(frozen=True, slots=True, eq=False)
class Piece:
    """A part of a clip: a sentence of a text, or some seconds of a recording or of idle animation.

    It gains speech, then lip motion, gestures and edits; what it lacks is at rest.

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
    sentence
        Phones as they were spoken, in seconds of the piece: the sentence may begin within the first frame, behind the
        rest of the one before it, and end behind the last frame. None for a recording.
    transcript
        Phones of the whole recording, with its first piece; None for all other pieces.
    voice_sound
        Sound as the voice returns it, which gestures follow; None where it is that of the clip.
    script
        Words that are said, with their punctuation; empty where they are not known.
    is_last
        Whether the clip ends with it, as far as is known.
    plan
        Speech that gestures follow, in seconds of the piece; None for that which words and sound of the piece show.
    drawn
        Gestures that a thread draws (`tts2face.session.gesture_layer`), until they are added.
    """

    clip: Clip
    begin: float
    n_steps: int
    timeline: Timeline = field(default_factory=Timeline)
    marks: tuple[MarkTime, ...] = ()
    explain: "Callable[[], tuple[PhoneExplanation, ...]]" = tuple
    mismatches: "tuple[TextMismatch, ...]" = ()
    text: str = ""
    sentence: PhoneSequence | None = None
    transcript: PhoneSequence | None = None
    voice_sound: Waveform | None = None
    script: tuple[TextWord, ...] = ()
    is_last: bool = False
    plan: SpeechPlan | None = None
    drawn: "Future[Any] | None" = None

    @property
    def speech(self) -> Speech:
        """Speech with the final sound, in seconds of the piece."""
        return self.clip.speech

    @property
    def followed_sound(self) -> Waveform:
        """Sound that gestures follow."""
        return self.speech.waveform if self.voice_sound is None else self.voice_sound


@dataclass(frozen=True, slots=True, eq=False)
class SpeechModels:
    """Voices and what they share: ``voice`` returns the voice of a name and a language.

    ``yield_turn`` is called between the steps of a piece; ``memory`` keeps the speech and the lip motion of sentences;
    ``deliveries`` are those of the styles of a palette.
    """

    voice: Voices
    yield_turn: YieldTurn = keep_on
    memory: ResultMemory = NO_MEMORY
    deliveries: Deliveries = field(default_factory=lambda: NO_DELIVERIES)


@dataclass(frozen=True, slots=True)
class SpeechSpan:
    """Seconds of a clip at which its first word begins, its last word ends, and its sound ends."""

    begin: float
    end: float
    total: float


def measure_speech(prepared: PreparedRequest, models: SpeechModels) -> SpeechSpan:
    """Span of the speech of a text in its clip, without synthesis of motion."""
    start = 0.0
    end = 0.0
    total = 0.0
    for part, _ in _framed(prepared, models, WholeFrames(0, prepared.fps, ends_on_frame=False)):
        at, phones = float(part.first / prepared.fps), part.phones
        voiced = [number for number, phone in enumerate(phones.phones) if phone != SILENCE]
        if voiced:
            start = start if end else at + float(phones.edges[voiced[0]])
            end = at + float(phones.edges[voiced[-1] + 1])
        total = at + part.spoken.sound.duration
    return SpeechSpan(start, end, total)


def _framed(
    prepared: PreparedRequest, models: SpeechModels, frames: WholeFrames, *, has_phones: bool = True
) -> Iterator[tuple[FramedPart, SpokenPart | None]]:
    """Spoken parts in whole frames, and as they were spoken; None where the sentences after the last one are silent."""
    for part in speak_sentences(prepared, models, has_phones=has_phones):
        yield frames.add(part.spoken, is_last=part.is_last), part
    if (rest := frames.finish()) is not None:
        yield frames.add(rest, is_last=True), None


def spoken_pieces(
    prepared: PreparedRequest,
    models: SpeechModels,
    first_frame: int = 0,
    *,
    has_phones: bool = True,
    ends_on_frame: bool = False,
) -> Iterator[Piece]:
    """Pieces of a text or of idle animation with their speech and marks; the face is at rest and has no channels.

    All but the last end on a frame boundary, so that sound and picture stay synchronous at any length.

    Parameters
    ----------
    first_frame
        Frame of a longer clip at which the first piece begins.
    has_phones
        Whether more than the sound is wanted; otherwise it is not aligned with its phones, and marks have no time.
    ends_on_frame
        Whether the last one does so, too.
    """
    frames = WholeFrames(first_frame, prepared.fps, ends_on_frame=ends_on_frame)
    for framed, part in _framed(prepared, models, frames, has_phones=has_phones):
        piece = _piece(framed, prepared.fps, part)
        yield replace(piece, is_last=False) if ends_on_frame else piece


def _piece(part: FramedPart, fps: Fraction, said: SpokenPart | None) -> Piece:
    spoken = part.spoken
    start, speech = float(part.first / fps), spoken.speech
    return Piece(
        Clip.at_rest(part.n_frames, float(fps), replace(speech, waveform=spoken.sound)),
        start,
        0 if said is None else said.n_steps,
        spoken.timeline.restrict(0.0, speech.waveform.duration).shift(start),
        tuple(replace(mark, seconds=mark.seconds + start) for mark in spoken.marks),
        text="" if said is None else said.text,
        script=() if said is None else said.script,
        is_last=said is None or said.is_last,
        sentence=part.phones,
        voice_sound=speech.waveform,
    )


def spoken_ahead(pieces: Iterator[Piece], timeline: Timeline, yield_turn: YieldTurn) -> Iterator[Piece]:
    """Pieces of a text, spoken up to the latest time of a timeline before the first one is passed on.

    So times beyond the end of the clip are refused before anything of it is sent; beyond `AHEAD_S` that is found later.
    """
    waiting, seconds = deque[Piece](), 0.0
    # a time beyond the clip gets 400, not a stream that breaks off (decision 206)
    while seconds <= min(timeline.latest_s, AHEAD_S):
        if (piece := next(pieces, None)) is None:
            timeline.check_duration(seconds)
            break
        waiting.append(piece)
        seconds += piece.clip.motion.duration
        yield_turn()
    while waiting:
        yield waiting.popleft()
    yield from pieces


def timed_speech(prepared: PreparedRequest, models: SpeechModels, *, has_phones: bool = True) -> Iterator[Piece]:
    """Pieces of a text or of idle animation without motion; `has_phones` as for `spoken_pieces`.

    Raises
    ------
    InputError
        The request has a recording, or a time beyond the end of the clip, which its motion would refuse.
    """
    if isinstance(prepared.request.source, Recorded):
        raise InputError("a recording is not spoken; remove it, or stream its clip")
    pieces = spoken_pieces(prepared, models, has_phones=has_phones)
    return _within_clip(pieces, prepared.timeline, models.yield_turn) if prepared.request.has_gestures else pieces


def _within_clip(pieces: Iterator[Piece], timeline: Timeline, yield_turn: YieldTurn) -> Iterator[Piece]:
    seconds = 0.0
    for piece in spoken_ahead(pieces, timeline, yield_turn):
        seconds += piece.clip.motion.duration
        yield piece
    timeline.check_duration(seconds)


def after_listening(spoken: Spoken) -> Spoken:
    """A text that is spoken after listening: its first sound leaves time for a breath and for lips that part."""
    return spoken if spoken.lead is None else replace(spoken, lead=max(spoken.lead, TURN_S))


def speak_sentences(
    prepared: PreparedRequest, models: SpeechModels, *, has_phones: bool = True
) -> Iterator[SpokenPart]:
    """Spoken sentences, whose steps are characters, or parts of idle animation; of an excerpt there is one."""
    if prepared.excerpt is not None:
        yield _speak_excerpt(prepared, prepared.excerpt, models)
        return
    request = prepared.request
    source = request.source
    if isinstance(source, Idle) or (isinstance(source, Listening) and source.then is None):
        yield from silent_sentences(source.seconds, IDLE_STEPS, prepared.listening)
        return
    _require_voices(prepared)
    voices, said = cache(models.voice), Counter[str]()
    first = text_of(request)
    voice = voices(first.voice, request.language)
    if isinstance(source, Listening):
        rate = voice.sample_rate
        yield from _ending(silent_sentences(source.seconds, IDLE_STEPS, prepared.listening, rate), is_last=False)
        first = after_listening(first)
    request = replace(request, source=first)
    unspoken = cache(lambda: replace(request, source=replace(first, text=""), **NOT_SPOKEN))
    spoken_with = cache(lambda: (unspoken(), frozenset(prepared.dictionary.items())))
    following = cache(lambda: replace(request, source=replace(first, lead=JOIN_LEAD_S)))

    def speak(sentence: Sentence) -> SpokenSentence:
        given = following() if said else request
        lead = JOIN_LEAD_S if said else first.lead
        if not has_phones:
            sound = sentence_sound(voice, sentence, given, voices, deliveries=models.deliveries)
            return SpokenSentence(Speech.without_phones(sound), Timeline(), (), sound)
        return models.memory.recall(
            lambda: ("speech", sentence.relative(), lead, spoken_with()),
            lambda: speak_sentence(voice, sentence, given, voices, models.yield_turn, deliveries=models.deliveries),
            lambda made: made.sound.samples.nbytes + made.speech.waveform.samples.nbytes,
        )

    shortened = map(partial(_expected, voice), prepared.sentences())
    for (sentence, before_s, after_s), found, is_last in _spoken(shortened, speak):
        text = " ".join(phrase.source for phrase in sentence.utterances)
        spoken = found
        if has_phones:
            phones = prepared.corrected(found.speech.phones, text, said[text])
            spoken = replace(found, speech=replace(found.speech, phones=phones))
        said[text] += 1
        before = long_silence(before_s, Timeline(), voice.sample_rate)
        after = long_silence(after_s, spoken.timeline, voice.sample_rate)
        part = SpokenPart(spoken, sentence.n_characters, text, script=script_of(sentence, request.language))
        yield from _ending(chain(before, [part], after), is_last=is_last)


def _expected(voice: Voice, sentence: Sentence) -> Shortened:
    """A sentence without its long silences, for which the voice is asked ahead."""
    shortened = without_long_silence(sentence)
    expect_sentence(voice, shortened.sentence)
    return shortened


def _ending(parts: Iterator[SpokenPart], *, is_last: bool) -> Iterator[SpokenPart]:
    """Parts of which the last is, or is not, that of a clip."""
    part = next(parts)
    for following in parts:
        yield part._replace(is_last=False)
        part = following
    yield part._replace(is_last=is_last)


def _require_voices(prepared: PreparedRequest) -> None:
    """Refuse a text with a voice that is missing, which would fail in a later sentence."""
    for name in {run.voice for run in prepared.text.runs if run.voice is not None}:
        require_installed(name)


def _speak_excerpt(prepared: PreparedRequest, excerpt: Excerpt, models: SpeechModels) -> SpokenPart:
    """The kept words of a text that is spoken as a whole, with the request's silence before them."""
    text = prepared.text
    places = [len(text_prefix(text.text, n)) for n in (excerpt.first, excerpt.last)]
    has_next = excerpt.last < n_letters(text.text)
    marks = [
        NameMark(at, name) for at, name, is_set in zip(places, (_FIRST, _LAST), (True, has_next), strict=True) if is_set
    ]
    whole = replace(text, marks=tuple(sorted((*text.marks, *marks), key=lambda mark: mark.at)))
    request = replace(prepared, text=whole, excerpt=None)
    spoken = [part.spoken for part in speak_sentences(request, models)]
    starts = np.cumsum([0.0, *(sentence.speech.waveform.duration for sentence in spoken)])
    times = {
        mark.name: mark.seconds + start for said, start in zip(spoken, starts, strict=False) for mark in said.marks
    }
    voice = concatenate_speech([sentence.speech for sentence in spoken])
    bounds = word_bounds(voice, times.get(_FIRST, 0.0), times.get(_LAST, voice.waveform.duration))
    kept = excerpt_of_speech(voice, *bounds)
    sound = excerpt_of_speech(concatenate_speech([_with_sound(sentence) for sentence in spoken]), *bounds)
    cut = 0
    lead = text_of(prepared.request).lead
    if lead is not None:
        cut = round((speech_onset(kept.waveform) - lead) * kept.waveform.rate)
    silence = [silent_speech(excerpt.silence, kept.waveform.rate)] if excerpt.silence > 0.0 else []
    kept, sound = (concatenate_speech([shift_start(part, cut), *silence]) for part in (kept, sound))
    written = text.text[places[0] : places[1]].strip()
    return SpokenPart(SpokenSentence(kept, Timeline(), (), sound.waveform), len(written), written, is_last=True)


def _with_sound(spoken: SpokenSentence) -> Speech:
    """The speech of a sentence with the sound of its clip."""
    return replace(spoken.speech, waveform=spoken.sound.part(0, len(spoken.speech.waveform.samples)))


def _spoken(
    sentences: Iterator[Shortened], speak: Callable[[Sentence], SpokenSentence]
) -> Iterator[tuple[Shortened, SpokenSentence, bool]]:
    """Sentences with their speech and whether one is the last, but silent ones, unless these are all."""
    silent, n_spoken = None, 0
    following = next(sentences, None)
    while following is not None:
        shortened, following = following, next(sentences, None)
        try:
            spoken = speak(shortened.sentence)
        except SilentTextError as error:
            silent = error
            continue
        n_spoken += 1
        yield shortened, spoken, following is None
    # single signs are left out; a text of signs alone is an error
    if silent is not None and not n_spoken:
        raise silent
