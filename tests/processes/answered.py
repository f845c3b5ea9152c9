"""Handlers and children as tests ask them."""

import io
import threading
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from tts2face.jobs.refused_file import RefusedFileError
from tts2face.processes.child import Call, Handler, answer
from tts2face.processes.message import Message, read_message
from tts2face.processes.parent import Child, ChildEndedError
from tts2face.processes.program import Program
from tts2face.service.uploads.decode import DECODE, program


def answered(handler: Handler, content: Mapping[str, Any]) -> list[Message]:
    """Messages of a call that is answered in this process."""
    out = io.BytesIO()
    answer(Call(Message("asked", content), out, threading.Condition()), {"asked": handler})
    out.seek(0)
    return list(iter(lambda: read_message(out), None))


def ordered(handlers: str, kind: str, content: Mapping[str, Any]) -> tuple[list[Mapping[str, Any]], Mapping[str, Any]]:
    """Events and result of a call of a child that works on this order only; errors as the child."""
    events: list[Mapping[str, Any]] = []
    child = Child(Program(handlers))
    try:
        return events, child.call(kind, content, on_event=lambda event: events.append(event.content)).content
    finally:
        child.close()


def refusal(kind: str, source: Path, target: Path, limit: float) -> str:
    """Why the decoder refuses a file, or how it ended; nothing for one that it takes."""
    child = Child(program(kind))
    try:
        child.call(DECODE, {"kind": kind, "source": str(source), "target": str(target), "limit": limit}, timeout_s=300)
    except (RefusedFileError, ChildEndedError) as refused:
        return str(refused)
    finally:
        child.close()
    return ""
