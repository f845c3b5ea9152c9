"""How much of the machine a long piece of work takes, and where it keeps its finished parts."""

import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from lexicon.errors import BackendError, InputError
from tts2face.video.landmark_models import user_cache

Progress = Callable[[int, int], None]  # steps done, and of all
StageCallback = Callable[[str], Progress]  # begins a stage of a long piece of work by its name, and gives its progress


@dataclass(frozen=True, slots=True)
class RunOptions:
    """How the work is done, which changes nothing in its result.

    ``cache`` is the folder for finished parts (the user's cache when None), ``jobs`` the number of processes (one per
    core when None), ``model`` the bundle of landmark models (found when None).
    """

    cache: Path | None = None
    jobs: int | None = None
    model: Path | None = None

    def folder(self) -> Path:
        """The folder for finished parts, made if it was not there.

        Raises
        ------
        BackendError
            It cannot be written.
        """
        folder = self.cache or user_cache() / "recordings"
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as refused:
            raise BackendError(f"cannot write {folder}: {refused.strerror}; choose another cache folder") from refused
        return folder

    def n_processes(self) -> int:
        """Number of processes.

        Raises
        ------
        InputError
            It is below 1.
        """
        jobs = self.jobs or os.cpu_count() or 1
        if jobs < 1:
            raise InputError(f"jobs must be 1 or more, not {jobs}")
        return jobs


def ignore_stage(_: str) -> Progress:
    """Stages that nobody watches."""
    return lambda done, of: None
