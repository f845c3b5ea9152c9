"""Marks of synthetic sound and pictures, read as other programs read them."""

from fractions import Fraction
from pathlib import Path
from xml.etree import ElementTree

import av
import numpy as np
import pytest
from PIL import Image

from lexicon.errors import InputError
from tests.walkers import boxes, png_chunks, riff_chunks
from tts2face.picture.gif import GifWriter
from tts2face.picture.movie import (
    MKV_MOVIE,
    MOV_MOVIE,
    MP4_MOVIE,
    STREAMED_MP4,
    STREAMED_WEBM,
    WEBM_MOVIE,
    MovieKind,
    MovieWriter,
)
from tts2face.picture.png_folder import PngFolderWriter
from tts2face.picture.sound_stream import SOUND_KINDS, encode_sound
from tts2face.picture.write_buffer import WriteBuffer
from tts2face.serving.batch.assemble import join_segments
from tts2face.session.inspection import FileMarks, inspect_file
from tts2face.storage.marks import COMPOSITE, MAX_TEXT, PROGRAM, SOURCE_TYPES, TRAINED, XMP_BOX, Making, Mark, today
from tts2face.types import Waveform

NOTICE = 'Synthetic media: synthesised by tts2face from a photograph of <Zoë> & "friends"'
TEXT = "Hello, Zoë & <all>.\nTwo lines."
MARK = Mark(NOTICE, COMPOSITE, "Zoë").of(Making(TEXT, "heart"))
N_FRAMES = 10
PICTURE = np.full((64, 64, 3), 128, np.uint8)
SOUNDS = [name for name in SOUND_KINDS if name != "pcm"]
FILES = {"mp4": MP4_MOVIE, "mov": MOV_MOVIE, "webm": WEBM_MOVIE, "mkv": MKV_MOVIE}
STREAMS = {"mp4": STREAMED_MP4, "webm": STREAMED_WEBM}


def said_in(packet: bytes | str) -> list[str]:
    root = ElementTree.fromstring(packet)
    return [value for element in root.iter() for value in element.attrib.values()]


