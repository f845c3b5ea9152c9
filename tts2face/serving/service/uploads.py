"""Uploaded files: never opened by the server itself, never stored under a client's name.

Turns of the uploads that are checked.

Decoding of an uploaded file in a child process, with limits of memory, time and files, and without a network.

A file becomes a plain one (sound: mono .wav at 48 kHz; picture: .png); a resource (talker, face, palette, dictionary)
is checked and written, with its description and picture, into the folder ``target``; ``draw-`` and its kind draw the
picture ``target`` only; ``places`` finds lips and lids in a photo for the folder ``target``; ``subtitles-`` and an
encoding check subtitles; a video is measured. ``limit`` is the largest duration in seconds, number of pixels or cues,
or size in bytes.
"""

import asyncio
import errno
import json
import os
import shutil
import tempfile
from collections.abc import AsyncIterator, Iterator, Mapping
from contextlib import asynccontextmanager, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType
from typing import Any

from starlette.datastructures import UploadFile

from lexicon.errors import DataError, InputError, Tts2faceError
from lexicon.inputs import parse_json
from tts2face.picture.movie import SOUND_RATE
from tts2face.processes.child import Call, Handler
from tts2face.processes.parent import ChildEndedError, call_once
from tts2face.processes.program import ProcessLimits, Program
from tts2face.processes.tools import LOW_PRIORITY, run_take_tool
from tts2face.serving.service.errors import RefusedError
from tts2face.serving.service.exchange import while_client_stays
from tts2face.serving.service.settings import ServiceSettings
from tts2face.serving.work import resource_check
from tts2face.serving.work.resource_check import (
    RESOURCE_KINDS,
    STATEMENT,
    RefusedFileError,
    check_resource,
    draw_resource,
    find_places,
)
from tts2face.storage.files import is_disk_full

MAX_CHECKS, MAX_WAITING = 2, 8  # uploads that are checked, and that wait for it


class Checks:
    """Turns of the uploads that are checked."""

    def __init__(self) -> None:
        self._turns, self._n_waiting = asyncio.Semaphore(MAX_CHECKS), 0

    async def __aenter__(self) -> None:
        """Wait for a turn.

        Raises
        ------
        RefusedError
            Too many wait already.
        """
        if self._turns.locked() and self._n_waiting >= MAX_WAITING:
            raise RefusedError(
                429, "busy", f"{self._n_waiting} uploads wait to be checked; send it again later", {"Retry-After": "10"}
            )
        self._n_waiting += 1
        try:
            with while_client_stays():
                await self._turns.acquire()
        finally:
            self._n_waiting -= 1

    async def __aexit__(self, *_: object) -> None:
        """End the turn."""
        self._turns.release()


SOUND, PICTURE, VIDEO, DRAW, SUBTITLES, PLACES = "sound", "picture", "video", "draw-", "subtitles-", "places"
LIMITS = ProcessLimits(memory_bytes=2 << 30, cpu_s=60, file_bytes=1 << 30, n_files=64)
RESOURCE_CPU_S = 180  # a resource with its picture takes 3 to 5 s, at the first time with the compilation of kernels
SOUND_FORMATS = "wav,mp3,ogg,flac,aac,mov,mp4,m4a,matroska,webm,aiff,caf"
# Formats of recordings, with the endings under which other readers recognise them.
VIDEO_FORMATS = {
    "mov": ".mp4", "mp4": ".mp4", "matroska": ".mkv", "webm": ".webm", "avi": ".avi", "mpegps": ".mpg", "mpeg": ".mpg",
}  # fmt: skip
MAX_VIDEO_PIXELS, MAX_VIDEO_FPS = 4096 * 2304, 240
PICTURE_FORMATS = ("PNG", "JPEG", "WEBP", "BMP", "TIFF")
DECODE = "decode"  # name of the call


@contextmanager
def _decoding(kind: str, *errors: type[Exception]) -> Iterator[None]:
    """Refuse a file whose decoding ends in one of these errors."""
    try:
        yield
    except RefusedFileError:
        raise
    except errors as error:
        if is_disk_full(error):
            raise
        raise RefusedFileError(f"it is no {kind} that can be decoded") from error


