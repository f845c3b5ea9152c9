"""Plans of speech whose sound still arrives: its sentence so far, with the accents that are known.

Level and pitch are relative to the last seconds of the sound, pauses end a sentence, and a peak is an accent once what
follows it is known. What was planned is not changed.
"""

from dataclasses import replace

import numpy as np

from tts2face.gestures.prosody import with_speech_level
from tts2face.gestures.speech_plan import (
    LEAST_PHRASE_S,
    MOST_PROMINENT,
    PEAK_GAP_S,
    PHRASE_PAUSE_S,
    Accent,
    SoundFeatures,
    Span,
    SpeechPlan,
    SpokenSentence,
    heard_accents,
    heard_rise,
    heard_spans,
)
from tts2face.numeric.arrays import Float32Array
from tts2face.sound.praat import IntensityTrack, intensity_track
from tts2face.types import Waveform

WINDOW_S = 1.6  # of sound from which level, pitch and accents are taken
ANALYSIS_S = 0.05  # of new sound after which they are taken again
PEAK_KNOWN_S = 0.06  # of sound behind a peak with which it is one
OPEN_S = 2.0  # for which an open sentence goes on as far as is known
END_PAUSE_S = 0.3  # of silence that ends a sentence: commas are shorter, and full stops longer
LEAST_SPEECH_S = 0.12  # of sound with which a sentence begins
# Prominence of an accent above that of its peak: those of texts are of content words, .87 in the mean; peaks have .40.
MORE_PROMINENCE = 0.47
TAIL_S = 0.1  # of sound before new sound, of which the intensity is measured with it
LEVEL_SHARE = 0.3  # of the level of the window in the level of speech, where there was speech before


