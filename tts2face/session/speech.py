"""Synthesis of sentences with marks: sound with pauses, rate and level under styles, and the times of the marks."""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from lexicon.errors import InputError, SilentTextError
from lexicon.given_phones import TextWord
from lexicon.marked_text import MAX_PAUSE_S, GestureMark, Mark, MarkedText, NameMark, StyleRun
from lexicon.normalize import spoken_forms, written_pieces
from lexicon.pauses import PAUSES_S, last_mark
from lexicon.sentence_length import n_letters
from lexicon.sentences import Phrase, Sentence, index_by_letters
from lexicon.sequence import PhoneSequence, WordSpan
from lexicon.sources import written_groups
from tts2face.gestures.elements import StyleSpan, span_weights
from tts2face.gestures.timeline import Timeline
from tts2face.numeric.arrays import FloatArray
from tts2face.request import Request
from tts2face.session.joining import (
    END_S,
    JOIN_LEAD_S,
    LEAST_TAIL_S,
    SentenceTimes,
    WordTimes,
    end_after,
    join_utterances,
    lead_in,
    resampled_speech,
    silent_speech,
)
from tts2face.session.marked_styles import innermost_styles
from tts2face.session.phrase_delivery import (
    NO_DELIVERIES,
    Deliveries,
    delivery_of,
    phrase_content,
    prosody_of,
    speak_phrase,
    text_of,
)
from tts2face.session.prepared import gesture_of
from tts2face.sound.delivery import sound_with
from tts2face.sound.level import level_speech
from tts2face.sound.voice import ExpectingVoice, Voice, apply_volume
from tts2face.sound.voice_pool import has_voice, speaks
from tts2face.types import Speech, Waveform, YieldTurn, concatenate_speech, keep_on

MIN_UTTERANCE_GAP_S = 0.02  # between utterances of a sentence; less would cut into speech (edges are exact to 16 ms)
SPEED_CHANGE_PAUSE_S = 0.06  # between utterances that differ in speed only
IDLE_PART_S = 10.0  # length of the parts of idle animation, similar to a long sentence
IDLE_RATE = 48_000  # Hz, sample rate of idle animation
LOUDNESS_RAMP_S = 0.03  # transition between two loudness levels
Voices = Callable[[str | None, str], Voice]  # a voice by name (None: the best one) and language


@dataclass(frozen=True, slots=True)
class MarkTime:
    """A named mark and its time in seconds."""

    name: str
    seconds: float


@dataclass(frozen=True, slots=True, eq=False)
class SpokenSentence:
    """A synthesised sentence; times are relative to its start.

    Parameters
    ----------
    speech
        Speech as the voice returns it, from which motion is computed.
    timeline
        Gestures requested by the marks.
    marks
        Named marks.
    sound
        Sound of `speech` at the loudness of the clip.
    """

    speech: Speech
    timeline: Timeline
    marks: tuple[MarkTime, ...]
    sound: Waveform


class SpokenPart(NamedTuple):
    """A spoken sentence with its steps of progress and its written text, or a part of a silence, which has no text."""

    spoken: SpokenSentence
    n_steps: int
    text: str = ""
    is_last: bool = False  # of a clip, as far as is known before it is spoken
    script: tuple[TextWord, ...] = ()  # its words, with punctuation


class Shortened(NamedTuple):
    """A sentence without its long silences, and their seconds before and after it."""

    sentence: Sentence
    before_s: float
    after_s: float


