"""Messages of a process of the tools: lines of JSON."""

import json
from collections.abc import Mapping
from typing import Any, TextIO

from tts2face.types import Progress


def line_progress(out: TextIO, stage: str) -> Progress:
    """Progress callback of a stage, which writes ``stage``, ``done`` and ``of``; equal messages are written once."""
    written = [(0, 0)]

    def report(done: int, of: int) -> None:
        if (done, of) != written[0]:
            written[0] = (done, of)
            write_line(out, {"stage": stage, "done": done, "of": of})

    write_line(out, {"stage": stage, "done": 0, "of": 0})
    return report


def write_line(out: TextIO, content: Mapping[str, Any]) -> None:
    """Write one message."""
    out.write(json.dumps(content, ensure_ascii=False) + "\n")
    out.flush()
