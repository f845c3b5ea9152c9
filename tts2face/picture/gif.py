"""Animated GIF with one palette for all pictures; sound is discarded."""

from collections.abc import Sequence
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tts2face.storage.marks import Mark, complete

TICKS_PER_SECOND = 100  # ticks of a GIF's clock per second
MIN_TICKS = 2  # browsers play shorter delays as 0.1 s
COLOUR_BITS = 6  # bits of each channel in the colour lookup table
BAYER = np.array([[0, 8, 2, 10], [12, 4, 14, 6], [3, 11, 1, 9], [15, 7, 13, 5]], np.int16)
# 8-bit steps between the extremes of the ordered dither, which does not flicker on still pictures.
# of 255, from the least to the greatest step of the pattern
DITHER_AMPLITUDE = 10
OPAQUE_COVERAGE = 128  # least coverage of an opaque pixel


class GifWriter:
    """Sink that writes a GIF."""

    def __init__(
        self, path: Path, swatches: Sequence[NDArray[np.uint8]], fps: Fraction, mark: Mark | None = None
    ) -> None:
        """Open a file with a mark; the palette is computed from the pictures `swatches`."""
        import av

        self._path, self._mark = path, mark
        self._fps = fps
        self._n_frames = 0
        self._last = -MIN_TICKS
        height, width, channels = swatches[0].shape
        # the last entry is the transparent one
        self._palette, self._nearest = _colour_table(swatches, 256 if channels == 3 else 255)
        pattern = np.tile(BAYER, (-(-height // 4), -(-width // 4)))[:height, :width, None]
        self._dither = (pattern * DITHER_AMPLITUDE // 16 - DITHER_AMPLITUDE // 2).astype(np.int16)
        delay = max(MIN_TICKS, round(TICKS_PER_SECOND / fps))  # of the last picture
        options = {"loop": "0", "final_delay": str(delay)}
        self._container: Any = av.open(str(path), "w", format="gif", options=options)
        self._video: Any = self._container.add_stream("gif", rate=fps)
        self._video.width, self._video.height, self._video.pix_fmt = width, height, "pal8"
        self._video.codec_context.time_base = Fraction(1, TICKS_PER_SECOND)

    def picture(self, pixels: NDArray[np.uint8]) -> None:
        """Append one picture (H, W, 3 or 4); pictures shorter than `MIN_TICKS` are skipped."""
        import av

        tick = round(self._n_frames * TICKS_PER_SECOND / self._fps)
        self._n_frames += 1
        if tick - self._last < MIN_TICKS:
            return
        self._last = tick
        levels = np.clip(pixels[:, :, :3] + self._dither, 0, 255).astype(np.int32) >> (8 - COLOUR_BITS)
        indices = self._nearest[
            (levels[:, :, 0] << 2 * COLOUR_BITS) | (levels[:, :, 1] << COLOUR_BITS) | levels[:, :, 2]
        ]
        if pixels.shape[2] == 4:
            indices[pixels[:, :, 3] < OPAQUE_COVERAGE] = 255
        indexed: Any = (indices, self._palette)  # PyAV takes a pair for pal8; its stubs do not say so
        frame = av.VideoFrame.from_ndarray(indexed, format="pal8")
        frame.pts, frame.time_base = tick, Fraction(1, TICKS_PER_SECOND)
        self._container.mux(self._video.encode(frame))

    def sound(self, samples: NDArray[np.float32]) -> None:
        """Discard the samples; a GIF has no sound."""

    def finish(self) -> None:
        """Flush the encoder and close the file."""
        self._container.mux(self._video.encode(None))
        self._container.close()
        complete(self._path, "gif", self._mark)  # the muxer writes no comments

    def abandon(self) -> None:
        """Close the file without completing it."""
        self._container.close()


def _colour_table(swatches: Sequence[NDArray[np.uint8]], n_colours: int) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
    """Palette (256, 4) of alpha, red, green, blue by median cut, and the nearest entry of every quantised colour.

    The second array has ``2 ** (3 * COLOUR_BITS)`` entries.
    """
    from PIL import Image
    from scipy.spatial import cKDTree

    colours_seen = np.concatenate([swatch[:, :, :3].reshape(-1, 3) for swatch in swatches])
    mosaic = Image.fromarray(colours_seen[:: max(1, len(colours_seen) // 400_000)][None])
    entries = (
        mosaic.quantize(n_colours, Image.Quantize.MEDIANCUT, kmeans=1, dither=Image.Dither.NONE).getpalette() or []
    )
    colours = np.array(entries, np.uint8).reshape(-1, 3)[:n_colours]
    palette = np.zeros((256, 4), np.uint8)
    palette[: len(colours), 0], palette[: len(colours), 1:] = 255, colours
    levels = np.indices((1 << COLOUR_BITS,) * 3).reshape(3, -1).T * (1 << (8 - COLOUR_BITS)) + (1 << (7 - COLOUR_BITS))
    nearest = np.asarray(cKDTree(colours).query(levels)[1], np.uint8)
    return palette, nearest
