"""Movie files, written frame by frame: MP4 (H.264 and AAC), WebM (VP9 and Opus), or MOV (H.264 and PCM).

Movies that are sent while they are made: fragmented MP4, and WebM.

Pictures of consecutive clips, each with the sound of its frame.
"""

import math
from collections import deque
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import InputError
from tts2face.picture.options import Picture
from tts2face.picture.pace import Pace
from tts2face.picture.provenance import WriteBuffer, append_to_mp4
from tts2face.picture.renderer import FrameRenderer
from tts2face.types import SOUND_RATE, Chunk, Clip, exact_rate, first_sample

BT709, LIMITED_RANGE = 1, 1  # H.273 code points: primaries, transfer and matrix of BT.709; studio range


@dataclass(frozen=True, slots=True)
class MovieKind:
    """Container, codecs and their options."""

    container: str
    video: str
    audio: str
    audio_bits: int
    video_options: Mapping[str, str]
    container_options: Mapping[str, str] = field(default_factory=dict)


# Of the presets measured (docs/decisions/031-h264-settings.md) veryfast gives a quarter of ultrafast's size at half its
# speed. With x264's vector code of the macroblock tree, equal pictures gave other bytes in widths as 64 or 320. A face
# before a still background moves little and has no cuts: neither is searched for.
_X264 = "cpu-independent=1:me=dia:scenecut=0"
MP4_MOVIE = MovieKind(
    "mp4", "libx264", "aac", 128_000,
    MappingProxyType({"crf": "18", "preset": "veryfast", "profile": "high", "x264-params": _X264}),
    MappingProxyType({"movflags": "+faststart"}),
)  # fmt: skip
_NO_RANDOM_IDS = {"fflags": "+bitexact"}  # of segments and tracks: equal clips are equal bytes
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

# Movies that are sent while they are made: fragments of a fifth of a second that refer to no later picture.
STREAMED_MP4 = MovieKind(
    "mp4", "libx264", "aac", 128_000,
    MappingProxyType({**MP4_MOVIE.video_options, "bf": "0", "rc-lookahead": "0"}),
    MappingProxyType({"movflags": "+frag_keyframe+empty_moov+default_base_moof", "frag_duration": "200000",
                      "flush_packets": "1"}),
)  # fmt: skip
STREAMED_WEBM = MovieKind(
    "webm", "libvpx-vp9", "libopus", 96_000, WEBM_MOVIE.video_options,
    MappingProxyType({**_NO_RANDOM_IDS, "live": "1", "cluster_time_limit": "200", "flush_packets": "1"}),
)  # fmt: skip


