"""Files that are sent while they are made."""

import io
import json
import tempfile
import threading
import wave
from collections.abc import Iterator
from pathlib import Path

import av
import numpy as np
import pytest

import tts2face
from lexicon.errors import InputError
from tests.world import World
from tts2face.session import speech_stream
from tts2face.session.encoded_stream import media_types
from tts2face.sound.voice_pool import VoicePool

TEXT = (
    "<speak>Bob may move. <break time='300ms'/> We were away, loud and <prosody volume='+4dB'>clear</prosody>.</speak>"
)
SMALL = tts2face.Picture(size="64x64", supersampling=1)
BEYOND = [
    {"nods": [{"time": 50}]}, {"gestures": [{"time": 50, "name": "wink"}]}, {"listens": [{"start": 50}]},
    {"gaze": [{"down_deg": 1, "left_deg": 1, "start": 50}]},
    {"expressions": [{"expression": "happy", "weight": 0.5, "start": 0.5, "end": 50}]},
    {"spans": [{"feature": "head", "style": "neutral", "start": 50}]},
]  # fmt: skip


@pytest.fixture(scope="module")
def session(world: World, voices: VoicePool) -> tts2face.Session:
    return world.session(voices=voices)


@pytest.fixture(scope="module")
def clip(session: tts2face.Session) -> tts2face.Clip:
    return session.clip(TEXT, fps=25)


def content(chunks: Iterator[tts2face.Chunk]) -> bytes:
    return b"".join(chunk.content for chunk in chunks)


@pytest.mark.parametrize(("format", "video"), [("mp4", "h264"), ("webm", "vp9")])
def test_a_movie_has_the_frames_and_the_sound_of_its_clip(
    format: str, video: str, session: tts2face.Session, clip: tts2face.Clip
) -> None:
    chunks = list(session.stream_file(TEXT, format, picture=SMALL, fps=25))
    assert sum(chunk.seconds for chunk in chunks) == pytest.approx(len(clip.motion) / 25)
    with av.open(io.BytesIO(content(iter(chunks)))) as movie:
        pictures = [frame.to_ndarray(format="rgb24") for frame in movie.decode(video=0)]
        assert movie.streams.video[0].codec_context.name == video
    with av.open(io.BytesIO(content(iter(chunks)))) as movie:
        seconds = sum(frame.samples / frame.sample_rate for frame in movie.decode(audio=0))
    assert len(pictures) == len(clip.motion)
    assert seconds == pytest.approx(clip.speech.waveform.duration, abs=0.06)
    assert max(float(np.abs(one.astype(float) - pictures[0]).max()) for one in pictures) > 60  # the lips move


@pytest.mark.parametrize("format", ["mp4", "webm"])
def test_the_first_second_of_a_movie_plays_before_the_rest_is_made(format: str, session: tts2face.Session) -> None:
    begin, n_bytes = 0.0, b""
    for chunk in session.stream_file("Bob may move. We were away.", format, picture=SMALL, fps=25):
        n_bytes += chunk.content
        begin += chunk.seconds
        if begin >= 1.0:
            break
    with av.open(io.BytesIO(n_bytes)) as movie:
        assert len(list(movie.decode(video=0))) >= 15


@pytest.mark.parametrize("format", ["wav", "pcm", "mp3", "opus", "weba", "aac", "flac"])
def test_sound_is_that_of_the_clip(format: str, session: tts2face.Session, clip: tts2face.Clip) -> None:
    encoded = content(session.stream_file(TEXT, format, fps=25))
    sound = clip.speech.waveform
    if format == "pcm":
        samples = np.frombuffer(encoded, "<i2") / 32767
    else:
        with av.open(io.BytesIO(encoded)) as file:
            planes = [frame.to_ndarray().astype(float).ravel() for frame in file.decode(audio=0)]
            rate, name = file.streams.audio[0].rate, file.streams.audio[0].format.name
        samples = np.concatenate(planes) / {"s16": 32768, "s32": 2**31}.get(name, 1.0)
        if format in {"opus", "weba"}:
            assert rate == 48_000
            samples = samples[::2]
    exact = format in {"wav", "pcm", "flac"}
    assert len(samples) == len(sound.samples) if exact else len(samples) >= len(sound.samples) - 240
    at = 0 if exact else int(np.argmax(np.correlate(samples[:60_000], sound.samples[12_000:36_000]))) - 12_000
    assert abs(at) <= 0.005 * 24_000
    shared = samples[max(at, 0) :][: len(sound.samples) - 3000]
    given = sound.samples[max(-at, 0) :][: len(shared)]
    if exact:
        assert np.abs(shared - given).max() < 1e-4
    else:
        assert np.corrcoef(shared, given)[0, 1] > 0.95


@pytest.mark.parametrize("format", ["oculus", "azure", "curves", "words", "livelink"])
def test_lines_are_those_of_the_export(
    format: str, session: tts2face.Session, tmp_path: "pytest.TempPathFactory"
) -> None:
    path = tmp_path / f"clip.{format}"  # type: ignore[operator]
    tts2face.export(session.stream(TEXT), path, format=format, face=session.face)
    chunks = list(session.stream_file(TEXT, format))
    assert content(iter(chunks)) == path.read_bytes()
    assert sum(1 for chunk in chunks if chunk.content) >= 2  # one for each sentence


