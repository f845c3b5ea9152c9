"""Jobs, their events and their results over HTTP, with a real server and its workers."""

import csv
import io
import json
import wave
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import av
import httpx
import pytest

from tests.running import HostService, RunningService, eventually
from tests.serving.service.job_requests import CLIP, SMALL, finished, submit
from tests.serving.service.receiver import Receiver
from tests.walkers import samples_of

SRT = b"1\n00:00:00,500 --> 00:00:01,500\nANN: Hello.\n\n2\n00:00:02,000 --> 00:00:03,000\nBob may.\n"
VTT = b"WEBVTT\n\n00:01.000 --> 00:02.000\nBye.\n"


@pytest.fixture(scope="module")
def receiver() -> Iterator[Receiver]:
    with Receiver(n_refused=1) as made:
        yield made


@pytest.fixture(scope="module")
def jobs(host: HostService, receiver: Receiver) -> Iterator[RunningService]:
    """A service with one worker and the webhooks of `receiver`."""
    with host(**receiver.environment) as running:
        yield running


@pytest.fixture
def api(jobs: RunningService) -> Iterator[httpx.Client]:
    with httpx.Client(base_url=jobs.url, timeout=60.0) as made:
        yield made


def test_a_clip_is_that_of_its_stream_as_a_complete_file(api: httpx.Client) -> None:
    for format in ("curves", "mp4", "wav"):
        request = {**CLIP, **SMALL, "format": format}
        answer = submit(api, request)
        assert answer.status_code == 202
        assert answer.headers["location"] == f"/v1/jobs/{answer.json()['id']}"
        job = finished(api, answer.json())
        assert (job["state"], job["error"]) == ("done", None), job
        (result,) = job["results"]
        made, streamed = api.get(result["url"]).content, api.post("/v1/clips", json=request).content
        if format == "curves":
            assert made == streamed
        elif format == "wav":
            with wave.open(io.BytesIO(made)) as sound:
                assert 2 * sound.getnframes() == len(samples_of(made))
            assert samples_of(made) == samples_of(streamed)
        else:
            assert duration_of(made) == pytest.approx(n_frames(streamed) / SMALL["fps"], abs=0.05)
            assert n_frames(made) == n_frames(streamed)


def duration_of(movie: bytes) -> float:
    """Seconds that the header of a movie states."""
    with av.open(io.BytesIO(movie), "r") as file:
        return (file.duration or 0) / av.time_base


def n_frames(movie: bytes) -> int:
    with av.open(io.BytesIO(movie), "r") as file:
        return len(list(file.decode(video=0)))


def test_recordings_timelines_and_backgrounds_reach_the_worker(api: httpx.Client) -> None:
    sound = api.post("/v1/clips", json={"text": "Hello there.", "format": "wav"}).content
    timeline = json.dumps({"spans": []}).encode()
    background = io.BytesIO()
    from PIL import Image

    Image.new("RGB", (64, 64), (200, 0, 0)).save(background, "PNG")
    request = {"size": "64x64", "supersampling": 1, "fps": 5, "format": "mp4"}
    form = {"job": json.dumps({"kind": "clip", "request": request})}
    files = {"audio": sound, "background": background.getvalue(), "timeline": timeline}
    job = finished(api, api.post("/v1/jobs", data=form, files=files).json())
    assert job["state"] == "done", job["error"]
    with av.open(io.BytesIO(api.get(job["results"][0]["url"]).content)) as movie:
        corner = next(movie.decode(video=0)).to_ndarray(format="rgb24")[0, 0]
    assert corner[0] > 150
    assert corner[2] < 60


def test_subtitles_become_clips_and_a_manifest(api: httpx.Client) -> None:
    request = {**SMALL, "cast": '[[role]]\nspeaker = "ANN"\nidentity = "kofi"', "exports": ["track.json"]}
    form = {"job": json.dumps({"kind": "subtitles", "request": request})}
    files = [("subtitles", ("../../evil.srt", SRT)), ("subtitles", ("b.vtt", VTT))]
    job = finished(api, api.post("/v1/jobs", data=form, files=files).json())
    assert (job["state"], job["error"]) == ("done", None), job
    names = [one["name"] for one in job["results"]]
    stems = ["subtitles-001-0001", "subtitles-001-0002", "subtitles-002-0001"]
    assert names == sorted(
        ["manifest.csv", "manifest.json", *(f"{one}{end}" for one in stems for end in (".mp4", ".track.json"))]
    )
    by_name = {one["name"]: one for one in job["results"]}
    manifest = api.get(by_name["manifest.json"]["url"]).json()
    assert [one["source"] for one in manifest["outputs"]] == [["subtitles-001.srt"]] * 2 + [["subtitles-002.vtt"]]
    assert "/" not in json.dumps(manifest["outputs"])
    movie = api.get(by_name["subtitles-001-0001.mp4"]["url"])
    assert movie.headers["content-type"] == "video/mp4"
    assert job["progress"]["done"] == job["progress"]["of"] == 6


