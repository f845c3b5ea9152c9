"""Sound files that end before what they state."""

import struct
import wave
from pathlib import Path

import av
import numpy as np
import pytest

from lexicon.errors import DataError
from tts2face.serving.work.uploaded_file import decode_sound
from tts2face.video.media import read_sound
from tts2face.video.sound_survey import sound_notes

RATE, SECONDS = 16_000, 3
SAMPLES = (0.2 * np.sin(0.1 * np.arange(SECONDS * RATE)) * 32767).astype("<i2")
CODECS = {"wav": "pcm_s16le", "w64": "pcm_s16le", "caf": "pcm_s16be", "avi": "pcm_s16le", "au": "pcm_s16be"}
COMPRESSED = {"flac": "flac", "tta": "tta", "mka": "flac", "aiff": "pcm_s16be"}
# Of RIFF and of its sound, of programs that write to a pipe.
STREAMED = {
    "ffmpeg": (0xFFFFFFFF, 0xFFFFFFFF), "zero": (0, 0), "SoX, espeak": (0x7FFFF024, 0x7FFFF000),
    "31 bits": (0x7FFFFFFF, 0x7FFFFFFF - 36), "32 bits less the head": (0xFFFFFFFF, 0xFFFFFFFF - 36),
    "only the sound is known": (0, 2 * SECONDS * RATE), "a wrong whole": (9_000_000, 2 * SECONDS * RATE),
}  # fmt: skip


def written(path: Path, codec: str, layout: str = "mono") -> Path:
    with av.open(str(path), "w") as container:
        stream = container.add_stream(codec, rate=RATE, layout=layout)
        for at in range(0, len(SAMPLES), RATE // 10):
            block = np.repeat(SAMPLES[None, at : at + RATE // 10], 2 if layout == "stereo" else 1, axis=1)
            frame = av.AudioFrame.from_ndarray(block, "s16", layout)
            frame.sample_rate, frame.pts = RATE, at
            container.mux(stream.encode(frame))
        container.mux(stream.encode(None))
    return path


def cut(path: Path, share: float) -> Path:
    content = path.read_bytes()
    target = path.with_name(f"cut{path.suffix}")
    target.write_bytes(content[: round(share * len(content))])
    return target


def wave_file(path: Path, riff: int, data: int, before: bytes = b"", after: bytes = b"") -> Path:
    form = b"fmt " + struct.pack("<IHHIIHH", 16, 1, 1, RATE, 2 * RATE, 2, 16)
    head = b"RIFF" + struct.pack("<I", riff) + b"WAVE" + form + before
    path.write_bytes(head + b"data" + struct.pack("<I", data) + SAMPLES.tobytes() + after)
    return path


@pytest.mark.parametrize("suffix", CODECS)
@pytest.mark.parametrize("layout", ["mono", "stereo"])
@pytest.mark.parametrize("share", [0.9, 2 / 3, 0.2])
def test_what_is_missing_is_said_and_the_rest_is_read(suffix: str, layout: str, share: float, tmp_path: Path) -> None:
    whole = written(tmp_path / f"a.{suffix}", CODECS[suffix], layout)
    assert sound_notes([whole]) == ()
    path = cut(whole, share)
    assert read_sound(path, RATE).duration == pytest.approx(share * SECONDS, abs=0.2)
    (note,) = sound_notes([path])
    assert note.startswith(f"cut.{suffix} is cut off: the last ")
    tolerance = 0.6 if suffix == "avi" else 0.12  # which does not state where its sound begins
    assert float(note.split()[6]) == pytest.approx((1 - share) * SECONDS, abs=tolerance)
    notes = decode_sound(path, tmp_path / "sent.wav", 10.0)
    assert notes == (note.replace(path.name, str(path)),)


@pytest.mark.parametrize("name", STREAMED)
def test_a_size_that_was_not_known_is_no_gap(name: str, tmp_path: Path) -> None:
    assert sound_notes([wave_file(tmp_path / "a.wav", *STREAMED[name])]) == ()


def test_a_size_behind_other_chunks_is_found(tmp_path: Path) -> None:
    names = b"LIST" + struct.pack("<I", 11) + b"INFOISFT\x00\x00\x00\x00"[:11] + b"\0"
    (note,) = sound_notes([wave_file(tmp_path / "a.wav", 0, 4 * SECONDS * RATE, before=names)])
    assert note.startswith("a.wav is cut off: the last 3.00 s")
    whole = wave_file(tmp_path / "b.wav", 1 << 20, 2 * SECONDS * RATE, before=names, after=b"LIST")
    assert sound_notes([whole]) == ()  # what follows the sound may be missing


@pytest.mark.parametrize("suffix", COMPRESSED)
def test_others_are_refused_with_what_they_state(suffix: str, tmp_path: Path) -> None:
    path = cut(written(tmp_path / f"a.{suffix}", COMPRESSED[suffix]), 0.6)
    with pytest.raises(DataError, match=r"is truncated: it ends at [12]\.\d\d s of 3\.00 s; copy it again"):
        read_sound(path, RATE)


def test_a_file_that_is_whole_for_python_is_whole(tmp_path: Path) -> None:
    with wave.open(str(tmp_path / "a.wav"), "wb") as file:
        file.setparams((1, 3, RATE, 0, "NONE", ""))
        file.writeframes(b"\0\0\1" * 999)  # an odd number of bytes
    assert sound_notes([tmp_path / "a.wav"]) == ()
