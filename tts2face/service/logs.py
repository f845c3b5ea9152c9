"""Log of the service: one line for each event, as JSON or as text, with the id of the request it belongs to."""

import json
import logging
import sys
import time
import traceback
from contextvars import ContextVar
from typing import Any

LOG = logging.getLogger("tts2face.service")
REQUEST_ID: ContextVar[str | None] = ContextVar("request_id", default=None)
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
        if record.name == LOG.name and isinstance(fields := getattr(record, "fields", None), dict):
            return {"event": record.getMessage(), **fields}
        message = record.getMessage()
        lines = message.splitlines() or [""]
        return {"event": "library", "logger": record.name, "message": message if self._with_text else lines[0][:300]}

    def _error(self, error: BaseException) -> dict[str, Any]:
        frames = [f"{one.filename}:{one.lineno} {one.name}" for one in traceback.extract_tb(error.__traceback__)]
        found: dict[str, Any] = {"error": type(error).__name__, "traceback": frames}
        if self._with_text:
            found["error_message"] = str(error)
        return found


def configure_logs(format: str = JSON_LINES, *, with_text: bool = False) -> None:
    """Write all records of this process to standard error, in the given format."""
    handler = logging.StreamHandler(sys.stderr)
    handler.setFormatter(LineFormatter(format, with_text=with_text))
    logging.basicConfig(level=logging.INFO, handlers=[handler], force=True)
    for name in ("uvicorn", "uvicorn.error", "uvicorn.access"):  # uvicorn would write lines of its own
        logging.getLogger(name).handlers.clear()
        logging.getLogger(name).propagate = True


def _timestamp(seconds: float) -> str:
    return time.strftime("%Y-%m-%dT%H:%M:%S", time.gmtime(seconds)) + f".{int(seconds % 1 * 1000):03d}Z"


def _word(text: str) -> str:
    return text if text.isidentifier() else json.dumps(text)
