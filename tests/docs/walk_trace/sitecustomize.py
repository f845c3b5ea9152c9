"""Records which functions of the product are called, in every process that has this folder on its path.

Python imports this module by its name when it starts. `PYTHONWALK` names a folder with a file ``on``, whose only byte
switches the record on and off for all processes, and `PYTHONWALK_ROOT` the checkout. Each process appends to a file of
its own: nanoseconds, and the function as ``file:line:name``, once; what runs while modules are imported is left out.
Calls in `ALWAYS` do not wait for the switch: its processes start and poll by themselves, some of it once in a minute.
"""

import mmap
import os
import sys
import threading
import time
from types import CodeType, FrameType
from typing import Any

PACKAGES = ("cli", "corpus_tools", "tts2face", "lexicon")
ALWAYS = "tts2face/serving/work/"


def start(folder: str, root: str) -> None:
    """Record calls of this process, also those of its later threads."""
    with open(f"{folder}/on", "r+b") as switch:
        is_on = mmap.mmap(switch.fileno(), 1)
    out = open(f"{folder}/{os.getpid()}-{time.time_ns()}.calls", "a", buffering=1, encoding="utf-8")  # noqa: SIM115
    tops = tuple(f"{root}/{package}/" for package in PACKAGES)
    always = f"{root}/{ALWAYS}"
    seen: set[CodeType] = set()

    def record(frame: FrameType, event: str, _argument: Any) -> None:
        code = frame.f_code
        if event != "call" or code in seen or not code.co_filename.startswith(tops if is_on[0] else always):
            return
        if not is_import(frame):
            seen.add(code)
            file = code.co_filename.removeprefix(f"{root}/")
            out.write(f"{time.monotonic_ns()}\t{file}:{code.co_firstlineno}:{code.co_qualname}\n")

    threading.setprofile(record)
    sys.setprofile(record)


def is_import(frame: FrameType | None) -> bool:
    """Whether a module that is being imported runs a frame."""
    while frame is not None and frame.f_code.co_name != "_call_with_frames_removed":
        frame = frame.f_back
    return frame is not None


if "PYTHONWALK" in os.environ:
    start(os.environ["PYTHONWALK"], os.environ["PYTHONWALK_ROOT"])
