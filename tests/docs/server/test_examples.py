"""Programs of docs/examples that talk to a service, or are one."""

import csv
import re
import wave
from collections.abc import Iterator
from io import BytesIO
from pathlib import Path

import av
import httpx
import numpy as np
import pytest

from tests.docs.programs import ENVIRONMENT, prepare_example, run
from tests.running import START_TIMEOUT_S, LoggedProcess, RunningService, eventually


def test_a_live_stream(service: RunningService, tmp_path: Path) -> None:
    command = prepare_example("live_stream", tmp_path)[-1]
    ended = run(command.replace("ws://localhost:8880", service.url.replace("http", "ws", 1)), tmp_path)
    assert ended.returncode == 0, ended.stderr
    spoken = [line.split(" s  ")[1] for line in ended.stdout.splitlines()]
    assert spoken == ["Hello there, how are you?", "I am well.", "We were away."]
    with wave.open(str(tmp_path / "live.wav")) as sound:
        seconds = sound.getnframes() / sound.getframerate()
        samples = np.frombuffer(sound.readframes(sound.getnframes()), np.int16)
    assert 0.02 < np.abs(samples / 32768).mean() < 0.5
    with (tmp_path / "live.csv").open(newline="") as file:
        names, *rows = csv.reader(file)
    weights = np.array(rows, float)
    np.testing.assert_allclose(weights[:, 0], np.arange(len(weights)) / 30, atol=1e-3)
    assert len(weights) == pytest.approx(seconds * 30, abs=1)
    assert weights[:, names.index("jawOpen")].max() > 0.1


@pytest.fixture
def application(tmp_path: Path) -> Iterator[str]:
    """Address of the example's application."""
    command = prepare_example("web_app", tmp_path)[-1].split()
    process = LoggedProcess("-m", *command, "--app-dir", str(tmp_path), "--port", "0", environment=ENVIRONMENT)
    try:
        found = eventually(lambda: re.search(r"http://[\d.:]+", "".join(process.lines)), START_TIMEOUT_S)
        yield found[0]
    finally:
        process.end()


def test_a_web_application(application: str) -> None:
    with httpx.Client(base_url=application, timeout=60.0) as client:
        assert "<video" in client.get("/").text
        clip = client.get("/clip", params={"text": "Hello there.", "style": "delighted"})
        assert (clip.status_code, clip.headers["content-type"]) == (200, "video/mp4")
        with av.open(BytesIO(clip.content)) as film:
            n_frames = sum(1 for _ in film.decode(video=0))
            size = film.streams.video[0].width
        words = client.get("/words", params={"text": "Hello there."}).json()
        assert [word for word, *_ in words] == ["Hello", "there"]
        assert words[-1][2] < n_frames / 30 < words[-1][2] + 1.0
        assert size == 384
        refused = client.get("/clip", params={"text": "Hello.", "style": "gleeful"})
        assert (refused.status_code, "there is no style 'gleeful'" in refused.text) == (422, True)
