"""Delivery of a phrase: what the request, its marks and its style ask of the voice."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from types import MappingProxyType

from lexicon.marked_text import RATE_LIMITS, StyleRun
from lexicon.sentences import Phrase
from tts2face.gestures.timeline import parse_style
from tts2face.models.palette import FEATURES, PLAIN, Delivery
from tts2face.request import Request, Spoken
from tts2face.sound.delivery import speak_with
from tts2face.sound.prosody import Prosody
from tts2face.sound.voice import SpeechInput, SpokenWord, Voice
from tts2face.types import Speech

Deliveries = Mapping[str, Delivery]  # of a palette's styles, by name
NO_DELIVERIES: Deliveries = MappingProxyType({})


def text_of(request: Request) -> Spoken:
    """The text of a request, of which there is one, with its options."""
    assert request.spoken is not None
    return request.spoken


def delivery_of(part: Phrase, runs: Sequence[StyleRun], request: Request, deliveries: Deliveries) -> Delivery:
    """Delivery of a phrase: that of the style of most of its letters, if the style is one of the whole face.

    A rate, volume, pitch or range that the request or a mark sets replaces that of the style.
    """
    spoken = text_of(request)
    if spoken.plain_delivery:
        return PLAIN
    found = deliveries.get(_whole_style(request.style, _longest_run(part, runs).styles), PLAIN)
    has_rate = spoken.rate != 1.0 or part.rate != 1.0 or part.seconds is not None
    has_volume = spoken.volume != 1.0 or any(run.volume != 1.0 for run in runs)
    has_pitch = spoken.voice_pitch != 0.0 or any(run.tone.pitch != 0.0 for run in runs)
    has_range = spoken.voice_range != 1.0 or any(run.tone.range != 1.0 for run in runs)
    return Delivery(
        1.0 if has_rate else found.rate,
        0.0 if has_volume else found.level_db,
        0.0 if has_pitch else found.pitch,
        1.0 if has_range else found.range,
    )


def prosody_of(part: Phrase, request: Request, delivery: Delivery) -> Prosody:
    """Prosody of a phrase with the delivery of its style."""
    spoken = text_of(request)
    rate = 1.0 if part.seconds is not None else spoken.rate * part.rate * delivery.rate
    return Prosody(rate, spoken.voice_pitch + delivery.pitch, spoken.voice_range * delivery.range)


def _longest_run(part: Phrase, runs: Sequence[StyleRun]) -> StyleRun:
    """The run with most letters of a phrase; the first of equal ones."""
    ends = [*(run.start for run in runs[1:]), part.last]
    lengths = [min(end, part.last) - max(run.start, part.first) for run, end in zip(runs, ends, strict=True)]
    return runs[lengths.index(max(lengths))]


@lru_cache(maxsize=1000)
def _whole_style(base: str | None, nested: tuple[str, ...]) -> str:
    """Name of the style that all features have; empty if they differ or have none."""
    chosen: dict[str, str] = {}
    for written in ([base] if base is not None else []) + list(nested):
        chosen |= parse_style(written)
    names = {chosen.get(feature, "") for feature in FEATURES}
    return names.pop() if len(names) == 1 else ""


def speak_phrase(speaker: Voice, part: Phrase, request: Request, prosody: Prosody) -> Speech:
    """Speech of a phrase, as long as it shall be as far as rates of `RATE_LIMITS` reach."""
    content, language = phrase_content(part), part.language or request.language
    speech = speak_with(speaker, content, prosody, request.known_seed, language=language)
    if part.seconds is None or not speech.words:
        return speech
    lasting = float(speech.phones.edges[speech.words[-1].last] - speech.phones.edges[speech.words[0].first])
    rate = min(max(prosody.rate * lasting / part.seconds, RATE_LIMITS[0]), RATE_LIMITS[1])
    return speak_with(speaker, content, replace(prosody, rate=rate), request.known_seed, language=language)


def phrase_content(part: Phrase) -> SpeechInput:
    """Words of a phrase with their phones, or its text."""
    return [SpokenWord(word.text, word.segments, word.after, word.tone) for word in part.words] or part.text
