"""Talkers built from uploaded recordings: limits, consent, refusals, and a talker that speaks."""

import hashlib
import io
import json
import os
import wave
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import av
import httpx
import numpy as np
import pytest
from numpy.typing import NDArray

import tts2face
from tests.conftest import SHARED
from tests.rendered_takes import transcript
from tests.running import HostService, eventually
from tests.serving.service.job_requests import finished
from tests.serving.service.server.test_resource_check import WORDS
from tts2face.models.talker_file import load_talker
from tts2face.serving.service.keys import add_key
from tts2face.video.media import read_sound

TEXT = "We were away a year ago. Bob may move. The boy will buy a pie for you. She saw the ship near the shore."
FPS, RATE = 25, 16_000
DATA: list[str] = []  # folder of the service
Build = Callable[..., httpx.Response]


@pytest.fixture(scope="module")
def take(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A video of the shipped head that speaks `TEXT`."""
    path = tmp_path_factory.mktemp("take") / "take.mp4"
    tts2face.Session().write(TEXT, path, size="256x256", fps=FPS)
    return path


@pytest.fixture(scope="module")
def keys(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("keys") / "keys.toml"


@pytest.fixture(scope="module")
def clients(host: HostService, keys: Path) -> Iterator[dict[str, httpx.Client]]:
    """Clients of two keys, of a service that takes large bodies only as recordings."""
    secrets = {"ann": add_key(keys, "ann", ["speak", "build"]), "reader": add_key(keys, "reader", ["speak"])}
    with host(keys=keys, body_mb=0.02, video_mb=5, video_s=60) as running, ExitStack() as stack:
        DATA.append(running.data.name)
        yield {
            name: stack.enter_context(
                httpx.Client(base_url=running.url, timeout=60.0, headers={"authorization": f"Bearer {secret}"})
            )
            for name, secret in secrets.items()
        }


def order(client: httpx.Client, video: bytes, words: str = TEXT, **request: Any) -> httpx.Response:
    """Answer to a recording."""
    form = {"job": json.dumps({"kind": "talker", "request": {"name": "anna", **request}})}
    files = {"video": ("../../a.mp4", video), "transcript": ("t.txt", words.encode())}
    return client.post("/v1/talkers/build", data=form, files=files)


@pytest.fixture
def build(clients: dict[str, httpx.Client]) -> Build:
    """Function that sends a recording."""
    return lambda video, *words, key="ann", **request: order(clients[key], video, *words, **request)


def stored_files(content: bytes) -> list[Path]:
    """Files of the service with a content."""
    name = hashlib.sha256(content).hexdigest()
    return [Path(folder, name) for folder, _, names in os.walk(DATA[-1]) if name in names]


def movie(seconds: float = 2.0, side: int = 128, samples: NDArray[np.int16] | None = None) -> bytes:
    """A video of coloured noise, with a tone or with given samples at `RATE`."""
    buffer, rng = io.BytesIO(), np.random.default_rng(3)
    with av.open(buffer, "w", format="mp4") as out:
        video, audio = out.add_stream("libx264", rate=FPS), out.add_stream("aac", rate=RATE, layout="mono")
        video.width = video.height = side
        video.pix_fmt = "yuv420p"
        for _ in range(int(seconds * FPS)):
            pixels = rng.integers(0, 255, (side, side, 3)).astype(np.uint8)
            out.mux(video.encode(av.VideoFrame.from_ndarray(pixels)))
        tone = (8000 * np.sin(np.arange(int(seconds * RATE)) * 0.1)).astype(np.int16)
        frame = av.AudioFrame.from_ndarray((tone if samples is None else samples)[None], "s16", "mono")
        frame.rate = RATE
        out.mux([*audio.encode(frame), *audio.encode(None), *video.encode(None)])
    return buffer.getvalue()


def faceless(take: Path) -> bytes:
    """Coloured noise with the sound of the take, so that only the face is missing."""
    spoken = read_sound(take, RATE)
    return movie(spoken.duration, samples=(spoken.samples * 32767).astype(np.int16))


def sound() -> bytes:
    buffer = io.BytesIO()
    with wave.open(buffer, "wb") as file:
        file.setparams((1, 2, 16_000, 0, "NONE", ""))
        file.writeframes(bytes(32_000))
    return buffer.getvalue()


@pytest.mark.usefixtures("face_model")
def test_a_recording_becomes_a_talker_that_speaks(
    clients: dict[str, httpx.Client], build: Build, take: Path, tmp_path: Path
) -> None:
    assert take.stat().st_size > 100_000  # larger than other bodies may be
    queued = build(take.read_bytes(), licence="CC0-1.0", language="en-gb")
    assert queued.status_code == 202, queued.text
    client = clients["ann"]
    job = finished(client, queued.json())
    assert (job["state"], job["error"]) == ("done", None), job
    eventually(lambda: not stored_files(take.read_bytes()))  # the recording itself is not kept
    events = client.get(f"/v1/jobs/{job['id']}/events").text
    assert "reading recordings" in events
    assert '"n_kept": 1' in events
    assert '"warnings": [' in events
    assert "record words with these phones next" in events
    shown = client.get("/v1/talkers/anna").json()
    base = load_talker("grid_s1")  # completes a short recording
    about = shown["about"]
    assert (about["n_utterances"], shown["owner"]) == (1 + len(base.utterances), "ann")
    assert about["licence"] == f"recordings: CC0-1.0; base: {base.metadata['licence']}"
    assert client.get("/v1/talkers/anna/picture").headers["content-type"] == "image/png"
    assert [one["name"] for one in client.get("/v1/talkers").json()["data"]] == ["grid_s1", "anna"]
    result = next(one for one in job["results"] if one["name"] == "anna.talker")
    assert result["sha256"] == shown["sha256"]
    (tmp_path / "anna.talker").write_bytes(client.get(result["url"]).content)
    spoken = client.post("/v1/clips", json={"text": "We may.", "format": "curves", "talker": "anna"})
    session = tts2face.Session(tmp_path / "anna.talker")
    assert spoken.content == b"".join(chunk.content for chunk in session.stream_file("We may.", "curves"))
    page = next((one for one in job["results"] if one["name"] == "report.html"), None)
    if page is not None:
        assert client.get(page["url"]).headers["content-type"] == "application/octet-stream"
    again = build(take.read_bytes())
    assert (again.status_code, again.json()["error"]["code"]) == (409, "name_taken")
    assert client.delete("/v1/talkers/anna").status_code == 204


@pytest.mark.usefixtures("face_model")
def test_a_recording_without_a_face_is_refused_with_the_reason(
    clients: dict[str, httpx.Client], build: Build, take: Path
) -> None:
    queued = build(faceless(take), name="nobody")
    assert queued.status_code == 202, queued.text
    job = finished(clients["ann"], queued.json())
    assert (job["state"], job["results"]) == ("failed", [])
    assert job["error"] == "no recording could be used: recording: no frame shows a face"
    assert "nobody" not in clients["ann"].get("/v1/talkers").text


@pytest.mark.parametrize(
    ("make", "request_", "status", "reason"),
    [
        (lambda: b"", {}, 422, "video cannot be used: it is empty; send another file"),
        (lambda: b"#EXTM3U\n#EXTINF:10,\nfile:///etc/passwd\n", {}, 422, "it is no video that can be decoded"),
        (lambda: b"ffconcat version 1.0\nfile /etc/passwd\n", {}, 422, "it is no video that can be decoded"),
        (sound, {}, 422, "it is no video that can be decoded"),
        (lambda: movie(side=64)[:3000], {}, 422, "it is no video that can be decoded"),
        (lambda: movie(61.0, 16), {}, 422, "video cannot be used: it is longer than 60 s"),
        (lambda: movie(0.5), {"appearance": True}, 422, "needs the consent of the person shown"),
        (lambda: movie(0.5), {"appearance": True, "consent": "yes"}, 422, "is not one of the three answers"),
        (lambda: movie(0.5), {"consent": "me"}, 422, "give appearance and consent, or neither"),
        (lambda: movie(0.5), {"name": "../x"}, 422, "name: String should match pattern"),
        (lambda: movie(0.5), {"name": "x" * 10_000}, 422, "name: String should match pattern"),
        (lambda: movie(0.5), {"name": "tts-1"}, 409, "the talker tts-1 belongs to the service"),
        (lambda: bytes(6_000_000), {}, 413, "the body is larger than 5 MB"),
    ],
)
def test_wrong_recordings_are_refused(
    build: Build, make: Callable[[], bytes], request_: dict[str, Any], status: int, reason: str
) -> None:
    answer = build(make(), **request_)
    assert (answer.status_code, reason in answer.json()["error"]["message"]) == (status, True), answer.text


def test_building_needs_its_scope_and_only_it_may_be_large(clients: dict[str, httpx.Client], build: Build) -> None:
    large = bytes(100_000)
    refused = build(b"x", key="reader")
    assert (refused.status_code, refused.json()["error"]["code"]) == (403, "forbidden")
    assert build(large, key="reader").status_code == 413
    for path in ("/v1/jobs", "/v1/talkers", "/v1/clips"):
        answer = clients["ann"].post(path, data={"name": "x"}, files={"file": ("x", large)})
        assert (answer.status_code, "larger than 0.02 MB" in answer.text) == (413, True)
    form = {"job": json.dumps({"kind": "talker", "request": {"name": "x"}})}
    job = clients["reader"].post("/v1/jobs", data=form, files={"video": ("x", b"x")})
    assert (job.status_code, job.json()["error"]["code"]) == (403, "forbidden")
    wrong = clients["ann"].post("/v1/talkers/build", json={"kind": "talker"})
    assert (wrong.status_code, "send a form" in wrong.text) == (422, True)
    clip = {"job": json.dumps({"kind": "clip", "request": {"text": "Hello."}})}
    other = clients["ann"].post("/v1/talkers/build", data=clip, files={"video": ("x", b"x")})
    assert (other.status_code, "the kinds are talker" in other.text) == (422, True)


def test_a_key_may_have_some_talkers_in_work(host: HostService) -> None:
    video = movie(0.5)
    with host(workers=0) as running, httpx.Client(base_url=running.url, timeout=60.0) as client:
        queued = [order(client, video, name=f"t{number}") for number in range(4)]
        assert [one.status_code for one in queued] == [202] * 4, queued[-1].text
        fifth = order(client, video, name="t5")
        assert (fifth.status_code, fifth.json()["error"]["code"]) == (429, "queue_full")
        client.post(f"/v1/jobs/{queued[0].json()['id']}/cancel").raise_for_status()
        assert order(client, video, name="t5").status_code == 202


def test_words_may_be_sent_once(clients: dict[str, httpx.Client]) -> None:
    form = {"job": json.dumps({"kind": "talker", "request": {"name": "x"}})}
    files = {"transcript": ("t", b"Hello."), "subtitles": ("s", b"1\n00:00:00,500 --> 00:00:01,500\nHello.\n")}
    twice = clients["ann"].post("/v1/jobs", data=form, files=files)
    assert (twice.status_code, "there are words twice" in twice.text) == (422, True)
    none = clients["ann"].post("/v1/jobs", data=form, files={"transcript": ("t", WORDS)})
    assert (none.status_code, "there is no recording" in none.text) == (422, True)


@pytest.mark.usefixtures("face_model")
def test_a_real_recording_becomes_a_talker(clients: dict[str, httpx.Client], build: Build) -> None:
    """One sentence of a real person, if the recordings are there."""
    found = sorted((SHARED / "recordings" / "grid_s1" / "clips").glob("*.mkv"))
    if not found:
        pytest.skip("the recordings of real people are not part of the repository")
    queued = build(found[0].read_bytes(), transcript(found[0].stem), name="real")
    assert queued.status_code == 202, queued.text
    job = finished(clients["ann"], queued.json())
    assert (job["state"], job["error"]) == ("done", None), job
    assert clients["ann"].get("/v1/talkers/real").json()["about"]["n_utterances"] > 1  # its own, and the base's
