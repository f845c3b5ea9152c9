"""Options of a request that exclude each other, in one table with the sentence that refuses them."""

from dataclasses import fields
from typing import Any, NamedTuple

from lexicon.errors import InputError


class Exclusion(NamedTuple):
    """Options of which any is refused where all of some others are given and one is not, with the sentence.

    An option is given if it differs from its default, a text if it is not blank; ``gestures=none`` is one with a value.
    """

    refused: set[str]
    beside: set[str]
    sentence: str
    without: str = ""


OF_SPEECH = {"markup", "voice", "rate", "voice_pitch", "voice_range", "volume", "lead", "spoken_mark"}
# In the order in which they are found.
EXCLUSIONS = (
    Exclusion({"articulation"}, {"idle"}, "--articulation has no effect with --idle; remove one of them"),
    Exclusion({"audio_map"}, set(), "--audio-map needs a recording; add --audio or remove --audio-map", "audio"),
    Exclusion(
        {"audio_map"},
        {"text"},
        "--audio-map has no effect if the words are given; remove --audio-map or the text",
    ),
    Exclusion(
        {"audio_map=voices", "audio_map=network", "audio_map=linear"},
        {"articulation"},
        "--articulation needs the phones of a recording; remove it, or --audio-map",
    ),
    Exclusion(
        {"voice", "rate", "voice_pitch", "voice_range", "lead", "spoken_mark"},
        {"audio"},
        "--voice, --rate, --voice-pitch, --voice-range, --lead and --spoken-mark have no effect on a recording; "
        "remove them or --audio",
    ),
    Exclusion({"text", "audio"}, {"idle"}, "--idle cannot be combined with text or --audio; remove one of them"),
    Exclusion(
        OF_SPEECH,
        {"idle"},
        "--markup, --voice, --rate, --voice-pitch, --voice-range, --volume, --lead and --spoken-mark have no effect "
        "with --idle; remove them",
    ),
    Exclusion(
        {"partner"},
        set(),
        "--partner needs a face that listens; add --listen with the seconds, or remove it",
        "listen",
    ),
    Exclusion({"audio", "idle"}, {"listen"}, "--listen cannot be combined with --audio or --idle; remove one of them"),
    Exclusion(
        OF_SPEECH,
        {"listen"},
        "--markup, --voice, --rate, --voice-pitch, --voice-range, --volume, --lead and --spoken-mark need a text after "
        "--listen; add one, or remove them",
        "text",
    ),
    Exclusion({"pitch"}, {"gestures=noise"}, "--pitch has no effect with --gestures noise; remove one of them"),
    Exclusion(
        {"style", "gain", "expression", "timeline", "pitch", "gaze"},
        {"gestures=none"},
        "--style, --gain, --expression, --timeline, --pitch and --gaze have no effect with --gestures none; remove "
        "them, or choose --gestures fields",
    ),
)


def check_exclusions(options: Any) -> None:
    """Refuse the options of a dataclass that exclude each other (`InputError`)."""
    given: set[str] = set()
    for option in fields(options):
        value = getattr(options, option.name)
        is_text = isinstance(value, str)
        if value != option.default and (not is_text or value.strip()):
            given |= {option.name, f"{option.name}={value}"} if is_text else {option.name}
    for row in EXCLUSIONS:
        if row.refused & given and row.beside <= given and row.without not in given:
            raise InputError(row.sentence)
