"""A talker from the accepted takes of a recording, and its first sentence, each made in a child process."""

import os
import shutil
from collections.abc import Callable, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any

from lexicon.errors import BackendError
from tts2face.processes.async_parent import call_once
from tts2face.processes.child import Call, Handler
from tts2face.processes.program import ProcessLimits, Program
from tts2face.serving.work.talker_build import TOOL, talker_build
from tts2face.serving.work.tools import run_tool

# files in the folder of a recording
TALKER = "talker.talker"
REPORT = "report.html"
CLIP = "first.mp4"
MADE, CHECKED = "made.talker", "checked"  # as the builder names them
MAX_TALKER_BYTES = 500e6
SECONDS_A_TAKE = 10.0  # at most, for the limit of time
CLIP_S = 600.0  # limit of the first sentence
CLIP_LIMITS = ProcessLimits(memory_bytes=4 << 30, cpu_s=600, file_bytes=1 << 30, n_files=256)
SPEAK = "speak"  # name of the call
N_SHOWN = 5  # refused takes


async def build_talker(folder: Path, *, name: str, consent: str, n_takes: int, on_message: Callable[..., None]) -> str:
    """Build the talker of a recording with its own face; one sentence about it.

    Parameters
    ----------
    on_message
        Called with the stage, and the steps done and of all.

    Raises
    ------
    InputError, DataError, BackendError
        As `tts2face corpus build` says.
    """
    for old in (TALKER, REPORT, CLIP, MADE):
        (folder / old).unlink(missing_ok=True)
    shutil.rmtree(folder / CHECKED, ignore_errors=True)
    order = {
        "folder": str(folder), "name": name, "consent": consent, "provenance": {"name": name},
        "with_appearance": True, "max_bytes": MAX_TALKER_BYTES,
    }  # fmt: skip
    build = talker_build(SECONDS_A_TAKE * n_takes, order)
    result = await run_tool(
        build.program, TOOL, build.order, on_message, what="the recording", timeout_s=build.timeout_s
    )
    os.replace(folder / MADE, folder / TALKER)
    shutil.rmtree(folder / CHECKED, ignore_errors=True)
    refused = "; ".join(f"{take}: {reason}" for take, reason in result["refused"][:N_SHOWN])
    minutes = f"{result['n_kept']} takes, {result['minutes']:.1f} minutes"
    return f"The talker {name} is made of {minutes}." + (f" Refused: {refused}." if refused else "")


async def speak(folder: Path, text: str) -> None:
    """Write the clip of a sentence with the talker's own face.

    Raises
    ------
    InputError
        The sentence cannot be said.
    BackendError
        The clip could not be made in time.
    """
    order = {"talker": str(folder / TALKER), "text": text, "out": str(folder / CLIP)}
    try:
        await call_once(Program(f"{__name__}:HANDLERS", CLIP_LIMITS), SPEAK, order, timeout_s=CLIP_S)
    except TimeoutError as late:
        raise BackendError("the clip took too long; give a shorter sentence") from late


def _speak(call: Call) -> dict[str, Any]:
    from tts2face.session.session import Session

    call.hide(Path(call.content["out"]).parent)
    Session(talker=call.content["talker"], face="self").write(call.content["text"], call.content["out"])
    return {}


HANDLERS: Mapping[str, Handler] = MappingProxyType({SPEAK: _speak})
