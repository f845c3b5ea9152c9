"""A stream without an end: what it keeps is bounded, and its motion does not depend on the pieces."""

import numpy as np
import pytest

from tests.world import World
from tts2face.gestures.noise import NoiseStream
from tts2face.gestures.stream import GestureFields, GestureStream
from tts2face.gestures.timeline import Timeline
from tts2face.types import Waveform

FPS, RATE, SECONDS = 30.0, 8_000, 30
SOUND = np.random.default_rng(0).normal(0, 0.1, SECONDS * RATE).clip(-1, 1)


@pytest.fixture(scope="module")
def fields(world: World) -> GestureFields:
    return GestureFields(world.palette)


def sound(n_frames: int, begin: int) -> Waveform:
    """Noise whose samples depend on their place in the whole only."""
    first, last = (round(frame / FPS * RATE) for frame in (begin, begin + n_frames))
    return Waveform(SOUND[first:last], RATE)


def test_an_endless_stream_keeps_no_past(fields: GestureFields) -> None:
    stream = GestureStream(fields, style="neutral", seed=0, fps=FPS)
    kept: list[int] = []
    for begin in range(0, int(SECONDS * FPS), 6):
        stream.next(sound(6, begin), 6, Timeline())
        kept.append(max(len(track._times) + len(track._values) for track in stream._tracks.values()))
    assert max(kept[10:]) <= max(kept[:10])
    assert max(kept) < 100


@pytest.mark.parametrize("kind", [GestureStream, NoiseStream])
def test_silence_in_short_pieces_moves_as_in_long_ones(fields: GestureFields, kind: type) -> None:
    def values(n_frames: int) -> dict[str, np.ndarray]:
        stream = kind(fields, style="neutral", seed=0, fps=FPS)
        silence = Waveform(np.zeros(round(n_frames / FPS * RATE), np.float32), RATE)
        parts = [stream.next(silence, n_frames, Timeline()) for _ in range(int(10 * FPS) // n_frames)]
        return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}

    short, long = values(6), values(300)
    assert short.keys() == long.keys()
    for name in short:
        np.testing.assert_allclose(short[name], long[name], atol=1e-6)
