"""The build of a talker from recordings by the tool ``talker``, with its limits."""

from collections.abc import Mapping
from dataclasses import replace
from importlib.util import find_spec
from typing import Any, NamedTuple

from tts2face.processes.program import ProcessLimits, Program

BUILDER = TOOL = "talker"  # the program, and its handler
LIMITS = ProcessLimits(memory_bytes=4 << 30, cpu_s=0, file_bytes=2 << 30, n_files=256)
CPU_S = 1200  # of any recording
CPU_S_PER_S = 40  # for each second of a recording; 256 x 256 pixels take 1 s a second
SLOWNESS = 5.0  # elapsed time in units of the processor time, on a machine that has other work


class TalkerBuild(NamedTuple):
    """A build for whoever calls the tool: the builder within its limits, its order, and the seconds for it."""

    program: Program
    order: Mapping[str, Any]
    timeout_s: float


def talker_build(seconds: float, order: Mapping[str, Any]) -> TalkerBuild:
    """The build of an order for so many seconds of recordings.

    Parameters
    ----------
    order
        ``folder``, whose folder ``recordings`` has them, and beside which the builder writes; ``name``, ``consent`` and
        ``provenance``; ``with_appearance``; ``max_bytes`` of the talker.
    """
    cpu_s = int(CPU_S + CPU_S_PER_S * seconds)
    order = {**order, "with_report": find_spec("matplotlib") is not None}
    return TalkerBuild(Program(BUILDER, replace(LIMITS, cpu_s=cpu_s)), order, SLOWNESS * cpu_s)
