"""Log of the service: one line for each event, as JSON or as text, with the id of the request it belongs to."""

import atexit
import json
import logging
import queue
import sys
import threading
import time
import traceback
from contextlib import suppress
from contextvars import ContextVar
from typing import Any, TextIO

LOG = logging.getLogger("tts2face.service")
PACKAGE = "tts2face."  # start of the names of loggers whose records are events without texts
REQUEST_ID: ContextVar[str | None] = ContextVar("request_id", default=None)
MAX_LINES = 10_000  # that wait to be written
CLOSE_S = 1.0  # in which they are written at the end
JSON_LINES, TEXT_LINES = FORMATS = ("json", "text")


def log_event(event: str, *, level: int = logging.INFO, error: BaseException | None = None, **fields: Any) -> None:
    """Write an event with its fields to the log.

    Parameters
    ----------
    error
        Its traceback is written, too.
    """
    LOG.log(level, event, extra={"fields": fields}, exc_info=error)


class LineFormatter(logging.Formatter):
    """Formats records as lines.

    Parameters
    ----------
    format
        ``json``: an object; ``text``: time, level, event, and ``name=value``, with values as JSON.
    with_text
        Write the messages of errors and of other libraries, which may quote the text of a request.
    """

    def __init__(self, format: str = JSON_LINES, *, with_text: bool = False) -> None:
        super().__init__()
        self._format, self._with_text = format, with_text

    def format(self, record: logging.LogRecord) -> str:
        """One line without control characters, whatever the record holds."""
        content = {"time": _timestamp(record.created), "level": record.levelname.lower(), **self._fields(record)}
        if (request := REQUEST_ID.get()) is not None:
            content.setdefault("id", request)
        if record.exc_info and record.exc_info[1] is not None:
            content |= self._error(record.exc_info[1])
        if self._format == JSON_LINES:
            return json.dumps(content, default=str)
        head = f"{content.pop('time')} {content.pop('level').upper()} {_word(content.pop('event'))}"
        return head + "".join(f" {name}={json.dumps(value, default=str)}" for name, value in content.items())

    def _fields(self, record: logging.LogRecord) -> dict[str, Any]:
        if record.name.startswith(PACKAGE) and isinstance(fields := getattr(record, "fields", None), dict):
            return {"event": record.getMessage(), **fields}
        message = record.getMessage()
        lines = message.splitlines() or [""]
        # messages of libraries may quote a text that is spoken
        return {"event": "library", "logger": record.name, "message": message if self._with_text else lines[0][:300]}

    def _error(self, error: BaseException) -> dict[str, Any]:
        frames = [
            f"{frame.filename}:{frame.lineno} {frame.name}" for frame in traceback.extract_tb(error.__traceback__)
        ]
        found: dict[str, Any] = {"error": type(error).__name__, "traceback": frames}
        if self._with_text:
            found["error_message"] = str(error)
        return found


class LineWriter(logging.Handler):
    """Writes lines to a file in a thread of its own, so that nobody waits for a reader of the log.

    While `MAX_LINES` wait, further ones are dropped; their number is written later.
    """

    def __init__(self, file: TextIO) -> None:
        super().__init__()
        self._file, self._n_dropped = file, 0
        self._lines: queue.Queue[str | None] = queue.Queue(MAX_LINES)
        self._thread = threading.Thread(target=self._write, name="log", daemon=True)
        self._thread.start()
        atexit.register(self.close)

    def emit(self, record: logging.LogRecord) -> None:
        """Queue the line of a record."""
        # the log says itself that it has gaps
        if self._n_dropped and not self._lines.full():
            n_dropped, self._n_dropped = self._n_dropped, 0
            note = logging.LogRecord(LOG.name, logging.WARNING, "", 0, "lines dropped", None, None)
            note.fields = {"lines": n_dropped}
            self._lines.put_nowait(self.format(note))
        try:
            self._lines.put_nowait(self.format(record))
        except queue.Full:
            self._n_dropped += 1

    def close(self) -> None:
        """Write what waits, for at most `CLOSE_S`."""
        super().close()
        with suppress(queue.Full):
            self._lines.put(None, timeout=CLOSE_S)
            self._thread.join(CLOSE_S)

    def _write(self) -> None:
        while (line := self._lines.get()) is not None:
            with suppress(OSError, ValueError):  # the reader has gone
                self._file.write(f"{line}\n")
                self._file.flush()


def configure_logs(format: str = JSON_LINES, *, with_text: bool = False) -> None:
    """Write all records of this process to standard error, in the given format."""
    handler = LineWriter(sys.stderr)
    handler.setFormatter(LineFormatter(format, with_text=with_text))
    logging.basicConfig(level=logging.INFO, handlers=[handler], force=True)
    for name in ("uvicorn", "uvicorn.error", "uvicorn.access"):  # uvicorn would write lines of its own
        logging.getLogger(name).handlers.clear()
        logging.getLogger(name).propagate = True


def _timestamp(seconds: float) -> str:
    return time.strftime("%Y-%m-%dT%H:%M:%S", time.gmtime(seconds)) + f".{int(seconds % 1 * 1000):03d}Z"


def _word(text: str) -> str:
    return text if text.isidentifier() else json.dumps(text)
