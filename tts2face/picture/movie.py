"""Movie files, written frame by frame: MP4 (H.264 and AAC), WebM (VP9 and Opus), or MOV (H.264 and PCM)."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tts2face.picture.write_buffer import WriteBuffer
from tts2face.storage.marks import Mark, complete, container_tags, xmp_box
from tts2face.types import SOUND_RATE

BT709, LIMITED_RANGE = 1, 1  # H.273 code points: primaries, transfer and matrix of BT.709; studio range
# Of the presets measured (docs/decisions/031-h264-settings.md) veryfast gives a quarter of ultrafast's size at half its
# speed. With x264's vector code of the macroblock tree, equal pictures gave other bytes in widths as 64 or 320. A face
# before a still background moves little and has no cuts: neither is searched for.
_X264 = "cpu-independent=1:me=dia:scenecut=0"
_NO_RANDOM_IDS = {"fflags": "+bitexact"}  # of segments and tracks: equal clips are equal bytes


@dataclass(frozen=True, slots=True)
class MovieKind:
    """Container, codecs and their options."""

    container: str
    video: str
    audio: str
    audio_bits: int
    video_options: Mapping[str, str]
    container_options: Mapping[str, str] = field(default_factory=dict)
    audio_options: Mapping[str, str] = field(default_factory=dict)
    audio_layout: str = "mono"
    video_bits: int = 0  # in a second; 0: constant quality by `crf`


MP4_MOVIE = MovieKind(
    "mp4", "libx264", "aac", 128_000,
    MappingProxyType({"crf": "18", "preset": "veryfast", "profile": "high", "x264-params": _X264}),
    MappingProxyType({"movflags": "+faststart"}),
)  # fmt: skip


WEBM_MOVIE = MovieKind(
    "webm", "libvpx-vp9", "libopus", 96_000,
    MappingProxyType({"crf": "24", "deadline": "realtime", "cpu-used": "6", "row-mt": "1", "tile-columns": "1",
                      "auto-alt-ref": "0", "lag-in-frames": "0"}),
    MappingProxyType(_NO_RANDOM_IDS),
)  # fmt: skip


MOV_MOVIE = MovieKind(
    "mov", "libx264", "pcm_s16le", 768_000, MP4_MOVIE.video_options
)  # uncompressed sound, for editing


MKV_MOVIE = MovieKind(
    "matroska", "libvpx-vp9", "pcm_s16le", 768_000, WEBM_MOVIE.video_options, WEBM_MOVIE.container_options
)  # parts that are joined into .webm


# Movies that are sent while they are made: fragments of a fifth of a second that refer to no later picture. The header
# waits for the first fragment: only then does it know the encoder's delay, by which sound is late without an edit list.
STREAMED_MP4 = MovieKind(
    "mp4", "libx264", "aac", 128_000,
    MappingProxyType({**MP4_MOVIE.video_options, "bf": "0", "rc-lookahead": "0"}),
    MappingProxyType({"movflags": "+frag_keyframe+empty_moov+default_base_moof+delay_moov", "frag_duration": "200000",
                      "flush_packets": "1"}),
)  # fmt: skip


STREAMED_WEBM = MovieKind(
    "webm", "libvpx-vp9", "libopus", 96_000, WEBM_MOVIE.video_options,
    MappingProxyType({**_NO_RANDOM_IDS, "live": "1", "cluster_time_limit": "200", "flush_packets": "1"}),
)  # fmt: skip


# For servers of live streams: no picture waits for a later one, and a decoder can begin at each key picture.
LIVE_H264: Mapping[str, str] = MappingProxyType({
    "profile": "baseline", "preset": "superfast", "tune": "zerolatency", "bf": "0",
    "x264-params": "repeat-headers=1:cpu-independent=1",
})  # fmt: skip


def mux_pictures(container: Any, packets: Iterable[Any], sound: Any) -> None:
    """Write packets of pictures; the blocks of a WebM file stand in the order of their times, as players demand.

    The muxer orders packets by their decoding times, and then writes Opus later, by the samples that a decoder drops
    (CodecDelay, RFC 7845): decoding times of pictures are earlier by as much, in the file's unit.
    """
    container.start_encoding()
    head = bytes(sound.codec_context.extradata or b"")
    # only Opus has a start that players drop (RFC 7845, 4.2)
    if not head.startswith(b"OpusHead"):
        container.mux(packets)
        return
    dropped = Fraction(int.from_bytes(head[10:12], "little"), SOUND_RATE)
    for packet in packets:
        unit = packet.stream.time_base
        scale = packet.time_base / unit
        packet.pts, packet.duration = _nearest(packet.pts * scale), _nearest(packet.duration * scale)
        packet.dts, packet.time_base = packet.pts - _nearest(dropped / unit), unit
        container.mux(packet)


def _nearest(value: Fraction) -> int:
    """The nearest integer as FFmpeg rounds it, a half upwards."""
    return math.floor(value + Fraction(1, 2))


class MovieWriter:
    """Sink that encodes pictures and sound; `finish` completes the file, or the stream of a server.

    Attributes
    ----------
    n_frames
        Frame of the next picture; the one before it is shown until then.
    """

    def __init__(
        self,
        path: Path | WriteBuffer | str,
        kind: MovieKind,
        shape: tuple[int, ...],
        clock: tuple[Fraction, int],
        mark: Mark | None = None,
    ) -> None:
        """Open a file, a stream, or the URL of a server, for pictures of `shape` (H, W, 3 or 4) at `clock` (fps, Hz).

        `mark` becomes tags of the container, and in MP4 the last box.
        """
        import av
        from av.video.reformatter import VideoReformatter

        self._reformatter = VideoReformatter()  # one for all pictures: making one takes as long as a conversion
        self._has_alpha = shape[2] == 4
        self._fps, self._rate = clock
        self._path, self._mark = path, mark
        self._format = kind.container
        self._layout = kind.audio_layout
        fps = self._fps
        self.n_frames = self._n_samples = 0
        self._fill_colour: NDArray[np.uint8] | None = None
        target = str(path) if isinstance(path, Path) else path
        self._container: Any = av.open(target, "w", format=kind.container, options=dict(kind.container_options))
        self._container.metadata.update(container_tags(kind.container, mark))
        video: Any = self._container.add_stream(kind.video, rate=fps, options=dict(kind.video_options))
        video.width, video.height = shape[1], shape[0]
        video.pix_fmt = "yuva420p" if self._has_alpha else "yuv420p"
        video.codec_context.time_base = 1 / fps
        video.codec_context.thread_count = 1  # drawing uses the other cores; more threads double the work here
        video.codec_context.bit_rate = kind.video_bits
        video.codec_context.color_primaries = video.codec_context.color_trc = BT709
        video.codec_context.colorspace, video.codec_context.color_range = BT709, LIMITED_RANGE
        if self._has_alpha:
            video.metadata["alpha_mode"] = "1"
        audio: Any = self._container.add_stream(
            kind.audio, rate=SOUND_RATE, layout=kind.audio_layout, options=dict(kind.audio_options)
        )
        audio.codec_context.bit_rate = kind.audio_bits
        self._video, self._audio = video, audio

    def start(self) -> None:
        """Write the header, or connect to the server; otherwise the first picture or sound does."""
        self._container.start_encoding()

    def picture(self, pixels: NDArray[np.uint8]) -> None:
        """Append one picture (H, W, 3 or 4)."""
        import av

        if self._has_alpha:
            pixels = self._fill_transparent(pixels)
        from av.video.reformatter import ColorRange, Colorspace

        rgb = np.ascontiguousarray(pixels)
        frame = self._reformatter.reformat(
            av.VideoFrame.from_numpy_buffer(rgb, format="rgba" if self._has_alpha else "rgb24"),
            format=self._video.pix_fmt,
            dst_colorspace=Colorspace.ITU709,
            src_color_range=ColorRange.JPEG,
            dst_color_range=ColorRange.MPEG,
            threads=1,  # as the encoder
        )
        frame.pts, frame.time_base = self.n_frames, 1 / self._fps
        self.n_frames += 1
        mux_pictures(self._container, self._video.encode(frame), self._audio)

    def _fill_transparent(self, pixels: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """Pixels with empty ones filled by the mean colour of the head, so that coding does not darken its outline."""
        empty = pixels[:, :, 3] == 0
        # of the first picture that shows something, for the whole film
        if self._fill_colour is None and not empty.all():
            self._fill_colour = pixels[~empty][:, :3].mean(axis=0).astype(np.uint8)
        filled = pixels.copy()
        if self._fill_colour is not None:
            filled[empty, :3] = self._fill_colour
        return filled

    def sound(self, samples: NDArray[np.float32]) -> None:
        """Append mono samples (n,) in [-1, 1]."""
        import av

        if self._layout == "mono":
            frame = av.AudioFrame.from_ndarray(np.ascontiguousarray(samples[None, :]), format="fltp", layout="mono")
        else:  # both sides are alike: a conversion of the layout would be 3 dB quieter
            both = np.repeat(samples, 2)[None, :]
            frame = av.AudioFrame.from_ndarray(np.ascontiguousarray(both), format="flt", layout=self._layout)
        frame.sample_rate, frame.pts, frame.time_base = self._rate, self._n_samples, Fraction(1, self._rate)
        self._n_samples += len(samples)
        self._container.mux(self._audio.encode(frame))

    def finish(self) -> None:
        """Flush the encoders and close the file."""
        mux_pictures(self._container, self._video.encode(None), self._audio)
        self._container.mux(self._audio.encode(None))
        self._container.close()
        if isinstance(self._path, Path):
            complete(self._path, self._format, self._mark)
        elif isinstance(self._path, WriteBuffer) and self._format == "mp4" and self._mark is not None:
            self._path.write(xmp_box(self._mark))

    def abandon(self) -> None:
        """Close the file without completing it."""
        self._container.close()
