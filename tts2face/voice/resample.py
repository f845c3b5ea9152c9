"""Speech at another sample rate: voices of one clip differ, its sound has one rate."""

import numpy as np

from lexicon.sequence import PhoneSequence
from tts2face.types import Speech, Waveform


def resampled_speech(speech: Speech, rate: int) -> Speech:
    """The same speech at a rate in Hz, with the same edges but the last, which is the length of the sound.

    Source: soxr's high quality (De Jong, the SoX resampler library); clipped to full scale.
    """
    sound = speech.waveform
    if sound.rate == rate:
        return speech
    import soxr

    samples = np.clip(soxr.resample(sound.samples, sound.rate, rate, quality="HQ"), -1.0, 1.0)
    edges = speech.phones.edges.copy()
    edges[-1] = len(samples) / rate
    return Speech(Waveform(samples, rate), PhoneSequence(speech.phones.phones, edges), speech.words)
