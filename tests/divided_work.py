"""What each process of a whole run would do again is divided among them: rewriting test modules, compiling kernels.

A pytest plugin. In a fresh checkout pytest writes assertions anew (10 s of processor time in each process), and on a
machine without compiled kernels each process compiles all (30 s). What one of them has done, the others find on disk.
"""

import sys
from collections.abc import Iterator, Mapping
from contextlib import suppress
from importlib import import_module
from pathlib import Path
from tempfile import gettempdir
from typing import Any

import pytest

TESTS = Path(__file__).resolve().parent
STEPS: tuple[tuple[str, Mapping[str, Any]], ...] = (  # of `tts2face.session.warm_up`, the longest first
    ("compile_pictures", {"face": "head"}),
    ("compile_pictures", {"face": "ada"}),
    ("compile_motion", {}),
    ("compile_gestures", {}),
)


def pytest_collection(session: pytest.Session) -> None:
    """Import a share of the test modules, so that the other processes find them rewritten."""
    if (place := _place(session.config)) is None or sys.dont_write_bytecode:
        return
    number, count = place
    ignored, config = session.config.hook.pytest_ignore_collect, session.config
    paths = [path for path in sorted(TESTS.rglob("test_*.py")) if not ignored(collection_path=path, config=config)]
    for path in paths[number * len(paths) // count : (number + 1) * len(paths) // count]:
        with suppress(Exception, pytest.skip.Exception):  # which collection tells
            import_module(".".join(path.relative_to(TESTS.parent).with_suffix("").parts))


@pytest.hookimpl(trylast=True)
def pytest_collection_finish(session: pytest.Session) -> None:
    """Compile the kernels that no other process of the run compiles."""
    if _place(session.config) is None:
        return
    from tests.processes.answered import answered
    from tts2face.session.warm_up import HANDLERS

    for step, content in _unclaimed():
        answered(HANDLERS[step], content)


def _place(config: pytest.Config) -> tuple[int, int] | None:
    """Number of a process of pytest-xdist that runs all tests, and how many there are; None for any other."""
    given: Mapping[str, Any] = getattr(config, "workerinput", {})
    if not given or [Path(path).resolve() for path in config.args] != [TESTS]:
        return None
    return int(given["workerid"].removeprefix("gw")), int(given["workercount"])


def _unclaimed() -> Iterator[tuple[str, Mapping[str, Any]]]:
    """Steps that no other process of the run has taken; its temporary folder is that of `tests.started`."""
    for number, step in enumerate(STEPS):
        with suppress(FileExistsError):
            (Path(gettempdir()) / f"kernels-{number}").touch(exist_ok=False)
            yield step
