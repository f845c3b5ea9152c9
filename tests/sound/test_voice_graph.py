"""The voice's network in two parts, as they are kept on disk: what the whole model says, up to rounding."""

from pathlib import Path

import numpy as np
import onnxruntime
import pytest
from hibari.voices import voice_path

from tts2face.sound.heart_network import SPECTRA, HeartNetwork


@pytest.fixture
def model() -> bytes:
    return Path(voice_path("heart")).read_bytes()


@pytest.mark.parametrize("n_letters", [3, 60])
def test_the_parts_say_what_the_model_says(
    model: bytes, n_letters: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    whole = onnxruntime.InferenceSession(model, options, providers=["CPUExecutionProvider"])
    letters = np.random.default_rng(0).integers(1, 50, n_letters).tolist()
    inputs = {"ids": np.array([letters], np.int64), "speed": np.array([1.0], np.float32)}
    expected = dict(zip(SPECTRA, whole.run(list(SPECTRA), inputs), strict=True))

    def spoken() -> list[bytes]:
        network = HeartNetwork(model)
        hidden, durations = network.read(letters)
        steps = np.maximum(np.rint(durations), 1).astype(np.int64)
        frames = network.frames(letters, hidden, steps)
        # other fusions of operations; phases are free where nothing sounds
        for name, found in zip(("lh", "ln", "lr"), (frames.harmonic, frames.noise, frames.free), strict=True):
            assert np.median(np.abs(found - expected[name][0])) < 0.1  # nepers; the weights have 8 bits
        assert np.median(np.abs(frames.f0 - expected["f0"][0])) < 0.5
        return [array.tobytes() for array in frames]

    first = spoken()
    assert spoken() == first  # made, and read
    (kept,) = (tmp_path / "tts2face" / "voices").glob("*")
    kept.write_bytes(kept.read_bytes()[:-100])
    assert spoken() == first


def test_durations_are_an_input(model: bytes) -> None:
    network, letters = HeartNetwork(model), [0, 20, 30, 40, 0]
    hidden, durations = network.read(letters)
    assert durations.shape == (5,)
    assert len(network.frames(letters, hidden, np.array([4, 3, 7, 5, 6])).f0) == 2 * 25
