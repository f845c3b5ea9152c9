"""Fit of speech to the time of its cue: the speaking rate, the pauses, and what remains too long."""

import re
from collections.abc import Callable
from dataclasses import dataclass

from lexicon.errors import InputError
from tts2face.batch.options import CUT_PAUSES, REPORT
from tts2face.request import RATE_LIMITS
from tts2face.synthesis.speech_stream import SpeechSpan

MAX_STEPS = 4  # of the search for a rate; two are usual
AIM = 0.985  # of the cue's time, so that rounding of durations by the voice does not need another step
PAUSE_PLACES = re.compile(r"(?<=\w)([,;:.!?…]+)\s+(?=\S)")
SHORT_PAUSE = "[pause 0]"  # the shortest pause between two utterances, 20 ms


Measure = Callable[[str, float], SpeechSpan]  # span of a text at a rate


@dataclass(frozen=True, slots=True)
class Fit:
    """Text and rate by which speech fits its cue.

    Parameters
    ----------
    text
        Words, with marks that shorten the pauses if that was needed.
    rate
        Speaking rate.
    speech_s
        Seconds from the begin of the cue to the end of the last word.
    overflow_s
        Seconds by which the last word ends after the cue; 0 if it fits.
    n_steps
        Number of times the speech was measured.
    """

    text: str
    rate: float
    speech_s: float
    overflow_s: float
    n_steps: int


@dataclass(frozen=True, slots=True)
class Limits:
    """Time of a cue, time up to the next one (None: unlimited), and how speech may be changed."""

    window_s: float
    slot_s: float | None
    rate: float
    max_rate: float
    policy: str


def fit_speech(text: str, limits: Limits, measure: Measure) -> Fit:
    """Choose the rate and pauses by which a text fits its cue.

    The natural duration is measured first; a text that is shorter than its cue keeps its rate. Else the rate is raised
    up to `Limits.max_rate`, measured again at each step, as durations of voices do not follow the rate exactly. Then
    the policy applies: ``extend`` lets the speech end after its cue, up to the next one; ``cut-pauses`` shortens the
    pauses at punctuation first; ``report`` changes nothing.
    """
    fastest = max(limits.rate, limits.max_rate)
    fit = _search(text, limits.rate, fastest, limits.window_s, measure)
    if fit.overflow_s > 0.0 and limits.policy == CUT_PAUSES and PAUSE_PLACES.search(text):
        short = PAUSE_PLACES.sub(rf"\1 {SHORT_PAUSE} ", text)
        n_before = fit.n_steps
        fit = _search(short, limits.rate, fastest, limits.window_s, measure)
        fit = Fit(fit.text, fit.rate, fit.speech_s, fit.overflow_s, fit.n_steps + n_before)
    if limits.slot_s is not None and fit.speech_s > limits.slot_s and limits.policy != REPORT:
        last = _search(fit.text, fit.rate, RATE_LIMITS[1], limits.slot_s, measure)  # the next cue begins: faster
        overflow = max(0.0, last.speech_s - limits.window_s)
        fit = Fit(last.text, last.rate, last.speech_s, overflow, fit.n_steps + last.n_steps)
    return fit


def _search(text: str, rate: float, fastest: float, window_s: float, measure: Measure) -> Fit:
    """The lowest rate from `rate` to `fastest` at which a text fits, or the fastest one."""
    if not rate <= fastest:
        raise InputError(f"the rate {rate:g} exceeds the largest rate {fastest:g}; lower it")
    spoken = measure(text, rate).end
    steps = 1
    while spoken > window_s and rate < fastest and steps < MAX_STEPS:
        rate = min(fastest, rate * max(spoken / (window_s * AIM), 1.01))
        if steps == MAX_STEPS - 1:
            rate = fastest
        spoken = measure(text, rate).end
        steps += 1
    return Fit(text, round(rate, 6), spoken, max(0.0, spoken - window_s), steps)
