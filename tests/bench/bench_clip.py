"""From text to a finished clip: speed, cold start, memory.

Run: ``python tests/bench/bench_clip.py`` (``--minutes 10`` for the long text). A reference loop of plain numpy runs
before and after, so that figures of different machines and times can be compared. ``--start`` prints only the processor
time and peak memory of commands in new processes, ``--first`` time and processor time of the very first clip; with
``--beside ../other``, in turn with those of another working copy.
"""

import argparse
import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from sentences import sentences

from tts2face.models.face_loading import load_face
from tts2face.models.talker_file import load_talker
from tts2face.picture.film import ClipWriter
from tts2face.picture.options import Picture
from tts2face.request import Request
from tts2face.session.session import Session

COMMAND = "from cli.main import main; main()"
HOMES = ("NUMBA_CACHE_DIR", "XDG_CACHE_HOME")  # other places of compiled kernels
SHORT = "We were away a year ago, but Bob may move five big maps."
TEN_SECONDS = f"{SHORT} Peter Piper picked a peck of pickled peppers, and she sells sea shells by the shore."
FIRST_FRAME = """
import os, sys, time
from tts2face.picture.renderer import MeshRenderer
frames = MeshRenderer.frames
def first(*arguments, **options):
    for _ in frames(*arguments, **options):
        print(time.process_time(), flush=True)
        os._exit(0)
MeshRenderer.frames = first
from cli.main import run
run(sys.argv[1:])
"""
STARTS = {
    "wav": ("start.wav", COMMAND),
    "csv": ("start.csv", COMMAND),
    "first frame": ("start.mp4", FIRST_FRAME),
    "clip": ("start.mp4", COMMAND),
}


def reference_s() -> float:
    """Seconds of a fixed amount of single-threaded numpy work."""
    values = np.random.default_rng(0).normal(size=400_000)
    began = time.perf_counter()
    for _ in range(20):
        values = np.sort(values * 1.0001 - 0.5)
    return time.perf_counter() - began


def whole_clip(folder: Path, n_runs: int = 3) -> None:
    """Speak, animate, draw, encode: 512 x 512, 30 frames a second, 2 x 2 samples; after one warm-up."""
    ready = Session(load_talker("grid_s1"), load_face("head"))
    rates, before = [], reference_s()
    for run in range(n_runs + 1):
        began = time.perf_counter()
        written = ready.write(Request(text=TEN_SECONDS), folder / "clip.mp4", picture=Picture())
        if run:
            rates.append(written.seconds / (time.perf_counter() - began))
    print(
        f"whole clip of {written.seconds:.1f} s: {np.median(rates):.2f} x real time ({min(rates):.2f}-{max(rates):.2f})"
    )
    request = Request(text=TEN_SECONDS)
    clips = [piece.clip for piece in ready.stream(request)]
    began = time.perf_counter()
    with ClipWriter(folder / "drawn.mp4", ready.renderer(Picture())) as writer:
        for clip in clips:
            writer.add(clip)
    frames = sum(len(clip.motion) for clip in clips)
    spent = time.perf_counter() - began
    print(f"drawing and encoding alone: {frames / spent:.0f} frames/s")
    print(f"reference loop: {before:.2f} s before, {reference_s():.2f} s after")


def start_cpu(folder: Path, trees: list[Path], n_runs: int = 7) -> None:
    """Median processor seconds and peak memory of one sentence in a new process on one core, with kernels on disk."""
    for what, (name, code) in STARTS.items():
        used: dict[Path, list[tuple[float, float]]] = {tree: [] for tree in trees}
        for run in range(n_runs + 1):
            for tree in trees:
                (folder / name).unlink(missing_ok=True)
                found = _use_of(["-c", code, SHORT, "--out", str(folder / name), "--quiet"], tree)
                if run:  # the first one warms the disk
                    used[tree].append(found)
        medians = [np.median(used[tree], axis=0) for tree in trees]
        shown = (f"{tree} {cpu:.2f} s, {peak:.0f} MB" for tree, (cpu, peak) in zip(trees, medians, strict=True))
        print(f"{what}: {'; '.join(shown)}")
        if len(medians) > 1:
            print("    {:.3f} and {:.3f} of the other's".format(*(medians[0] / medians[1])))


def _use_of(arguments: list[str], tree: Path) -> tuple[float, float]:
    """Processor seconds of a Python process in a working copy, those it prints or those until it ends; its peak in MB.

    Raises
    ------
    RuntimeError
        It failed.
    """
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    environment["PYTHONPATH"] = str(tree.resolve())
    with tempfile.TemporaryFile("w+") as printed:
        child = subprocess.Popen(
            [sys.executable, *arguments], stdout=printed, env=environment, cwd=tree,
            preexec_fn=lambda: os.sched_setaffinity(0, {max(os.sched_getaffinity(0))}),  # noqa: PLW1509 - no threads
        )  # fmt: skip
        _, status, usage = os.wait4(child.pid, 0)
        if status:
            raise RuntimeError(f"{tree}: {' '.join(arguments[2:])} failed with {status}")
        printed.seek(0)
        stated = printed.read()
    return float(stated) if stated else usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024


