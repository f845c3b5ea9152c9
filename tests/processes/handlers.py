"""Handlers of children that tests start."""

import os
import sys
import time
from pathlib import Path
from typing import Any

from lexicon.errors import InputError
from tts2face.processes.child import Call, Handler, StoppedError
from tts2face.processes.message import RESULT, Message


class NarrowError(InputError):
    """An error that the parent knows as it imports this module, or by its base."""


def _double(call: Call) -> Message:
    call.stage("doubling")(1, 1)
    print("a library that prints")  # noqa: T201
    return Message(RESULT, {"of": call.content["n"], "pid": os.getpid()}, 2 * call.payload)


def _refuse(call: Call) -> dict[str, Any]:
    call.hide(call.content["path"], "the file")
    raise NarrowError(f"{call.content['path']} is\n wrong")


def _die(call: Call) -> dict[str, Any]:
    sys.stderr.write("out of luck\n")
    sys.stderr.flush()
    os._exit(3)


def _sleep(call: Call) -> dict[str, Any]:
    call.event({"pid": os.getpid()})
    time.sleep(600)
    return {}


def _add(call: Call) -> dict[str, Any]:
    total = 0
    while total < 6:
        total += call.more().content["n"]
        call.event({"total": total})
    return {"total": total}


def _count(call: Call) -> dict[str, Any]:
    """Numbered megabytes, until the caller leaves; none while the call is paused."""
    number = 0
    while True:
        with call.changed:
            call.changed.wait_for(lambda: call.is_stopped or not call.is_paused, 0.01)
            if call.is_stopped:
                raise StoppedError
            if call.is_paused:
                continue
        call.event({"number": number, "pid": os.getpid()}, bytes(1 << 20))
        number += 1


def _write(call: Call) -> dict[str, Any]:
    Path(call.content["path"]).write_bytes(bytes(call.content["n"]))
    return {"secret": os.environ.get("AWS_SECRET_ACCESS_KEY")}


def named(**settings: Any) -> dict[str, Handler]:
    """A handler that answers with the settings."""
    return {"settings": lambda _: settings}


HANDLERS: dict[str, Handler] = {
    "double": _double, "refuse": _refuse, "die": _die, "sleep": _sleep, "add": _add, "count": _count, "write": _write,
}  # fmt: skip
