"""Figures of batches for docs/performance.md: planning, overhead, two processes, memory, throughput of the queue.

Run on a machine without other load: ``python tests/bench/bench_batch.py [plan | overhead | jobs | queue DATABASE]``.
"""

import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from tts2face.picture.options import Picture
from tts2face.request import Request
from tts2face.serving.batch.engine import LocalEngine
from tts2face.serving.batch.options import BatchOptions
from tts2face.serving.batch.output import Plan
from tts2face.serving.batch.plan import plan_batch
from tts2face.serving.batch.run import run_batch

WORDS = (
    "We were away a year ago, but Bob may move five big maps.",
    "The gif loads slowly, and nobody knows why it does so.",
    "Please call me when the last train has left the station.",
    "Good morning to all of you, and thank you for coming here.",
)  # each is spoken in 2.5 to 4 s


def stamp(seconds: float) -> str:
    whole = int(seconds)
    return f"{whole // 3600:02d}:{whole // 60 % 60:02d}:{whole % 60:02d},{round((seconds - whole) * 1000):03d}"


def subtitles(folder: Path, n_cues: int, period_s: float = 5.0) -> Path:
    path = folder / "bench.srt"
    lines = [
        f"{n + 1}\n{stamp(n * period_s)} --> {stamp((n + 1) * period_s)}\n{WORDS[n % len(WORDS)]} Number {n}.\n"
        for n in range(n_cues)
    ]
    path.write_text("\n".join(lines), encoding="utf-8")
    return path


def plan_of(folder: Path, n_cues: int, **picture: object) -> Plan:
    path = subtitles(folder, n_cues)
    return plan_batch([path], BatchOptions(), request=Request(fps=25), picture=Picture(**picture))


def bench_plan(folder: Path) -> None:
    began = time.perf_counter()
    plan = plan_of(folder, 1000)
    n_segments = len(plan.segments)
    print(f"1,000 cues planned in {time.perf_counter() - began:.2f} s ({n_segments} segments)")


def bench_overhead(folder: Path, n_cues: int = 12) -> None:
    """Wall time of a batch in one process, against that of its renderings alone, measured inside."""
    plan = plan_of(folder, n_cues)
    run_batch(plan_of(folder / "..", 1, size="64x64"), folder / "warm")
    result = run_batch(plan, folder / "one")
    import json

    entries = json.loads((folder / "one" / "manifest.json").read_text())["outputs"]
    rendering = sum(entry["took_s"] for entry in entries)
    print(
        f"{n_cues} cues of 5 s: {result.took_s:.2f} s, rendering {rendering:.2f} s, "
        f"overhead {100 * (result.took_s / rendering - 1):.1f} %"
    )
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(f"peak memory {peak:.0f} MB")


def bench_jobs(folder: Path, n_cues: int = 16) -> None:
    """Two processes against one, both bound to single cores; the start of the processes is part of it."""
    took = {}
    for n_jobs in (1, 2):
        plan = plan_of(folder, n_cues)
        engine = BoundEngine(n_jobs)
        took[n_jobs] = run_batch(plan, folder / f"jobs{n_jobs}", engine=engine).took_s
        peak = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024
        print(f"{n_jobs} processes: {took[n_jobs]:.2f} s, largest child {peak:.0f} MB")
    print(f"two processes are {took[1] / took[2]:.2f} x one")


class BoundEngine(LocalEngine):
    """As `LocalEngine`, with a child process also for one job."""

    def render(self, segments, store):  # type: ignore[no-untyped-def]
        from concurrent.futures import ThreadPoolExecutor, as_completed

        from tts2face.serving.batch.engine import _processes, render_into

        with _processes(self.n_jobs) as free, ThreadPoolExecutor(self.n_jobs) as pool:

            def work(segment):  # type: ignore[no-untyped-def]
                process = free.get()
                try:
                    return render_into(store, segment, process, self.on_message)
                finally:
                    free.put(process)

            for finished in as_completed([pool.submit(work, segment) for segment in segments.values()]):
                yield finished.result()


def bench_queue(folder: Path, database: str, n_workers: int = 4, n_cues: int = 400) -> None:
    """Jobs per second that workers without any rendering take from a database."""
    from tts2face.serving.batch.store import open_store
    from tts2face.serving.work.engine import DatabaseEngine

    plan = plan_of(folder, n_cues)
    store = folder / "store"
    command = [
        sys.executable,
        "-m",
        "tests.serving.work.stub_worker",
        database or str(folder / "jobs.sqlite"),
        str(store),
    ]
    children = [
        subprocess.Popen([*command, str(folder / "rendered"), "0"], stdin=subprocess.PIPE) for _ in range(n_workers)
    ]
    time.sleep(4.0)
    began = time.perf_counter()
    engine = DatabaseEngine(command[3], str(store), n_workers=0)
    done = sum(one.result is not None for one in engine.render(plan.segments, open_store(store)))
    took = time.perf_counter() - began
    for child in children:
        child.kill()
        child.wait()
    print(f"{n_workers} workers without work: {done} jobs in {took:.1f} s, {done / took:.0f} jobs/s")


def main() -> None:
    chosen = sys.argv[1:2] or ["plan", "overhead", "jobs", "queue"]
    with tempfile.TemporaryDirectory(prefix="bench-") as folder:
        for name in chosen:
            place = Path(folder) / name
            place.mkdir()
            if name == "queue":
                bench_queue(place, *sys.argv[2:3] or [""])
            else:
                {"plan": bench_plan, "overhead": bench_overhead, "jobs": bench_jobs}[name](place)


if __name__ == "__main__":
    main()
