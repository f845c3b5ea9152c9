"""Program of a child process: handlers of ours, or a tool of a package above this one or of a stranger.

Processes that read files of strangers: limits of memory, time and files, no network, no credentials.
"""

import ctypes
import json
import os
import sys
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from importlib import import_module
from typing import Any

from lexicon.errors import BackendError
from lexicon.values.json_text import parse_json
from tts2face.plugins import TOOLS, declared, load_plugin

NEW_USERS, NEW_NETWORK = 0x10000000, 0x40000000  # flags of unshare in Linux's sched.h

# glibc returns blocks of 1 MiB and more to the system, instead of keeping those of each thread (decision 073).
RETURNED_BLOCKS = {"MALLOC_MMAP_THRESHOLD_": "1048576", "MALLOC_TRIM_THRESHOLD_": "1048576"}
ONE_THREAD = {"NUMBA_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}  # for each library
KEPT_VARIABLES = (
    "PATH", "HOME", "LANG", "LC_", "TMPDIR", "TEMP", "SYSTEMROOT", "LOCALAPPDATA", "XDG_", "PYTHON", "VIRTUAL_ENV",
    "NUMBA_", "TTS2FACE_FACE_MODEL",
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class ProcessLimits:
    """Limits of a process that reads files of strangers: memory, processor time, size of files, open files."""

    memory_bytes: int
    cpu_s: int
    file_bytes: int
    n_files: int


def limit_process(limits: ProcessLimits) -> None:
    """Limit this process, and leave the network where the system allows it; not on Windows."""
    import resource

    resource.setrlimit(resource.RLIMIT_AS, (limits.memory_bytes, limits.memory_bytes))
    resource.setrlimit(resource.RLIMIT_CPU, (limits.cpu_s, limits.cpu_s))
    resource.setrlimit(resource.RLIMIT_FSIZE, (limits.file_bytes, limits.file_bytes))
    resource.setrlimit(resource.RLIMIT_NOFILE, (limits.n_files, limits.n_files))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    if sys.platform.startswith("linux"):
        # a new user owns a new network without devices; no rights are needed
        ctypes.CDLL(None).unshare(NEW_USERS | NEW_NETWORK)  # refused in some containers


def child_environment(*, has_own_threads: bool) -> dict[str, str]:
    """Variables of a child; the libraries of one that has threads of its own, or one core, have one each."""
    return dict(os.environ) | RETURNED_BLOCKS | (ONE_THREAD if has_own_threads else {})


def bare_environment() -> dict[str, str]:
    """Variables of a process that reads uploads: no credentials, one thread for each library."""
    kept = {name: value for name, value in os.environ.items() if name.startswith(KEPT_VARIABLES)}
    return kept | ONE_THREAD


@dataclass(frozen=True, slots=True)
class Program:
    """Handlers and limits of a child.

    Parameters
    ----------
    handlers
        ``module:NAME`` of a table of handlers, or of a function that makes one of `settings`; or the name of an entry
        point of the group `TOOLS`, one handler or a table of them.
    limits
        For files of strangers; with them it gets no credentials of the environment. None: no limits.
    core
        Core to which it is bound; None: all.
    niceness
        Added to that of the parent; streams of a server go first.
    at_once
        Calls that an `AsyncChild` answers at once, each in a thread of its own; a caller who leaves one ends that
        call and not the process.
    settings
        JSON values.
    has_log
        Its standard error is that of the parent, for a log; otherwise its last line says why the child ended.
    """

    handlers: str
    limits: ProcessLimits | None = None
    core: int | None = None
    niceness: int = 0
    at_once: int = 1
    settings: Mapping[str, Any] = field(default_factory=dict)
    has_log: bool = False

    def written(self) -> str:
        """The argument of the child's command line."""
        return json.dumps(asdict(self))

    def environment(self) -> dict[str, str]:
        """Variables of the child."""
        if self.limits is not None:
            return bare_environment()
        return child_environment(has_own_threads=self.core is not None or self.at_once > 1)

    def load(self) -> Mapping[str, Any]:
        """The handlers by name.

        Raises
        ------
        BackendError
            No installed package declares the tool, or it cannot be loaded.
        """
        module, _, name = self.handlers.partition(":")
        if name:
            handlers: Any = getattr(import_module(module), name)
            return handlers(**self.settings) if callable(handlers) else handlers  # type: ignore[no-any-return]
        if module not in declared(TOOLS):
            raise BackendError(f"no installed package declares the tool {module!r} ({TOOLS}); install tts2face again")
        tool = load_plugin(TOOLS, module)
        return tool if isinstance(tool, Mapping) else {module: tool}


def read_program(argument: str) -> Program:
    """The program of `Program.written`."""
    content = parse_json(argument, "the program of a child process")
    limits = None if content["limits"] is None else ProcessLimits(**content["limits"])
    return Program(**content | {"limits": limits})
