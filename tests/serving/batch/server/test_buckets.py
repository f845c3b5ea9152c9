"""Stores in buckets of S3, Google Cloud Storage and Azure, against emulators of other projects."""

import os
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import pytest

from tests.packages import needs, reason

pytest.importorskip("obstore", reason=reason("obstore"))


from cli.main import run
from lexicon.errors import BackendError, InputError
from tests.running import eventually
from tests.serving.batch.conftest import SRT, Planner
from tests.serving.batch.emulators import (
    ACCOUNT,
    ACCOUNT_KEY,
    SECRET,
    Emulator,
    Relay,
    make_container,
    start_azurite,
    start_moto,
)
from tests.tones import LetterVoice
from tts2face.serving.batch import engine as engines
from tts2face.serving.batch import store
from tts2face.serving.batch.run import run_batch
from tts2face.serving.batch.segment import Segment
from tts2face.serving.batch.segment_result import SegmentResult
from tts2face.serving.batch.store import open_store
from tts2face.storage import bucket as bucket_stores

ADDRESS = "ab" * 32
RESULT = SegmentResult(15, 10.0, 1.1, 1.4, 0.0, 0.0, ("a warning",), 2.5)
WORDS = ["--size", "64x64", "--fps", "10", "--supersampling", "1"]
AWAY_S = 40.0  # within which a store that does not answer must be reported


@dataclass
class Bucket:
    """A bucket of an emulator; requests pass a relay."""

    kind: str
    url: str
    missing_url: str
    relay: Relay
    emulator: Emulator


@pytest.fixture(scope="module")
def servers() -> Iterator[Callable[[str], Emulator]]:
    """Emulators by kind, started when first needed."""
    started: list[Emulator] = []

    @lru_cache
    def server(program: str) -> Emulator:
        started.append(start_moto() if program == "moto" else start_azurite())
        return started[-1]

    yield server
    for one in started:
        one.close()


@pytest.fixture(params=["s3", "gs", "az"])
def bucket(
    request: pytest.FixtureRequest, servers: Callable[[str], Emulator], monkeypatch: pytest.MonkeyPatch
) -> Iterator[Bucket]:
    """An empty bucket, and the environment that reaches it."""
    kind = request.param
    server = servers("azurite" if kind == "az" else "moto")
    name = f"clips{kind}{time.time_ns()}"  # moto does not decode %2D, as which obstore sends a hyphen
    place = f"http://127.0.0.1:{server.relay.port}"
    environment = {
        "s3": {
            "AWS_ENDPOINT_URL": place,
            "AWS_REGION": "us-east-1",
            "AWS_ACCESS_KEY_ID": "someone",
            "AWS_SECRET_ACCESS_KEY": SECRET,
        },
        "gs": {"GOOGLE_BASE_URL": place, "GOOGLE_BEARER_TOKEN": SECRET},
        "az": {
            "AZURE_STORAGE_ENDPOINT": f"{place}/{ACCOUNT}",
            "AZURE_STORAGE_ACCOUNT_NAME": ACCOUNT,
            "AZURE_STORAGE_ACCOUNT_KEY": ACCOUNT_KEY,
        },
    }[kind]
    for variable, value in environment.items():
        monkeypatch.setenv(variable, value)
    monkeypatch.setenv("NO_PROXY", "127.0.0.1")
    if kind == "az":
        make_container(server, name)
    else:
        server.request("PUT", f"/{name}")
    yield Bucket(kind, f"{kind}://{name}/season", f"{kind}://{name}missing/season", server.relay, server)
    server.relay.restore()


@pytest.fixture
def is_impatient(monkeypatch: pytest.MonkeyPatch) -> None:
    """One try for each request, and short pauses."""
    monkeypatch.setattr(bucket_stores, "RETRIES", {**bucket_stores.RETRIES, "max_retries": 0})
    monkeypatch.setattr(store, "PAUSE_S", 0.2)


def write_movie(folder: Path, content: bytes = b"movie") -> Path:
    movie = folder / "new.mov"
    movie.write_bytes(content)
    return movie


def batch(bucket_url: str, folder: Path, *words: str) -> list[str]:
    (folder / "one.srt").write_text(SRT, encoding="utf-8")
    return ["batch", str(folder / "one.srt"), "--out", str(folder / "clips"), "--store", bucket_url, *WORDS, *words]


