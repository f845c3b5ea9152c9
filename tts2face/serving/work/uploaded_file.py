"""Decoding of an uploaded file in a child process, with limits of memory, time and files, and without a network.

A file becomes a plain one (sound: mono .wav at 48 kHz; picture: .png); a resource (talker, face, palette, dictionary)
is checked and written, with its description and picture, into the folder ``target``; ``draw-`` and its kind draw the
picture ``target`` only; ``places`` finds lips and lids in a photo for the folder ``target``; subtitles are checked, and
a video is measured. ``limit`` is the largest duration in seconds, number of pixels or cues, or size in bytes.
"""

import json
import shutil
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from lexicon.errors import DataError, Tts2faceError
from tts2face.processes.child import Call, Handler
from tts2face.processes.program import ProcessLimits, Program
from tts2face.serving.work.resource_check import (
    N_MAGIC,
    RESOURCE_KINDS,
    RefusedFileError,
    check_resource,
    draw_resource,
    find_places,
    is_picture,
)
from tts2face.serving.work.tools import LOW_PRIORITY
from tts2face.storage.files import is_disk_full
from tts2face.storage.pictures import decoding_bytes
from tts2face.types import SOUND_RATE

if TYPE_CHECKING:
    from PIL.Image import Image

SOUND = "sound"
PICTURE = "picture"
VIDEO = "video"
DRAW = "draw-"
SUBTITLES = "subtitles"
PLACES = "places"
LIMITS = ProcessLimits(memory_bytes=2 << 30, cpu_s=60, file_bytes=1 << 30, n_files=64)
MEDIA_BYTES = 1 << 30  # of addresses of a reader of sounds, videos and subtitles; 265 MB measured
RESOURCE_CPU_S = 180  # a resource with its picture takes 3 to 5 s, at the first time with the compilation of kernels
SOUND_FORMATS = "wav,mp3,ogg,flac,aac,mov,mp4,m4a,matroska,webm,aiff,caf,w64,au,ac3,eac3,amr,asf,avi,flv,mpegts,mpeg"
HALF_RANGE = 1 << 15  # of 16 bits: a sound of 16 bits stays as it is
# Formats of recordings, with the endings under which other readers recognise them.
VIDEO_FORMATS = {
    "mov": ".mp4", "mp4": ".mp4", "matroska": ".mkv", "webm": ".webm", "avi": ".avi", "mpegps": ".mpg", "mpeg": ".mpg",
    "mpegts": ".ts",
}  # fmt: skip
MAX_VIDEO_PIXELS, MAX_VIDEO_FPS = 4096 * 2304, 240
PICTURE_FORMATS = ("PNG", "JPEG", "WEBP", "BMP", "TIFF")
# Other pictures, by their first bytes after some.
OTHER_PICTURES = (
    (0, b"GIF8", "GIF"), (4, b"ftypavi", "AVIF"), (4, b"ftyphei", "HEIC"), (4, b"ftypmif1", "HEIF"),
    (4, b"jP  ", "JPEG 2000"), (0, b"<svg", "SVG"), (0, b"%PDF", "PDF"),
)  # fmt: skip
DECODE, MEASURE = "decode", "measure"  # names of the calls
MIB = 1 << 20
# Memory of a child besides pixels: of Python with a decoder; with the models of a check. Measured, rounded up.
CHILD_BYTES, RESOURCE_BYTES = 96 * MIB, 512 * MIB


class FileOrder(NamedTuple):
    """A file that is decoded; the encoding is that of subtitles, None where they say it."""

    kind: str
    source: Path
    target: Path
    limit: float
    encoding: str | None = None


@contextmanager
def _decoding(kind: str, source: Path, *errors: type[Exception]) -> Iterator[None]:
    """Refuse a file that is empty, or whose decoding ends in one of these errors."""
    if not source.stat().st_size:
        raise RefusedFileError("it is empty")
    try:
        yield
    except RefusedFileError:
        raise
    except errors as error:
        if is_disk_full(error):
            raise
        raise RefusedFileError(f"it is no {kind} that can be decoded") from error