def speak_sentence(
    voice: Voice,
    sentence: Sentence,
    request: Request,
    voices: Voices | None = None,
    yield_turn: YieldTurn = keep_on,
    *,
    deliveries: Deliveries = NO_DELIVERIES,
) -> SpokenSentence:
    """Synthesise a sentence with its pauses, speeds and loudness, and compute the times of its marks.

    The speech of a sentence without marks equals the output of the voice, byte for byte. The sound is normalised to the
    loudness of all clips, to which the loudness of the request and of the marks is relative. `yield_turn` is called
    between the steps.

    Parameters
    ----------
    voice
        Voice of the request.
    request
        Options of the clip; its ``lead`` is `JOIN_LEAD_S` for a sentence after another one.
    voices
        Returns the voice of a name and a language, for spans in another voice or language; their sound is resampled to
        the sample rate of `voice`.
    deliveries
        Of the styles of the palette.
    """
    text = text_of(request)
    parts: list[Phrase] = []
    spoken: list[Speech] = []
    volumes: list[float] = []  # of the sound; motion follows the voice's own loudness
    for part in sentence.utterances:
        speaker = speaker_of(part, voice, request, voices)
        delivery = delivery_of(part, sentence.runs, request, deliveries)
        prosody = prosody_of(part, request, delivery)
        try:
            speech = speak_phrase(speaker, part, request, prosody)
        except SilentTextError:  # signs, such as pictures, for which a voice has no words
            # a sentence of signs alone is an error, beside words they are left out
            if part is sentence.utterances[-1] and not spoken:
                raise
            continue
        parts.append(part)
        spoken.append(resampled_speech(speech, voice.sample_rate))
        volumes.append(text.volume * delivery.volume)
    spoken[0] = _led(spoken[0], request)
    spoken[-1] = _ended(spoken[-1], sentence, prosody.rate)
    sentence = replace(sentence, utterances=tuple(parts))
    spoken = [
        as_written(speech, part, part.language or request.language)
        for speech, part in zip(spoken, sentence.utterances, strict=True)
    ]
    word_times = [
        WordTimes(
            part.source, speech.phones, speech.words, language=part.language or request.language, first=part.first
        )
        for part, speech in zip(parts, spoken, strict=True)
    ]
    gains = [
        _gain(speech.waveform, sentence.runs, part, times)
        for part, speech, times in zip(parts, spoken, word_times, strict=True)
    ]
    scaled = [_scale_speech(speech, text.volume, gain) for speech, gain in zip(spoken, gains, strict=True)]
    speech, starts = _join_sentence(scaled, sentence, voice.sample_rate)
    yield_turn()
    levelled = level_speech(spoken, [volume * gain for volume, gain in zip(volumes, gains, strict=True)], yield_turn)
    sound = _join_sentence(levelled, sentence, voice.sample_rate)[0].waveform
    times = SentenceTimes(tuple(part.first for part in sentence.utterances), tuple(word_times), tuple(starts))
    return SpokenSentence(
        speech, *resolve_marks(sentence.runs, sentence.marks, times, (sentence.first, sentence.last)), sound
    )


def as_written(speech: Speech, part: Phrase, language: str) -> Speech:
    """Speech whose words are those of the text (3,50 €), each with the phones of its spoken ones; English as it is."""
    if language.startswith("en") or part.words:
        return speech
    words = speech.words
    groups = written_groups([word.text for word in words], spoken_forms(part.source, language))
    spans = [
        WordSpan(text, words[at.start].first, words[at.stop - 1].last, min(words[k].confidence for k in at))
        for text, at in groups
    ]
    return replace(speech, words=tuple(spans))


def script_of(sentence: Sentence, language: str) -> tuple[TextWord, ...]:
    """Words of a sentence as `as_written` has them, with the punctuation after them."""
    found: list[TextWord] = []
    for part in sentence.utterances:
        own = part.language or language
        if own.startswith("en") or part.words:
            found += part.words or map(TextWord, part.text.split())
            continue
        found += (TextWord(text, after=after) for text, after in written_pieces(part.source, own))
    return tuple(found)


def expect_sentence(voice: Voice, sentence: Sentence) -> None:
    """Let a voice that can begin with a sentence, while the one before it is worked on."""
    if isinstance(voice, ExpectingVoice):
        for part in sentence.utterances:
            if part.voice is None and part.language is None:
                voice.expect(phrase_content(part))


