"""The voice's graph as it is kept on disk: the outputs of the model, bit by bit."""

from pathlib import Path

import numpy as np
import onnxruntime
import pytest
from hibari.voices import voice_path

from tts2face.sound.heart import DURATION_TENSOR, add_graph_output, open_network


@pytest.fixture
def model() -> bytes:
    return Path(voice_path("heart")).read_bytes()


@pytest.mark.parametrize("n_letters", [3, 60])
def test_the_kept_graph_gives_the_bits_of_the_model(
    model: bytes, n_letters: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    plain = onnxruntime.InferenceSession(
        add_graph_output(model, DURATION_TENSOR), options, providers=["CPUExecutionProvider"]
    )
    letters = np.random.default_rng(0).integers(1, 50, (1, n_letters))
    inputs = {"ids": letters.astype(np.int64), "speed": np.array([1.0], np.float32)}
    expected = [output.tobytes() for output in plain.run(None, inputs)]
    for _ in range(2):  # made, and read
        assert [output.tobytes() for output in open_network(model).run(None, inputs)] == expected
    (kept,) = (tmp_path / "tts2face" / "voices").glob("*")
    kept.write_bytes(kept.read_bytes()[:-100])
    assert [output.tobytes() for output in open_network(model).run(None, inputs)] == expected