def decode_sound(source: Path, target: Path, max_seconds: float) -> tuple[str, ...]:
    """Write the sound of a file as mono 16-bit .wav at `SOUND_RATE`; notes on what is guessed of it."""
    from tts2face.storage.wave_files import WaveFile
    from tts2face.video.media import sound_blocks
    from tts2face.video.sound_survey import survey_sound

    n_left = int(max_seconds * SOUND_RATE)
    try:
        with _decoding(SOUND, source), WaveFile(target, SOUND_RATE) as out:
            for block in sound_blocks(source, SOUND_RATE, SOUND_FORMATS, max_seconds):
                n_left -= len(block)
                if n_left < 0:
                    raise RefusedFileError(f"it is longer than {max_seconds:g} s")
                steps = np.clip(np.rint(block * HALF_RANGE), -HALF_RANGE, HALF_RANGE - 1).astype("<i2")
                out.write_pcm(steps.tobytes())
    except RefusedFileError:
        raise
    except DataError as wrong:
        if "cannot be read as" in str(wrong):
            raise RefusedFileError(
                "it is no sound that can be decoded; send WAV, MP3, FLAC, Ogg, MP4, WebM or MPEG"
            ) from wrong
        raise RefusedFileError(str(wrong).replace(f"{source} ", "it ", 1)) from wrong
    if n_left == int(max_seconds * SOUND_RATE):
        raise RefusedFileError("its sound is empty")
    return survey_sound(source, SOUND_FORMATS, max_seconds).notes(str(source))


@contextmanager
def _opened_picture(source: Path, max_pixels: float) -> "Iterator[Image]":
    """A picture whose size is checked, before anything is decoded; errors as `decode_picture`."""
    from PIL import Image

    Image.MAX_IMAGE_PIXELS = None  # the size is checked here
    with source.open("rb") as file:
        head = file.read(N_MAGIC)
    for at, magic, name in OTHER_PICTURES:
        if head.startswith(magic, at):
            raise RefusedFileError(f"{name} is not read; give a PNG, JPEG or WebP")
    with (
        _decoding("picture", source, OSError, ValueError, SyntaxError, MemoryError),
        Image.open(source, formats=PICTURE_FORMATS) as picture,
    ):
        if picture.width * picture.height > max_pixels:
            raise RefusedFileError(f"it has {picture.width} x {picture.height} pixels, more than {max_pixels:.0f}")
        n_bytes = decoding_bytes(picture)
        if n_bytes + CHILD_BYTES > LIMITS.memory_bytes:
            raise RefusedFileError(
                f"a {picture.format} of {picture.width} x {picture.height} pixels takes {n_bytes // MIB} MB to decode, "
                f"more than {(LIMITS.memory_bytes - CHILD_BYTES) // MIB}; reduce its size"
            )
        yield picture


def decode_picture(source: Path, target: Path, max_pixels: float) -> None:
    """Write a picture as .png."""
    with _opened_picture(source, max_pixels) as picture:
        plain = picture if picture.mode == "RGB" else picture.convert("RGB")  # which would copy it
        plain.save(target, "PNG", compress_level=1)


def check_video(source: Path, target: Path, max_seconds: float) -> None:
    """Write what a video is, JSON with its ending and seconds; its packets are counted and not decoded."""
    import av

    options = {"format_whitelist": ",".join(VIDEO_FORMATS), "protocol_whitelist": "none"}
    with (
        _decoding("video", source, av.FFmpegError, ValueError, EOFError, StopIteration),
        source.open("rb") as file,
        av.open(file, "r", options=options) as container,
    ):
        stream = next((stream for stream in container.streams.video if stream.codec_context is not None), None)
        if stream is None:
            raise RefusedFileError("it holds no video")
        if stream.width * stream.height > MAX_VIDEO_PIXELS:
            raise RefusedFileError(f"it has {stream.width} x {stream.height} pixels, more than 4096 x 2304")
        suffix = next(VIDEO_FORMATS[name] for name in container.format.name.split(",") if name in VIDEO_FORMATS)
        seconds = _measure_video(container, stream, max_seconds)
    target.write_text(json.dumps({"suffix": suffix, "seconds": seconds}))