def sentence_sound(
    voice: Voice,
    sentence: Sentence,
    request: Request,
    voices: Voices | None = None,
    *,
    deliveries: Deliveries = NO_DELIVERIES,
) -> Waveform:
    """Sound of `speak_sentence`, byte for byte, without aligning the phones of a sentence that needs no edges."""
    part, text = sentence.utterances[0], text_of(request)
    # joins and gains need the edges of phones
    if len(sentence.utterances) > 1 or part.seconds is not None or any(run.loudness != 1.0 for run in sentence.runs):
        return speak_sentence(voice, sentence, request, voices, deliveries=deliveries).sound
    speaker = speaker_of(part, voice, request, voices)
    delivery = delivery_of(part, sentence.runs, request, deliveries)
    prosody, language = prosody_of(part, request, delivery), part.language or request.language
    sound = sound_with(speaker, phrase_content(part), prosody, request.known_seed, language=language)
    whole = _led(resampled_speech(Speech.without_phones(sound), voice.sample_rate), request)
    whole = _ended(whole, sentence, prosody.rate)
    levelled = level_speech([whole], [text.volume * delivery.volume * np.ones(1)])
    return _join_sentence(levelled, sentence, voice.sample_rate)[0].waveform


def _led(speech: Speech, request: Request) -> Speech:
    """Speech with the request's silence before it."""
    lead = text_of(request).lead
    return speech if lead is None else lead_in(speech, lead)


def _ended(speech: Speech, sentence: Sentence, rate: float) -> Speech:
    """Speech with the silence behind a sentence."""
    tail = END_S if sentence.pause_s is None else sentence.pause_s / rate - JOIN_LEAD_S
    return end_after(speech, max(tail, LEAST_TAIL_S))


def speaker_of(part: Phrase, voice: Voice, request: Request, voices: Voices | None) -> Voice:
    """Voice of a phrase: the request's, or for a span with a voice or language of its own, the matching one."""
    if part.voice is None and part.language is None:
        return voice
    if voices is None:
        raise InputError("a text with spans of other voices or languages needs voices to speak them")
    return voices(voice_in(part.voice or text_of(request).voice, part.language), part.language or request.language)


def voice_in(name: str | None, language: str | None) -> str | None:
    """`name` if that voice speaks `language` (None: the language of the text), else None for the default voice."""
    if language is None or name is None or (has_voice(name) and speaks(name, language)):
        return name
    return None


def _join_sentence(speeches: Sequence[Speech], sentence: Sentence, rate: int) -> tuple[Speech, list[float]]:
    """Utterances of a sentence with its pauses, and the start of each in seconds."""
    speech, starts = join_utterances(speeches, [_pause_after(part) for part in sentence.utterances[:-1]])
    if sentence.leading_pause > 0:
        before = silent_speech(sentence.leading_pause, rate)
        speech, starts = concatenate_speech([before, speech]), [second + before.waveform.duration for second in starts]
    if pause := sentence.utterances[-1].pause:
        speech = concatenate_speech([speech, silent_speech(pause, rate)])
    return speech, starts


def silent_sentences(seconds: float, n_steps: int, timeline: Timeline, rate: int = IDLE_RATE) -> Iterator[SpokenPart]:
    """Yield silence in parts of up to `IDLE_PART_S`; the last one is the last of a clip.

    `timeline` is that of the whole silence, `rate` that of the sound in Hz.
    """
    n_samples = max(round(seconds * rate), 1)
    bounds = [*range(0, n_samples, round(IDLE_PART_S * rate)), n_samples]
    for first, last in pairwise(bounds):
        steps = n_steps * last // n_samples - n_steps * first // n_samples
        start, end = first / rate, last / rate
        silence = silent_speech(end - start, rate)
        spoken = SpokenSentence(silence, timeline.restrict(start, end).shift(-start), (), silence.waveform)
        yield SpokenPart(spoken, steps, is_last=last == n_samples)


def without_long_silence(sentence: Sentence) -> Shortened:
    """A sentence with at most `MAX_PAUSE_S` of silence at either end.

    Pauses between words add up only where nothing but punctuation is between them.
    """
    *others, last = sentence.utterances
    before = max(sentence.leading_pause - MAX_PAUSE_S, 0.0)
    after = max((last.pause or 0.0) - MAX_PAUSE_S, 0.0)
    if not (before or after):
        return Shortened(sentence, 0.0, 0.0)
    kept = replace(last, pause=None if last.pause is None else last.pause - after)
    shorter = replace(sentence, utterances=(*others, kept), leading_pause=sentence.leading_pause - before)
    return Shortened(shorter, before, after)


