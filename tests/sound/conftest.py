"""What is heard in the sentences of takes, once for the tests of alignment and of recognition."""

from collections.abc import Callable
from functools import cache
from pathlib import Path

import pytest

from tts2face.sound.alignment import Aligner, HeardSound
from tts2face.sound.recogniser import RATE
from tts2face.sound.voice import Voice
from tts2face.sound.voice_pool import load_voice
from tts2face.video.media import read_sound

HEARD_TOGETHER = pytest.mark.xdist_group("hearing")  # in one process


@pytest.fixture(scope="session")
def aligner() -> Aligner:
    return Aligner()


@pytest.fixture(scope="session")
def heart() -> Voice:
    """The default voice of English, loaded once."""
    return load_voice("heart", "en-us")


@pytest.fixture(scope="session")
def hear_take(aligner: Aligner) -> Callable[[Path], HeardSound]:
    """What is heard in a video."""
    return cache(lambda video: aligner.hear(read_sound(video, RATE)))
