"""Decoding of the pictures and sound of media files.

Times are presentation times of the file, in seconds, for pictures and sound alike, so that both are synchronous.
"""

import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError, InputError
from lexicon.values.files import check_regular_file
from tts2face.types import Waveform

if TYPE_CHECKING:
    from av.audio.frame import AudioFrame
    from av.audio.stream import AudioStream
    from av.container import InputContainer
    from av.video.frame import VideoFrame
    from av.video.stream import VideoStream


Stream = TypeVar("Stream", "AudioStream", "VideoStream")

AV_WITHOUT_OPTION = 19  # version of PyAV from which on other characters in metadata never raise
MAX_SHORTFALL_S = 0.25  # a file that ends this much before its stated end is truncated; codecs pad by less
MAX_DELAY_S = 60.0  # largest start time of the sound; larger values indicate damage
MAX_FPS = 240.0  # upper limit of cameras; higher stated rates are those of the file's time base
QUARTER_TURN_DEG = 90


@dataclass(frozen=True, slots=True)
class MediaInfo:
    """Metadata of a media file: duration in seconds, picture size in pixels, sample rate in Hz (0 without sound)."""

    duration: float
    fps: float
    width: int
    height: int
    rate: int


@dataclass(frozen=True, slots=True, eq=False)
class TimedFrame:
    """One upright frame: `pixels` (H, W, 3) sRGB uint8, presented at `time` seconds."""

    time: float
    pixels: NDArray[np.uint8]


def read_media_info(path: Path) -> MediaInfo:
    """Read the metadata of a video file without decoding it.

    Raises
    ------
    InputError
        The file does not exist.
    DataError
        The file is damaged or has no video.
    """
    with _open_container(path) as container:
        stream = _video_stream(container, path)
        context = stream.codec_context
        sound = _first_decodable(container.streams.audio)
        return MediaInfo(
            # FFmpeg counts the duration of a file in microseconds
            (container.duration or 0) / 1e6,
            _frame_rate(container, stream, path),
            context.width,
            context.height,
            sound.rate if sound else 0,
        )


def read_frames(path: Path) -> Iterator[TimedFrame]:
    """Yield every frame of the first video stream, upright, one at a time.

    Raises
    ------
    InputError
        The file does not exist.
    DataError
        The file has no video, a frame cannot be decoded, or the file ends before its stated duration.
    """
    with _open_container(path) as container:
        stream = _video_stream(container, path)
        stream.thread_type = "NONE"  # recordings are read in parallel, one process each
        for frame in _decode_frames(container, stream, path):
            if frame.is_corrupt:
                raise DataError(f"{path} is damaged at {frame.time or 0:.2f} s; copy or record it again")
            yield TimedFrame(_presentation_time(frame, path), _upright_pixels(frame))


def read_sound(path: Path, rate: int) -> Waveform:
    """Read the sound of a file as mono at `rate` Hz; sample 0 is at time 0 of the file.

    Raises
    ------
    InputError
        The file does not exist.
    DataError
        The file has no sound, the sound cannot be decoded, or the file ends before its stated duration.
    """
    import soxr

    blocks: list[NDArray[np.float32]] = []
    with _open_container(path) as container:
        stream = _sound_stream(container, path)
        start = 0.0
        for frame in _decode_frames(container, stream, path):
            if not blocks:
                start = _first_sample_time(frame, path)
            blocks.append(_mix_to_mono(frame))
        source_rate = stream.rate
    sound = _shift_samples(np.concatenate(blocks), round(start * source_rate))
    return Waveform(np.clip(soxr.resample(sound, source_rate, rate), -1.0, 1.0), rate)


def sound_blocks(path: Path, rate: int) -> Iterator[NDArray[np.float32]]:
    """Yield the sound of a file, as `read_sound` returns it, in blocks, for bounded memory.

    Raises
    ------
    InputError, DataError
        As `read_sound`, in place of the block that fails.
    """
    import soxr

    with _open_container(path) as container:
        stream = _sound_stream(container, path)
        resampler = soxr.ResampleStream(stream.rate, rate, 1, dtype="float32")
        n_early: int | None = None  # number of samples before time 0 that remain to be skipped
        for frame in _decode_frames(container, stream, path):
            samples = _mix_to_mono(frame)
            if n_early is None:
                offset = round(_first_sample_time(frame, path) * stream.rate)
                samples, n_early = _shift_samples(samples, max(offset, 0)), max(-offset, 0)
            cut = min(n_early, len(samples))
            n_early -= cut
            yield np.clip(resampler.resample_chunk(samples[cut:]), -1.0, 1.0)
        yield np.clip(resampler.resample_chunk(np.zeros(0, np.float32), last=True), -1.0, 1.0)


def _first_sample_time(frame: "AudioFrame", path: Path) -> float:
    start = float(frame.time or 0.0)
    if abs(start) > MAX_DELAY_S:
        raise DataError(f"{path} is damaged: its sound starts at {start:.0f} s; copy or convert it")
    return start


