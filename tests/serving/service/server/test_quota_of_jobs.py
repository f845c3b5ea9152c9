"""Seconds of speech of jobs."""

from pathlib import Path

import httpx

from tests.running import HostService
from tts2face.serving.service.keys import add_key


def test_jobs_use_the_seconds_of_speech_too(host: HostService, tmp_path: Path) -> None:
    """By their texts, as they are made later and elsewhere."""
    path = tmp_path / "keys.toml"
    headers = {"authorization": f"Bearer {add_key(path, 'a', ['speak'], speech_s_per_day=10)}"}
    with host(keys=path, workers=0) as running:
        job = {"kind": "clip", "request": {"text": "We were away a year ago. " * 12}}
        answers = [httpx.post(f"{running.url}/v1/jobs", json=job, headers=headers, timeout=60) for _ in range(2)]
        assert [answer.status_code for answer in answers] == [202, 429], answers[0].text
        assert int(answers[1].headers["retry-after"]) > 3600