def test_a_segment_is_stored_whole_fetched_listed_and_removed(bucket: Bucket, tmp_path: Path) -> None:
    opened = open_store(bucket.url)
    opened.check()
    assert opened.result(ADDRESS) is None
    assert list(opened.addresses()) == []
    content = bytes(range(256)) * 30_000  # 7.7 MB: more than a part of an upload in parts
    opened.put(ADDRESS, write_movie(tmp_path, content), RESULT)
    opened.put(ADDRESS, write_movie(tmp_path, content), RESULT)
    assert not (tmp_path / "new.mov").exists()
    assert opened.result(ADDRESS) == RESULT
    assert opened.fetch(ADDRESS, tmp_path).read_bytes() == content
    assert list(opened.addresses()) == [ADDRESS]
    opened.remove(ADDRESS)
    opened.remove(ADDRESS)
    assert opened.result(ADDRESS) is None
    assert list(opened.addresses()) == []


@pytest.mark.parametrize("bucket", ["s3", "az"], indirect=True)  # moto does not know Google's condition
def test_a_stored_movie_is_not_replaced(bucket: Bucket, tmp_path: Path) -> None:
    opened = open_store(bucket.url)
    for content in (b"first", b"second"):
        opened.put(ADDRESS, write_movie(tmp_path, content), RESULT)
    assert opened.fetch(ADDRESS, tmp_path).read_bytes() == b"first"


