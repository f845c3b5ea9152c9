"""Options of long computations: cache folder, processes, model files, and which tier of transcripts is read."""

import os
from dataclasses import dataclass
from pathlib import Path

from lexicon.errors import BackendError, InputError
from lexicon.values.fields import check_fields
from tts2face.storage.user_folders import user_cache


@dataclass(frozen=True, slots=True)
class RunOptions:
    """Options of a run over recordings; all but ``tier`` leave its result as it is.

    ``cache`` is the folder for intermediate results (the user's cache when None), ``jobs`` the number of processes (one
    per core when None), ``model`` the bundle of landmark models (found when None).
    ``tier`` is the name of the tier of the words in TextGrids and other files of tiers (the likely one when None).
    """

    cache: Path | None = None
    jobs: int | None = None
    model: Path | None = None
    tier: str | None = None

    def __post_init__(self) -> None:
        """Refuse values of other types (`InputError`)."""
        check_fields(self)

    def folder(self) -> Path:
        """The cache folder, created if necessary.

        Raises
        ------
        BackendError
            The folder cannot be written.
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
            ``jobs`` is below 1.
        """
        jobs = (os.cpu_count() or 1) if self.jobs is None else self.jobs
        if jobs < 1:
            raise InputError(f"jobs must be 1 or more, not {jobs}")
        return jobs
