"""kill -9 of the worker that builds a talker: another one builds it, and nothing of the first stays behind."""

import json
import os
import signal
from collections.abc import Iterator
from pathlib import Path

import httpx
import pytest

import tts2face
from tests.running import HostService, RunningService, eventually
from tests.serving.service.job_requests import finished
from tests.started import running_processes

TEXT = "We were away a year ago. Bob may move. The boy will buy a pie for you."


@pytest.fixture
def running(host: HostService) -> Iterator[RunningService]:
    with host() as service:
        yield service


def children(parent: int, *words: str) -> list[int]:
    """Processes that a process has started, with these words in their command lines."""
    found = [number for number, its_parent in running_processes().items() if its_parent == parent]
    lines = {number: Path(f"/proc/{number}/cmdline").read_text() for number in found}
    return [number for number, line in lines.items() if all(word in line for word in words)]


@pytest.mark.usefixtures("face_model")
def test_a_talker_is_built_after_the_death_of_its_worker(running: RunningService, tmp_path: Path) -> None:
    take = tmp_path / "take.mp4"
    tts2face.Session().write(TEXT, take, size="256x256", fps=25)
    with httpx.Client(base_url=running.url, timeout=60.0) as client:
        form = {"job": json.dumps({"kind": "talker", "request": {"name": "anna"}})}
        files = {"video": take.read_bytes(), "transcript": TEXT.encode()}
        job = client.post("/v1/talkers/build", data=form, files=files).json()
        eventually(lambda: client.get(f"/v1/jobs/{job['id']}").json()["progress"]["done"] > 0, 120.0)
        workers = children(
            running.process.pid, "tts2face.serving.work.worker"
        )  # also those of other services of the host
        ((worker, builder),) = ((one, its) for one in workers for its in children(one, "tts2face.processes", "talker"))
        os.kill(worker, signal.SIGKILL)
        eventually(lambda: builder not in running_processes(), 30.0)
        ended = finished(client, job)
        assert (ended["state"], ended["error"]) == ("done", None), ended
        assert [one["name"] for one in client.get("/v1/talkers").json()["data"]] == ["grid_s1", "anna"]
        assert client.get("/v1/usage").json()["resources"]["used"] == 1
