"""Folder of .png pictures, numbered from 0, with the sound in sound.wav."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tts2face.storage.marks import Mark, complete, png_labels
from tts2face.storage.wave_files import WaveFile

SOUND_NAME = "sound.wav"
# nine hours at 30 frames a second
NUMBER_DIGITS = 6
COMPRESSION = 3  # zlib level: twice as fast as the default 6, 4 % larger


class PngFolderWriter:
    """Sink that writes pictures to a folder."""

    def __init__(self, folder: Path, sound_rate: int, mark: Mark, sound_mark: Mark | None) -> None:
        """Open an existing folder; `mark` is that of every picture, and `sound_mark` that of the sound."""
        self._folder, self._n_frames, self._mark, self._labels = folder, 0, mark, png_labels(mark)
        self._sound = WaveFile(folder / SOUND_NAME, sound_rate, sound_mark)

    def picture(self, pixels: NDArray[np.uint8]) -> None:
        """Write one picture (H, W, 3 or 4)."""
        from PIL import Image

        path = self._folder / f"{self._n_frames:0{NUMBER_DIGITS}d}.png"
        Image.fromarray(pixels).save(path, compress_level=COMPRESSION, pnginfo=self._labels)
        complete(path, "png", self._mark)
        self._n_frames += 1

    def sound(self, samples: NDArray[np.float32]) -> None:
        """Append mono samples (n,) in [-1, 1] as 16-bit integers."""
        self._sound.write(samples)

    def finish(self) -> None:
        """Complete the sound file."""
        self._sound.close()

    def abandon(self) -> None:
        """Close the sound file."""
        self._sound.close()


def is_png_folder(folder: Path) -> bool:
    """Whether a folder contains only files that `PngFolderWriter` writes."""
    return all(
        path.name == SOUND_NAME or (path.suffix == ".png" and path.stem.isdigit() and len(path.stem) >= NUMBER_DIGITS)
        for path in folder.iterdir()
    )
