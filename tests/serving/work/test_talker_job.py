"""Jobs of kind ``talker`` with a stub in place of the builder: ends of the builder, names, quotas, repetitions."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from corpus_tools.tools.talker import BuildOrder
from lexicon.errors import DataError
from tests.models.made import write_made_talker
from tests.serving.work.stub_builder import MADE, ORDER
from tts2face.serving.work import tools
from tts2face.serving.work.blobs import open_blobs
from tts2face.serving.work.database import database_url
from tts2face.serving.work.kinds import JobCancelledError, JobTask, Products
from tts2face.serving.work.resources import ResourceTable
from tts2face.serving.work.talker_job import run_talker
from tts2face.storage.sql import DatabaseAwayError

Run = Callable[..., Products]


@pytest.fixture
def events() -> list[dict[str, Any]]:
    return []


@pytest.fixture
def run(tmp_path: Path, events: list[dict[str, Any]], monkeypatch: pytest.MonkeyPatch) -> Run:
    """Function that executes a job."""
    monkeypatch.setattr(tools, "TALKER_BUILDER", "tests.serving.work.stub_builder:HANDLERS")
    (tmp_path / "a.mp4").write_bytes(b"video")
    write_made_talker(tmp_path / MADE, has_face=False)
    blobs = open_blobs(tmp_path / "store", "resources")

    def execute(name: str = "anna", order: str = "1", n_resources: int = 5, check: Any = lambda: None) -> Products:
        folder = tmp_path / f"work-{len(list(tmp_path.iterdir()))}"
        folder.mkdir()
        request = {
            "owner": "ann", "name": name, "appearance": False, "consent": None, "provenance": {}, "seconds": 1.0,
            "limits": {"n_resources": n_resources, "n_bytes": 10**6}, "order": order,
        }  # fmt: skip
        return run_talker(JobTask(
            request, {"recording.mp4": tmp_path / "a.mp4"}, folder, None, None, events.append, check,  # type: ignore[arg-type]
            database_url(tmp_path / "a.sqlite"), lambda: blobs,
        ))  # fmt: skip

    return execute


def stored(tmp_path: Path) -> list[str]:
    table = ResourceTable(database_url(tmp_path / "a.sqlite"))
    names = [one.name for one in table.select("talker", "ann")]
    table.close()
    return names


def test_a_talker_is_stored_once_however_often_its_job_runs(
    run: Run, tmp_path: Path, events: list[dict[str, Any]]
) -> None:
    """A worker that dies after it has stored the talker is followed by another, which runs the job again."""
    first = run()
    assert BuildOrder(**json.loads((tmp_path / ORDER).read_text())).name == "anna"  # what the builder takes
    assert [one.name for one in first.files] == ["anna.talker"]
    assert events == [
        {"type": "progress", "stage": "reading recordings", "done": 0, "of": 0},
        {"type": "progress", "stage": "reading recordings", "done": 1, "of": 2},
        {
            "type": "built",
            "n_kept": 6,
            "minutes": 0.1,
            "refused": ["a: too dark"],
            "warnings": [f"b: weakness {number}" for number in range(20)],
            "notes": ["record more"],
        },
    ]
    run()
    assert stored(tmp_path) == ["anna"]
    with pytest.raises(DataError, match="there is a talker anna already; delete it, or choose another name"):
        run(order="2")


def test_a_full_quota_is_said(run: Run, tmp_path: Path) -> None:
    run("first")
    with pytest.raises(DataError, match="the key ann has 1 resources, its limit; delete one first"):
        run("second", order="2", n_resources=1)
    assert stored(tmp_path) == ["first"]


def test_a_builder_that_dies_is_said(run: Run) -> None:
    with pytest.raises(DataError, match="the recording needs too much memory or time; record it shorter"):
        run("dies")


def test_a_cancelled_job_ends_its_builder(run: Run, tmp_path: Path) -> None:
    looks: list[int] = []

    def cancel() -> None:
        looks.append(1)
        if len(looks) == 2:
            raise DatabaseAwayError("the database cannot be reached")  # the building goes on meanwhile
        if len(looks) > 3:
            raise JobCancelledError

    with pytest.raises(JobCancelledError):
        run("sleeps", check=cancel)
    assert stored(tmp_path) == []
