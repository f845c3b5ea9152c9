"""Exact conversion between video frames and audio samples."""

from fractions import Fraction

from lexicon.inputs import check_limits
from lexicon.sequence import SILENCE, PhoneSequence
from tts2face.request import FPS_LIMITS
from tts2face.types import Speech, frame_count

NTSC_NOMINAL_RATES = (24, 30, 48, 60, 120)  # nominal rates whose broadcast form is 1000/1001 of them (SMPTE 12M)


def exact_rate(fps: float) -> Fraction:
    """Frame rate as an exact fraction; 23.976, 29.97, 59.94 and the like become multiples of 1000/1001.

    Raises
    ------
    InputError
        The rate lies outside `FPS_LIMITS`.
    """
    check_limits("fps", fps, FPS_LIMITS)
    for nominal in NTSC_NOMINAL_RATES:
        if abs(fps - nominal * 1000 / 1001) < 0.006:
            return Fraction(nominal * 1000, 1001)
    return Fraction(fps).limit_denominator(1000)


def first_sample(frame: int, rate: int, fps: Fraction) -> int:
    """Index of the audio sample, at `rate` Hz, that coincides with the start of a frame."""
    return round(Fraction(frame) * rate / fps)


def pad_to_frame(speech: Speech, first_frame: int, fps: Fraction) -> Speech:
    """Speech padded with silence up to the end of its last frame.

    Parameters
    ----------
    first_frame
        Index of the speech's first frame within the whole clip, from which sample positions are rounded.
    """
    rate = speech.waveform.rate
    n_frames = frame_count(speech.waveform.duration, float(fps))
    n_samples = first_sample(first_frame + n_frames, rate, fps) - first_sample(first_frame, rate, fps)
    sound = speech.waveform.padded(n_samples)
    phones, edges = list(speech.phones.phones), list(speech.phones.edges)
    if phones[-1] != SILENCE and len(sound.samples) > len(speech.waveform.samples):
        phones.append(SILENCE)
        edges.append(edges[-1])
    edges[-1] = sound.duration
    return Speech(sound, PhoneSequence(phones, edges), speech.words)
