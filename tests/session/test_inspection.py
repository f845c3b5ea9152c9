"""What files say of their making, of this program and of others; bad files get one sentence."""

import json
import struct
from pathlib import Path

import numpy as np
import pytest
from PIL import Image, PngImagePlugin

import tts2face
from cli.main import run
from lexicon.errors import DataError, InputError
from tests.walkers import riff_chunks
from tests.world import World
from tts2face.session.inspection import inspect_file
from tts2face.storage.mark_readers import parse_packet
from tts2face.storage.wave_files import wave_bytes

CAMERA = "http://cv.iptc.org/newscodes/digitalsourcetype/digitalCapture"
XMP = (
    '<x:xmpmeta xmlns:x="adobe:ns:meta/"><rdf:RDF xmlns:rdf="http://www.w3.org/1999/02/22-rdf-syntax-ns#">'
    '<rdf:Description xmlns:i="http://iptc.org/std/Iptc4xmpExt/2008-02-29/" xmlns:xmp="http://ns.adobe.com/xap/1.0/">'
    "{}</rdf:Description></rdf:RDF></x:xmpmeta>"
)


def picture(path: Path, body: str) -> Path:
    """A picture of another program, with XMP."""
    image, packet = Image.fromarray(np.zeros((8, 8, 3), np.uint8)), XMP.format(body).encode()
    if path.suffix == ".png":
        labels = PngImagePlugin.PngInfo()
        labels.add_itxt("XML:com.adobe.xmp", packet.decode())
        image.save(path, pnginfo=labels)
    else:
        image.save(path, xmp=packet)
    return path


@pytest.mark.parametrize("format", ["bmp", "tiff"])
def test_pictures_without_a_place_for_marks_have_the_name_of_their_format(format: str, tmp_path: Path) -> None:
    path = tmp_path / f"a.{format}"
    Image.new("RGB", (16, 16)).save(path)
    assert (inspect_file(path).format, inspect_file(path).source) == (format, "")


@pytest.mark.parametrize("name", ["a.png", "a.jpg", "a.webp"])
def test_pictures_of_other_programs_are_read(name: str, tmp_path: Path) -> None:
    written = f"<i:DigitalSourceType>{CAMERA}</i:DigitalSourceType><xmp:CreatorTool>Camera 3</xmp:CreatorTool>"
    found = inspect_file(picture(tmp_path / name, written))
    assert (found.source, found.program, found.is_synthetic) == ("digitalCapture", "Camera 3", False)


@pytest.mark.parametrize(
    "written",
    [
        '<i:DigitalSourceType rdf:resource="https://cv.iptc.org/newscodes/digitalsourcetype/trainedAlgorithmicMedia"/>',
        "<i:DigitalSourceType>http://cv.iptc.org/newscodes/digitalsourcetype/trainedAlgorithmicMedia</i:DigitalSourceType>",
        "<i:DigitalSourceType><rdf:Bag><rdf:li>trainedAlgorithmicMedia</rdf:li></rdf:Bag></i:DigitalSourceType>",
    ],
    ids=["resource", "text", "list"],
)
def test_all_forms_of_a_property_count(written: str, tmp_path: Path) -> None:
    assert inspect_file(picture(tmp_path / "a.png", written)).is_synthetic


def test_a_bomb_of_entities_expands_to_nothing() -> None:
    bomb = b'<!DOCTYPE a [<!ENTITY b "bbbbbbbb"><!ENTITY c "&b;&b;&b;">]>' + XMP.format("&c;").encode()
    assert parse_packet(bomb) == {}
    assert parse_packet(b"no XML <") == {}


def test_a_clip_says_who_speaks_what(world: World, tmp_path: Path) -> None:
    session = world.session()
    session.export("Bob <b>may</b> [nod] go.", [tmp_path / "a.wav", tmp_path / "a.glb", tmp_path / "a.vrma"])
    for name in ("a.wav", "a.glb", "a.vrma"):
        found = inspect_file(tmp_path / name)
        assert (found.source, found.voice, found.is_synthetic) == ("trainedAlgorithmicMedia", "heart", True)
        assert " ".join(found.text.split()) == "Bob may go."
        assert found.program == f"tts2face {tts2face.__version__}"


def test_the_sound_of_a_recording_is_no_synthesis(world: World, tmp_path: Path) -> None:
    session = world.session()
    session.export("Bob may.", tmp_path / "speech.wav")
    request = tts2face.Request(audio=tmp_path / "speech.wav")
    session.export(request, [tmp_path / "a.wav", tmp_path / "a.glb", tmp_path / "a.track.json"])
    assert not inspect_file(tmp_path / "a.wav").is_synthetic
    assert inspect_file(tmp_path / "a.glb").source == "compositeWithTrainedAlgorithmicMedia"
    tts2face.convert(tmp_path / "a.track.json", tmp_path / "b.wav")
    assert list(riff_chunks((tmp_path / "b.wav").read_bytes())) == [b"fmt ", b"data"]


def _cut(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:40])


BAD = {
    "empty.wav": (lambda path: path.write_bytes(b""), r"empty.wav is empty \(0 bytes\); copy or record it again"),
    "text.mp4": (lambda path: path.write_text("hello"), r"text.mp4 cannot be read as video or sound"),
    "cut.png": (lambda path: (picture(path, ""), _cut(path)), r"cut.png ends within a block; copy it again"),
    "cut.gif": (lambda path: path.write_bytes(b"GIF89a\1\0\1\0\xf7\0\0"), r"cut.gif ends within a block"),
    "head.glb": (lambda path: path.write_bytes(b"glTF" + struct.pack("<4I", 2, 22, 2, 0) + b"[]"), r"it has no asset"),
    "bad.glb": (lambda path: path.write_bytes(b"glTF" + struct.pack("<4I", 2, 22, 2, 0) + b"{!"), r"bad.glb"),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_files_get_one_sentence(name: str, tmp_path: Path) -> None:
    write, reason = BAD[name]
    write(tmp_path / name)
    with pytest.raises(DataError, match=reason) as refused:
        inspect_file(tmp_path / name)
    assert "\n" not in str(refused.value)


def test_a_file_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"there is no file .*absent.wav; check the path"):
        inspect_file(tmp_path / "absent.wav")
    with pytest.raises(DataError, match=r"is a folder, not a file"):
        inspect_file(tmp_path)


def test_the_command_prints_what_it_finds(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "a.wav"
    assert run(["Hello there.", "--voice", "espeak", "--spoken-mark", "auto", "--out", str(out), "--quiet"]) == 0
    assert run(["inspect", str(out)]) == 0
    printed = capsys.readouterr().out
    assert f"{out}: says that it is synthetic\n" in printed
    assert "  text: This voice is synthetic.  Hello there.\n" in printed
    assert run(["inspect", str(out), "--json"]) == 0
    content = json.loads(capsys.readouterr().out)
    assert (content["voice"], content["synthetic"], content["signature"]) == ("espeak", True, None)
    out.write_bytes(wave_bytes(np.zeros(2400, np.float32), 24_000))
    assert run(["inspect", str(out)]) == 0
    assert "says nothing of being synthetic" in capsys.readouterr().out
    assert run(["inspect", str(tmp_path / "absent.wav")]) == 2


def test_a_time_stamp_needs_a_signature(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["Hello.", "--out", "a.wav", "--time-stamp", "http://a"]) == 2
    assert "--time-stamp belongs to a signature; add --sign CERTIFICATE KEY, or remove it" in capsys.readouterr().err
