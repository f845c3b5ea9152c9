"""Of a recording that ends in damage, a command says one sentence on standard error and nothing else."""

import subprocess
import sys
from pathlib import Path

import av
import numpy as np
import pytest

RATE = 22_050  # Hz; another than that of clips, so that the sound is resampled while it is read
COMMANDS = {
    "without words": ["--audio", "said.mp3", "--out", "x.mp4"],
    "with words": ["Bob may read.", "--audio", "said.mp3", "--out", "x.mp4"],
    "mapped": ["--audio", "said.mp3", "--audio-map", "network", "--out", "x.track.json"],
    "partner": ["--listen", "2", "--partner", "said.mp3", "--out", "x.mp4"],
    "batch": ["batch", "said.srt", "--audio", ".", "--out", "clips", "--format", "none", "--export", "srt"],
}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """With two seconds of noise as MP3, whose second half is damaged, and their words."""
    path = tmp_path / "said.mp3"
    with av.open(str(path), "w") as container:
        stream = container.add_stream("libmp3lame", rate=RATE, layout="mono")
        noise = np.random.default_rng(0).normal(size=(1, 2 * RATE)) * 3000
        frame = av.AudioFrame.from_ndarray(noise.astype(np.int16), format="s16", layout="mono")
        frame.rate = RATE
        for resampled in av.AudioResampler(format=stream.format, layout="mono", rate=RATE).resample(frame):
            container.mux(stream.encode(resampled))
        container.mux(stream.encode(None))
    content = bytearray(path.read_bytes())
    half = len(content) // 2
    content[half:] = bytes(37 * at % 251 for at in range(half, len(content)))
    path.write_bytes(content)
    (tmp_path / "said.srt").write_text("1\n00:00:00,000 --> 00:00:02,000\nBob may read.\n")
    return tmp_path


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[pytest.mark.smoke] * (name == "mapped")) for name in COMMANDS]
)
def test_nothing_but_the_sentence_is_printed(folder: Path, name: str) -> None:
    command = [sys.executable, "-m", "tts2face", *COMMANDS[name], "--quiet"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 3, done.stderr
    assert done.stderr.startswith("tts2face: ")
    assert "said.mp3 is truncated: it ends at 0.9" in done.stderr
    assert done.stderr.count("\n") == 1