def mux_pictures(container: Any, packets: Iterable[Any], sound: Any) -> None:
    """Write packets of pictures; the blocks of a WebM file stand in the order of their times, as players demand.

    The muxer orders packets by their decoding times, and then writes Opus later, by the samples that a decoder drops
    (CodecDelay, RFC 7845): decoding times of pictures are earlier by as much, in the file's unit.
    """
    container.start_encoding()
    head = bytes(sound.codec_context.extradata or b"")
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
    """Sink that encodes pictures and sound; `finish` completes the file.

    Attributes
    ----------
    n_frames
        Frame of the next picture; the one before it is shown until then.
    """

    def __init__(
        self,
        path: Path | WriteBuffer,
        kind: MovieKind,
        shape: tuple[int, ...],
        clock: tuple[Fraction, int],
        notice: str = "",
    ) -> None:
        """Open a file, or a stream, for pictures of `shape` (H, W, 3 or 4) and mono sound at `clock` (fps, Hz).

        `notice` becomes the comment in its metadata, and in MP4 an XMP packet.
        """
        import av
        from av.video.reformatter import VideoReformatter

        self._reformatter = VideoReformatter()  # one for all pictures: making one takes as long as a conversion
        self._has_alpha = shape[2] == 4
        self._fps, self._rate = clock
        self._path, self._notice = path, notice if kind.container == "mp4" else ""
        fps = self._fps
        self.n_frames = self._n_samples = 0
        self._fill_colour: NDArray[np.uint8] | None = None
        target = str(path) if isinstance(path, Path) else path
        self._container: Any = av.open(target, "w", format=kind.container, options=dict(kind.container_options))
        if notice:
            self._container.metadata["comment"] = notice
        video: Any = self._container.add_stream(kind.video, rate=fps, options=dict(kind.video_options))
        video.width, video.height = shape[1], shape[0]
        video.pix_fmt = "yuva420p" if self._has_alpha else "yuv420p"
        video.codec_context.time_base = 1 / fps
        video.codec_context.thread_count = 1  # drawing uses the other cores; more threads double the work here
        video.codec_context.bit_rate = 0  # constant quality by `crf`
        video.codec_context.color_primaries = video.codec_context.color_trc = BT709
        video.codec_context.colorspace, video.codec_context.color_range = BT709, LIMITED_RANGE
        if self._has_alpha:
            video.metadata["alpha_mode"] = "1"
        audio: Any = self._container.add_stream(kind.audio, rate=SOUND_RATE, layout="mono")
        audio.codec_context.bit_rate = kind.audio_bits
        self._video, self._audio = video, audio

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
        if self._fill_colour is None and not empty.all():
            self._fill_colour = pixels[~empty][:, :3].mean(axis=0).astype(np.uint8)
        filled = pixels.copy()
        if self._fill_colour is not None:
            filled[empty, :3] = self._fill_colour
        return filled

    def sound(self, samples: NDArray[np.float32]) -> None:
        """Append mono samples (n,) in [-1, 1]."""
        import av

        frame = av.AudioFrame.from_ndarray(np.ascontiguousarray(samples[None, :]), format="fltp", layout="mono")
        frame.sample_rate, frame.pts, frame.time_base = self._rate, self._n_samples, Fraction(1, self._rate)
        self._n_samples += len(samples)
        self._container.mux(self._audio.encode(frame))

    def finish(self) -> None:
        """Flush the encoders and close the file."""
        mux_pictures(self._container, self._video.encode(None), self._audio)
        self._container.mux(self._audio.encode(None))
        self._container.close()
        append_to_mp4(self._path, self._notice)

    def abandon(self) -> None:
        """Close the file without completing it."""
        self._container.close()


FrameSound = tuple[NDArray[np.uint8] | None, NDArray[np.float32]]  # a picture, or sound only, and its samples


class ClipFrames:
    """Frames of consecutive clips in one film.

    Each clip begins on the frame after the previous clip, and its sound on the sample of that frame, so that picture
    and sound do not drift apart.

    Parameters
    ----------
    renderer
        Renderer of the clips' frames.
    threads
        Number of frames drawn in advance; None for one on each core.
    pace
        Of a movie that is seen while it is made: frames may have fewer samples, or none. None: all are drawn.
    """

    def __init__(self, renderer: FrameRenderer, threads: int | None = None, pace: Pace | None = None) -> None:
        self.n_frames = self.n_added = 0
        self._renderer, self._threads, self._pace = renderer, threads, pace
        self._n_samples = 0
        self._clock: tuple[float, int] | None = None

    def add(self, clip: Clip) -> Iterator[FrameSound]:
        """Draw the frames of one more clip.

        Yields
        ------
        pixels : (H, W, 3 or 4) or None
            Picture; None for the first item, which is the silence up to the clip's first frame, and for frames that
            are not drawn.
        samples : (n,)
            Sound of the frame.

        Raises
        ------
        InputError
            Its fps or sound rate differs from those of the first clip, or its channels are not those of the face.
        """
        if self._clock is None:
            self._clock = (clip.fps, clip.speech.waveform.rate)
        if self._clock != (clip.fps, clip.speech.waveform.rate):
            raise InputError(f"clips of one file must share fps and sound rate; this one has {clip.fps:g} fps")
        first = self.n_frames
        start = self._first_sample(first)
        yield None, np.zeros(start - self._n_samples, np.float32)  # the previous clip ended within a frame
        self.n_added += len(clip.motion)
        at, samples = 0, clip.speech.waveform.samples
        for number, pixels in self._pictures(clip):
            while self.n_frames <= first + number:
                is_drawn = self.n_frames == first + number
                self.n_frames += 1
                until = min(self._first_sample(self.n_frames) - start, len(samples))
                yield pixels if is_drawn else None, samples[at:until]
                at = until
                if self._pace is not None:
                    self._pace.advance(clip.fps)
        self._n_samples = start + at

    def _pictures(self, clip: Clip) -> Iterator[tuple[int, NDArray[np.uint8]]]:
        """Numbers of the frames that are drawn, the first and the last among them, and their pictures."""
        pace, n_frames, first = self._pace, len(clip.motion), self.n_frames
        if pace is None:
            yield from enumerate(self._renderer.frames(clip, threads=self._threads, first=first))
            return
        pace.begin()
        at, begun = 0, deque[int]()

        def choose(*, has_all_samples: bool) -> Iterator[int]:
            nonlocal at
            while at < n_frames and pace.quality.has_all_samples == has_all_samples:
                begun.append(at)
                yield at
                at = at + 1 if at == n_frames - 1 else min(at + pace.quality.frame_step, n_frames - 1)

        while at < n_frames:
            has_all_samples = pace.quality.has_all_samples
            renderer = self._renderer if has_all_samples else self._renderer.with_fewest_samples()
            chosen = choose(has_all_samples=has_all_samples)
            for pixels in renderer.frames(clip, chosen, threads=self._threads, first=first):
                yield begun.popleft(), pixels

    def _first_sample(self, frame: int) -> int:
        fps, rate = self._clock or (1.0, 1)
        return first_sample(frame, rate, exact_rate(fps))


