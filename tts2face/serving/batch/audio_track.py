"""A recording of a whole subtitle file, such as a dubbing track, of which segments take excerpts."""

import hashlib
import wave
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from tempfile import TemporaryFile, gettempdir
from typing import IO

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import InputError
from tts2face.storage.files import translate_disk_errors
from tts2face.types import SOUND_RATE
from tts2face.video.media import sound_blocks

SAMPLE_BYTES = 2


@dataclass(frozen=True, slots=True)
class Track:
    """Sound of a recording on the disk, mono with 16 bits at `SOUND_RATE`; a temporary file without a name."""

    file: IO[bytes]
    n_samples: int

    def __del__(self) -> None:
        """Close the file, which removes it."""
        self.file.close()

    def read(self, begin: int, end: int) -> NDArray[np.int16]:
        """Samples [begin, end); silence before the start and after the end of the recording."""
        samples = np.zeros(max(end - begin, 0), np.int16)
        first, last = max(begin, 0), min(end, self.n_samples)
        if first < last:
            self.file.seek(first * SAMPLE_BYTES)
            content = self.file.read((last - first) * SAMPLE_BYTES)
            samples[first - begin : last - begin] = np.frombuffer(content, np.int16)
        return samples

    def excerpt_hash(self, begin: int, end: int) -> str:
        """SHA-256 of samples [begin, end)."""
        return hashlib.sha256(self.read(begin, end).tobytes()).hexdigest()

    def write_excerpt(self, path: Path, begin: int, end: int) -> None:
        """Write samples [begin, end) as a .wav file."""
        with translate_disk_errors(path), wave.open(str(path), "wb") as file:
            file.setparams((1, SAMPLE_BYTES, SOUND_RATE, 0, "NONE", ""))
            file.writeframes(self.read(begin, end).tobytes())


def open_track(path: Path) -> Track:
    """Track of a recording, which is decoded once; the last one stays open."""
    try:
        status = path.stat()
    except OSError as refused:
        raise InputError(f"cannot read {path}: {refused.strerror}; check the path") from refused
    return _open_track(path, status.st_size, status.st_mtime_ns)


@lru_cache(maxsize=1)
def _open_track(path: Path, _size: int, _time: int) -> Track:
    file = TemporaryFile(prefix="tts2face-")  # noqa: SIM115 - as long as the track is used
    n_samples = 0
    try:
        for block in sound_blocks(path, SOUND_RATE):
            samples = np.round(block * 32767.0).astype(np.int16)
            n_samples += len(samples)
            with translate_disk_errors(Path(gettempdir())):
                file.write(samples.tobytes())
        file.flush()
    except BaseException:
        file.close()
        raise
    return Track(file, n_samples)
