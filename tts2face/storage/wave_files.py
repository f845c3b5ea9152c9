"""16-bit mono .wav files, written in parts."""

import io
import wave
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

# of 16 bits; -32768 stays unused, so that both directions are alike
FULL_SCALE = 32767


def open_wave(target: str | BinaryIO, rate: int) -> wave.Wave_write:
    """Open a .wav file for writing at a path or in an open file; closing it completes its header."""
    file = wave.open(target, "wb")  # noqa: SIM115 - closed by the caller
    file.setparams((1, 2, rate, 0, "NONE", "not compressed"))
    return file


def pcm_bytes(samples: NDArray[np.floating]) -> bytes:
    """Samples (n,) in [-1, 1] as 16-bit integers."""
    steps: NDArray[np.int16] = np.rint(samples * FULL_SCALE).astype("<i2")
    return steps.tobytes()


def wave_bytes(samples: NDArray[np.floating], rate: int) -> bytes:
    """Content of a .wav file."""
    content = io.BytesIO()
    with open_wave(content, rate) as file:
        file.writeframes(pcm_bytes(samples))
    return content.getvalue()
