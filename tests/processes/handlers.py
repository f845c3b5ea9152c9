"""Handlers of children that tests start."""

import os
import sys
import time
from pathlib import Path
from typing import Any

from lexicon.errors import InputError
from tts2face.processes.child import Call
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


def _write(call: Call) -> dict[str, Any]:
    Path(call.content["path"]).write_bytes(bytes(call.content["n"]))
    return {"secret": os.environ.get("AWS_SECRET_ACCESS_KEY")}


HANDLERS = {"double": _double, "refuse": _refuse, "die": _die, "sleep": _sleep, "add": _add, "write": _write}