def decode_sound(source: Path, target: Path, max_seconds: float) -> None:
    """Write the first sound stream of a file as mono 16-bit .wav at `SOUND_RATE`.

    Raises
    ------
    RefusedFileError
        It has no sound, more than `max_seconds`, or cannot be decoded.
    """
    import wave

    import av

    # A playlist could name other files: only formats without references, and no protocol to open them.
    options = {"format_whitelist": SOUND_FORMATS, "protocol_whitelist": "none"}
    with (
        _decoding("sound", av.FFmpegError, ValueError, EOFError),
        source.open("rb") as file,
        av.open(file, "r", options=options) as container,
    ):
        if not container.streams.audio:
            raise RefusedFileError("it has no sound")
        resampler = av.AudioResampler(format="s16", layout="mono", rate=SOUND_RATE)
        n_left = int(max_seconds * SOUND_RATE)
        with wave.open(str(target), "wb") as out:
            out.setparams((1, 2, SOUND_RATE, 0, "NONE", "not compressed"))
            for frame in container.decode(audio=0):
                for part in resampler.resample(frame):
                    n_left -= part.samples
                    if n_left < 0:
                        raise RefusedFileError(f"it is longer than {max_seconds:g} s")
                    out.writeframesraw(bytes(part.planes[0])[: 2 * part.samples])
    if n_left == int(max_seconds * SOUND_RATE):
        raise RefusedFileError("its sound is empty")


def decode_picture(source: Path, target: Path, max_pixels: float) -> None:
    """Write a picture as .png.

    Raises
    ------
    RefusedFileError
        It has more than `max_pixels`, or cannot be decoded.
    """
    from PIL import Image

    Image.MAX_IMAGE_PIXELS = None  # the size is checked here, before anything is decoded
    with (
        _decoding("picture", OSError, ValueError, SyntaxError, MemoryError),
        Image.open(source, formats=PICTURE_FORMATS) as picture,
    ):
        if picture.width * picture.height > max_pixels:
            raise RefusedFileError(f"it has {picture.width} x {picture.height} pixels, more than {max_pixels:g}")
        picture.convert("RGB").save(target, "PNG", compress_level=1)


def check_video(source: Path, target: Path, max_seconds: float) -> None:
    """Write what a video is, JSON with its ending and seconds; its packets are counted and not decoded.

    Raises
    ------
    RefusedFileError
        It is no video, longer than `max_seconds`, or its pictures are too large or too many.
    """
    import av

    options = {"format_whitelist": ",".join(VIDEO_FORMATS), "protocol_whitelist": "none"}
    with (
        _decoding("video", av.FFmpegError, ValueError, EOFError, StopIteration),
        source.open("rb") as file,
        av.open(file, "r", options=options) as container,
    ):
        stream = next((one for one in container.streams.video if one.codec_context is not None), None)
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
    """Copy a subtitle file, and write its numbers beside it: cues and seconds, as JSON.

    Raises
    ------
    RefusedFileError
        It contains no cues or more than `max_cues`.
    """
    from lexicon.errors import Tts2faceError
    from tts2face.interchange.subtitles.reader import read_subtitles

    shutil.copyfile(source, target)
    try:
        cues = read_subtitles(target, encoding).cues
    except Tts2faceError as wrong:
        raise RefusedFileError(str(wrong).replace(f"{target.parent}/", "")) from wrong
    if len(cues) > max_cues:
        raise RefusedFileError(f"it has {len(cues)} cues, more than {max_cues:g}")
    numbers = {"cues": len(cues), "seconds": max(cue.end_s for cue in cues)}
    Path(f"{target}.json").write_text(json.dumps(numbers))


