"""Commands ended by a signal leave neither files nor processes."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from cli.main import run
from cli.process import UNCHANGED
from tests.running import eventually
from tests.started import running_processes
from tests.world import World

COMMAND = [sys.executable, "-c", "from cli.main import main; main()"]
ROOT = str(Path(__file__).parents[3])
TEXT = "This is a rather long sentence that takes some time to speak. " * 200
PATIENCE_S = 120.0
POOL = """
import os, sys, time
from pathlib import Path
from corpus_tools.parallel import map_unordered

def start(folder):
    (Path(folder) / str(os.getpid())).touch()
    return time.sleep

if __name__ == "__main__":
    from cli.process import INTERRUPTION
    INTERRUPTION.install()
    list(map_unordered([600.0, 600.0], start, (sys.argv[1],), 2))
"""

COMPILER = """
import ctypes, os, signal, sys, threading, time
from pathlib import Path
from cli.main import app, main
from tts2face.storage.temporary import Temporary

@app.command
def dropped(number: int):
    "Twice the signal within a callback of compiled code, where the first exception is dropped."
    called = []

    @ctypes.CFUNCTYPE(None)
    def callback():
        called.append(1)
        os.kill(os.getpid(), number)
        os.kill(os.getpid(), number)

    with Temporary(Path("x.mp4")):
        callback()
        assert called
        print("goes on", flush=True)
        time.sleep(600)

@app.command
def replaced(number: int):
    "The exception leads to another one, as in numba."
    try:
        os.kill(os.getpid(), number)
        time.sleep(600)
    finally:
        raise RuntimeError("no compiled object yet")

@app.command
def parted(number: int):
    "A thread that nothing ends, as one that its pool does not know yet when the exception comes."
    threading.Thread(target=threading.Event().wait).start()
    os.kill(os.getpid(), number)
    time.sleep(600)

@app.command
def stuck():
    "Compiled code that does not return, so that no handler runs in the main thread."
    with Temporary(Path("x.mp4")):
        ctypes.CDLL(None).system(b"echo begins; read line")

main()
"""

pytestmark = pytest.mark.skipif(
    not hasattr(signal, "SIGHUP") or not Path("/proc/self/stat").exists(), reason="needs POSIX signals and /proc"
)


def start_command(here: Path, world: World) -> "subprocess.Popen[str]":
    """A command that has begun to write x.mp4."""
    process = subprocess.Popen(
        [*COMMAND, TEXT, "--out", "x.mp4", "--size", "64x64", *world.flags],
        stderr=subprocess.PIPE, text=True, cwd=here, env={**os.environ, **world.environment},
    )  # fmt: skip
    eventually(lambda: list(here.glob(".x*")) or process.poll() is not None)
    assert process.poll() is None
    return process


@pytest.mark.parametrize(
    ("name", "code"), [("SIGINT", 130), pytest.param("SIGTERM", 143, marks=pytest.mark.smoke), ("SIGHUP", 129)]
)
def test_a_signal_leaves_no_files_and_no_processes(tmp_path: Path, world: World, name: str, code: int) -> None:
    earlier = tmp_path / "x.mp4"
    earlier.write_bytes(b"of an earlier run")
    with start_command(tmp_path, world) as process:
        process.send_signal(getattr(signal, name))
        _, message = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == code
    assert f"interrupted; {UNCHANGED}" in message
    assert list(tmp_path.iterdir()) == [earlier]
    assert earlier.read_bytes() == b"of an earlier run"


def run_script(here: Path, *arguments: str) -> "subprocess.Popen[str]":
    return subprocess.Popen(
        [sys.executable, "-c", COMPILER, *arguments],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        cwd=here,
        env={**os.environ, "PYTHONPATH": ROOT},
    )


@pytest.mark.smoke
def test_a_signal_whose_exception_is_dropped_or_replaced_ends_the_command(tmp_path: Path) -> None:
    """Signals that come twice at once, as from `timeout`, are one."""
    numbers = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
    started = [
        (number, run_script(tmp_path, command, str(int(number))))
        for number in numbers
        for command in ("dropped", "replaced", "parted")
    ]
    wrong = []
    for number, process in started:
        with process:
            try:
                _, message = process.communicate(timeout=PATIENCE_S)
            except subprocess.TimeoutExpired:
                process.kill()
                message = "goes on"
        if process.returncode != 128 + number or message.strip() != f"tts2face: interrupted; {UNCHANGED}":
            wrong.append((number.name, process.args[3:], process.returncode, message))
    assert wrong == []
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("n_signals", [1, pytest.param(100, marks=pytest.mark.smoke)])
def test_compiled_code_that_does_not_return_ends_with_the_process(tmp_path: Path, n_signals: int) -> None:
    """A while after the first signal, or at once with the second one; what it was writing is removed."""
    with run_script(tmp_path, "stuck") as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "begins\n"
        sent, end = 0, time.monotonic() + PATIENCE_S
        while process.poll() is None and time.monotonic() < end:
            if sent < n_signals:
                process.send_signal(signal.SIGTERM)
                sent += 1
            time.sleep(0.1)
        code = process.poll()
        process.kill()
        _, message = process.communicate()
    assert code == 128 + signal.SIGTERM
    assert message.strip() == f"tts2face: interrupted; {UNCHANGED}"
    assert list(tmp_path.iterdir()) == []


def test_files_of_a_killed_command_are_removed_by_the_next_one(tmp_path: Path, tones: World) -> None:
    with start_command(tmp_path, tones) as process:
        process.kill()
    assert list(tmp_path.glob(".x*"))
    out = ["--out", str(tmp_path / "x.mp4"), "--size", "64x64", "--fps", "5"]
    assert run(["Hi.", *tones.flags, *out]) == 0
    assert [path.name for path in tmp_path.iterdir()] == ["x.mp4"]


@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM", "SIGHUP", pytest.param("SIGKILL", marks=pytest.mark.smoke)])
def test_processes_of_a_pool_end_with_their_parent(tmp_path: Path, name: str) -> None:
    script = tmp_path / "pool_script.py"
    script.write_text(POOL)
    started = tmp_path / "started"
    started.mkdir()
    with subprocess.Popen([sys.executable, str(script), str(started)], stderr=subprocess.DEVNULL) as process:
        eventually(lambda: len(list(started.iterdir())) == 2)
        children = {int(path.name) for path in started.iterdir()}
        assert children <= running_processes().keys()
        process.send_signal(getattr(signal, name))
        ended = time.monotonic()
        process.wait(PATIENCE_S)
        eventually(lambda: not children & running_processes().keys())
    assert time.monotonic() - ended < 15.0  # their tasks take ten minutes
