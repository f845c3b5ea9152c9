"""Tools of other packages that work on one order: takes to styles, tables and films; photos to heads; talkers.

They read files of strangers: each has limits of memory, time and files, and no network, and ends with the server.
"""

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from typing import Any, NamedTuple

from lexicon.errors import DataError
from tts2face.processes.async_parent import call_once
from tts2face.processes.parent import ChildEndedError
from tts2face.processes.program import ProcessLimits, Program

TAKES, TAKE_S = "takes", 1800.0  # the tool, and the time of one order
TAKE_LIMITS = ProcessLimits(memory_bytes=6 << 30, cpu_s=1800, file_bytes=1 << 30, n_files=256)
LOW_PRIORITY = 10  # streams go first
TALKER_BUILDER = TALKER_TOOL = "talker"  # the program, and its handler
TALKER_LIMITS = ProcessLimits(memory_bytes=4 << 30, cpu_s=0, file_bytes=2 << 30, n_files=256)
CPU_S = 1200  # of any recording
CPU_S_PER_S = 40  # for each second of a recording; 256 x 256 pixels take 1 s a second
SLOWNESS = 5.0  # elapsed time in units of the processor time, on a machine that has other work


async def run_take_tool(
    kind: str, order: Mapping[str, Any], on_message: Callable[..., None], *, cpu_s: int = TAKE_LIMITS.cpu_s
) -> Mapping[str, Any]:
    """Result of an order of ``takes``; `on_message` gets the stage, and the steps done and of all.

    Raises
    ------
    InputError, DataError, BackendError
        The take cannot be used, or needs too much memory or time.
    TimeoutError
        It takes longer than `TAKE_S`.
    """
    program = Program(TAKES, replace(TAKE_LIMITS, cpu_s=cpu_s), niceness=LOW_PRIORITY)
    return await run_tool(program, kind, order, on_message, what="the take", timeout_s=TAKE_S)


async def run_tool(
    program: Program, kind: str, order: Mapping[str, Any], on_message: Callable[..., None], *, what: str,
    timeout_s: float,
) -> Mapping[str, Any]:  # fmt: skip
    """Result of one order of a tool in a child of its own; errors as `run_take_tool`."""
    with limits_of(what):
        return await call_once(
            program, kind, order, on_event=lambda event: on_message(**event.content), timeout_s=timeout_s
        )


@contextmanager
def limits_of(what: str) -> Iterator[None]:
    """The one sentence about a tool that its limits have ended, as a `DataError`; `what` was given to it."""
    try:
        yield
    except ChildEndedError as ended:
        raise DataError(f"{what} needs too much memory or time; record it shorter, or with smaller pictures") from ended


class TalkerBuild(NamedTuple):
    """The builder of talkers within its limits, for a call `TALKER_TOOL` with its `BuildOrder`; the seconds for it."""

    program: Program
    timeout_s: float


def talker_build(seconds: float) -> TalkerBuild:
    """The build of a talker from so many seconds of recordings."""
    cpu_s = int(CPU_S + CPU_S_PER_S * seconds)
    return TalkerBuild(Program(TALKER_BUILDER, replace(TALKER_LIMITS, cpu_s=cpu_s)), SLOWNESS * cpu_s)
