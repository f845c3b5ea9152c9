"""A filmed recording, observed as a corpus is, as the decomposition needs it."""

import numpy as np

from corpus_tools.decompose.captured import Captured
from corpus_tools.listen import SOUND_RATE, part_of
from corpus_tools.observation import Observation
from tts2face.types import Waveform
from tts2face.video.media import read_sound


def captured_film(seen: Observation, sound: Waveform | None = None) -> Captured:
    """One observation with its sound, on the clock of its landmarks.

    Parameters
    ----------
    sound
        Of the whole video, where it was read already.

    Raises
    ------
    InputError, DataError
        The video is gone, or as `tts2face.video.media.read_sound`.
    """
    heard = sound or read_sound(seen.video, SOUND_RATE)
    begin = seen.quality.cut + seen.quality.lag
    span = (max(begin, 0.0), begin + len(seen.landmarks) / seen.fps)
    early = np.zeros(max(0, round(-begin * heard.rate)), np.float32)  # the picture begins before the sound
    samples = np.concatenate([early, part_of(heard, span).samples])
    return Captured(seen.name, seen.fps, seen.landmarks, seen.head, Waveform(samples, heard.rate))