def long_silence(seconds: float, timeline: Timeline, rate: int) -> Iterator[SpokenPart]:
    """`silent_sentences` of some seconds within a text, if there are any, without progress of their own.

    The styles without an end in the `timeline` of the sentence before it go on.
    """
    timeline = Timeline(spans=tuple(replace(span, start=0.0) for span in timeline.spans if span.end == math.inf))
    yield from silent_sentences(seconds, 0, timeline, rate) if seconds > 0.0 else ()


def resolve_marks(
    runs: Sequence[StyleRun], marks: Sequence[Mark], times: WordTimes | SentenceTimes, letters: tuple[int, int]
) -> tuple[Timeline, tuple[MarkTime, ...]]:
    """Convert marks in a range of letters to a timeline and named marks, by the times of the letters.

    A style that starts at the first letter starts at 0 s, and one that reaches the last letter has no end. Other styles
    start with their first word and end with their last word, or at the onset of the next style.
    """
    first, last = letters
    spans: list[StyleSpan] = []
    previous_end = 0.0
    for run, following in zip(runs, [*runs[1:], None], strict=True):
        start = max(times.onset(run.start) if run.start > first else 0.0, previous_end)
        if following is None or following.start >= last:
            end = math.inf
        else:
            end = times.onset(following.start) if following.styles else times.end(following.start)
        previous_end = max(end, previous_end)
        if start < end:
            spans += [StyleSpan(feature, style, start, end) for feature, style in innermost_styles(run.styles).items()]
    gestures = tuple(gesture_of(mark, times.onset(mark.at)) for mark in marks if isinstance(mark, GestureMark))
    names = tuple(MarkTime(mark.name, times.onset(mark.at)) for mark in marks if isinstance(mark, NameMark))
    return Timeline(spans=tuple(spans), gestures=gestures), names


def resolve_recording_marks(
    text: MarkedText, phones: PhoneSequence, words: Sequence[WordSpan], language: str
) -> tuple[Timeline, tuple[MarkTime, ...]]:
    """As `resolve_marks`, for a recording; an empty timeline if its words are unknown."""
    if not words:
        return Timeline(), ()
    indexed = index_by_letters(text)
    times = WordTimes(text.text, phones, words, language=language)
    return resolve_marks(indexed.runs, indexed.marks, times, (0, n_letters(text.text)))


def _pause_after(utterance: Phrase) -> float:
    """Pause in seconds between an utterance and the next one of its sentence."""
    if utterance.pause is not None:
        return max(utterance.pause, MIN_UTTERANCE_GAP_S)
    return max(PAUSES_S[last_mark(utterance.source)] / utterance.rate, SPEED_CHANGE_PAUSE_S)


def _gain(sound: Waveform, runs: Sequence[StyleRun], part: Phrase, times: WordTimes) -> FloatArray:
    """(n,) or (1,) gain of an utterance's samples, from the loudness of its runs."""
    volumes = [
        (run.loudness, max(run.start, part.first), end)
        for run, end in zip(runs, [*(run.start for run in runs[1:]), part.last], strict=True)
        if run.start < part.last and end > part.first
    ]
    if all(volume == 1.0 for volume, _, _ in volumes):
        return np.ones(1)
    seconds = np.arange(len(sound.samples)) / sound.rate
    gain = np.ones(len(seconds))
    for volume, first, last in volumes:
        start = times.onset(first) if first > part.first else 0.0
        end = times.end(last) if last < part.last else math.inf
        if start < end:
            gain += (volume - 1.0) * span_weights(seconds, start, end, LOUDNESS_RAMP_S)
    factors: FloatArray = np.maximum(gain, 0.0)
    return factors


def _scale_speech(speech: Speech, volume: float, gain: FloatArray) -> Speech:
    """Speech times a volume and a gain, limited to full scale, from which motion is computed."""
    samples = apply_volume(speech.waveform.samples, volume)
    # limited: scaled as a whole, what is not louder would become softer
    scaled = samples if len(gain) == 1 else np.clip(samples * gain, -1.0, 1.0)
    return replace(speech, waveform=Waveform(scaled, speech.waveform.rate))
