"""Frames and samples on one exact clock."""

from fractions import Fraction

from lexicon.errors import InputError
from tts2face.request import FRAMES_PER_SECOND

BROADCAST = (24, 30, 48, 60, 120)  # nominal rates whose broadcast form is 1000/1001 of them (SMPTE 12M)


def exact_rate(fps: float) -> Fraction:
    """Frames per second as a fraction; 23.976, 29.97, 59.94 and the like are thousandths over 1001.

    Raises
    ------
    InputError
        The rate is out of range.
    """
    low, high = FRAMES_PER_SECOND
    if not low <= fps <= high:
        raise InputError(f"fps must lie between {low:g} and {high:g}, not {fps:g}")
    for nominal in BROADCAST:
        if abs(fps - nominal * 1000 / 1001) < 0.006:
            return Fraction(nominal * 1000, 1001)
    return Fraction(fps).limit_denominator(1000)


def first_sample(frame: int, rate: int, fps: Fraction) -> int:
    """The sample that sounds when a frame appears."""
    return round(Fraction(frame) * rate / fps)
