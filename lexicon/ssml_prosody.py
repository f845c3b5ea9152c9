"""Values of ``<prosody>``: rate, volume, pitch, range and contour."""

import math
import re
from collections.abc import Mapping
from types import MappingProxyType

from lexicon.errors import InputError
from lexicon.marked_text import PITCH_LIMITS
from lexicon.tones import Contour

SEMITONES_PER_OCTAVE = 12.0
USUAL_RANGE = 7.6  # semitones from the 10th to the 90th percentile of F0 in read sentences, by which a range is counted
NAMED_RATES = MappingProxyType({"x-slow": 0.5, "slow": 0.75, "medium": 1.0, "default": 1.0, "fast": 1.3, "x-fast": 1.7})
NAMED_VOLUMES = MappingProxyType(
    {"silent": 0.0, "x-soft": 0.35, "soft": 0.6, "medium": 1.0, "default": 1.0, "loud": 1.4, "x-loud": 2.0}
)
NAMED_PITCHES = MappingProxyType(
    {"x-low": -6.0, "low": -3.0, "medium": 0.0, "default": 0.0, "high": 3.0, "x-high": 6.0}
)
NAMED_RANGES = MappingProxyType({"x-low": 0.3, "low": 0.6, "medium": 1.0, "default": 1.0, "high": 1.4, "x-high": 1.8})
_AMOUNT = r"[0-9]{1,6}(?:\.[0-9]{1,9})?|\.[0-9]{1,9}"
_CHANGE = re.compile(rf"(?P<sign>[+-]?)(?P<amount>{_AMOUNT})\s*(?P<unit>%|st|Hz|dB|)", re.IGNORECASE)
_POINT = re.compile(rf"\(\s*({_AMOUNT})%\s*,\s*([^()\s]{{1,40}})\s*\)[\s,]*")
MAX_POINTS = 100  # of a contour
LARGEST_DB = 1e3  # is refused by the limits, too, and does not overflow


def semitones_factor(semitones: float) -> float:
    """Factor of a frequency that is so many semitones higher."""
    return math.pow(2.0, semitones / SEMITONES_PER_OCTAVE)


def look_up_value(what: str, value: str, values: Mapping[str, float]) -> float:
    """Value of a named setting."""
    if value not in values:
        raise InputError(f"there is no {what} {value[:40]!r}; use {', '.join(values)}")
    return values[value]


def parse_rate(written: str) -> float:
    """Factor of the speaking rate from a name, a percentage (80%), a change (-20%), or a number."""
    match = _CHANGE.fullmatch(written.strip())
    if match and match["unit"] == "%":
        share = float(match["amount"]) / 100
        return {"": share, "+": 1 + share, "-": 1 - share}[match["sign"]]
    if match and not match["unit"] + match["sign"]:
        return float(match["amount"])
    return look_up_value("rate", written.strip(), NAMED_RATES)


def parse_volume(written: str) -> float:
    """Factor of the volume from a name, decibels (+6dB), a change (+20%), or a share (80%, and 80 as in SSML 1.0)."""
    value = written.strip()
    match = _CHANGE.fullmatch(value)
    if match and match["unit"].lower() == "db":
        return float(10.0 ** (min(_signed(match), LARGEST_DB) / 20))
    if match and match["unit"] in {"%", ""}:
        return _signed(match) / 100 + (match["sign"] != "")
    if value not in NAMED_VOLUMES:
        raise InputError(
            f"cannot read the volume {written[:40]!r}; use decibels such as +6dB, or one of {', '.join(NAMED_VOLUMES)}"
        )
    return NAMED_VOLUMES[value]


def parse_pitch(written: str, voice_hz: float, added: float = 0.0) -> float:
    """Semitones to add, from a name, a change (+2st, -10%, +20Hz) or a pitch in Hz.

    Parameters
    ----------
    voice_hz
        Usual pitch of the voice.
    added
        Semitones that are added to it already: a pitch in Hz replaces them, as far as `PITCH_LIMITS` reach.
    """
    value = written.strip()
    match = _CHANGE.fullmatch(value)
    if match is None:
        if value not in NAMED_PITCHES:
            raise InputError(
                f"cannot read the pitch {written[:40]!r}; use semitones (+2st), a change (-10%, +20Hz), "
                f"a pitch (180Hz), or {', '.join(NAMED_PITCHES)}"
            )
        return NAMED_PITCHES[value]
    unit, amount = match["unit"].lower(), _signed(match)
    if unit == "st":
        return amount
    if unit == "%":
        factor = 1.0 + amount / 100
    elif unit == "hz":
        now_hz = voice_hz * semitones_factor(added)
        factor = amount / now_hz + (match["sign"] != "")
    else:
        raise InputError(f"the pitch {written[:40]!r} has no unit; use semitones (+2st), per cent (-10%) or Hz (180Hz)")
    if factor <= 0.0:
        raise InputError(f"a pitch of {written[:40]!r} leaves none; use a smaller change, as -20%")
    semitones = SEMITONES_PER_OCTAVE * math.log2(factor)
    if unit == "hz" and not match["sign"]:
        return min(max(added + semitones, PITCH_LIMITS[0]), PITCH_LIMITS[1]) - added
    return semitones


def parse_range(written: str, voice_hz: float) -> float:
    """Factor of the range of pitch from a name, a change (-50%, +2st, +20Hz), or a range in Hz."""
    value = written.strip()
    match = _CHANGE.fullmatch(value)
    if match is None:
        return look_up_value("range", value, NAMED_RANGES)
    unit, amount = match["unit"].lower(), _signed(match)
    range_hz = voice_hz * (semitones_factor(USUAL_RANGE / 2) - semitones_factor(-USUAL_RANGE / 2))
    usual = {"%": 100.0, "st": USUAL_RANGE, "hz": range_hz}
    if unit not in usual:
        raise InputError(f"the range {written[:40]!r} has no unit; use per cent (-50%), semitones (+2st) or Hz (80Hz)")
    # a percentage is a change also without a sign (SSML 1.1, 3.2.4)
    return max(amount / usual[unit] + (match["sign"] != "" or unit == "%"), 0.0)


def parse_contour(written: str, voice_hz: float, added: float = 0.0) -> Contour:
    """Points of a contour: shares of the time, 0 to 1, with the semitones there; arguments as of `parse_pitch`.

    Times without order are ordered, and of several points at one time the last one counts (SSML 1.1, 3.2.4). Points
    beyond `PITCH_LIMITS` lie on them: those of Azure's own example are 16 semitones low.
    """
    points: dict[float, float] = {}
    at, text = 0, written.strip()
    while match := _POINT.match(text, at):
        pitch = parse_pitch(match[2], voice_hz, added)
        points[min(float(match[1]) / 100, 1.0)] = min(max(pitch, PITCH_LIMITS[0]), PITCH_LIMITS[1])
        at = match.end()
    if at < len(text) or len(points) > MAX_POINTS:
        raise InputError(
            f'cannot read the contour {written[:40]!r}; write up to {MAX_POINTS} points as "(0%,+20%)(90%,-2st)"'
        )
    return tuple(sorted(points.items()))


def _signed(match: "re.Match[str]") -> float:
    return float(match["amount"]) * (-1 if match["sign"] == "-" else 1)
