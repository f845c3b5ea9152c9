"""Three subtitle files, two workers: all is killed, then a worker now and then; each clip is there once, in sync.

`TTS2FACE_SERIES_CUES` is the number of cues of a file (12). For the figures in docs/performance.md:
``TTS2FACE_SERIES_CUES=400 pytest -n 0 --log-cli-level=INFO tests/serving/work/server/test_series.py``.
"""

import csv
import json
import logging
import os
import random
import subprocess
import sys
import threading
import time
from pathlib import Path

import av
import pytest

from tests.packages import reason

pytest.importorskip("dbos", reason=reason("dbos"))

from tests.running import eventually
from tests.serving.work.conftest import Postgres
from tests.serving.work.series import Episode, make_series
from tests.serving.work.watch import StoreWatch
from tts2face.serving.batch.store import open_store
from tts2face.serving.work.queue_control import list_jobs

N_CUES = int(os.environ.get("TTS2FACE_SERIES_CUES", "12"))
FPS = 10
N_KILLS = N_CUES // 4  # at most, of one worker or of both
TIMEOUT_S = 240 + 6 * N_CUES
N_STORED = 6  # when everything is killed
FIRST_KILL_S, KILL_INTERVAL_S = 3.0, (2.0, 6.0)
LOG = logging.getLogger(__name__)
COMMAND = [sys.executable, "-m", "tts2face"]
DRAFT = ["--voice", "espeak", "--size", "64x64", "--supersampling", "1", "--fps", str(FPS)]


def start_worker(database: str, store: Path, log: Path) -> "subprocess.Popen[bytes]":
    with log.open("ab") as messages:
        return subprocess.Popen(
            [*COMMAND, "worker", "--database", database, "--store", str(store)], stdout=messages, stderr=messages
        )


class Killer:
    """Kills one of two workers, or both, every few seconds, and starts others.

    The seconds are counted from the first segment after the last kill, so that a slow machine ends the test, too.
    """

    def __init__(self, database: str, store: Path, log: Path, watch: StoreWatch) -> None:
        self._start = lambda: start_worker(database, store, log)
        self._watch = watch
        self._workers = [self._start(), self._start()]
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run)
        self.n_kills = 0

    def _run(self) -> None:
        generator = random.Random(1)
        wait_s = FIRST_KILL_S
        for _ in range(N_KILLS):
            if self._ended.wait(wait_s):
                return
            wait_s = generator.uniform(*KILL_INTERVAL_S)
            n_stored = len(self._watch.stored)
            for number in [generator.randrange(2)] if generator.random() < 0.8 else [0, 1]:
                self._workers[number].kill()
                self._workers[number].wait()
                self._workers[number] = self._start()
                self.n_kills += 1
            while len(self._watch.stored) == n_stored and not self._ended.wait(0.2):
                continue

    def __enter__(self) -> "Killer":
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._ended.set()
        self._thread.join()
        for worker in self._workers:
            worker.kill()
            worker.wait()


def check_clip(path: Path, entry: dict[str, object]) -> None:
    """The clip decodes, and sound and pictures last as the manifest says, within a frame."""
    with av.open(str(path)) as container:
        n_frames = sum(1 for _ in container.decode(video=0))
    with av.open(str(path)) as container:
        seconds = sum(frame.samples / frame.sample_rate for frame in container.decode(audio=0))
    assert n_frames == entry["n_frames"]
    assert abs(seconds - n_frames / FPS) <= 1 / FPS + 1024 / 48_000  # the last block of AAC is padded


def check_outputs(folder: Path, episodes: tuple[Episode, ...]) -> None:
    entries = json.loads((folder / "manifest.json").read_text(encoding="utf-8"))["outputs"]
    assert {entry["status"] for entry in entries} == {"done"}
    with (folder / "manifest.csv").open(encoding="utf-8", newline="") as file:
        assert [row["file"] for row in csv.DictReader(file)] == [entry["file"] for entry in entries]
    for episode in episodes:
        own = [entry for entry in entries if entry["source"] == [str(episode.path)]]
        assert len(own) == len(episode.spoken)
        for entry, (begin, words) in zip(own, sorted(episode.spoken.items()), strict=True):
            assert entry["cues"][0]["text"].split() == words.split()
            assert abs(entry["cues"][0]["begin_s"] - begin) <= 1 / FPS
            check_clip(folder / entry["file"], entry)
    assert sorted(path.name for path in folder.glob("*.mp4")) == sorted(entry["file"] for entry in entries)


@pytest.mark.parametrize("kind", ["sqlite", "postgres"])
def test_a_series_survives_kills(kind: str, tmp_path: Path, request: pytest.FixtureRequest) -> None:
    server: Postgres | None = request.getfixturevalue("postgres") if kind == "postgres" else None
    database = str(tmp_path / "jobs.sqlite") if server is None else server.database()
    episodes = make_series(tmp_path, N_CUES)
    n_clips = sum(len(episode.spoken) for episode in episodes)
    store, out, log = tmp_path / "store", tmp_path / "clips", tmp_path / "workers.log"
    files = [str(episode.path) for episode in episodes]
    batch = [*COMMAND, "batch", *files, "--out", str(out), "--database", database, "--store", str(store), *DRAFT]
    batch += ["--jobs", "0"]
    began = time.perf_counter()
    with StoreWatch(store) as watch:
        first = [subprocess.Popen([*batch, "--quiet"]), *(start_worker(database, store, log) for _ in range(2))]
        try:
            eventually(lambda: len(watch.stored) >= N_STORED, TIMEOUT_S)
        finally:
            for one in first:
                one.kill()
            if server is not None:
                server.kill()
            for one in first:
                one.wait()
        watch.look()
        assert len(watch.stored) < n_clips - 2, "all was done before everything was killed"
        if server is not None:
            server.start()
        with Killer(database, store, log, watch) as killer:
            done = subprocess.run([*batch, "--quiet"], capture_output=True, text=True, check=False, timeout=TIMEOUT_S)
            if not killer.n_kills:
                pytest.fail(
                    f"the series was done after {time.perf_counter() - began:.0f} s, before a worker was killed"
                )
    assert done.returncode == 0, done.stderr
    check_outputs(out, episodes)
    stored = sorted(open_store(store).addresses())  # equal cues share a segment
    assert stored == sorted({job.name.partition(".")[0] for job in list_jobs(database)})
    assert 0.9 * n_clips < len(stored) <= n_clips
    assert {job.state for job in list_jobs(database)} == {"done"}
    assert watch.n_twice == 0
    assert watch.cut_off() <= killer.n_kills + 4  # the first two and the last two workers are killed, too
    LOG.info(
        "%d clips, %d segments, %d kills; %d renderings were cut off and repeated, %d stored segments rendered again; "
        "%.0f s",
        n_clips, len(stored), killer.n_kills, watch.cut_off(), watch.n_twice, time.perf_counter() - began,
    )  # fmt: skip
    again = subprocess.run(batch, capture_output=True, text=True, check=True)
    assert f"{n_clips} clips were up to date" in again.stdout + again.stderr
