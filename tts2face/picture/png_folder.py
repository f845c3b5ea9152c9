"""Folder of .png pictures, numbered from 0, with the sound in sound.wav."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tts2face.picture.provenance import png_labels
from tts2face.storage.wave_files import open_wave, pcm_bytes

SOUND_NAME = "sound.wav"
# nine hours at 30 frames a second
NUMBER_DIGITS = 6
COMPRESSION = 3  # zlib level: twice as fast as the default 6, 4 % larger


class PngFolderWriter:
    """Sink that writes pictures to a folder."""

    def __init__(self, folder: Path, sound_rate: int, notice: str = "") -> None:
        """Open an existing folder; `notice` becomes the comment and an XMP packet of every picture."""
        self._folder, self._n_frames, self._labels = folder, 0, png_labels(notice)
        self._sound = open_wave(str(folder / SOUND_NAME), sound_rate)

    def picture(self, pixels: NDArray[np.uint8]) -> None:
        """Write one picture (H, W, 3 or 4)."""
        from PIL import Image

        path = self._folder / f"{self._n_frames:0{NUMBER_DIGITS}d}.png"
        Image.fromarray(pixels).save(path, compress_level=COMPRESSION, pnginfo=self._labels)
        self._n_frames += 1

    def sound(self, samples: NDArray[np.float32]) -> None:
        """Append mono samples (n,) in [-1, 1] as 16-bit integers."""
        self._sound.writeframes(pcm_bytes(samples))

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