def test_a_stream_that_is_left_releases_its_threads_and_voice(session: tts2face.Session) -> None:
    before = set(threading.enumerate())
    chunks = session.stream_file(TEXT, "mp4", picture=SMALL)
    assert next(chunks).seconds == 0.0
    next(chunks)
    chunks.close()  # type: ignore[attr-defined]
    for thread in set(threading.enumerate()) - before:
        thread.join(5.0)
        assert not thread.is_alive()
    assert len(content(session.stream_file("Hello.", "pcm"))) > 10_000


@pytest.mark.parametrize(
    ("format", "picture", "reason"),
    [
        ("avi", SMALL, "no streamed format 'avi'; the formats are mp4, webm, wav"),
        ("mp4", tts2face.Picture(background="transparent"), "mp4 cannot be transparent; choose webm"),
    ],
)
def test_wrong_formats_are_refused(
    format: str, picture: tts2face.Picture, reason: str, session: tts2face.Session
) -> None:
    with pytest.raises(InputError, match=reason):
        session.stream_file("Hello.", format, picture=picture)


def test_all_formats_have_media_types() -> None:
    assert {name: media_types()[name] for name in ("mp4", "wav", "mp3", "curves")} == {
        "mp4": "video/mp4",
        "wav": "audio/wav",
        "mp3": "audio/mpeg",
        "curves": "application/jsonl",
    }


@pytest.mark.parametrize("format", ["mp4", "webm", "wav", "mp3", "opus", "weba", "flac"])
def test_a_complete_file_has_its_length_in_its_header(
    format: str, session: tts2face.Session, clip: tts2face.Clip
) -> None:
    chunks = list(session.stream_file(TEXT, format, picture=SMALL, fps=25, is_complete=True))
    assert sum(chunk.seconds for chunk in chunks) == pytest.approx(clip.speech.waveform.duration, abs=0.04)
    with av.open(io.BytesIO(content(iter(chunks)))) as file:
        assert file.duration is not None
        assert file.duration / av.time_base == pytest.approx(clip.speech.waveform.duration, abs=0.08)
    if format == "wav":
        with wave.open(io.BytesIO(content(iter(chunks)))) as sound:
            assert sound.getnframes() == len(clip.speech.waveform.samples)


def test_flac_is_sent_with_its_length(session: tts2face.Session, clip: tts2face.Clip) -> None:
    with av.open(io.BytesIO(content(session.stream_file(TEXT, "flac", fps=25)))) as file:
        stream = file.streams.audio[0]
        assert stream.duration * stream.time_base == pytest.approx(clip.speech.waveform.duration, abs=1e-4)


@pytest.mark.parametrize("format", ["mp4", "webm"])
def test_a_complete_movie_is_that_of_the_command(format: str, session: tts2face.Session, tmp_path: Path) -> None:
    session.write("We may.", tmp_path / f"clip.{format}", picture=SMALL)
    made = content(session.stream_file("We may.", format, picture=SMALL, is_complete=True))
    assert made == (tmp_path / f"clip.{format}").read_bytes()


def test_a_complete_file_is_not_left_behind(
    session: tts2face.Session, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    chunks = session.stream_file(TEXT, "flac", is_complete=True)
    assert next(chunks).content == b""
    chunks.close()  # type: ignore[attr-defined]
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("elements", BEYOND, ids=lambda one: next(iter(one)))
@pytest.mark.parametrize("format", ["mp4", "curves", "wav", "mp3"])
def test_times_beyond_the_clip_are_refused_before_its_first_byte(
    elements: dict[str, object], format: str, session: tts2face.Session, tmp_path: Path
) -> None:
    (tmp_path / "t.json").write_text(json.dumps(elements))
    chunks = session.stream_file("Bob may move. We were away.", format, picture=SMALL, timeline=tmp_path / "t.json")
    with pytest.raises(InputError, match="lies beyond the clip"):
        next(chunks)


def test_times_beyond_the_speech_alone_are_refused(session: tts2face.Session, tmp_path: Path) -> None:
    (tmp_path / "t.json").write_text(json.dumps({"nods": [{"time": 60}]}))
    with pytest.raises(InputError, match="the nod at 60 s lies beyond the clip"):
        next(session.stream_speech("Bob may move.", timeline=tmp_path / "t.json"))


def test_times_within_the_clip_do_not_wait_for_its_end(session: tts2face.Session, tmp_path: Path) -> None:
    (tmp_path / "t.json").write_text(json.dumps({"nods": [{"time": 0.5}]}))
    text = "Bob may move. We were away. " * 40
    assert next(session.stream_file(text, "curves", timeline=tmp_path / "t.json")).content


@pytest.mark.parametrize("format", ["curves", "wav"])
def test_times_beyond_a_long_clip_are_refused_at_its_end(
    format: str, session: tts2face.Session, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(speech_stream, "AHEAD_S", 1.0)
    (tmp_path / "t.json").write_text(json.dumps({"nods": [{"time": 500}]}))
    chunks = session.stream_file("Bob may move. We were away. " * 3, format, timeline=tmp_path / "t.json")
    assert next(chunks).content
    with pytest.raises(InputError, match="the nod at 500 s lies beyond the clip"):
        list(chunks)