def test_a_batch_keeps_its_segments_in_a_bucket(
    bucket: Bucket, voices: list[LetterVoice], tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    assert run(batch(bucket.url, tmp_path)) == 0
    assert {path.name for path in (tmp_path / "clips").iterdir()} == {
        *(f"one-000{number}.mp4" for number in (1, 2, 3)),
        "manifest.json",
        "manifest.csv",
    }
    assert len(list(open_store(bucket.url).addresses())) == 3
    (tmp_path / "clips" / "one-0002.mp4").unlink()
    n_voices = len(voices)
    assert run(batch(bucket.url, tmp_path)) == 0
    assert len(voices) == n_voices
    printed = "".join(capfd.readouterr())
    assert "1 clips" in printed
    assert "from 0 new segments" in printed
    for text in (printed, (tmp_path / "clips" / "manifest.json").read_text()):
        assert SECRET not in text
        assert ACCOUNT_KEY not in text


@pytest.mark.parametrize("bucket", ["s3"], indirect=True)
def test_workers_share_a_bucket(bucket: Bucket, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    needs("dbos")
    jobs = ["--database", str(tmp_path / "jobs.sqlite")]
    worker = subprocess.Popen(
        [sys.executable, "-m", "tts2face", "worker", "--store", bucket.url, *jobs],
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        assert run(batch(bucket.url, tmp_path, "--voice", "espeak", "--jobs", "0", *jobs)) == 0
    finally:
        worker.terminate()
        said = worker.communicate(timeout=30)[1]
    assert len(list((tmp_path / "clips").glob("*.mp4"))) == 3
    printed = "".join(capfd.readouterr()) + said
    assert SECRET not in printed
    for path in tmp_path.rglob("*"):
        assert path.is_dir() or SECRET.encode() not in path.read_bytes()


def test_a_killed_upload_leaves_nothing_visible(bucket: Bucket, tmp_path: Path) -> None:
    movie = write_movie(tmp_path, os.urandom(9_000_000))
    upload = (
        "import sys; from pathlib import Path; from tts2face.serving.batch.store import open_store\n"
        "from tts2face.serving.batch.segment_result import SegmentResult\n"
        "open_store(sys.argv[1]).put(sys.argv[2], Path(sys.argv[3]), SegmentResult(15, 10.0))"
    )
    bucket.relay.limit = 3_000_000
    child = subprocess.Popen([sys.executable, "-c", upload, bucket.url, ADDRESS, str(movie)])
    eventually(lambda: bucket.relay.n_bytes > bucket.relay.limit, 30.0)
    child.kill()
    child.wait()
    bucket.relay.restore()
    opened = open_store(bucket.url)
    assert opened.result(ADDRESS) is None
    with pytest.raises(BackendError, match="is missing in"):
        opened.fetch(ADDRESS, tmp_path)
    assert movie.exists()
    opened.put(ADDRESS, movie, RESULT)
    assert opened.result(ADDRESS) == RESULT


def test_a_result_without_its_movie_is_removed(bucket: Bucket, tmp_path: Path) -> None:
    opened = open_store(bucket.url)
    opened.put(ADDRESS, write_movie(tmp_path), RESULT)
    opened.files.delete(f"ab/{ADDRESS}.mov")
    with pytest.raises(BackendError, match=rf"is missing in {bucket.url}; run again"):
        opened.fetch(ADDRESS, tmp_path)
    assert opened.result(ADDRESS) is None


def test_a_missing_bucket_is_named_before_anything_is_rendered(
    bucket: Bucket, voices: list[LetterVoice], tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    assert run(batch(bucket.missing_url, tmp_path)) == 4
    message = capfd.readouterr().err
    assert f"{bucket.missing_url} does not exist; create the bucket" in message
    assert voices == []


@pytest.mark.parametrize("bucket", ["s3", "az"], indirect=True)
def test_wrong_credentials_are_one_sentence(
    bucket: Bucket,
    voices: list[LetterVoice],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
) -> None:
    if bucket.kind == "s3":
        bucket.emulator.request("POST", "/moto-api/reset-auth", {"Content-Type": "text/plain"}, b"0")
    else:
        monkeypatch.setenv("AZURE_STORAGE_ACCOUNT_KEY", "c2VjcmV0" * 8)
    try:
        assert run(batch(bucket.url, tmp_path)) == 4
    finally:
        if bucket.kind == "s3":
            bucket.emulator.request("POST", "/moto-api/reset-auth", {"Content-Type": "text/plain"}, b"1000000")
    message = capfd.readouterr().err
    assert f"{bucket.url} refuses the credentials (403 Forbidden" in message
    assert "c2VjcmV0" not in message
    assert SECRET not in message
    assert [line for line in message.splitlines() if not line.startswith("tts2face: note: ")] == [
        message.splitlines()[-1]
    ]
    assert voices == []


@pytest.mark.parametrize("bucket", ["s3", "az"], indirect=True)
def test_missing_credentials_are_named(bucket: Bucket, monkeypatch: pytest.MonkeyPatch) -> None:
    for variable in ("AWS_SECRET_ACCESS_KEY", "AZURE_STORAGE_ACCOUNT_NAME"):
        monkeypatch.delenv(variable, raising=False)
    with pytest.raises((BackendError, InputError), match=r"AWS_SECRET_ACCESS_KEY|AZURE_STORAGE_ACCOUNT_NAME"):
        open_store(bucket.url).check()


def test_a_store_that_cannot_be_reached_is_reported_in_time(
    bucket: Bucket, voices: list[LetterVoice], tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    bucket.relay.fail()
    began = time.monotonic()
    assert run(batch(bucket.url, tmp_path)) == 4
    assert time.monotonic() - began < AWAY_S
    message = capfd.readouterr().err
    assert f"{bucket.url} cannot be reached at 127.0.0.1:{bucket.relay.port} (no connection); check" in message
    assert [line for line in message.splitlines() if not line.startswith("tts2face: note: ")] == [
        message.splitlines()[-1]
    ]
    assert voices == []


class Renderer:
    """Writes a movie, while the store goes away."""

    def __init__(self, relay: Relay) -> None:
        self._relay, self.n_calls = relay, 0

    def render(self, segment: Segment, out: Path) -> SegmentResult:
        self.n_calls += 1
        self._relay.fail()
        threading.Timer(1.0, self._relay.restore).start()
        out.write_bytes(b"movie")
        return SegmentResult(15, 10.0)


@pytest.mark.usefixtures("is_impatient")
def test_work_pauses_while_the_store_is_away(bucket: Bucket, plan_of: Planner) -> None:
    opened, renderer, messages = open_store(bucket.url), Renderer(bucket.relay), []
    segment = plan_of().outputs[0].segments[0]
    rendered = engines.render_into(opened, segment, renderer, messages.append)
    assert rendered.result == SegmentResult(15, 10.0)
    assert renderer.n_calls == 1
    assert opened.result(segment.address) == rendered.result
    assert [message.split(":")[0] for message in messages] == ["paused", "continued"]
    assert bucket.url in messages[0]


@pytest.mark.usefixtures("is_impatient")
def test_a_clip_whose_segments_cannot_be_read_fails_with_the_reason(
    bucket: Bucket, plan_of: Planner, voices: list[LetterVoice], tmp_path: Path
) -> None:
    opened = open_store(bucket.url)
    run_batch(plan_of(), tmp_path / "out", store=opened)
    fetch, opened.fetch = opened.fetch, lambda *_: (bucket.relay.fail(), fetch(*_))[1]
    (tmp_path / "out" / "one-0001.mp4").unlink()
    ((name, reason),) = run_batch(plan_of(), tmp_path / "out", store=opened).failed
    assert name == "one-0001.mp4"
    assert f"{bucket.url} cannot be reached" in reason
    bucket.relay.restore()
    assert run_batch(plan_of(), tmp_path / "out", store=open_store(bucket.url)).n_made == 1


@pytest.mark.parametrize("url", ["s3://key:secret@bucket/season", "az://clips/x?sv=1&sig=secret"])
def test_credentials_in_the_url_are_refused_and_not_repeated(url: str) -> None:
    with pytest.raises(InputError, match="contains credentials") as refused:
        open_store(url)
    assert "secret" not in str(refused.value).replace("SECRET", "").replace("by environment", "")