@dataclass(frozen=True, slots=True)
class StreamedMovie:
    """Encodings of a movie format, sent while it is made and as a complete file, and its media type."""

    kind: MovieKind
    complete: MovieKind
    media_type: str
    has_alpha: bool


MOVIE_KINDS = {
    "mp4": StreamedMovie(STREAMED_MP4, MP4_MOVIE, "video/mp4", False),
    "webm": StreamedMovie(STREAMED_WEBM, WEBM_MOVIE, "video/webm", True),
}


def encode_movie(
    clips: Iterable[Clip], renderer: FrameRenderer, format: str, *, threads: int | None = None,
    pace: Pace | None = None, path: Path | None = None,
) -> Iterator[Chunk]:  # fmt: skip
    """Draw and encode consecutive clips; yields a chunk of the movie after each frame.

    Fragments of a fifth of a second can be played when they arrive.

    Parameters
    ----------
    format
        One of `MOVIE_KINDS`.
    threads, pace
        As for `ClipFrames`.
    path
        Where a complete file is written, with its duration and an index; chunks are empty then.

    Raises
    ------
    InputError
        The format is unknown or cannot be transparent, or the clips differ in fps, sound rate or channels.
    """
    movie, frames = find_movie_kind(format, renderer.picture), ClipFrames(renderer, threads, pace)
    buffer, writer, n_frames = WriteBuffer(), None, 0
    target, kind = (buffer, movie.kind) if path is None else (path, movie.complete)
    try:
        for clip in clips:
            writer = writer or _open_movie(target, kind, clip, renderer)
            for pixels, samples in frames.add(clip):
                seconds = (frames.n_frames - n_frames) / clip.fps
                n_frames = frames.n_frames
                if pixels is not None:
                    writer.n_frames = n_frames - 1
                    writer.picture(pixels)
                if len(samples):
                    writer.sound(samples)
                yield Chunk(buffer.take(), seconds)
        if writer is not None:
            writer.finish()
            writer = None
            yield Chunk(buffer.take())
    finally:
        if writer is not None:
            writer.abandon()


def find_movie_kind(format: str, picture: Picture) -> StreamedMovie:
    """Encodings of a movie format; raises as `encode_movie`."""
    if format not in MOVIE_KINDS:
        raise InputError(f"there is no streamed movie format {format!r}; the formats are {', '.join(MOVIE_KINDS)}")
    movie = MOVIE_KINDS[format]
    if picture.is_transparent and not movie.has_alpha:
        raise InputError(f"{format} cannot be transparent; choose webm, or another background")
    return movie


def _open_movie(target: Path | WriteBuffer, kind: MovieKind, clip: Clip, renderer: FrameRenderer) -> MovieWriter:
    picture, clock = renderer.picture, (exact_rate(clip.fps), clip.speech.waveform.rate)
    return MovieWriter(target, kind, (picture.height, picture.width, picture.channels), clock, renderer.notice)
