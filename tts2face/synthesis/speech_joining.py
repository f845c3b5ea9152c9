"""Concatenation of utterances with pauses between them, exact to the sample."""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from lexicon.sequence import SILENCE, PhoneSequence
from tts2face.speech.forced_alignment import enforce_increasing
from tts2face.types import Speech, Waveform, concatenate_speech

CUT_SILENCE_S = 0.05  # after a phrase within a sentence; with the silence before the next one a pause as at a comma
AUDIBLE_SHARE = 0.01  # of the largest amplitude
FADE_S = 0.005  # linear fade at each cut, which avoids clicks


def join_utterances(speeches: Sequence[Speech], gaps: Sequence[float]) -> tuple[Speech, list[float]]:
    """Concatenate utterances with given pauses.

    Parameters
    ----------
    speeches
        N utterances at one sample rate.
    gaps
        N - 1 pauses in seconds; silences at the ends of the utterances count as part of them.

    Returns
    -------
    speech
        The utterances in sequence.
    begins
        N offsets in seconds from times of the utterances to times of the whole.
    """
    parts: list[Speech] = []
    begins: list[float] = []
    at = 0.0
    for number, speech in enumerate(speeches):
        before = gaps[number - 1] if number > 0 else math.inf
        behind = gaps[number] if number < len(gaps) else math.inf
        short, cut = trim_silence(speech, before=before / 2, behind=behind / 2)
        if parts:
            missing = before - _silence_at_ends(parts[-1])[1] - _silence_at_ends(short)[0]
            if round(missing * speech.waveform.rate) > 0:
                parts.append(silent_speech(missing, speech.waveform.rate))
                at += parts[-1].waveform.duration
        parts.append(short)
        begins.append(at - cut)
        at += short.waveform.duration
    return (concatenate_speech(parts) if len(parts) > 1 else parts[0]), begins


def trim_silence(speech: Speech, *, before: float, behind: float) -> tuple[Speech, float]:
    """Limit the silence at the start and end of speech to `before` and `behind` seconds.

    Returns
    -------
    speech
        The trimmed speech.
    cut
        Seconds removed from the start.
    """
    sound, phones = speech.waveform, speech.phones
    lead, trail = _silence_at_ends(speech)
    begin = round(max(lead - before, 0.0) * sound.rate)
    end = len(sound.samples) - round(max(trail - behind, 0.0) * sound.rate)
    if (begin, end) == (0, len(sound.samples)):
        return speech, 0.0
    samples = sound.samples[begin:end] * _fade_gains(end - begin, sound.rate, begin > 0, end < len(sound.samples))
    edges = phones.edges - begin / sound.rate
    edges[0], edges[-1] = 0.0, len(samples) / sound.rate
    return Speech(Waveform(samples, sound.rate), PhoneSequence(phones.phones, edges), speech.words), begin / sound.rate


def trim_end(speech: Speech) -> Speech:
    """Speech with at most `CUT_SILENCE_S` of silence after its last audible sample, whatever its phones."""
    sound, phones = speech.waveform, speech.phones
    level = np.abs(sound.samples)
    audible = np.flatnonzero(level > AUDIBLE_SHARE * level.max(initial=0.0))
    end = int(audible[-1]) + 1 + round(CUT_SILENCE_S * sound.rate) if len(audible) else len(level)
    if end >= len(level):
        return speech
    short = Waveform(sound.samples[:end] * _fade_gains(end, sound.rate, False, True), sound.rate)
    edges = enforce_increasing(np.minimum(phones.edges, short.duration))
    return Speech(short, PhoneSequence(phones.phones, edges), speech.words)


def silent_speech(seconds: float, rate: int) -> Speech:
    """Speech that consists of silence, of at least one sample."""
    n_samples = max(round(seconds * rate), 1)
    return Speech.without_phones(Waveform(np.zeros(n_samples, np.float32), rate))


def resampled_speech(speech: Speech, rate: int) -> Speech:
    """Resample speech to `rate` Hz; all phone edges but the last, the duration of the sound, are unchanged."""
    if speech.waveform.rate == rate:
        return speech
    sound = speech.waveform.resampled(rate)
    edges = speech.phones.edges.copy()
    edges[-1] = sound.duration
    return Speech(sound, PhoneSequence(speech.phones.phones, edges), speech.words)


def _silence_at_ends(speech: Speech) -> tuple[float, float]:
    """Seconds of silence at the start and at the end."""
    labels, edges = speech.phones.phones, speech.phones.edges
    lead = float(edges[1]) if labels[0] == SILENCE else 0.0
    return lead, float(edges[-1] - edges[-2]) if labels[-1] == SILENCE else 0.0


def _fade_gains(n_samples: int, rate: int, begins: bool, ends: bool) -> NDArray[np.float32]:
    ramp = np.linspace(0.0, 1.0, min(round(FADE_S * rate), n_samples // 2), endpoint=False, dtype=np.float32)
    gain = np.ones(n_samples, np.float32)
    if begins:
        gain[: len(ramp)] = ramp
    if ends:
        gain[n_samples - len(ramp) :] = ramp[::-1]
    return gain
