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
import sys
import tempfile
from pathlib import Path

RUN = "TTS2FACE_TEST_RUN"
# A shell lets its background jobs ignore these, and so would the processes that tests send them to.
IGNORED_IN_BACKGROUND = (signal.SIGINT, signal.SIGQUIT, signal.SIGHUP)
PARENT_S = 1.0  # a process that pytest has forked can hold its pipe: the end of pytest itself is seen after this time


def pytest_configure(config: object) -> None:
    """Start the watchdog; processes of pytest-xdist belong to the run that has started them."""
    for number in IGNORED_IN_BACKGROUND:
        if signal.getsignal(number) is signal.SIG_IGN:
            signal.signal(number, signal.default_int_handler if number == signal.SIGINT else signal.SIG_DFL)
    if hasattr(config, "workerinput") or not Path("/proc/self/environ").exists():
        return
    folder = tempfile.mkdtemp(prefix="tts2face-tests-")
    os.chmod(folder, 0o711)  # PostgreSQL runs as another user
    os.environ.setdefault("PYTEST_DEBUG_TEMPROOT", tempfile.gettempdir())  # what pytest keeps for a look stays there
    run, without_run = folder.rsplit("-", 1)[1], {name: os.environ[name] for name in os.environ if name != RUN}
    watched, _ = os.pipe()  # its other end is open until pytest ends
    os.posix_spawn(
        sys.executable, [sys.executable, "-S", __file__, run, folder], without_run,
        file_actions=[(os.POSIX_SPAWN_DUP2, watched, 0)], setsid=True,
    )  # fmt: skip
    os.close(watched)
    os.environ |= {RUN: run, "TMPDIR": folder}
    tempfile.tempdir = folder


def running_processes() -> dict[int, int]:
    """Number of the parent of each process that has not ended."""
    found = {}
    for path in Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError):
            state, parent = path.read_text().rpartition(")")[2].split()[:2]
            if state != "Z":  # ended, but for its parent's look at how
                found[int(path.parent.name)] = int(parent)
    return found


def children(number: int) -> list[int]:
    """Processes that a process has started, and theirs."""
    parents, found = running_processes(), [number]
    for one in found:  # grows
        found += [child for child, parent in parents.items() if parent == one]
    return found[1:]


def processes_of(run: str) -> list[int]:
    """Numbers of the processes of a run, and of those that these have started."""
    entry, found = f"{RUN}={run}".encode(), set()
    for number in running_processes():
        with contextlib.suppress(OSError):
            if entry in Path(f"/proc/{number}/environ").read_bytes().split(b"\0"):
                # Children may have an environment of their own, or have written a title over it.
                found |= {number, *children(number)}
    return sorted(found)


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
