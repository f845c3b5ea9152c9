"""One movie file: MP4 (H.264 and AAC) or WebM (VP9 and Opus), fed frame by frame."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

SOUND_RATE = 48_000  # Hz; what players and editors expect, and Opus demands
BT709, LIMITED_RANGE = 1, 1  # H.273 code points: primaries, transfer and matrix of BT.709; studio range


@dataclass(frozen=True, slots=True)
class MovieKind:
    """Codecs of a movie and their settings."""

    container: str
    video: str
    audio: str
    audio_bits: int
    video_options: Mapping[str, str]
    container_options: Mapping[str, str] = field(default_factory=dict)


# Of the presets measured (docs/decisions/031-h264-settings.md) veryfast gives a quarter of ultrafast's size at half its
# speed.
MP4_MOVIE = MovieKind(
    "mp4", "libx264", "aac", 128_000,
    MappingProxyType({"crf": "18", "preset": "veryfast", "profile": "high"}),
    MappingProxyType({"movflags": "+faststart"}),
)  # fmt: skip
WEBM_MOVIE = MovieKind(
    "webm", "libvpx-vp9", "libopus", 96_000,
    MappingProxyType({"crf": "24", "deadline": "realtime", "cpu-used": "6", "row-mt": "1", "tile-columns": "1",
                      "auto-alt-ref": "0", "lag-in-frames": "0"}),
)  # fmt: skip


class MovieWriter:
    """A movie being written: pictures and sound in, a finished file after `finish`."""

    def __init__(
        self, path: Path, kind: MovieKind, shape: tuple[int, ...], clock: tuple[Fraction, int], notice: str = ""
    ) -> None:
        """Open a file for pictures of `shape` (H, W, 3 or 4) and mono sound at `clock` (fps, Hz); it says `notice`."""
        import av

        self._has_alpha = shape[2] == 4
        self._fps, self._rate = clock
        fps = self._fps
        self._n_frames = self._n_samples = 0
        self._fill_colour: NDArray[np.uint8] | None = None
        self._container: Any = av.open(str(path), "w", format=kind.container, options=dict(kind.container_options))
        if notice:
            self._container.metadata["comment"] = notice
        video: Any = self._container.add_stream(kind.video, rate=fps, options=dict(kind.video_options))
        video.width, video.height = shape[1], shape[0]
        video.pix_fmt = "yuva420p" if self._has_alpha else "yuv420p"
        video.codec_context.time_base = 1 / fps
        video.codec_context.thread_count = 1  # drawing fills the other cores; more threads here cost twice the work
        video.codec_context.bit_rate = 0  # the quality of `crf` rules alone
        video.codec_context.color_primaries = video.codec_context.color_trc = BT709
        video.codec_context.colorspace, video.codec_context.color_range = BT709, LIMITED_RANGE
        if self._has_alpha:
            video.metadata["alpha_mode"] = "1"
        audio: Any = self._container.add_stream(kind.audio, rate=SOUND_RATE, layout="mono")
        audio.codec_context.bit_rate = kind.audio_bits
        self._video, self._audio = video, audio

    def picture(self, pixels: NDArray[np.uint8]) -> None:
        """Append one picture."""
        import av

        if self._has_alpha:
            pixels = self._fill_transparent(pixels)
        frame = av.VideoFrame.from_ndarray(pixels, format="rgba" if self._has_alpha else "rgb24")
        frame = frame.reformat(
            format=self._video.pix_fmt, dst_colorspace="ITU709", src_color_range="JPEG", dst_color_range="MPEG"
        )
        frame.pts, frame.time_base = self._n_frames, 1 / self._fps
        self._n_frames += 1
        self._container.mux(self._video.encode(frame))

    def _fill_transparent(self, pixels: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """Pixels whose empty places have a colour of the head, so that coding does not darken its outline."""
        empty = pixels[:, :, 3] == 0
        if self._fill_colour is None and not empty.all():
            self._fill_colour = pixels[~empty][:, :3].mean(axis=0).astype(np.uint8)
        filled = pixels.copy()
        if self._fill_colour is not None:
            filled[empty, :3] = self._fill_colour
        return filled

    def sound(self, samples: NDArray[np.float32]) -> None:
        """Append mono samples."""
        import av

        frame = av.AudioFrame.from_ndarray(np.ascontiguousarray(samples[None, :]), format="fltp", layout="mono")
        frame.sample_rate, frame.pts, frame.time_base = self._rate, self._n_samples, Fraction(1, self._rate)
        self._n_samples += len(samples)
        self._container.mux(self._audio.encode(frame))

    def finish(self) -> None:
        """Write what the encoders still hold and close the file."""
        self._container.mux(self._video.encode(None))
        self._container.mux(self._audio.encode(None))
        self._container.close()

    def abandon(self) -> None:
        """Close the file unfinished."""
        self._container.close()
