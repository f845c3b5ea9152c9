"""The first sentence of a talker from a recording, made in a child process that imports nothing else of the studio."""

from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any

from lexicon.errors import BackendError
from tts2face.processes.async_parent import call_once
from tts2face.processes.child import Call, Handler
from tts2face.processes.program import ProcessLimits, Program

# files in the folder of a recording
TALKER = "talker.talker"
REPORT = "report.html"
CLIP = "first.mp4"
CLIP_S = 600.0  # limit of the first sentence
CLIP_LIMITS = ProcessLimits(memory_bytes=4 << 30, cpu_s=600, file_bytes=1 << 30, n_files=256)
SPEAK = "speak"  # name of the call


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