def decode(kind: str, source: Path, target: Path, limit: float) -> None:
    """Decode or check one file of a kind.

    Raises
    ------
    RefusedFileError
        It is not what it should be.
    """
    if kind in RESOURCE_KINDS:
        check_resource(kind, source, target, limit)
    elif kind.startswith(SUBTITLES):
        check_subtitles(source, target, limit, kind.removeprefix(SUBTITLES) or None)
    elif kind == PLACES:
        find_places(source, target)
    elif kind.startswith(DRAW):
        draw_resource(kind.removeprefix(DRAW), source, target)
    else:
        {SOUND: decode_sound, PICTURE: decode_picture, VIDEO: check_video}[kind](source, target, limit)


def _decode(call: Call) -> dict[str, Any]:
    asked = call.content
    try:
        decode(asked["kind"], Path(asked["source"]), Path(asked["target"]), float(asked["limit"]))
    except OSError as error:
        if not is_disk_full(error):
            raise
        return {"is_full": True}
    return {"is_full": False}


def program(kind: str) -> Program:
    """The child that decodes a file of a kind."""
    if kind in {SOUND, PICTURE, VIDEO} or kind.startswith(SUBTITLES):
        return Program(f"{__name__}:HANDLERS", LIMITS)
    return Program(f"{__name__}:HANDLERS", replace(LIMITS, cpu_s=RESOURCE_CPU_S), niceness=LOW_PRIORITY)


HANDLERS: Mapping[str, Handler] = MappingProxyType({DECODE: _decode})


RESOURCE_TIMEOUT_S = 300.0  # a check takes 3 to 7 s; with other work on the machine, and kernels to compile, longer
AVATAR_CPU_S = 240  # the head of a person takes 15 s
UPLOAD_PREFIX = "tts2face-upload-"  # of names of private folders
MAX_REASON = 300  # characters
MAX_TEXT_BYTES = 1_000_000
BLOCK_BYTES = 1 << 20


@dataclass(frozen=True, slots=True)
class UploadFolder:
    """A private folder of one request; it is removed when the request ends."""

    path: Path
    settings: ServiceSettings

    async def sound(self, name: str, upload: UploadFile) -> Path:
        """Decoded sound of an upload, a .wav file; `name` is the field's name in messages.

        Raises
        ------
        RefusedError
            It is no sound, or too long.
        """
        return await self._decode(SOUND, name, upload, ".wav", self.settings.sound_s)

    async def picture(self, name: str, upload: UploadFile) -> Path:
        """Decoded picture of an upload, a .png file; errors as `sound`."""
        return await self._decode(PICTURE, name, upload, ".png", self.settings.upload_pixels)

    async def text(self, name: str, upload: UploadFile, suffix: str) -> Path:
        """Text of an upload, at most `MAX_TEXT_BYTES`; its reader checks it."""
        path = self.path / f"{name}{suffix}"
        content = await upload.read(MAX_TEXT_BYTES + 1)
        if len(content) > MAX_TEXT_BYTES:
            raise RefusedError(413, "too_large", f"{name} has more than {MAX_TEXT_BYTES} bytes; send less")
        path.write_bytes(content)
        return path

    async def subtitles(
        self, name: str, upload: UploadFile, suffix: str, encoding: str | None, max_cues: int
    ) -> tuple[Path, dict[str, float]]:
        """Checked subtitles of an upload, and their numbers: cues and seconds.

        Raises
        ------
        RefusedError
            They have no cues, or too many.
        """
        path = await self._decode(f"{SUBTITLES}{encoding or ''}", name, upload, suffix, max_cues)
        numbers: dict[str, float] = parse_json(Path(f"{path}.json").read_text(), name)
        return path, numbers

    async def video(self, name: str, upload: UploadFile) -> tuple[Path, float]:
        """Recording of a talker, as it was sent, and its seconds.

        Raises
        ------
        RefusedError
            It is no video, too long, or its pictures are too large.
        """
        given, checked = await self._save(name, upload), self.path / f"{name}.video"
        await decode_file((VIDEO, given, checked, self.settings.video_s), name, self.settings.decode_s)
        facts = parse_json(checked.read_text(), name)
        return given.rename(given.with_suffix(facts["suffix"])), float(facts["seconds"])

    async def resource(self, kind: str, given: Path, max_bytes: float) -> Path:
        """Folder with a saved file, checked as a talker, face, palette or dictionary (`tts2face.serving.work`).

        A photo, beside which is what is `stated` of it, becomes a face.

        Raises
        ------
        RefusedError
            It is none, or larger than `max_bytes`.
        """
        checked = self.path / "checked"
        checked.mkdir()
        await decode_file((kind, given, checked, max_bytes), f"the {kind}", RESOURCE_TIMEOUT_S)
        return checked

    async def avatar(self, photo: Path, max_bytes: float) -> Path:
        """Folder with the checked head of a person in a photo, beside which is its statement; errors as `resource`."""
        checked = self.path / "checked"
        checked.mkdir()
        order = {"take": str(photo), "out": str(checked), "max_bytes": max_bytes}
        try:
            async with asyncio.timeout(RESOURCE_TIMEOUT_S):
                await run_take_tool("avatar", order, lambda **_: None, cpu_s=AVATAR_CPU_S)
        except (Tts2faceError, TimeoutError) as wrong:
            reason = "it needs too much memory or time" if isinstance(wrong, TimeoutError) else str(wrong)
            raise _refused("the photo", reason.replace(photo.name, "the photo")) from wrong
        return checked

    async def places(self, photo: Path) -> tuple[Path, dict[str, Any]]:
        """The picture of a saved photo as a browser shows it, and what was found in it: size, fit and notes.

        Raises
        ------
        RefusedError
            It shows no face that can be moved.
        """
        await decode_file((PLACES, photo, self.path, 0.0), "the photo", RESOURCE_TIMEOUT_S)
        found: dict[str, Any] = parse_json((self.path / resource_check.PLACES).read_text(), "the photo")
        return self.path / resource_check.SHOWN, found

    def state(self, photo: Path, stated: Mapping[str, Any]) -> None:
        """Write what is stated of a photo beside it, with the most pixels that it may have."""
        photo.with_name(STATEMENT).write_text(json.dumps({**stated, "max_pixels": self.settings.upload_pixels}))

    async def _decode(self, kind: str, name: str, upload: UploadFile, suffix: str, limit: float) -> Path:
        given, decoded = await self._save(name, upload), self.path / f"{name}{suffix}"
        await decode_file((kind, given, decoded, limit), name, self.settings.decode_s)
        given.unlink(missing_ok=True)
        return decoded

    async def _save(self, name: str, upload: UploadFile) -> Path:
        path = self.path / f"{name}.upload"
        await save_upload(upload, path)
        return path


