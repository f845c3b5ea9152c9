"""Processes of the tools that work on one order: takes to styles, tables and films; photos to heads; talkers.

They read files of strangers: each has limits of memory, time and files, and no network, and ends with the server.
"""

import asyncio
import json
import sys
from collections.abc import Callable, Mapping
from contextlib import suppress
from typing import Any

from lexicon.errors import BackendError, DataError
from lexicon.inputs import parse_json
from tts2face.batch.render_process import KINDS
from tts2face.limited_process import bare_environment

TAKE_PROCESS = "corpus_tools.take_process"  # by name: the tools stand above this package
TAKE_S = 1800.0  # of one order


async def run_take_process(order: Mapping[str, Any], on_message: Callable[..., None]) -> dict[str, Any]:
    """Result of an order of `corpus_tools.take_process`; `on_message` gets the stage, and the steps done and of all.

    Raises
    ------
    InputError, DataError, BackendError
        The take cannot be used, or needs too much memory or time.
    """
    return await asyncio.wait_for(run_tool(TAKE_PROCESS, order, on_message, "is_result", "the take"), TAKE_S)


async def run_tool(
    module: str, order: Mapping[str, Any], on_message: Callable[..., None], result: str, what: str
) -> dict[str, Any]:
    """Last message of a process of the tools, which has a field `result`; errors as `run_take_process`."""
    child = await asyncio.create_subprocess_exec(
        sys.executable, "-m", module, stdin=asyncio.subprocess.PIPE, stdout=asyncio.subprocess.PIPE,
        stderr=asyncio.subprocess.DEVNULL, env=bare_environment(),
    )  # fmt: skip
    assert child.stdin is not None
    assert child.stdout is not None
    try:
        child.stdin.write(json.dumps(order).encode() + b"\n")
        await child.stdin.drain()
        while line := await child.stdout.readline():
            content: dict[str, Any] = parse_json(line.decode(), "the tools")
            if "error" in content:
                raise KINDS.get(content["error"], BackendError)(content["message"])
            if result in content:
                return content
            on_message(content["stage"], content["done"], content["of"])
    finally:
        await end_process(child)
    raise DataError(f"{what} needs too much memory or time; record it shorter, or with smaller pictures")


async def end_process(child: asyncio.subprocess.Process) -> None:
    """End a process and wait for its end."""
    with suppress(ProcessLookupError):
        child.kill()
    await child.wait()
