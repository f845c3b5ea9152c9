"""Sound and pictures of every container on one clock, which begins where the file does."""

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

import av
import numpy as np
import pytest
from numpy.typing import NDArray

from lexicon.errors import DataError
from tts2face.serving.work.uploaded_file import decode_sound
from tts2face.storage.wave_files import wave_bytes
from tts2face.video.container import start_time
from tts2face.video.media import read_frames, read_media_info, read_sound, sound_blocks

pytestmark = pytest.mark.formats

RATE = 48_000
LATENCY_S = 0.005  # by which a word may be off
FPS, SECONDS = 25, 2.0
AAC_FRAME, MP2_FILTER, MP3_FILTER, AC3_BLOCK = 1024 / RATE, 481 / RATE, 1105 / RATE, 256 / RATE
EMPTY_MOOV = {"movflags": "frag_keyframe+empty_moov"}


@dataclass(frozen=True, slots=True)
class Kind:
    """A file: its ending, codecs, options of the container, and seconds that its encoder adds and the file omits."""

    suffix: str
    codec: str
    options: Mapping[str, str]
    added: float = 0.0
    video: str = ""


def late(seconds: float) -> dict[str, str]:
    return {"output_ts_offset": str(seconds)}


KINDS = {
    "wav": Kind("wav", "pcm_s16le", {}), "flac": Kind("flac", "flac", {}), "ogg": Kind("ogg", "flac", {}),
    "opus": Kind("opus", "libopus", {}), "m4a": Kind("m4a", "aac", {}), "mka": Kind("mka", "aac", {}),
    "mp3 with the header of LAME": Kind("mp3", "libmp3lame", {}),
    "mp3 without": Kind("mp3", "libmp3lame", {"write_xing": "0"}, MP3_FILTER),
    "adts": Kind("aac", "aac", {}, AAC_FRAME), "ac3": Kind("ac3", "ac3", {}, AC3_BLOCK),
    "ts": Kind("ts", "aac", {}, AAC_FRAME), "ts at 100 s": Kind("ts", "aac", late(100), AAC_FRAME),
    "ts at 5000 s": Kind("ts", "mp2", late(5000), MP2_FILTER),
    "ts whose 33 bits wrap": Kind("ts", "aac", late(95440.5), AAC_FRAME),
    "mpg": Kind("mpg", "mp2", {}, MP2_FILTER), "mka at 5 s": Kind("mka", "flac", late(5)),
    "webm at 7 s": Kind("webm", "libopus", late(7)),
    "mp4 in fragments": Kind("mp4", "aac", EMPTY_MOOV, AAC_FRAME),
}  # fmt: skip
FILMS = {
    "mp4": Kind("mp4", "aac", {}, video="libx264"), "mkv": Kind("mkv", "aac", {}, video="libx264"),
    "mkv at 5 s": Kind("mkv", "aac", late(5), video="libx264"), "ts": Kind("ts", "aac", {}, video="libx264"),
    "ts at 100 s": Kind("ts", "aac", late(100), video="libx264"),
    "ts whose 33 bits wrap": Kind("ts", "aac", late(95441.5), video="libx264"),
    "mpg": Kind("mpg", "mp2", {}, video="mpeg1video"), "webm at 3 s": Kind("webm", "libopus", late(3), video="libvpx"),
}  # fmt: skip


def chirps() -> NDArray[np.float64]:
    """Four sounds of .2 s, the first at .3 s, none like another."""
    sound = np.zeros(round(SECONDS * RATE))
    times = np.arange(round(0.2 * RATE)) / RATE
    for number in range(4):
        at = round((0.3 + 0.4 * number) * RATE)
        wave = np.sin(2 * np.pi * (200 + 300 * number) * times + 20 * np.sin(2 * np.pi * 5 * times))
        sound[at : at + len(times)] = 0.4 * np.hanning(len(times)) * wave
    return sound


def written(path: Path, kind: Kind, sound_at: float = 0.0, film_at: float = 0.0) -> Path:
    """A file of `chirps`, and with pictures whose brightness rises from the first one on, both from some time on."""
    with av.open(str(path.with_suffix(f".{kind.suffix}")), "w", options=dict(kind.options)) as container:
        audio = container.add_stream(kind.codec, rate=RATE, layout="mono")
        video = container.add_stream(kind.video, rate=FPS) if kind.video else None
        frames: list[tuple[float, av.VideoFrame | av.AudioFrame]] = []
        samples = np.round(chirps() * 32767).astype(np.int16)
        for at in range(0, len(samples), 4800):
            block = av.AudioFrame.from_ndarray(samples[None, at : at + 4800], format="s16", layout="mono")
            block.sample_rate, block.time_base, block.pts = RATE, Fraction(1, RATE), at + round(sound_at * RATE)
            frames.append((block.pts / RATE, block))
        if video is not None:
            video.width, video.height, video.pix_fmt = 64, 48, "yuv420p"
            for number in range(round(SECONDS * FPS)):
                frame = av.VideoFrame.from_ndarray(np.full((48, 64, 3), 20 + 3 * number, np.uint8), format="rgb24")
                frame.time_base, frame.pts = Fraction(1, FPS), number + round(film_at * FPS)
                frames.append((frame.pts / FPS, frame))
        for _, frame in sorted(frames, key=lambda timed: timed[0]):
            container.mux((audio if isinstance(frame, av.AudioFrame) else video).encode(frame))
        for stream in (audio, video):
            if stream is not None:
                container.mux(stream.encode(None))
    return path.with_suffix(f".{kind.suffix}")


