"""Speech at another sample rate: voices of one clip differ, its sound has one rate."""

import numpy as np

from lexicon.sequence import PhoneSequence
from tts2face.types import Speech, Waveform


def resampled_speech(speech: Speech, rate: int) -> Speech:
    """Resample speech to `rate` Hz; all phone edges but the last, the duration of the sound, are unchanged.

    The sound is clipped to full scale. Source: soxr, quality HQ (De Jong, the SoX resampler library).
    """
    sound = speech.waveform
    if sound.rate == rate:
        return speech
    import soxr

    samples = np.clip(soxr.resample(sound.samples, sound.rate, rate, quality="HQ"), -1.0, 1.0)
    edges = speech.phones.edges.copy()
    edges[-1] = len(samples) / rate
    return Speech(Waveform(samples, rate), PhoneSequence(speech.phones.phones, edges), speech.words)
