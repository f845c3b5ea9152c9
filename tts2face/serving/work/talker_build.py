"""The build of a talker from recordings by the tool ``talker``: its order and its limits."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from tts2face.processes.program import ProcessLimits, Program

BUILDER = TOOL = "talker"  # the program, and its handler
LIMITS = ProcessLimits(memory_bytes=4 << 30, cpu_s=0, file_bytes=2 << 30, n_files=256)
CPU_S = 1200  # of any recording
CPU_S_PER_S = 40  # for each second of a recording; 256 x 256 pixels take 1 s a second
SLOWNESS = 5.0  # elapsed time in units of the processor time, on a machine that has other work


@dataclass(frozen=True, slots=True)
class TalkerBuild:
    """A build that is to be run by whoever calls the tool.

    Parameters
    ----------
    folder
        It has the recordings in its folder ``recordings``; the builder writes beside it.
    seconds
        Of all recordings, for the limit of time.
    max_bytes
        Largest size of the talker.
    """

    folder: Path
    name: str
    consent: str
    provenance: Mapping[str, Any]
    seconds: float
    max_bytes: float
    has_appearance: bool = True

    @property
    def order(self) -> dict[str, Any]:
        """The order of the tool."""
        return {
            "folder": str(self.folder), "name": self.name, "provenance": self.provenance, "consent": self.consent,
            "with_appearance": self.has_appearance, "with_report": find_spec("matplotlib") is not None,
            "max_bytes": self.max_bytes,
        }  # fmt: skip

    @property
    def program(self) -> Program:
        """The builder within its limits."""
        return Program(BUILDER, replace(LIMITS, cpu_s=self._cpu_s))

    @property
    def timeout_s(self) -> float:
        """Elapsed time after which it is given up."""
        return SLOWNESS * self._cpu_s

    @property
    def _cpu_s(self) -> int:
        return int(CPU_S + CPU_S_PER_S * self.seconds)
