"""Answers of a service that keeps finished results."""

from pathlib import Path

import httpx

from tests.running import HostService


def test_the_service_answers_from_its_cache(host: HostService, tmp_path: Path) -> None:
    with host(cache_mb=10, data=tmp_path, workers=0) as running:
        body = {"text": "Hello there.", "format": "mp4", "size": "64x64", "supersampling": 1}
        first, second = (httpx.post(f"{running.url}/v1/clips", json=body, timeout=60.0) for _ in range(2))
        assert first.content == second.content
        lines = httpx.get(f"{running.url}/metrics").text.splitlines()
        assert "tts2face_cache_hits 1.0" in lines
        assert "tts2face_cache_misses 1.0" in lines
        assert [path.stat().st_size > len(first.content) for path in (tmp_path / "cache").iterdir()] == [True]
