"""An opened media file: its streams, their frames one after another, and where its clock starts."""

import math
import os
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager, nullcontext
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from lexicon.errors import DataError, InputError
from lexicon.values.files import check_regular_file

if TYPE_CHECKING:
    from av.audio.stream import AudioStream
    from av.container import InputContainer
    from av.packet import Packet
    from av.video.stream import VideoStream


Stream = TypeVar("Stream", "AudioStream", "VideoStream")

AV_WITHOUT_OPTION = 19  # version of PyAV from which on other characters in metadata never raise
MAX_SHORTFALL_S = 0.25  # a file that ends this much before its stated end is truncated; codecs pad by less
MAX_BROKEN_S = 0.1  # of packets that cannot be decoded between others that can
LEAST_PACKET_S = 0.001  # of what cannot be decoded and states no duration
# Formats that state how long they are; of others FFmpeg guesses it from the first bit rates.
STATE_DURATION = frozenset({"matroska", "webm", "mov", "mp4", "avi", "wav", "w64", "flac", "asf", "aiff", "caf", "tta"})
BROADCASTS = ("mpegts", "mpeg")
MAX_PRIMING_S = 0.1  # AAC begins with up to 2,112 samples that are not the recording's, .1 s at 22,050 Hz
RIFF_HEAD = 8  # bytes before those that a RIFF file counts


def start_time(path: Path, formats: str | None = None) -> float:
    """Seconds of a file's clock at which it starts: its first picture, or the first sample of its sound that is heard.

    What an encoder needs before the first sample is not heard where a file says how much that is (MP3 with the header
    of LAME, Opus, AAC in MP4 and Matroska). In a broadcast it is taken to be what precedes the first picture.
    """
    return _start_time(path, file_version(path), formats)


@lru_cache(maxsize=64)
def _start_time(path: Path, version: tuple[int, int, int], formats: str | None) -> float:
    with open_container(path, formats) as container:
        sound = first_decodable(container.streams.audio)
        film = next((stream for stream in container.streams.video if _is_film(stream)), None)
        shown, heard = _stated_start(film), _stated_start(sound)
        first = next(decode_packets(container.demux(sound), path, 0.0), None) if sound else None
        if first is not None and first.time is not None:  # Opus in WebM: before the time that the stream states
            heard = min(float(first.time), math.inf if heard is None else heard)
        if shown is None or heard is None:
            return heard or shown or 0.0
        is_unstated = is_broadcast(container) and shown - heard <= MAX_PRIMING_S
        return shown if is_unstated and shown > heard else min(shown, heard)


def _stated_start(stream: "AudioStream | VideoStream | None") -> float | None:
    """Seconds of the clock at which a stream says that it starts; None if it does not."""
    if stream is None or stream.start_time is None or stream.time_base is None:
        return None
    return float(stream.start_time * stream.time_base)


def is_broadcast(container: "InputContainer") -> bool:
    """Whether a file is an MPEG stream, whose clock may be set anew, and which does not state what encoders add."""
    return not {*container.format.name.split(",")}.isdisjoint(BROADCASTS)


def metadata_options() -> dict[str, Any]:
    """Arguments of `av.open` for metadata that are not UTF-8, which older programs write."""
    import av

    return {"metadata_errors": "replace"} if int(av.__version__.partition(".")[0]) < AV_WITHOUT_OPTION else {}


@contextmanager
def open_container(path: Path, formats: str | None = None) -> Iterator["InputContainer"]:
    """A media file, opened.

    Parameters
    ----------
    formats
        FFmpeg's names of the formats that a file of a stranger may have, separated by commas. It is then the only file
        that is opened, whatever others it names. None: all formats.
    """
    import av

    if not os.path.lexists(path):
        raise InputError(f"there is no recording {path}; check the path")
    check_regular_file(path)
    if path.stat().st_size == 0:
        raise DataError(f"{path} is empty (0 bytes); copy or record it again")
    # A playlist could name other files: only formats without references, and no protocol to open them.
    options = {} if formats is None else {"format_whitelist": formats, "protocol_whitelist": "none"}
    try:
        with (
            nullcontext(str(path)) if formats is None else path.open("rb") as source,
            av.open(source, options=options, **metadata_options()) as container,
        ):
            yield container
    except (av.FFmpegError, OSError) as broken:
        reason = getattr(broken, "strerror", None) or broken
        raise DataError(f"{path} cannot be read as video or sound ({reason}); copy or convert it") from broken


