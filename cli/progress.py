"""Progress bars on standard error, and messages of what delays a first run."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from cli.process import COMPILATION, Progress, write_message


@contextmanager
def progress_bar(description: str, quiet: bool = False) -> Iterator[Progress]:
    """Progress bar updated by ``on_progress(done, of)``; nothing is shown if quiet or without a terminal."""
    with stage_bar(quiet) as stages:
        yield stages(description)


@contextmanager
def compilation_messages(quiet: bool = False) -> Iterator[None]:
    """Say, unless quiet, that kernels are compiled and how many have been."""
    import logging

    log = logging.getLogger(COMPILATION)
    if quiet or log.handlers:  # an outer context says it
        yield
        return
    handler = logging.Handler()
    handler.emit = lambda record: write_message(record.getMessage())  # type: ignore[method-assign]
    log.addHandler(handler)
    log.setLevel(logging.INFO)
    try:
        yield
    finally:
        log.removeHandler(handler)


@contextmanager
def stage_bar(quiet: bool = False) -> Iterator[Callable[[str], Progress]]:
    """Progress bar that restarts with each named stage; nothing is shown if quiet or without a terminal."""
    with compilation_messages(quiet):
        if quiet or not sys.stderr.isatty():
            yield lambda _: lambda _done, _of: None
            return
        with _bar() as begin_stage:
            yield begin_stage


@contextmanager
def _bar() -> Iterator[Callable[[str], Progress]]:
    # imported late: --help and --quiet do without
    from rich.console import Console
    from rich.progress import BarColumn, TaskProgressColumn, TextColumn, TimeRemainingColumn
    from rich.progress import Progress as Bar

    columns = (TextColumn("{task.description}"), BarColumn(), TaskProgressColumn(), TimeRemainingColumn())
    with Bar(*columns, console=Console(stderr=True), transient=True) as bar:

        def begin_stage(description: str) -> Progress:
            for task in bar.task_ids:
                bar.remove_task(task)
            task = bar.add_task(description, total=None)
            return lambda done, of: bar.update(task, completed=done, total=of)

        yield begin_stage
