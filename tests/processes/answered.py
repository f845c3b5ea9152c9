"""Handlers and children as tests ask them."""

import asyncio
import io
import threading
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from tts2face.processes.async_parent import call_once
from tts2face.processes.child import Call, Handler, answer
from tts2face.processes.message import ERROR, Message, read_message
from tts2face.processes.parent import ChildEndedError, raised
from tts2face.processes.program import Program
from tts2face.serving.work.resource_check import RefusedFileError
from tts2face.serving.work.uploaded_file import DECODE, HANDLERS, program


def answered(handler: Handler, content: Mapping[str, Any]) -> list[Message]:
    """Messages of a call that is answered in this process."""
    out = io.BytesIO()
    answer(Call(Message("asked", content), out, threading.Condition()), {"asked": handler})
    out.seek(0)
    return list(iter(lambda: read_message(out), None))


def ordered(handlers: str, kind: str, content: Mapping[str, Any]) -> tuple[list[Mapping[str, Any]], Mapping[str, Any]]:
    """Events and result of a call of a child that works on this order only; errors as the child."""
    events: list[Mapping[str, Any]] = []
    called = call_once(Program(handlers), kind, content, on_event=lambda event: events.append(event.content))
    return events, asyncio.run(called)


def refusal(kind: str, source: Path, target: Path, limit: float, *, is_limited: bool = False) -> str:
    """Why the decoder refuses a file; nothing for one that it takes.

    Parameters
    ----------
    is_limited
        It decodes in a child with its limits, and may end; otherwise in this process.
    """
    order = {"kind": kind, "source": str(source), "target": str(target), "limit": limit}
    try:
        if is_limited:
            asyncio.run(call_once(program(kind), DECODE, order, timeout_s=300.0))
        elif (last := answered(HANDLERS[DECODE], order)[-1]).kind == ERROR:
            raise raised(last)
    except (RefusedFileError, ChildEndedError) as refused:
        return str(refused)
    return ""
