"""Processes that read files of strangers: limits of memory, time and files, no network, no credentials."""

import ctypes
import os
import sys
from dataclasses import dataclass

NEW_USERS, NEW_NETWORK = 0x10000000, 0x40000000  # flags of unshare in Linux's sched.h

# glibc returns blocks of 1 MiB and more to the system, instead of keeping those of each thread (decision 064).
RETURNED_BLOCKS = {"MALLOC_MMAP_THRESHOLD_": "1048576", "MALLOC_TRIM_THRESHOLD_": "1048576"}
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
        ctypes.CDLL(None).unshare(NEW_USERS | NEW_NETWORK)  # refused in some containers


def child_environment(core: int | None) -> dict[str, str]:
    """Variables of a child that is bound to a core, or to none."""
    threads = {} if core is None else {"NUMBA_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    return dict(os.environ) | RETURNED_BLOCKS | threads


def bare_environment() -> dict[str, str]:
    """Variables of a process that reads uploads: no credentials, one thread for each library."""
    kept = {name: value for name, value in os.environ.items() if name.startswith(KEPT_VARIABLES)}
    return {**kept, "NUMBA_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
