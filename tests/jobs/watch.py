"""A watch over a folder store: segments that were rendered although they were stored, and renderings cut off."""

import threading
from pathlib import Path

from tts2face.serving.batch.segment import SEGMENT_SUFFIX

INTERVAL_S = 0.5


class StoreWatch:
    """Looks at the files of a store again and again; a segment that was rendered again is another file (inode).

    Parameters
    ----------
    store
        Folder of the store.
    """

    def __init__(self, store: Path) -> None:
        self._store = store
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run)
        self.stored: dict[str, set[int]] = {}  # address -> the inodes of its files so far

    @property
    def n_twice(self) -> int:
        """Segments that were rendered although they were stored."""
        return sum(len(files) - 1 for files in self.stored.values())

    def cut_off(self) -> int:
        """Renderings that ended with their process: their unfinished files; a running one counts, too."""
        folder = self._store / "scratch"
        return len(list(folder.iterdir())) if folder.is_dir() else 0

    def look(self) -> None:
        """Note the present files."""
        for path in self._store.glob(f"??/*{SEGMENT_SUFFIX}"):
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