class ArrivingSpeech:
    """Speech of one speaker, in blocks of any size.

    Parameters
    ----------
    rate
        Of the sound, in Hz; 16 kHz are enough.
    """

    def __init__(self, rate: int) -> None:
        self._rate = rate
        self._sound: Float32Array = np.zeros(0, np.float32)  # the last `WINDOW_S`
        # samples before it, and up to the ends of the last two analyses
        self._first = self._n_analysed = self._n_tracked = 0
        self._level: float | None = None  # dB of speech
        self._features: SoundFeatures | None = None
        self._sentence: SpokenSentence | None = None
        self._closed = -np.inf  # s, end of the sentence before

    @property
    def seconds(self) -> float:
        """Duration of the sound so far."""
        return (self._first + len(self._sound)) / self._rate

    def add(self, samples: Float32Array) -> None:
        """Append samples (m,)."""
        whole = np.concatenate([self._sound, samples])
        spare = max(len(whole) - round(WINDOW_S * self._rate), 0)
        self._sound, self._first = whole[spare:], self._first + spare

    def plan(self, start: float, *, is_ended: bool = False) -> SpeechPlan:
        """Plan of the frames from `start` seconds of the sound on, in seconds from there.

        Parameters
        ----------
        is_ended
            Whether no more sound follows.
        """
        n_new = self._first + len(self._sound) - self._n_analysed
        if n_new >= ANALYSIS_S * self._rate or (is_ended and n_new):
            self._analyse()
        features = self._features
        if features is None:
            return SpeechPlan()
        sentence = self._follow(features, is_ended=is_ended)
        sentences = () if sentence is None else (sentence,)
        track = None if features.intensity is None else features.intensity.track
        here = replace(
            features,
            times=features.times - start,
            intensity=None if features.intensity is None or track is None else replace(
                features.intensity, track=IntensityTrack(track.centres - start, track.levels)
            ),
        )  # fmt: skip
        return replace(SpeechPlan(sentences).shift(-start), sound=here)

    def _analyse(self) -> None:
        """Level and pitch of the window, in seconds of the sound."""
        if len(self._sound) < TAIL_S * self._rate:
            return
        self._n_tracked, self._n_analysed = self._n_analysed, self._first + len(self._sound)
        start = self._first / self._rate
        track = self._extended(start)
        intensity = with_speech_level(track, start, self.seconds)
        if intensity.level is not None:
            before = intensity.level if self._level is None else self._level
            self._level = before + LEVEL_SHARE * (intensity.level - before)
        # features of the window are in seconds of it
        here = replace(intensity, track=IntensityTrack(track.centres - start, track.levels), level=self._level)
        found = SoundFeatures.of(Waveform(self._sound, self._rate), here)
        self._features = replace(found, times=found.times + start, intensity=replace(here, track=track))

    def _extended(self, start: float) -> IntensityTrack:
        """Intensity of the window, in seconds of the sound, of which only the end is measured."""
        first = max(self._n_tracked - round(TAIL_S * self._rate), self._first)
        tail = intensity_track(Waveform(self._sound[first - self._first :], self._rate))
        centres = tail.centres + first / self._rate
        known = None if self._features is None or self._features.intensity is None else self._features.intensity.track
        if known is None or first == self._first:
            return IntensityTrack(centres, tail.levels)
        old = (known.centres >= start) & (known.centres < centres[0] + TAIL_S / 2)
        new = centres >= centres[0] + TAIL_S / 2
        return IntensityTrack(
            np.concatenate([known.centres[old], centres[new]]), np.concatenate([known.levels[old], tail.levels[new]])
        )

    def _follow(self, features: SoundFeatures, *, is_ended: bool) -> SpokenSentence | None:
        """The open sentence, or the one that ends now; None in a pause."""
        known = self._n_analysed / self._rate
        spans = [
            span
            for span in heard_spans(features, END_PAUSE_S, LEAST_SPEECH_S)
            if span.end > self._closed + LEAST_SPEECH_S
        ]
        if self._sentence is None:
            if not spans:
                return None
            onset = max(spans[-1].start, self._closed)
            self._sentence = SpokenSentence(Span(onset, known), (Span(onset, known),), (), is_open=True)
        sentence = self._sentence
        spans = [span for span in spans if span.end > sentence.span.start]
        end = spans[0].end if spans else known
        accents = self._accents(features, sentence, known if is_ended else known - PEAK_KNOWN_S)
        if not is_ended and len(spans) == 1 and known - end < END_PAUSE_S:
            whole = Span(sentence.span.start, known + OPEN_S)
            phrases = self._phrases(features, sentence, whole)
            self._sentence = replace(sentence, span=whole, phrases=phrases, accents=accents)
            return self._sentence
        end = end if spans else max(sentence.span.start, known - END_PAUSE_S)
        whole = Span(sentence.span.start, max(end, sentence.span.start + features.step_s))
        self._sentence, self._closed = None, whole.end
        rises = heard_rise(features, whole.end)
        phrases = self._phrases(features, sentence, whole)
        return replace(sentence, span=whole, phrases=phrases, accents=accents, rises=rises, is_open=False)

    def _phrases(self, features: SoundFeatures, sentence: SpokenSentence, whole: Span) -> tuple[Span, ...]:
        """Phrases of the sentence so far: those that have ended stay, the last one ends with the sentence."""
        ended = sentence.phrases[:-1]
        start = sentence.phrases[-1].start
        known = self._n_analysed / self._rate
        for phrase in heard_spans(features, PHRASE_PAUSE_S):
            if start + LEAST_PHRASE_S <= phrase.end <= min(known - PHRASE_PAUSE_S, whole.end - LEAST_PHRASE_S):
                ended = (*ended, Span(start, phrase.end))
                start = phrase.end
        return *ended, Span(start, max(whole.end, start + features.step_s))

    def _accents(self, features: SoundFeatures, sentence: SpokenSentence, known: float) -> tuple[Accent, ...]:
        last = sentence.accents[-1].time if sentence.accents else sentence.span.start - PEAK_GAP_S
        found = list(sentence.accents)
        for accent in heard_accents(features):
            if last + PEAK_GAP_S <= accent.time <= known:
                found.append(replace(accent, prominence=min(accent.prominence + MORE_PROMINENCE, MOST_PROMINENT)))
                last = accent.time
        return tuple(found)
