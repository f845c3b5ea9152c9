"""Statement in files of synthetic pictures of people, read as other programs read it."""

from fractions import Fraction
from pathlib import Path
from xml.etree import ElementTree

import av
import numpy as np
import pytest
from PIL import Image

from tts2face.picture.movie import MOV_MOVIE, MP4_MOVIE, STREAMED_MP4, MovieKind, MovieWriter
from tts2face.picture.png_folder import PngFolderWriter
from tts2face.picture.provenance import MP4_BOX, SOURCE_TYPE
from tts2face.picture.write_buffer import WriteBuffer
from tts2face.serving.batch.assemble import join_segments

NOTICE = 'Synthetic media: synthesised by tts2face from a photograph of <Zoë> & "friends"'
N_FRAMES = 10
PICTURE = np.full((64, 64, 3), 128, np.uint8)


def said_in(packet: bytes | str) -> list[str]:
    root = ElementTree.fromstring(packet)
    return [value for element in root.iter() for value in element.attrib.values()]


def boxes(content: bytes) -> list[tuple[bytes, bytes]]:
    found = []
    while content:
        size = int.from_bytes(content[:4], "big")
        assert 8 <= size <= len(content)
        found.append((content[4:8], content[8:size]))
        content = content[size:]
    return found


def write(target: Path | WriteBuffer, kind: MovieKind, notice: str) -> None:
    writer = MovieWriter(target, kind, PICTURE.shape, (Fraction(25), 16_000), notice)
    for _ in range(N_FRAMES):
        writer.picture(PICTURE)
    writer.sound(np.zeros(16_000 * N_FRAMES // 25, np.float32))
    writer.finish()


def packet_of(content: bytes) -> bytes:
    kind, packet = boxes(content)[-1]
    assert (kind, packet[:16]) == (b"uuid", MP4_BOX)
    return packet[16:]


def test_a_movie_names_its_kind_of_source_and_plays(tmp_path: Path) -> None:
    out = tmp_path / "clip.mp4"
    write(out, MP4_MOVIE, NOTICE)
    said = said_in(packet_of(out.read_bytes()))
    assert SOURCE_TYPE in said
    assert NOTICE in said
    with av.open(str(out)) as container:
        assert container.metadata["comment"] == NOTICE
        assert sum(1 for _ in container.decode(video=0)) == N_FRAMES


def test_a_streamed_movie_names_it_at_its_end() -> None:
    buffer = WriteBuffer()
    write(buffer, STREAMED_MP4, NOTICE)
    assert NOTICE in said_in(packet_of(buffer.take()))


@pytest.mark.parametrize("notice", [NOTICE, ""], ids=["labelled", "plain"])
def test_joined_segments_say_what_they_said(tmp_path: Path, notice: str) -> None:
    segments = [tmp_path / f"{number}.mov" for number in range(2)]
    for segment in segments:
        write(segment, MOV_MOVIE, notice)
    assert join_segments(segments, tmp_path / "joined.mp4", 25) == 2 * N_FRAMES
    content = (tmp_path / "joined.mp4").read_bytes()
    assert (MP4_BOX in content) == bool(notice)
    if notice:
        assert NOTICE in said_in(packet_of(content))


def test_pictures_of_a_folder_name_it(tmp_path: Path) -> None:
    writer = PngFolderWriter(tmp_path, 16_000, NOTICE)
    writer.picture(PICTURE)
    writer.finish()
    with Image.open(tmp_path / "000000.png") as picture:
        assert picture.info["Comment"] == NOTICE
        assert SOURCE_TYPE in said_in(picture.info["XML:com.adobe.xmp"])