def test_a_table_of_lines_counts_and_comes_back(api: httpx.Client) -> None:
    form = {"job": json.dumps({"kind": "subtitles", "request": {**SMALL, "min_rate": 0.9, "max_overlap": 0.1}})}
    table = "cue;rate;spoken\n1;1,25;\n2;;no\n"
    job = finished(api, api.post("/v1/jobs", data=form, files=[("subtitles", SRT), ("lines", table.encode())]).json())
    assert job["state"] == "done", job["error"]
    by_name = {one["name"]: one["url"] for one in job["results"]}
    rows = list(csv.DictReader(io.StringIO(api.get(by_name["lines.csv"]).content.decode("utf-8-sig"))))
    assert [(one["file"], one["cue"], one["rate"], one["spoken"]) for one in rows] == [
        ("subtitles-001", "1", "1.25", ""), ("subtitles-001", "2", "", "no"),
    ]  # fmt: skip
    assert float(rows[0]["used_rate"]) == 1.25
    unknown = {"subtitles": SRT, "lines": b"cue,rate\n9,1.1\n"}
    failed = finished(api, api.post("/v1/jobs", data=form, files=unknown).json())
    assert failed["state"] == "failed"
    assert "has no cue 9 with words" in failed["error"]
    assert "/" not in failed["error"]


def test_a_dubbing_track_replaces_the_voice(api: httpx.Client) -> None:
    sound = api.post("/v1/clips", json={"text": "Hello. Bob may.", "format": "wav"}).content
    form = {
        "job": json.dumps(
            {"kind": "subtitles", "request": {**{k: SMALL[k] for k in SMALL if k != "voice"}, "per": "file"}}
        )
    }
    job = finished(api, api.post("/v1/jobs", data=form, files=[("subtitles", SRT), ("audio", sound)]).json())
    assert job["state"] == "done", job["error"]
    assert "subtitles-001.mp4" in [one["name"] for one in job["results"]]


def test_a_failed_job_says_why_without_paths_of_the_server(api: httpx.Client, jobs: RunningService) -> None:
    job = finished(api, submit(api, {**CLIP, "style": "gleeful"}).json())
    assert job["state"] == "failed"
    assert "there is no style 'gleeful' in the palette" in job["error"]
    form = {"job": json.dumps({"kind": "subtitles", "request": SMALL})}
    job = finished(
        api, api.post("/v1/jobs", data=form, files={"subtitles": b"1\n00:00:01,000 --> 00:00:02,000\n[noise]\n"}).json()
    )
    assert (job["state"], job["results"]) == ("failed", [])
    assert "no cue" in job["error"]
    assert jobs.data.name not in job["error"]


def read_events(api: httpx.Client, name: str, **headers: str) -> list[dict[str, Any]]:
    events: list[dict[str, Any]] = []
    with api.stream("GET", f"/v1/jobs/{name}/events", headers=headers) as answer:
        assert answer.headers["content-type"].startswith("text/event-stream")
        for line in answer.iter_lines():
            if line.startswith("id: "):
                events.append({"id": int(line[4:])})
            elif line.startswith("data: "):
                events[-1].update(json.loads(line[6:]))
    return events


def test_events_follow_a_job_and_go_on_after_the_last_one(api: httpx.Client) -> None:
    job = submit(api, {**CLIP, "text": "Events."}).json()
    events = read_events(api, job["id"])
    assert [one["state"] for one in events if one["type"] == "state"] == ["waiting", "running", "done"]
    assert [one["id"] for one in events] == list(range(1, len(events) + 1))
    assert read_events(api, job["id"], **{"Last-Event-ID": "2"}) == events[2:]
    assert read_events(api, job["id"], **{"Last-Event-ID": "no number"}) == events