def _measure_video(container: Any, stream: Any, max_seconds: float) -> float:
    """Seconds from the first to the last packet of a video, whatever the file states."""
    first = last = None
    for number, packet in enumerate(container.demux(stream)):
        if number > MAX_VIDEO_FPS * max_seconds:
            raise RefusedFileError(f"it has more pictures than {max_seconds:g} s of video")
        if packet.pts is not None and packet.time_base is not None:
            at = float(packet.pts * packet.time_base)
            first, last = (at, at) if first is None or last is None else (min(first, at), max(last, at))
            if last - first > max_seconds:
                raise RefusedFileError(f"it is longer than {max_seconds:g} s")
    if first is None or last is None:
        raise RefusedFileError("it has no pictures")
    return last - first


def check_subtitles(source: Path, target: Path, max_cues: float, encoding: str | None) -> None:
    """Copy a subtitle file, and write its numbers beside it: cues and seconds, as JSON."""
    from tts2face.interchange.subtitles.reader import read_subtitles

    shutil.copyfile(source, target)
    try:
        cues = read_subtitles(target, encoding).cues
    except Tts2faceError as wrong:
        raise RefusedFileError(str(wrong).replace(f"{target.parent}/", "")) from wrong
    if len(cues) > max_cues:
        raise RefusedFileError(f"it has {len(cues)} cues, more than {max_cues:.0f}")
    numbers = {"cues": len(cues), "seconds": max(cue.end_s for cue in cues)}
    Path(f"{target}.json").write_text(json.dumps(numbers))


def decode(order: FileOrder) -> tuple[str, ...]:
    """Decode or check a file; notes on what is guessed of it, in which its path stands for its name.

    Raises
    ------
    RefusedFileError
        It is not what it should be.
    """
    kind, source, target, limit, encoding = order
    if kind in RESOURCE_KINDS:
        check_resource(kind, source, target, limit)
    elif kind == SOUND:
        return decode_sound(source, target, limit)
    elif kind == SUBTITLES:
        check_subtitles(source, target, limit, encoding)
    elif kind == PLACES:
        find_places(source, target)
    elif kind.startswith(DRAW):
        draw_resource(kind.removeprefix(DRAW), source, target)
    else:
        {PICTURE: decode_picture, VIDEO: check_video}[kind](source, target, limit)
    return ()


def _measure(call: Call) -> dict[str, Any]:
    """The memory that a file takes when it is decoded, by its head and format."""
    kind = call.content["kind"]
    source = Path(call.content["source"])
    limit = float(call.content["limit"])
    if kind == PICTURE:
        with _opened_picture(source, limit) as picture:
            return {"memory_bytes": CHILD_BYTES + decoding_bytes(picture)}
    if not _is_resource(kind):
        return {"memory_bytes": CHILD_BYTES}
    return {"memory_bytes": RESOURCE_BYTES + _photo_bytes(source)}


def _photo_bytes(source: Path) -> int:
    """The memory that a photo takes when it is decoded; 0 for another file, which its check refuses or reads."""
    from tts2face.photo.photograph import open_photograph

    with source.open("rb") as file:
        if not is_picture(file.read(N_MAGIC)):
            return 0
    with suppress(DataError), open_photograph(source) as picture:
        return decoding_bytes(picture)
    return 0


def _decode(call: Call) -> dict[str, Any]:
    asked = call.content
    try:
        notes = decode(FileOrder(**{**asked, "source": Path(asked["source"]), "target": Path(asked["target"])}))
    except OSError as error:
        if not is_disk_full(error):
            raise
        return {"is_full": True}
    return {"is_full": False, "notes": notes}


def program(kind: str) -> Program:
    """The child that decodes a file of a kind."""
    limits = LIMITS if kind == PICTURE else replace(LIMITS, memory_bytes=MEDIA_BYTES)
    if _is_resource(kind):
        limits = replace(LIMITS, cpu_s=RESOURCE_CPU_S)
    return Program(f"{__name__}:HANDLERS", limits, niceness=LOW_PRIORITY)


def _is_resource(kind: str) -> bool:
    """Whether a file of a kind is checked with models, which takes longer."""
    return kind not in {SOUND, PICTURE, VIDEO, SUBTITLES}


HANDLERS: Mapping[str, Handler] = MappingProxyType({DECODE: _decode, MEASURE: _measure})