def metadata_options() -> dict[str, Any]:
    """Arguments of `av.open` for metadata that are not UTF-8, which older programs write."""
    import av

    return {"metadata_errors": "replace"} if int(av.__version__.partition(".")[0]) < AV_WITHOUT_OPTION else {}


@contextmanager
def _open_container(path: Path) -> Iterator["InputContainer"]:
    import av

    if not os.path.lexists(path):
        raise InputError(f"there is no recording {path}; check the path")
    check_regular_file(path)
    # FFmpeg says "invalid data" of an empty file
    if path.stat().st_size == 0:
        raise DataError(f"{path} is empty (0 bytes); copy or record it again")
    try:
        with av.open(str(path), **metadata_options()) as container:
            yield container
    except (av.FFmpegError, OSError) as broken:
        reason = getattr(broken, "strerror", None) or broken
        raise DataError(f"{path} cannot be read as video or sound ({reason}); copy or convert it") from broken


def _video_stream(container: "InputContainer", path: Path) -> "VideoStream":
    stream = _first_decodable(container.streams.video)
    if stream is None:
        raise DataError(f"{path} holds no video; give a recording with pictures")
    return stream


def _sound_stream(container: "InputContainer", path: Path) -> "AudioStream":
    stream = _first_decodable(container.streams.audio)
    if stream is None:
        raise DataError(f"{path} holds no sound; give a recording with its sound track")
    return stream


def _first_decodable(streams: Sequence[Stream]) -> Stream | None:
    """The first stream that can be decoded; damaged files may have streams of unknown kinds."""
    return next((stream for stream in streams if stream.codec_context is not None), None)


def _frame_rate(container: "InputContainer", stream: "VideoStream", path: Path) -> float:
    """Frame rate stated by the file; counted from the frames if it states none, or the rate of its time base."""
    stated = float(stream.average_rate or stream.guessed_rate or 0)
    # some containers state the rate of their time base (90,000) in place of a frame rate
    if 0 < stated <= MAX_FPS:
        return stated
    times = [packet.pts * packet.time_base for packet in container.demux(stream) if packet.pts and packet.time_base]
    counted = float((len(times) - 1) / (max(times) - min(times))) if len(set(times)) > 1 else 0.0
    if not 0 < counted <= MAX_FPS:
        raise DataError(f"{path} has no readable frame rate; convert it with ffmpeg -r")
    return counted


def _presentation_time(frame: "VideoFrame", path: Path) -> float:
    if frame.time is None:
        raise DataError(f"{path} has frames without a time; convert it with ffmpeg")
    return float(frame.time)


def _upright_pixels(frame: "VideoFrame") -> NDArray[np.uint8]:
    pixels = frame.to_ndarray(format="rgb24").astype(np.uint8, copy=False)
    # telephones film upright by turning the picture when it is shown
    turns = round(frame.rotation / QUARTER_TURN_DEG) % 4
    return np.ascontiguousarray(np.rot90(pixels, turns)) if turns else pixels


def _decode_frames(container: "InputContainer", stream: Any, path: Path) -> Iterator[Any]:
    """Decode the frames of one stream; DataError after the last one if the file is truncated."""
    n_frames, end = 0, 0.0
    for packet in container.demux():
        if packet.pts is not None and packet.time_base:
            end = max(end, float((packet.pts + (packet.duration or 0)) * packet.time_base))
        if packet.stream is stream:
            for frame in packet.decode():
                yield frame
                n_frames += 1
    if n_frames == 0:
        raise DataError(f"{path} holds a {stream.type} track without a frame; copy or record it again")
    stated = (container.duration or 0) / 1e6
    if end < stated - MAX_SHORTFALL_S:
        raise DataError(f"{path} is truncated: it ends at {end:.2f} s of {stated:.2f} s; copy it again")


def _mix_to_mono(frame: "AudioFrame") -> NDArray[np.float32]:
    samples: NDArray[Any] = frame.to_ndarray()
    channels = frame.layout.nb_channels
    if not frame.format.is_planar:
        samples = samples.reshape(-1, channels).T
    mean: NDArray[np.float64] = samples.astype(np.float64).mean(axis=0)
    if samples.dtype == np.uint8:
        # 8-bit sound is unsigned
        mean = (mean - 128.0) / 128.0
    elif np.issubdtype(samples.dtype, np.integer):
        mean = mean / -float(np.iinfo(samples.dtype).min)
    return mean.astype(np.float32)


def _shift_samples(samples: NDArray[np.float32], offset: int) -> NDArray[np.float32]:
    """Samples delayed by `offset` samples: padded with zeros, or cut if the offset is negative."""
    if offset >= 0:
        return np.concatenate([np.zeros(offset, np.float32), samples])
    return samples[-offset:]