def test_the_same_idempotency_key_is_the_same_job(api: httpx.Client) -> None:
    keyed = {"headers": {"Idempotency-Key": "order-17"}}
    first = submit(api, {**CLIP, "text": "Once."}, **keyed)
    again = submit(api, {**CLIP, "text": "Once."}, **keyed)
    other = submit(api, {**CLIP, "text": "Twice."}, **keyed)
    assert (first.status_code, again.status_code, other.status_code) == (202, 200, 422)
    assert first.json()["id"] == again.json()["id"]
    assert other.json()["error"]["code"] == "idempotency_conflict"
    done = finished(api, first.json())
    assert submit(api, {**CLIP, "text": "Once."}, **keyed).json()["results"] == done["results"]


def test_a_deleted_job_takes_its_results_along_unless_another_has_them(api: httpx.Client) -> None:
    first, second = (finished(api, submit(api, {**CLIP, "text": "Shared."}).json()) for _ in range(2))
    url = first["results"][0]["url"]
    assert second["results"][0]["url"] == url
    assert api.delete(f"/v1/jobs/{first['id']}").status_code == 204
    assert api.get(f"/v1/jobs/{first['id']}").status_code == 404
    assert api.get(url).status_code == 200
    assert api.delete(f"/v1/jobs/{second['id']}").status_code == 204
    assert api.get(url).status_code == 404


def test_a_cancelled_job_frees_the_worker(api: httpx.Client) -> None:
    long = submit(api, {"text": "This is a long clip, which nobody wants. " * 12, "format": "mp4"}).json()
    eventually(lambda: api.get(f"/v1/jobs/{long['id']}").json()["started"])
    cancelled = api.post(f"/v1/jobs/{long['id']}/cancel").json()
    assert (cancelled["state"], cancelled["results"]) == ("cancelled", [])
    assert api.post(f"/v1/jobs/{long['id']}/cancel").json() == cancelled
    assert [one["state"] for one in read_events(api, long["id"])] == ["waiting", "running", "cancelled"]
    after = finished(api, submit(api, {**CLIP, "text": "After."}).json())
    assert after["state"] == "done"
    assert api.get(f"/v1/jobs/{long['id']}").json()["state"] == "cancelled"


def test_a_webhook_is_signed_and_sent_again_until_it_arrives(api: httpx.Client, receiver: Receiver) -> None:
    body = {"kind": "clip", "request": {**CLIP, "text": "Webhook."}, "webhook": f"http://{receiver.host}/done?a=1"}
    job = finished(api, api.post("/v1/jobs", json=body).json())
    moved = finished(api, api.post("/v1/jobs", json=body | {"webhook": f"http://{receiver.host}/moved"}).json())
    eventually(lambda: api.get(f"/v1/jobs/{job['id']}").json()["webhook"]["state"] == "delivered")
    eventually(lambda: receiver.n_redirected)
    assert api.get(f"/v1/jobs/{job['id']}").json()["webhook"]["tries"] == 2  # the first one was refused
    assert receiver.wrong == []
    ((name, content),) = receiver.messages  # a redirect is not followed
    assert (name, content["type"]) == (job["id"], "job.done")
    assert content["job"]["results"] == job["results"]
    assert api.get(f"/v1/jobs/{moved['id']}").json()["webhook"]["state"] == "waiting"


def test_old_jobs_and_their_results_are_removed(host: HostService, tmp_path: Path) -> None:
    with host(data=tmp_path, results_days=30) as running, httpx.Client(base_url=running.url, timeout=60.0) as api:
        job = finished(api, submit(api, CLIP).json())
    assert len(list((tmp_path / "store" / "results").glob("??/*"))) == 1
    with host(data=tmp_path, results_days=1e-7, workers=0) as running:
        running.wait_for_event("old jobs removed", jobs=1)
        assert httpx.get(f"{running.url}/v1/jobs/{job['id']}").status_code == 404
    assert not list((tmp_path / "store" / "results").glob("??/*"))


def test_jobs_work_with_a_bucket(host: HostService, tmp_path: Path) -> None:
    """Inputs and results pass through the store of a URL, here a folder by file://."""
    service = host(data=tmp_path / "data", store=f"file://{tmp_path}/bucket")
    with service as running, httpx.Client(base_url=running.url, timeout=60.0) as api:
        form = {"job": json.dumps({"kind": "subtitles", "request": {**SMALL, "per": "film"}})}
        job = finished(api, api.post("/v1/jobs", data=form, files={"subtitles": SRT}).json())
        assert job["state"] == "done", job["error"]
        for result in job["results"]:
            assert len(api.get(result["url"]).content) == result["bytes"]
        assert api.delete(f"/v1/jobs/{job['id']}").status_code == 204
    assert not list((tmp_path / "bucket" / "results").glob("??/*"))
    assert len(list((tmp_path / "bucket").glob("??/*.mov"))) == 3