async def save_upload(upload: UploadFile, path: Path) -> None:
    """Write an uploaded file to a path."""
    with path.open("wb") as file:
        while block := await upload.read(BLOCK_BYTES):
            file.write(block)


async def decode_file(arguments: tuple[str, Path, Path, float], name: str, timeout_s: float) -> None:
    """Decode a file (kind, source, target and limit of `tts2face.serving.service.uploads`); `name` is that in messages.

    Raises
    ------
    RefusedError
        The file is refused, or takes too much memory or time.
    OSError
        The disk is full.
    """
    kind, source, target, limit = arguments
    order = {"kind": kind, "source": str(source), "target": str(target), "limit": limit}
    try:
        answer = await call_once(program(kind), DECODE, order, timeout_s=timeout_s)
    except TimeoutError as late:
        raise RefusedError(
            422, "invalid_data", f"{name} took more than {timeout_s:g} s to decode; send a simpler file"
        ) from late
    except (InputError, DataError) as refused:
        raise _refused(name, str(refused)) from refused
    except ChildEndedError as ended:
        raise _refused(name, "it needs too much memory or time") from ended
    if answer["is_full"]:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


def _refused(name: str, reason: str) -> RefusedError:
    return RefusedError(422, "invalid_data", f"{name} cannot be used: {reason[:MAX_REASON]}; send another file")


@asynccontextmanager
async def upload_folder(settings: ServiceSettings) -> AsyncIterator[UploadFolder]:
    """A private folder for the uploads of one request."""
    with tempfile.TemporaryDirectory(prefix=UPLOAD_PREFIX) as folder:
        yield UploadFolder(Path(folder), settings)
