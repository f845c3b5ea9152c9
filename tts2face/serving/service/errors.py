"""Errors of the service as answers."""

import logging
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Annotated, Any

from pydantic import BaseModel, Field
from starlette.exceptions import HTTPException

from lexicon.errors import BackendError, DataError, InputError, Tts2faceError
from tts2face.serving.service.logs import log_event
from tts2face.serving.service.messages import BusyError, DefectError
from tts2face.sound.voice_urls import SERVER_FAILS, failure_of_server
from tts2face.storage.user_folders import without_folders, without_paths

DRAINING_RETRY_S = 5  # until another server, or this one again, may be asked


class RefusedError(HTTPException):
    """A request that is refused before any work.

    It is Starlette's kind of exception, so that FastAPI passes it on when it is raised while a body is read.

    Parameters
    ----------
    status
        HTTP status.
    code
        Word for programs.
    message
        One sentence: what, which value, what to do.
    """

    def __init__(self, status: int, code: str, message: str, headers: Mapping[str, str] | None = None) -> None:
        self.status, self.code = status, code
        self.message = message
        self.headers: dict[str, str]
        super().__init__(status, message, dict(headers or {}))

    def __str__(self) -> str:
        """The message."""
        return self.message


STATUS: Mapping[type[Tts2faceError], tuple[int, str]] = {
    # by who can put it right: the client asks differently, waits, or the operator installs something
    BusyError: (429, "busy"),
    DefectError: (500, "internal"),
    InputError: (400, "invalid_request"),
    DataError: (422, "invalid_data"),
    BackendError: (503, "unavailable"),
}


def as_refused(error: Tts2faceError, folders: Iterable[Path] = ()) -> RefusedError:
    """Answer to an error of the synthesis; it does not name the `folders` of the files concerned.

    Where something is missing on this machine, it names no folder at all; what a voice server says is for the log.
    """
    if (reason := failure_of_server(str(error))) is not None:
        log_event("voice server failed", level=logging.WARNING, reason=reason)
        error = BackendError(SERVER_FAILS)
    status, code = next(found for kind, found in STATUS.items() if isinstance(error, kind))
    headers = {"Retry-After": str(BusyError.retry_after_s)} if status in {429, 503} else {}
    message = without_folders(" ".join(str(error).split()), folders)
    # what is missing on the server is named without the places of its disk
    return RefusedError(status, code, without_paths(message) if status == 503 else message, headers)


def draining(advice: str = "repeat the request") -> RefusedError:
    """Refusal of a service that shuts down."""
    headers = {"Retry-After": str(DRAINING_RETRY_S), "Connection": "close"}
    return RefusedError(503, "draining", f"the service is shutting down; {advice}", headers)


class ErrorDetail(BaseModel):
    """What is wrong."""

    message: Annotated[
        str,
        Field(
            description="What is wrong, which value, what to do.",
            examples=["the rate must be from 0.5 to 2, not 3; change it"],
        ),
    ]
    type: Annotated[
        str, Field(description="invalid_request_error or server_error.", examples=["invalid_request_error"])
    ]
    param: Annotated[
        str | None, Field(description="Name of the field, if the form of one is wrong.", examples=["rate"])
    ]
    code: Annotated[str, Field(description="Word for programs.", examples=["rate_limited"])]


class ErrorBody(BaseModel):
    """An error, in the form of OpenAI's API."""

    error: Annotated[ErrorDetail, Field(description="The error.")]


DOCUMENTED: dict[int | str, dict[str, Any]] = {
    status: {"model": ErrorBody, "description": text}
    for status, text in {
        400: "A value is wrong.",
        401: "The API key is missing or unknown.",
        403: "The key lacks the scope, or the page is of another origin.",
        404: "There is nothing of this name.",
        408: "The body did not arrive in time.",
        409: "The name is taken.",
        413: "The body or text is too long, or a quota is used up.",
        421: "The host is none of this service.",
        422: "The body does not have the form of the schema.",
        429: "Too many requests; Retry-After says when to repeat.",
        431: "The head of the request is too large.",
        500: "A defect of the service; the log says more.",
        503: "Something is missing on the server, it is not ready, or it is shutting down.",
    }.items()
}


def error_body(code: str, message: str, param: str | None = None) -> dict[str, Any]:
    """JSON of an error, in the form of OpenAI's API."""
    kind = "server_error" if code in {"internal", "unavailable", "draining"} else "invalid_request_error"
    return {"error": {"message": message, "type": kind, "param": param, "code": code}}
