"""Decoding of an uploaded file in a process of its own, with limits of memory, time and files, and without a network.

``python -m tts2face.service.decode_process KIND SOURCE TARGET LIMIT``: a file becomes a plain one (sound: mono .wav at
48 kHz; picture: .png); a resource (talker, face, palette, dictionary) is checked and written, with its description and
picture, into the folder TARGET; ``draw-`` and its kind draw the picture TARGET only; ``subtitles-`` and an encoding
check subtitles. LIMIT is the largest duration in seconds, number of pixels or cues, or size in bytes. The exit code is
0, or 2 with one sentence on standard error.
"""

import ctypes
import json
import os
import shutil
import sys
from pathlib import Path

from tts2face.service.refused_file import RefusedFileError
from tts2face.service.resource_check import RESOURCE_KINDS, check_resource, draw_resource

SOUND, PICTURE, DRAW, SUBTITLES = "sound", "picture", "draw-", "subtitles-"
MEMORY_BYTES, CPU_S, FILE_BYTES, N_FILES = 2 << 30, 60, 1 << 30, 64
RESOURCE_CPU_S = 180  # a resource with its picture takes 3 to 5 s, at the first time with the compilation of kernels
NEW_USERS, NEW_NETWORK = 0x10000000, 0x40000000  # flags of unshare in Linux's sched.h
SOUND_RATE = 48_000  # Hz
SOUND_FORMATS = "wav,mp3,ogg,flac,aac,mov,mp4,m4a,matroska,webm,aiff,caf"
PICTURE_FORMATS = ("PNG", "JPEG", "WEBP", "BMP", "TIFF")
REFUSED = 2
LOW_PRIORITY = 10


def limit_process(cpu_s: int = CPU_S) -> None:
    """Limit memory, processor time and files of this process, and leave the network where the system allows it."""
    import resource

    resource.setrlimit(resource.RLIMIT_AS, (MEMORY_BYTES, MEMORY_BYTES))
    resource.setrlimit(resource.RLIMIT_CPU, (cpu_s, cpu_s))
    resource.setrlimit(resource.RLIMIT_FSIZE, (FILE_BYTES, FILE_BYTES))
    resource.setrlimit(resource.RLIMIT_NOFILE, (N_FILES, N_FILES))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    if sys.platform.startswith("linux"):
        ctypes.CDLL(None).unshare(NEW_USERS | NEW_NETWORK)  # refused in some containers


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
    try:
        with source.open("rb") as file, av.open(file, "r", options=options) as container:
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
    except (av.FFmpegError, ValueError, EOFError) as error:
        raise RefusedFileError("it is no sound that can be decoded") from error
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
    try:
        with Image.open(source, formats=PICTURE_FORMATS) as picture:
            if picture.width * picture.height > max_pixels:
                raise RefusedFileError(f"it has {picture.width} x {picture.height} pixels, more than {max_pixels:g}")
            picture.convert("RGB").save(target, "PNG", compress_level=1)
    except (OSError, ValueError, SyntaxError, MemoryError) as error:
        raise RefusedFileError("it is no picture that can be decoded") from error


def check_subtitles(source: Path, target: Path, max_cues: float, encoding: str | None) -> None:
    """Copy a subtitle file, and write its numbers beside it: cues and seconds, as JSON.

    Raises
    ------
    RefusedFileError
        It contains no cues or more than `max_cues`.
    """
    from lexicon.errors import Tts2faceError
    from tts2face.subtitles.reader import read_subtitles

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
    elif kind.startswith(DRAW):
        draw_resource(kind.removeprefix(DRAW), source, target)
    else:
        {SOUND: decode_sound, PICTURE: decode_picture}[kind](source, target, limit)


def main() -> int:
    """Decode one file."""
    kind, source, target, limit = sys.argv[1:]
    if kind in {SOUND, PICTURE} or kind.startswith(SUBTITLES):
        limit_process()
    else:
        limit_process(RESOURCE_CPU_S)
        os.nice(LOW_PRIORITY)  # streams go first
    try:
        decode(kind, Path(source), Path(target), float(limit))
    except RefusedFileError as refused:
        sys.stderr.write(str(refused))
        return REFUSED
    return 0


if __name__ == "__main__":
    sys.exit(main())
