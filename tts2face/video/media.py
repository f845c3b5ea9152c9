"""Decoding of the pictures and sound of media files.

Times are seconds from the start of the file, for pictures and sound alike, so that both are synchronous. As in players,
the file starts where the first of them does, whatever its clock says there: that of a broadcast runs on for hours.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import chain, islice, repeat
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError
from tts2face.types import Waveform
from tts2face.video.container import (
    decode_frames,
    first_decodable,
    is_broadcast,
    open_container,
    sound_stream,
    start_time,
    video_stream,
)
from tts2face.video.sound_clock import MAX_DELAY_S, FrameTimes, Stretch, resample_stretch
from tts2face.video.sound_survey import SoundSurvey, survey_sound

if TYPE_CHECKING:
    from av.audio.frame import AudioFrame
    from av.container import InputContainer
    from av.video.frame import VideoFrame
    from av.video.stream import VideoStream

ABSOLUTE_DURATION = "matroska"  # whose duration ends at its last time stamp, wherever it starts
DEFAULT_FPS = 25  # of a broadcast that states none
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
    with open_container(path) as container:
        stream = video_stream(container, path)
        context = stream.codec_context
        sound = first_decodable(container.streams.audio)
        duration = (container.duration or 0) / 1e6  # FFmpeg counts it in microseconds
        if ABSOLUTE_DURATION in container.format.name:
            duration -= start_time(path)
        return MediaInfo(
            duration,
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
    start = start_time(path)
    with open_container(path) as container:
        stream = video_stream(container, path)
        stream.thread_type = "NONE"  # recordings are read in parallel, one process each
        for time, frame in _timed_frames(container, stream, path, start):
            if frame.is_corrupt:
                raise DataError(f"{path} is damaged at {time:.2f} s; copy or record it again")
            yield TimedFrame(time, _upright_pixels(frame))


def read_sound(path: Path, rate: int) -> Waveform:
    """Read the sound of a file as mono at `rate` Hz; sample 0 is at the start of the file.

    Raises
    ------
    InputError
        The file does not exist.
    DataError
        The file has no sound, the sound cannot be decoded, or the file ends before its stated duration.
    """
    import soxr

    with _open_sound(path) as (source_rate, blocks):
        sound = np.concatenate(list(blocks))
    return Waveform(np.clip(soxr.resample(sound, source_rate, rate), -1.0, 1.0), rate)


def sound_blocks(
    path: Path, rate: int, formats: str | None = None, longest_s: float | None = None
) -> Iterator[NDArray[np.float32]]:
    """Yield the sound of a file, as `read_sound` returns it, in blocks, for bounded memory.

    Parameters
    ----------
    formats
        As `tts2face.video.container.open_container`, for the file of a stranger.
    longest_s
        Seconds by which its channels are chosen at most; who gives it reads no more than these. None: all of it.

    Raises
    ------
    InputError, DataError
        As `read_sound`, in place of the block that fails.
    """
    import soxr

    with _open_sound(path, formats, longest_s) as (source_rate, blocks):
        resampler = soxr.ResampleStream(source_rate, rate, 1, dtype="float32")
        for samples in blocks:
            yield np.clip(resampler.resample_chunk(samples), -1.0, 1.0)
        yield np.clip(resampler.resample_chunk(np.zeros(0, np.float32), last=True), -1.0, 1.0)


@contextmanager
def _open_sound(
    path: Path, formats: str | None = None, longest_s: float | None = None
) -> Iterator[tuple[int, Iterator[NDArray[np.float32]]]]:
    """Sample rate of a file's sound, and its samples as one channel, in blocks from the start of the file."""
    start, survey = start_time(path, formats), survey_sound(path, formats, longest_s)
    with open_container(path, formats) as container:
        stream = sound_stream(container, path, survey.mix.track)
        yield stream.rate, _timed_samples(decode_frames(container, stream, path, start), survey, start, path)


def _timed_samples(
    frames: Iterator["AudioFrame"], survey: SoundSurvey, start: float, path: Path
) -> Iterator[NDArray[np.float32]]:
    """Samples of frames where the file's times say, with silence where it has a time but no sound."""
    end = start  # of what precedes, on the file's clock
    n_early = 0  # samples before the start of the file that remain to be left out
    stretches = chain(survey.clock.stretches, repeat(Stretch(0)))
    for number, ((time, rate, following), stretch) in enumerate(zip(_stretches(frames), stretches, strict=False)):
        gap = time - end
        if number == 0 and gap > MAX_DELAY_S:
            raise DataError(
                f"the sound of {path} begins {gap:.0f} s after its pictures, more than {MAX_DELAY_S:g} s; cut the "
                "file where the sound begins"
            )
        offset = round(gap * rate)
        if number == 0:
            n_early = max(-offset, 0)
        if offset > 0 and gap <= MAX_DELAY_S:
            yield np.zeros(offset, np.float32)
        n_samples = 0
        for samples in resample_stretch(map(survey.mix.mono, following), stretch):
            yield samples[n_early:]
            n_early -= min(n_early, len(samples))
            n_samples += len(samples)
        end = time + n_samples / rate


def _stretches(frames: Iterator["AudioFrame"]) -> Iterator[tuple[float, int, Iterator["AudioFrame"]]]:
    """Time, rate and frames of each stretch without a gap; its frames are read before the next one is."""
    times = FrameTimes()
    ahead = [(frame, times.add(frame)[0]) for frame in islice(frames, 1)]

    def following(first: "AudioFrame") -> Iterator["AudioFrame"]:
        yield first
        for frame in frames:
            time, is_new = times.add(frame)
            if is_new:
                ahead.append((frame, time))
                return
            yield frame

    while ahead:
        first, time = ahead.pop()
        yield time, first.sample_rate, following(first)


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


def _timed_frames(
    container: "InputContainer", stream: "VideoStream", path: Path, start: float
) -> "Iterator[tuple[float, VideoFrame]]":
    """Frames with their times after `start`; a broadcast whose clock is set anew goes on with the next frame."""
    before: float | None = None
    offset = start
    for frame in decode_frames(container, stream, path, start):
        time = _presentation_time(frame, path) - offset
        if is_broadcast(container) and before is not None and not before < time <= before + MAX_DELAY_S:
            step = float(1 / (stream.average_rate or stream.guessed_rate or DEFAULT_FPS))
            offset += time - before - step
            time = before + step
        yield time, frame
        before = time


def _presentation_time(frame: "VideoFrame", path: Path) -> float:
    if frame.time is None:
        raise DataError(f"{path} has frames without a time; convert it with ffmpeg")
    return float(frame.time)


def _upright_pixels(frame: "VideoFrame") -> NDArray[np.uint8]:
    pixels = frame.to_ndarray(format="rgb24").astype(np.uint8, copy=False)
    # telephones film upright by turning the picture when it is shown
    turns = round(frame.rotation / QUARTER_TURN_DEG) % 4
    return np.ascontiguousarray(np.rot90(pixels, turns)) if turns else pixels
