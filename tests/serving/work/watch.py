"""What must not happen twice: a watch over a folder store, and the ends of jobs in the database."""

import threading
from collections.abc import Mapping
from pathlib import Path

from tts2face.serving.batch.store import RESULT_SUFFIX
from tts2face.serving.work.database import database_url
from tts2face.storage.sql import Database

INTERVAL_S = 0.5


class StoreWatch:
    """Reads the results of a store again and again; that of a segment rendered again is another file (inode).

    A process that is killed between a movie and its result leaves a movie that is not stored: it is rendered again.

    Parameters
    ----------
    store
        Folder of the store.
    """

    def __init__(self, store: Path) -> None:
        self._store = store
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run)
        self.stored: dict[str, set[int]] = {}  # address -> the inodes of its results so far

    @property
    def n_twice(self) -> int:
        """Segments that were rendered although they were stored."""
        return sum(len(files) - 1 for files in self.stored.values())

    def cut_off(self) -> int:
        """Renderings that ended with their process: their unfinished files; a running one counts, too."""
        folder = self._store / "scratch"
        return len(list(folder.iterdir())) if folder.is_dir() else 0

    def look(self) -> None:
        """Note the present results."""
        for path in self._store.glob(f"??/*{RESULT_SUFFIX}"):
            try:
                self.stored.setdefault(path.stem, set()).add(path.stat().st_ino)
            except FileNotFoundError:
                continue

    def _run(self) -> None:
        while not self._ended.wait(INTERVAL_S):
            self.look()

    def __enter__(self) -> "StoreWatch":
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._ended.set()
        self._thread.join()
        self.look()


def ends_of_jobs(database: str) -> tuple[Mapping[str, int], Mapping[str, int]]:
    """How often each job of the service was done, and its number of results."""
    opened = Database(database_url(database))
    try:
        with opened.transaction() as look:
            done = '%"state": "done"%'
            count = "SELECT job_id, count(*) FROM"
            ends = look.rows(f"{count} tts2face_job_events WHERE content LIKE :done GROUP BY job_id", done=done)
            results = look.rows(f"{count} tts2face_job_files WHERE role = 'output' GROUP BY job_id")
    finally:
        opened.close()
    return dict(map(tuple, ends)), dict(map(tuple, results))