def write(target: Path | WriteBuffer, kind: MovieKind, mark: Mark | None = MARK) -> None:
    writer = MovieWriter(target, kind, PICTURE.shape, (Fraction(25), 16_000), mark)
    for _ in range(N_FRAMES):
        writer.picture(PICTURE)
    writer.sound(np.zeros(16_000 * N_FRAMES // 25, np.float32))
    writer.finish()


def sound(format: str, path: Path, mark: Mark | None, *, is_complete: bool) -> None:
    chunks = encode_sound(iter([Waveform(np.zeros(24_000), 24_000)]), format, path if is_complete else None, mark)
    content = b"".join(chunk.content for chunk in chunks)
    if not is_complete:
        path.write_bytes(content)


def check(found: FileMarks) -> None:
    assert (found.source, found.notice, found.program) == (COMPOSITE, NOTICE, PROGRAM)
    assert (found.face, found.voice, found.text) == ("Zoë", "heart", TEXT.replace("\n", " "))
    assert found.created == today()
    assert found.is_synthetic
    assert found.signature is None


@pytest.mark.parametrize("name", FILES)
def test_every_movie_says_what_it_is_and_plays(name: str, tmp_path: Path) -> None:
    out = tmp_path / f"clip.{name}"
    write(out, FILES[name])
    check(inspect_file(out))
    with av.open(str(out)) as container:
        tags = {key.lower(): value for key, value in container.metadata.items()}
        assert tags["comment"] == NOTICE
        assert sum(1 for _ in container.decode(video=0)) == N_FRAMES


@pytest.mark.parametrize("name", STREAMS)
def test_streamed_movies_say_it_too(name: str, tmp_path: Path) -> None:
    buffer, out = WriteBuffer(), tmp_path / f"clip.{name}"
    write(buffer, STREAMS[name])
    out.write_bytes(buffer.take())
    check(inspect_file(out))


def test_the_last_box_of_an_mp4_file_is_a_packet(tmp_path: Path) -> None:
    write(tmp_path / "clip.mp4", MP4_MOVIE)
    kind, packet = boxes((tmp_path / "clip.mp4").read_bytes())[-1]
    assert (kind, packet[:16]) == (b"uuid", XMP_BOX)
    assert {SOURCE_TYPES + COMPOSITE, NOTICE, PROGRAM, today()} <= set(said_in(packet[16:]))


@pytest.mark.parametrize("is_complete", [True, False], ids=["complete", "streamed"])
@pytest.mark.parametrize("format", SOUNDS)
def test_every_sound_says_what_it_is_and_plays(format: str, is_complete: bool, tmp_path: Path) -> None:
    marked, plain = tmp_path / f"a.{format}", tmp_path / f"b.{format}"
    sound(format, marked, MARK, is_complete=is_complete)
    sound(format, plain, None, is_complete=is_complete)
    check(inspect_file(marked))
    assert not inspect_file(plain).is_synthetic
    decoded = []
    for path in (marked, plain):
        with av.open(str(path)) as container:
            decoded.append(np.concatenate([frame.to_ndarray().ravel() for frame in container.decode(audio=0)]))
    assert np.array_equal(*decoded)


def test_chunks_of_wav_files(tmp_path: Path) -> None:
    sound("wav", tmp_path / "a.wav", MARK, is_complete=True)
    chunks = riff_chunks((tmp_path / "a.wav").read_bytes())
    assert list(chunks)[-1] == b"data"  # also of a stream, behind whose samples nothing can stand
    assert chunks[b"LIST"].startswith(b"INFOICMT")
    assert SOURCE_TYPES + COMPOSITE in said_in(chunks[b"_PMX"])


def test_a_gif_file_has_comment_and_packet(tmp_path: Path) -> None:
    writer = GifWriter(tmp_path / "a.gif", [PICTURE], Fraction(25), MARK)
    for number in range(N_FRAMES):
        writer.picture(PICTURE + np.uint8(number))
    writer.finish()
    found = inspect_file(tmp_path / "a.gif")
    check(found)
    with Image.open(tmp_path / "a.gif") as picture:
        assert picture.n_frames == N_FRAMES
        for number in range(N_FRAMES):
            picture.seek(number)
    content = (tmp_path / "a.gif").read_bytes()
    comment, _, packet = content[content.index(b"\x21\xfe") :].partition(b"\x21\xff\x0bXMP DataXMP")
    assert b"photograph of <Zo?>" in comment
    assert SOURCE_TYPES + COMPOSITE in said_in(packet[: packet.index(b"<?xpacket end")])
    assert content.endswith(bytes([2, 1, 0, 0, 59]))


def test_pictures_of_a_folder_and_their_sound_say_it(tmp_path: Path) -> None:
    writer = PngFolderWriter(tmp_path, 16_000, MARK, Mark("sound", voice="heart"))
    writer.picture(PICTURE)
    writer.finish()
    check(inspect_file(tmp_path / "000000.png"))
    assert inspect_file(tmp_path / "sound.wav").source == TRAINED
    with Image.open(tmp_path / "000000.png") as picture:
        assert picture.info["Comment"] == NOTICE
        assert SOURCE_TYPES + COMPOSITE in said_in(picture.info["XML:com.adobe.xmp"])
    kinds = [kind for kind, _ in png_chunks((tmp_path / "000000.png").read_bytes())]
    assert kinds.index(b"iTXt") < kinds.index(b"IDAT")


@pytest.mark.parametrize("mark", [MARK, None], ids=["marked", "plain"])
@pytest.mark.parametrize(("part", "whole"), [("mov", "mp4"), ("mov", "mov"), ("mkv", "webm")])
def test_joined_segments_say_what_they_said(tmp_path: Path, mark: Mark | None, part: str, whole: str) -> None:
    segments = [tmp_path / f"{number}.{part}" for number in range(2)]
    for segment in segments:
        write(segment, FILES[part], mark)
    out = tmp_path / f"joined.{whole}"
    assert join_segments(segments, out, 25) == 2 * N_FRAMES
    if mark is None:
        assert not inspect_file(out).is_synthetic
    else:
        check(inspect_file(out))


def test_long_texts_are_kept_in_part() -> None:
    kept = Mark("a").of(Making("word " * MAX_TEXT)).text
    assert (len(kept), kept[-1]) == (MAX_TEXT, "…")


def test_a_recording_makes_a_drawn_face_a_composite() -> None:
    assert Mark("a").of(Making(), is_recorded=True).source == COMPOSITE
    assert Mark("a").of(Making()).source == TRAINED


def test_the_day_is_that_of_the_variable_for_reproducible_builds(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "86400")
    assert today() == "1970-01-02"
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "soon")
    with pytest.raises(InputError, match="SOURCE_DATE_EPOCH must be a number of seconds since 1970, not 'soon'"):
        today()
