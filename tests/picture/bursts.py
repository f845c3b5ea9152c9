"""Two tones in a sound, and in files of it: where they stand is heard by its energy."""

from fractions import Fraction
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tts2face.picture.movie import (
    MKV_MOVIE,
    MOV_MOVIE,
    MP4_MOVIE,
    STREAMED_MP4,
    STREAMED_WEBM,
    WEBM_MOVIE,
    MovieKind,
    MovieWriter,
)
from tts2face.picture.sound_stream import encode_sound
from tts2face.picture.write_buffer import WriteBuffer
from tts2face.types import Waveform

BURSTS_S = (0.51, 2.01)  # middles of two tones of 20 ms, the second in the second part
SECONDS = 3.0
TOLERANCE_S = 0.005
STREAMED = "streamed "
MOVIES = MappingProxyType({
    "mp4": MP4_MOVIE, "streamed mp4": STREAMED_MP4, "webm": WEBM_MOVIE, "streamed webm": STREAMED_WEBM,
    "mov": MOV_MOVIE, "mkv": MKV_MOVIE,
})  # fmt: skip


def bursts(rate: int) -> NDArray[np.float32]:
    """(n,) samples with two tones."""
    seconds = np.arange(round(SECONDS * rate)) / rate
    window = sum(np.maximum(0.0, 1.0 - np.abs(seconds - middle) / 0.01) for middle in BURSTS_S)
    return np.asarray(0.8 * window * np.sin(2 * np.pi * 1000.0 * seconds), np.float32)


def onsets(samples: NDArray[Any], rate: int) -> NDArray[np.float64]:
    """Seconds of the middles of the tones."""
    energy = np.convolve(np.square(samples, dtype=float), np.ones(round(0.02 * rate)), "same")
    half = round(1.2 * rate)
    return np.array([energy[:half].argmax(), half + energy[half:].argmax()]) / rate


def encoded(kind: str, rate: int, path: Path | None) -> bytes:
    samples = bursts(rate)
    parts = [Waveform(samples[: len(samples) // 2], rate), Waveform(samples[len(samples) // 2 :], rate)]
    content = b"".join(chunk.content for chunk in encode_sound(iter(parts), kind, path))
    return content if path is None else path.read_bytes()


def encoded_movie(kind: MovieKind, fps: Fraction, path: Path | None) -> bytes:
    """A movie of grey pictures with the tones."""
    rate, buffer = 24_000, WriteBuffer()
    samples, picture = bursts(rate), np.full((48, 64, 3), 90, np.uint8)
    writer = MovieWriter(path or buffer, kind, picture.shape, (fps, rate))
    content = b""
    for number in range(round(SECONDS * fps)):
        writer.picture(picture)
        writer.sound(samples[round(number * rate / fps) : round((number + 1) * rate / fps)])
        content += buffer.take()
    writer.finish()
    return content + buffer.take() if path is None else path.read_bytes()