def delay(samples: NDArray[np.floating]) -> float:
    """Seconds by which the chirps are late."""
    n = 1 << 19
    found = np.fft.irfft(np.fft.rfft(samples, n) * np.conj(np.fft.rfft(chirps(), n)), n)
    at = int(found.argmax())
    return (at if at < n // 2 else at - n) / RATE


@pytest.mark.parametrize("name", KINDS)
def test_a_word_stands_where_it_was_recorded(name: str, tmp_path: Path) -> None:
    kind = KINDS[name]
    path = written(tmp_path / "line", kind)
    sound = read_sound(path, RATE)
    assert delay(sound.samples) == pytest.approx(kind.added, abs=LATENCY_S)
    assert sound.duration == pytest.approx(SECONDS + kind.added, abs=0.06)  # codecs fill their last frame
    np.testing.assert_allclose(np.concatenate(list(sound_blocks(path, RATE))), sound.samples, atol=1e-4)


@pytest.mark.parametrize("name", ["mp3 with the header of LAME", "ts at 100 s", "opus", "mka at 5 s", "mpg"])
def test_an_upload_is_decoded_as_a_file_is(name: str, tmp_path: Path) -> None:
    path = written(tmp_path / "line", KINDS[name])
    decode_sound(path, tmp_path / "sent.wav", 60.0)
    np.testing.assert_allclose(
        read_sound(tmp_path / "sent.wav", RATE).samples, read_sound(path, RATE).samples, atol=1e-4
    )


def test_a_plain_sound_stays_as_it_is(tmp_path: Path) -> None:
    (tmp_path / "a.wav").write_bytes(wave_bytes(chirps(), RATE))
    decode_sound(tmp_path / "a.wav", tmp_path / "b.wav", 60.0)
    assert (tmp_path / "b.wav").read_bytes() == (tmp_path / "a.wav").read_bytes()


@pytest.mark.parametrize("name", FILMS)
def test_pictures_are_on_the_clock_of_the_sound(name: str, tmp_path: Path) -> None:
    """The first one at the start, and each where it was filmed, though the sound begins .3 s later by intent."""
    path = written(tmp_path / "film", FILMS[name], sound_at=0.3)
    frames = list(read_frames(path))
    np.testing.assert_allclose([frame.time for frame in frames], np.arange(len(frames)) / FPS, atol=0.002)
    assert len(frames) == SECONDS * FPS
    assert delay(read_sound(path, RATE).samples) == pytest.approx(0.3, abs=LATENCY_S)
    assert read_media_info(path).duration == pytest.approx(2.3, abs=0.1)


@pytest.mark.parametrize("name", FILMS)
def test_a_film_begins_with_its_first_picture(name: str, tmp_path: Path) -> None:
    """What the encoder of the sound adds before it, and a broadcast does not state, is left out."""
    path = written(tmp_path / "film", FILMS[name])
    assert next(iter(read_frames(path))).time == pytest.approx(0.0, abs=0.002)
    tolerance = 1 / FPS if FILMS[name].suffix == "mpg" else LATENCY_S  # whose first picture is repeated
    assert delay(read_sound(path, RATE).samples) == pytest.approx(0.0, abs=tolerance)


@pytest.mark.parametrize("name", FILMS)
def test_a_film_that_begins_after_its_sound_keeps_its_delay(name: str, tmp_path: Path) -> None:
    path = written(tmp_path / "film", FILMS[name], film_at=0.4)
    late_by = next(iter(read_frames(path))).time - delay(read_sound(path, RATE).samples)
    tolerance = 1 / FPS if FILMS[name].suffix == "mpg" else LATENCY_S  # a program stream counts whole pictures
    assert late_by == pytest.approx(0.4, abs=tolerance)


def test_the_cover_of_an_album_is_no_picture_of_a_film(tmp_path: Path) -> None:
    path = tmp_path / "a.mp3"
    with av.open(str(path), "w") as container:
        audio = container.add_stream("libmp3lame", rate=RATE, layout="mono")
        cover = container.add_stream("png", width=16, height=16, pix_fmt="rgb24")
        cover.disposition = av.stream.Disposition.attached_pic
        container.mux(cover.encode(av.VideoFrame(16, 16, "rgb24")))
        frame = av.AudioFrame.from_ndarray(np.round(chirps() * 32767).astype(np.int16)[None], "s16", "mono")
        frame.sample_rate = RATE
        container.mux(audio.encode(frame))
        container.mux(audio.encode(None))
    assert delay(read_sound(path, RATE).samples) == pytest.approx(0.0, abs=LATENCY_S)


@pytest.mark.parametrize("share", [0.1, 0.33, 0.5])
def test_a_broadcast_that_is_cut_anywhere_is_read(share: float, tmp_path: Path) -> None:
    whole = written(tmp_path / "film", FILMS["ts at 100 s"])
    cut = tmp_path / "cut.ts"
    cut.write_bytes(whole.read_bytes()[round(share * whole.stat().st_size) :])
    lost = delay(read_sound(whole, RATE).samples) - delay(read_sound(cut, RATE).samples)
    assert lost == pytest.approx(start_time(cut) - start_time(whole), abs=LATENCY_S)


def test_a_clock_that_is_set_anew_goes_on(tmp_path: Path) -> None:
    """Two broadcasts one after another in a file: the second one follows the first."""
    once = written(tmp_path / "film", FILMS["ts"])
    twice = tmp_path / "twice.ts"
    twice.write_bytes(once.read_bytes() * 2)
    times = [frame.time for frame in read_frames(twice)]
    assert len(times) == 2 * SECONDS * FPS
    np.testing.assert_allclose(np.diff(times), 1 / FPS, atol=0.01)
    assert read_sound(twice, RATE).duration == pytest.approx(2 * read_sound(once, RATE).duration, abs=0.03)


def test_a_gap_in_the_sound_is_silence(tmp_path: Path) -> None:
    path = tmp_path / "paused.mka"
    samples = np.round(chirps() * 32767).astype(np.int16)
    with av.open(str(path), "w") as container:
        audio = container.add_stream("flac", rate=RATE, layout="mono")
        for at in range(0, len(samples), 4800):
            if not 0.6 <= at / RATE < 1.0:  # a microphone that was switched off
                block = av.AudioFrame.from_ndarray(samples[None, at : at + 4800], format="s16", layout="mono")
                block.sample_rate, block.time_base, block.pts = RATE, Fraction(1, RATE), at
                container.mux(audio.encode(block))
        container.mux(audio.encode(None))
    sound = read_sound(path, RATE)
    assert sound.duration == pytest.approx(SECONDS, abs=0.001)
    assert delay(sound.samples) == pytest.approx(0.0, abs=LATENCY_S)


def test_sound_long_after_the_pictures_is_refused_for_that(tmp_path: Path) -> None:
    path = written(tmp_path / "film", FILMS["mkv"], sound_at=90.0)
    with pytest.raises(DataError, match=r"begins 90 s after its pictures, more than 60 s; cut the file"):
        read_sound(path, RATE)


def test_damage_is_named_with_its_place(tmp_path: Path) -> None:
    path = written(tmp_path / "line", KINDS["m4a"])
    content = bytearray(path.read_bytes())
    content[len(content) // 4 : len(content) // 2] = bytes(len(content) // 2 - len(content) // 4)
    path.write_bytes(content)
    with pytest.raises(
        DataError, match=r"is damaged at 0\.\d\d s: 0\.\d\d s cannot be decoded; copy or record it again"
    ):
        read_sound(path, RATE)


@pytest.mark.parametrize("name", ["mp3 without", "adts"])
def test_a_file_whose_length_is_guessed_is_not_called_truncated(name: str, tmp_path: Path) -> None:
    """FFmpeg guesses it from the first bit rates; here silence of few bits precedes noise of many."""
    kind = KINDS[name]
    joined = tmp_path / f"joined.{kind.suffix}"
    parts = []
    for rate, level in ((32_000, 0), (256_000, 4000)):
        with av.open(str(tmp_path / f"part.{kind.suffix}"), "w", options=dict(kind.options)) as container:
            audio = container.add_stream(kind.codec, rate=RATE, layout="mono", bit_rate=rate)
            noise = np.random.default_rng(0).normal(0, level, 2 * RATE).astype(np.int16)
            frame = av.AudioFrame.from_ndarray(noise[None], format="s16", layout="mono")
            frame.sample_rate = RATE
            container.mux(audio.encode(frame))
            container.mux(audio.encode(None))
        parts.append((tmp_path / f"part.{kind.suffix}").read_bytes())
    joined.write_bytes(b"".join(parts))
    with av.open(str(joined)) as opened:
        assert (opened.duration or 0) / 1e6 > 6.0
    assert read_sound(joined, RATE).duration == pytest.approx(4.1, abs=0.1)