def video_stream(container: "InputContainer", path: Path) -> "VideoStream":
    """The first stream of pictures; DataError without one."""
    stream = first_decodable(container.streams.video)
    if stream is None:
        raise DataError(f"{path} holds no video; give a recording with pictures")
    return stream


def sound_stream(container: "InputContainer", path: Path, track: int = 0) -> "AudioStream":
    """The first stream of sound from a number on; DataError without one."""
    stream = first_decodable(container.streams.audio[track:]) or first_decodable(container.streams.audio)
    if stream is None:
        raise DataError(f"{path} holds no sound; give a recording with its sound track")
    return stream


def first_decodable(streams: Sequence[Stream]) -> Stream | None:
    """The first stream that can be decoded; damaged files may have streams of unknown kinds."""
    return next((stream for stream in streams if stream.codec_context is not None), None)


def _is_film(stream: "VideoStream") -> bool:
    """Whether a stream has pictures of its own times; the cover of an album has none."""
    import av

    return stream.codec_context is not None and not stream.disposition & av.stream.Disposition.attached_pic


def decode_frames(container: "InputContainer", stream: Any, path: Path, start: float) -> Iterator[Any]:
    """Decode the frames of one stream of a file that starts at `start`; DataError after the last if it is truncated."""
    n_frames, end = 0, start

    def packets() -> "Iterator[Packet[Any]]":
        nonlocal end
        for packet in container.demux():
            if packet.pts is not None and packet.time_base:
                end = max(end, float((packet.pts + (packet.duration or 0)) * packet.time_base))
            if packet.stream is stream:
                yield packet

    for frame in decode_packets(packets(), path, start):
        yield frame
        n_frames += 1
    if n_frames == 0:
        raise DataError(f"{path} holds no frame of its {stream.type} track; copy or record it again")
    stated = (container.duration or 0) / 1e6
    is_short = max(end, end - start) < stated - MAX_SHORTFALL_S
    if is_short and _states_duration(container) and not _is_whole_riff(path):
        raise DataError(f"{path} is truncated: it ends at {end - start:.2f} s of {stated:.2f} s; copy it again")


def _states_duration(container: "InputContainer") -> bool:
    """Whether a file states how long it is; an MP3 does so with the header of LAME, by which it starts late."""
    name = container.format.name
    return not STATE_DURATION.isdisjoint(name.split(",")) or (name == "mp3" and bool(container.start_time))


def decode_packets(packets: "Iterable[Packet[Any]]", path: Path, start: float) -> Iterator[Any]:
    """Decode packets of one stream; DataError at a stretch that cannot be decoded, between frames that can.

    A file may be cut anywhere: what precedes the first whole frame or follows the last one is no damage. Nor is the
    head of a second file in joined ones, which fills one packet.
    """
    import av

    has_begun = False
    broken_s = broken_at = 0.0
    for packet in packets:
        time_base = packet.time_base or 0
        try:
            frames = packet.decode()
        except av.InvalidDataError:
            if not broken_s:
                broken_at = float((packet.pts or 0) * time_base) - start
            broken_s += max(float((packet.duration or 0) * time_base), LEAST_PACKET_S)
            continue
        if frames and has_begun and broken_s > MAX_BROKEN_S:
            raise DataError(
                f"{path} is damaged at {broken_at:.2f} s: {broken_s:.2f} s cannot be decoded; copy or record it again"
            )
        if frames:
            has_begun = True
            broken_s = 0.0
        yield from frames


def _is_whole_riff(path: Path) -> bool:
    """Whether a RIFF file (AVI, WAV) has all its bytes; the lengths of the streams in its head may be wrong."""
    with path.open("rb") as file:
        name = file.read(4)
        size = int.from_bytes(file.read(4), "little")
    return name == b"RIFF" and 0 < size <= path.stat().st_size - RIFF_HEAD


def file_version(path: Path) -> tuple[int, int, int]:
    """Number, time and size of a file, by which results are kept: they change when the file does."""
    if not path.exists():  # opening it says so
        return 0, 0, 0
    found = path.stat()
    return found.st_ino, found.st_mtime_ns, found.st_size
