"""What a run of the tests starts ends with it, also when pytest is killed: processes and temporary files.

A pytest plugin. Processes inherit the environment variable `RUN`, and temporary files lie in a folder of the run. A
watchdog, ``python tests/started.py RUN FOLDER``, waits for the end of pytest, however it ends, then kills the processes
that are left and removes the folder. Linux only: elsewhere tests clean up as far as they get.
"""

import contextlib
import os
import select
import shutil
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

RUN = "TTS2FACE_TEST_RUN"
PARENT_S = 1.0  # a process that pytest has forked can hold its pipe: the end of pytest itself is seen after this time
_WATCHDOGS: list["subprocess.Popen[bytes]"] = []  # their standard input is open until pytest ends


def pytest_configure(config: object) -> None:
    """Start the watchdog; processes of pytest-xdist belong to the run that has started them."""
    if hasattr(config, "workerinput") or not Path("/proc/self/environ").exists():
        return
    folder = tempfile.mkdtemp(prefix="tts2face-tests-")
    os.chmod(folder, 0o711)  # PostgreSQL runs as another user
    os.environ.setdefault("PYTEST_DEBUG_TEMPROOT", tempfile.gettempdir())  # what pytest keeps for a look stays there
    without_run = {name: value for name, value in os.environ.items() if name != RUN}
    command = [sys.executable, "-S", __file__, folder.rsplit("-", 1)[1], folder]
    _WATCHDOGS.append(subprocess.Popen(command, stdin=subprocess.PIPE, env=without_run, start_new_session=True))
    os.environ |= {RUN: command[-2], "TMPDIR": folder}
    tempfile.tempdir = folder


def processes_of(run: str) -> list[int]:
    """Numbers of the processes of a run, and of those that these have started."""
    entry, parents, found = f"{RUN}={run}".encode(), {}, []
    for path in Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError, IndexError):
            parents[int(path.name)] = int((path / "stat").read_text().rpartition(")")[2].split()[1])
            if entry in (path / "environ").read_bytes().split(b"\0"):
                found.append(int(path.name))
    for number in found:  # grows: programs that write a title of their own over their environment are children
        found += [child for child, parent in parents.items() if parent == number and child not in found]
    return found


def end(run: str, folder: str) -> None:
    """Kill the processes of a run, and remove its folder."""
    while left := processes_of(run):
        for number in left:
            with contextlib.suppress(ProcessLookupError):
                os.kill(number, signal.SIGKILL)
        select.select([], [], [], 0.05)
    shutil.rmtree(folder, ignore_errors=True)


if __name__ == "__main__":
    pytest_process = os.getppid()
    while os.getppid() == pytest_process and not select.select([sys.stdin], [], [], PARENT_S)[0]:
        pass
    end(*sys.argv[1:])
