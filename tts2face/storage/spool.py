"""Rows of numbers on disk, for formats that name the number of frames before the frames."""

import shutil
import tempfile
from typing import IO, BinaryIO

import numpy as np
from numpy.typing import NDArray

MAX_MEMORY_BYTES = 1 << 20  # rows beyond it go to a temporary file
# of one step of a copy
COPY_BYTES = 1 << 20


class Spool:
    """Growing array (n, width) of little-endian numbers in a temporary file that has no name."""

    def __init__(self, width: int, dtype: str = "<f4") -> None:
        self.width = width
        self.dtype = np.dtype(dtype)
        self.n_rows = 0
        self._file: IO[bytes] = tempfile.SpooledTemporaryFile(MAX_MEMORY_BYTES)  # noqa: SIM115 - closed by close

    @property
    def n_bytes(self) -> int:
        """Size of all rows."""
        return self.n_rows * self.width * self.dtype.itemsize

    def add(self, rows: NDArray[np.generic]) -> None:
        """Append rows (n, width), or (n,) for a width of 1."""
        self._file.write(np.ascontiguousarray(rows, self.dtype).tobytes())
        self.n_rows += len(rows)

    def copy_to(self, file: BinaryIO | IO[bytes]) -> None:
        """Write all rows to an open file."""
        self._file.seek(0)
        shutil.copyfileobj(self._file, file, COPY_BYTES)

    def rows(self) -> NDArray[np.generic]:
        """All rows (n, width), read into memory."""
        self._file.seek(0)
        return np.frombuffer(self._file.read(), self.dtype).reshape(self.n_rows, self.width)

    def close(self) -> None:
        """Remove the temporary file."""
        self._file.close()
