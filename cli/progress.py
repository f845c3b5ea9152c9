"""Progress bars and last lines, on standard error."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from cli.streams import write_error

Progress = Callable[[int, int], None]


def write_message(line: str) -> None:
    """One line for the person at the terminal."""
    write_error(line)


@contextmanager
def progress_bar(what: str, quiet: bool = False) -> Iterator[Progress | None]:
    """A bar that follows ``on_progress(done, of)``; nothing when quiet or when no person is looking."""
    with stage_bar(quiet) as stages:
        yield stages(what) if stages else None


@contextmanager
def stage_bar(quiet: bool = False) -> Iterator[Callable[[str], Progress] | None]:
    """A bar that starts again with each stage, under its name; nothing when quiet or when no person is looking."""
    if quiet or not sys.stderr.isatty():
        yield None
        return
    from rich.console import Console
    from rich.progress import BarColumn, TaskProgressColumn, TextColumn, TimeRemainingColumn
    from rich.progress import Progress as Bar

    columns = (TextColumn("{task.description}"), BarColumn(), TaskProgressColumn(), TimeRemainingColumn())
    with Bar(*columns, console=Console(stderr=True), transient=True) as bar:

        def begin(what: str) -> Progress:
            for task in bar.task_ids:
                bar.remove_task(task)
            task = bar.add_task(what, total=None)
            return lambda done, of: bar.update(task, completed=done, total=of)

        yield begin
