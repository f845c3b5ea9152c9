"""Reading of sound and pictures from media files."""

import os
import struct
import subprocess
import sys
from fractions import Fraction
from pathlib import Path
from types import SimpleNamespace

import av
import numpy as np
import pytest

from lexicon.errors import DataError, InputError
from tests.corpus_tools.films import join_clips
from tts2face.video.media import _upright_pixels, read_frames, read_media_info, read_sound


def test_pictures_come_in_order_with_their_times(make_video):
    pictures = list(read_frames(make_video("grey.mkv", n_frames=10, fps=25, tone_s=0.4)))
    np.testing.assert_allclose([picture.time for picture in pictures], np.arange(10) / 25, atol=0.001)
    levels = [picture.pixels.mean() for picture in pictures]
    np.testing.assert_allclose(levels, 20 + 4 * np.arange(10), atol=2)  # of 255: 8-bit colour conversion
    assert pictures[0].pixels.shape == (48, 64, 3)


def test_facts(make_video):
    facts = read_media_info(make_video("grey.mkv", n_frames=10, fps=25, tone_s=0.4))
    assert (facts.fps, facts.width, facts.height, facts.rate) == (25.0, 64, 48, 16000)
    assert facts.duration == pytest.approx(0.4, abs=0.01)


@pytest.mark.parametrize("rate", [16000, 8000, 24000])
def test_a_tone_keeps_its_pitch_and_level_at_every_rate(make_video, rate):
    sound = read_sound(make_video("tone.mkv", tone_s=1.0), rate)
    assert sound.duration == pytest.approx(1.0, abs=0.001)
    spectrum = np.abs(np.fft.rfft(sound.samples))
    assert np.argmax(spectrum) * rate / len(sound.samples) == pytest.approx(440, abs=1)
    assert sound.samples[rate // 4 : rate // 2].std() == pytest.approx(0.5 / np.sqrt(2), rel=0.01)


@pytest.mark.parametrize(("degrees", "corner"), [(0, (0, 0)), (90, (1, 0)), (180, (1, 2)), (-90, (0, 1))])
def test_a_turned_film_is_put_upright(degrees, corner):
    pixels = np.zeros((2, 3, 3), np.uint8)
    pixels[0, 0] = 255
    upright = _upright_pixels(SimpleNamespace(rotation=degrees, to_ndarray=lambda format: pixels))
    turned = {0: (0, 0), 90: (2, 0), 180: (1, 2), -90: (0, 1)}[degrees]  # counter-clockwise, by hand
    assert upright[turned].tolist() == [255, 255, 255], corner


def test_no_such_file(tmp_path):
    with pytest.raises(InputError, match="there is no recording"):
        list(read_frames(tmp_path / "none.mkv"))


def test_empty_file(tmp_path):
    (tmp_path / "a.mkv").touch()
    with pytest.raises(DataError, match="is empty"):
        list(read_frames(tmp_path / "a.mkv"))


def test_text_that_calls_itself_a_film(tmp_path):
    (tmp_path / "a.mkv").write_text("no film at all\n" * 100)
    with pytest.raises(DataError, match="cannot be read as video or sound"):
        list(read_frames(tmp_path / "a.mkv"))


def test_truncated_film(make_video, tmp_path: Path):
    whole = make_video("whole.mkv", n_frames=50, tone_s=2.0)
    cut = tmp_path / "cut.mkv"
    cut.write_bytes(whole.read_bytes()[: whole.stat().st_size // 2])
    with pytest.raises(DataError, match="truncated"):
        list(read_frames(cut))


def test_no_pictures(make_video):
    with pytest.raises(DataError, match="holds no video"):
        list(read_frames(make_video("sound.mkv", n_frames=0, tone_s=1.0)))


def test_no_sound(make_video):
    with pytest.raises(DataError, match="holds no sound"):
        read_sound(make_video("silent.mkv"), 16000)


def test_a_rate_that_counts_ticks_is_read_from_the_frames(tmp_path):
    path = tmp_path / "ticks.mkv"
    with av.open(str(path), "w") as container:
        stream = container.add_stream("mpeg4", rate=1000)
        stream.width, stream.height, stream.pix_fmt = 64, 48, "yuv420p"
        for number in range(10):
            frame = av.VideoFrame.from_ndarray(np.full((48, 64, 3), 20 * number, np.uint8), format="rgb24")
            frame.pts, frame.time_base = 40 * number, Fraction(1, 1000)
            container.mux(stream.encode(frame))
        container.mux(stream.encode(None))
    assert read_media_info(path).fps == pytest.approx(25.0, rel=0.01)


@pytest.mark.fuzz
@pytest.mark.parametrize("name", ["bbaf2n.mkv", "copy.mp4"])
def test_damaged_films_are_read_or_refused_in_bounded_memory_and_time(name, rendered_takes, tmp_path):
    """A crash, another exception than a refusal, or more memory than the child may have ends the child."""
    recording = rendered_takes / "clips" / "bbaf2n.mkv"
    if name != recording.name:
        join_clips([recording], tmp_path / name)
        recording = tmp_path / name
    command = [sys.executable, "tests/video/damage.py", str(recording), str(tmp_path), "40", "7"]
    root = Path(__file__).parents[2]
    done = subprocess.run(  # noqa: PLW1510 - its answer is looked at
        command, cwd=root, env={**os.environ, "PYTHONPATH": str(root)}, capture_output=True, text=True, timeout=120
    )
    assert done.returncode == 0, done.stderr
    assert len(done.stdout.splitlines()) == 40
    assert "refused" in done.stdout


def test_metadata_that_are_not_utf_8_do_no_harm(tmp_path: Path) -> None:
    def chunk(name: bytes, content: bytes) -> bytes:
        return name + struct.pack("<I", len(content)) + content

    path = tmp_path / "named.wav"
    title = chunk(b"LIST", b"INFO" + chunk(b"INAM", "Grüße ".encode("latin-1")))
    form = chunk(b"fmt ", struct.pack("<HHIIHH", 1, 1, 8000, 16000, 2, 16))
    path.write_bytes(chunk(b"RIFF", b"WAVE" + form + title + chunk(b"data", bytes(16_000))))
    assert read_sound(path, 8000).duration == 1.0
