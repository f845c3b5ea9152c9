"""16-bit mono .wav files, written in parts."""

import io
import struct
from pathlib import Path
from types import TracebackType
from typing import BinaryIO, Self

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import InputError
from tts2face.storage.marks import Mark, complete, wave_chunks

# of 16 bits; -32768 stays unused, so that both directions are alike
FULL_SCALE = 32767


UNKNOWN_BYTES = 0xFFFFFFFF  # size of a file that is not yet known; players read to the end of the stream
MOST_BYTES = UNKNOWN_BYTES - 1_000_000  # of samples: sizes have 32 bits, and that of the whole file includes its head


def wave_head(rate: int, n_bytes: int | None, mark: Mark | None = None) -> bytes:
    """Bytes of a file before its samples: its header and its mark (RIFF, Microsoft 1991).

    `n_bytes` of samples follow; None: as many as will come, so that nothing could stand behind them.
    """
    middle = struct.pack("<4s4sIHHIIHH", b"WAVE", b"fmt ", 16, 1, 1, rate, 2 * rate, 2, 16) + wave_chunks(mark)
    sizes = (UNKNOWN_BYTES,) * 2 if n_bytes is None else (len(middle) + 8 + n_bytes, n_bytes)
    return struct.pack("<4sI", b"RIFF", sizes[0]) + middle + struct.pack("<4sI", b"data", sizes[1])


class WaveFile:
    """A .wav file at a path or in an open file, with its mark; `close` completes it.

    Raises
    ------
    InputError
        It would have more than 4 GB.
    """

    def __init__(self, target: Path | BinaryIO, rate: int, mark: Mark | None = None) -> None:
        self._rate, self._mark = rate, mark
        self._n_bytes = 0
        self._path, self._is_closed = target if isinstance(target, Path) else None, False
        self._file: BinaryIO = target.open("wb") if isinstance(target, Path) else target
        self._file.write(wave_head(rate, 0, mark))

    def __enter__(self) -> Self:
        """Return the file."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close the file."""
        self.close()

    def write(self, samples: NDArray[np.floating]) -> None:
        """Append samples (n,) in [-1, 1]."""
        self.write_pcm(pcm_bytes(samples))

    def write_pcm(self, content: bytes) -> None:
        """Append samples as `pcm_bytes` gives them."""
        if self._n_bytes + len(content) > MOST_BYTES:
            raise InputError("a .wav file has at most 4 GB of sound; choose flac, or divide the text")
        self._n_bytes += len(content)
        self._file.write(content)

    def close(self) -> None:
        """Complete the file; a second time it does nothing."""
        if self._is_closed:
            return
        self._is_closed = True
        self._file.seek(0)
        self._file.write(wave_head(self._rate, self._n_bytes, self._mark))
        if self._path is not None:
            self._file.close()
            complete(self._path, "wav", self._mark)


def pcm_bytes(samples: NDArray[np.floating]) -> bytes:
    """Samples (n,) in [-1, 1] as 16-bit integers."""
    steps: NDArray[np.int16] = np.rint(samples * FULL_SCALE).astype("<i2")
    return steps.tobytes()


def pcm_samples(content: bytes) -> NDArray[np.float32]:
    """Samples (n,) in [-1, 1] of 16-bit integers, as programs send them."""
    samples: NDArray[np.float32] = np.frombuffer(content, "<i2").astype(np.float32) / np.float32(FULL_SCALE + 1)
    return samples


def wave_bytes(samples: NDArray[np.floating], rate: int, mark: Mark | None = None) -> bytes:
    """Content of a .wav file."""
    content = io.BytesIO()
    with WaveFile(content, rate, mark) as file:
        file.write(samples)
    return content.getvalue()