def cold_start(folder: Path) -> None:
    """Time of the whole command in a new process, and to its first frame, with compiled kernels on disk."""
    for what, arguments in {"--help": ["--help"], "clip of one word": ["Hi.", "--out", str(folder / "hi.mp4")]}.items():
        spent = []
        for _ in range(5):
            began = time.perf_counter()
            subprocess.run([sys.executable, "-c", COMMAND, *arguments], check=True, capture_output=True)
            spent.append(time.perf_counter() - began)
        print(f"{what}: {np.median(spent):.2f} s ({min(spent):.2f}-{max(spent):.2f})")
    code = (
        "import sys, time; began = time.perf_counter()\n"
        "from tts2face.picture.renderer import MeshRenderer as M; frames = M.frames\n"
        "def first(*a, **k):\n"
        "    for n, x in enumerate(frames(*a, **k)):\n"
        "        if n == 0: print(time.perf_counter() - began)\n"
        "        yield x\n"
        "M.frames = first\n"
        "from cli.main import run; run(sys.argv[1:])"
    )
    spent = []
    for _ in range(5):
        arguments = [SHORT, "--out", str(folder / "first.mp4"), "--quiet"]
        done = subprocess.run([sys.executable, "-c", code, *arguments], check=True, capture_output=True, text=True)
        spent.append(float(done.stdout.split()[0]))
    print(f"cold start to the first frame: {np.median(spent):.2f} s ({min(spent):.2f}-{max(spent):.2f})")


def first_run(folder: Path, trees: list[Path], n_runs: int = 7) -> None:
    """Median time of the first clip of all, in an empty home, and processor time of all its processes."""
    spent: dict[Path, list[tuple[float, float]]] = {tree: [] for tree in trees}
    for _ in range(n_runs):
        for tree in trees:
            before, began = child_cpu_s(), time.perf_counter()
            with tempfile.TemporaryDirectory() as home:
                kept = {name: value for name, value in os.environ.items() if name not in HOMES}
                environment = kept | {"HOME": home, "PYTHONPATH": str(tree.resolve())}
                arguments = ["-c", COMMAND, SHORT, "--out", str(folder / "first_run.mp4"), "--quiet"]
                subprocess.run([sys.executable, *arguments], check=True, capture_output=True, env=environment, cwd=tree)
            spent[tree].append((time.perf_counter() - began, child_cpu_s() - before))
    for tree in trees:
        seconds, of_processor = np.median(spent[tree], axis=0)
        print(f"very first clip: {tree} {seconds:.1f} s, {of_processor:.1f} s of processor time")


def child_cpu_s() -> float:
    """Processor time of the child processes that have ended."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def long_text(folder: Path, minutes: float) -> None:
    """Peak memory and speed for a text of many minutes, in a process of its own."""
    text = folder / "long.txt"
    text.write_text("\n".join(sentences(round(minutes * 60 / 4.1))), encoding="utf-8")
    began = time.perf_counter()
    arguments = ["--file", str(text), "--out", str(folder / "long.mp4")]
    done = subprocess.run([sys.executable, "-c", COMMAND, *arguments], check=True, capture_output=True, text=True)
    spent = time.perf_counter() - began
    peak = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024
    print(f"{minutes:g} minutes of text: peak memory {peak:.0f} MB, {spent:.0f} s; {done.stderr.strip()}")


def main() -> None:
    """Print the figures that docs/performance.md sums up."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, default=0.0, help="also speak a text of so many minutes")
    parser.add_argument("--start", action="store_true", help="processor time of commands in new processes only")
    parser.add_argument("--first", action="store_true", help="the very first clip only, median of seven")
    parser.add_argument("--beside", type=Path, help="another working copy, whose commands run in turn with these")
    chosen = parser.parse_args()
    minutes = chosen.minutes
    trees = [Path.cwd(), *([chosen.beside] if chosen.beside else [])]
    with tempfile.TemporaryDirectory() as name:
        if chosen.first:
            first_run(Path(name), trees)
            return
        start_cpu(Path(name), trees)
        if chosen.start:
            return
        if minutes:
            long_text(Path(name), minutes)
        whole_clip(Path(name))
        cold_start(Path(name))
        first_run(Path(name), trees, n_runs=1)


if __name__ == "__main__":
    main()
