"""Streams, frame rates, errors and memory of the export of any format."""

import time
import tracemalloc
from dataclasses import replace
from itertools import islice

import numpy as np
import pytest

import tts2face
from lexicon.errors import BackendError, InputError
from tests.interchange.exports.made import FACE, RATE, format_parameter, made_clip, made_stream, silent_clip
from tts2face.interchange.exports.arkit import ARKIT_SHAPES
from tts2face.interchange.exports.frame_grid import FrameGrid
from tts2face.interchange.exports.table import FORMATS
from tts2face.picture.film import write_clips
from tts2face.picture.options import Picture
from tts2face.picture.renderer import mesh_renderer
from tts2face.picture.sound_stream import SOUND_KINDS, encode_sound
from tts2face.picture.streamed_movie import MOVIE_KINDS, encode_movie
from tts2face.types import Speech, Trajectory, Waveform, concatenate_clips

REAL_LOCALTIME, A_YEAR_S = time.localtime, 366 * 86400
ALL = [format_parameter(one) for one in FORMATS]


@pytest.fixture(params=ALL)
def name(request):
    """Name of a file in each format."""
    return f"clip{request.param.suffixes[0]}"


def test_a_stream_gives_the_same_file_as_its_whole(name, tmp_path):
    pieces = made_stream()
    tts2face.export(iter(pieces), tmp_path / name, face=FACE)
    parts = (tmp_path / name).read_bytes()
    if "track" in name:
        loaded = tts2face.load_clip(tmp_path / name)
        assert np.array_equal(loaded.motion.values, concatenate_clips(pieces).motion.values)
        return
    tts2face.export(concatenate_clips(pieces), tmp_path / name, face=FACE)
    whole = (tmp_path / name).read_bytes()
    if name.endswith((".npz", ".usda", ".glb", ".TextGrid".lower(), ".jsonl")):
        assert abs(len(whole) - len(parts)) <= 200  # times differ in the last digit
    else:
        assert whole == parts


@pytest.mark.parametrize("clip", [made_clip(1), silent_clip(), made_clip(31, 30000 / 1001), silent_clip(1, 1.0)])
def test_every_format_takes_short_silent_and_broadcast_clips(clip, name, tmp_path):
    written = tts2face.export(clip, tmp_path / name, face=FACE)
    assert written[0].stat().st_size > 0 or not clip.speech.words
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(path.name for path in written)


@pytest.mark.parametrize("name", ["clip.mp4", "clip.mov"])
def test_equal_pictures_give_equal_films(name, tmp_path):
    """Also in widths that x264's vector code does not fill."""
    clip, renderer = made_clip(4), mesh_renderer(FACE, Picture(size="64x48"))
    films = set()
    for _ in range(16):
        write_clips(tmp_path / name, [clip], renderer)
        films.add((tmp_path / name).read_bytes())
    assert len(films) == 1


def now_and_later(folder, monkeypatch, write):
    """Contents of the files that are written now and in a year: containers have fields for times and random numbers."""
    for number, name in enumerate(("now", "later")):
        (folder / name).mkdir()
        moved = time.time() + number * A_YEAR_S
        monkeypatch.setattr(time, "time", lambda moved=moved: moved)
        monkeypatch.setattr(time, "localtime", lambda seconds=moved, real=REAL_LOCALTIME: real(seconds))
        write(folder / name)
    roots = folder / "now", folder / "later"
    return [{path.relative_to(root): path.read_bytes() for path in root.rglob("*") if path.is_file()} for root in roots]


@pytest.mark.parametrize("one", ALL)
def test_a_format_gives_the_same_bytes_at_any_time(one, tmp_path, monkeypatch):
    def write(folder):
        for suffix in one.suffixes:
            tts2face.export(made_clip(4), folder / f"clip{suffix}", face=FACE)

    now, later = now_and_later(tmp_path, monkeypatch, write)
    assert len(now) >= len(one.suffixes)
    assert now == later


def test_films_pictures_and_streams_are_the_same_bytes_at_any_time(tmp_path, monkeypatch):
    clip, renderer = made_clip(4), mesh_renderer(FACE, Picture(size="64x48"))

    def write(folder):
        for name in ("clip.mp4", "clip.webm", "clip.mov", "clip.gif", "frames/"):
            write_clips(f"{folder}/{name}", [clip], renderer)
        for kind in MOVIE_KINDS:
            chunks = encode_movie([clip], renderer, kind)
            (folder / f"stream.{kind}").write_bytes(b"".join(chunk.content for chunk in chunks))
        for kind in SOUND_KINDS:
            chunks = encode_sound(iter([clip.speech.waveform]), kind)
            (folder / f"sound.{kind}").write_bytes(b"".join(chunk.content for chunk in chunks))

    now, later = now_and_later(tmp_path, monkeypatch, write)
    assert len(now) > 4 + len(MOVIE_KINDS) + len(SOUND_KINDS)
    assert now == later


def test_after_an_error_no_file_remains(name, tmp_path):
    def failing():
        yield made_clip()
        raise RuntimeError("the voice broke")

    with pytest.raises(RuntimeError, match="the voice broke"):
        tts2face.export(failing(), [tmp_path / name, tmp_path / "other.bvh"], face=FACE)
    assert not list(tmp_path.iterdir())


def test_an_empty_stream_is_refused(name, tmp_path):
    with pytest.raises(InputError, match="there is no clip to write"):
        tts2face.export([], tmp_path / name, face=FACE)
    assert not list(tmp_path.iterdir())


def test_clips_that_do_not_belong_together_are_refused(tmp_path):
    for other in (made_clip(fps=25.0), made_clip(channels=FACE.shape_names[:2]), _at_rate(made_clip(), 8000)):
        with pytest.raises(InputError, match="must share fps, sound rate and channels"):
            tts2face.export([made_clip(), other], tmp_path / "a.bvh")
    assert not list(tmp_path.iterdir())


def _at_rate(clip, rate):
    samples = clip.speech.waveform.samples[: len(clip.speech.waveform.samples) * rate // RATE]
    return replace(clip, speech=Speech(Waveform(samples, rate), clip.speech.phones, clip.speech.words))


def test_a_mesh_of_other_shapes_is_refused(tmp_path):
    with pytest.raises(InputError, match=r"4 channels .* are not the first of the face's 4 shapes"):
        tts2face.export(made_clip(channels=("a", "b", "c", "d")), tmp_path / "a.glb", face=FACE)
    with pytest.raises(InputError, match=r"a.glb holds the mesh of the face; give the face"):
        tts2face.export(made_clip(), tmp_path / "a.glb")


def test_gestures_need_the_face_for_arkit_formats(tmp_path):
    clip = made_clip(channels=("jawOpen", "brows0"))
    with pytest.raises(InputError, match=r"1 channels of the clip \(brows0, ...\) are not ARKit shapes"):
        tts2face.export(clip, tmp_path / "a.csv")
    with pytest.raises(InputError, match="the clip has none of them"):
        tts2face.export(made_clip(channels=("s0", "s1")), tmp_path / "a.a2f.json")


def test_a_folder_that_cannot_be_written_is_reported(tmp_path, monkeypatch):
    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("tts2face.interchange.exports.npz.NpzWriter.finish", full)
    with pytest.raises(BackendError, match=r"a.npz: No space left on device; free some space"):
        tts2face.export(made_clip(), tmp_path / "a.npz")
    assert not list(tmp_path.iterdir())


def test_several_files_appear_together(tmp_path):
    written = tts2face.export(made_clip(), [tmp_path / "a.glb", tmp_path / "b.vtt"], face=FACE)
    assert [path.name for path in written] == ["a.glb", "b.vtt", "a.wav"]
    assert {path.name for path in tmp_path.iterdir()} == {"a.glb", "a.wav", "b.vtt"}


@pytest.mark.parametrize("fps", [12.0, 24.0, 25.0, 30000 / 1001, 60.0, 120.0])
def test_resampling_of_a_stream_is_linear_interpolation_of_the_whole(fps):
    pieces = made_stream(4, 17)
    grid = FrameGrid(pieces[0], fps)
    parts = [grid.place(piece, "") for piece in pieces] + [grid.remainder()]
    rows = np.concatenate([part.motion for part in parts])
    whole = concatenate_clips(pieces)
    seconds = whole.speech.waveform.duration
    assert len(rows) == np.ceil(seconds * fps - 0.01)
    at = np.arange(len(rows)) / float(grid.fps)
    expected = [np.interp(at, np.arange(len(whole.motion)) / 30.0, column) for column in whole.motion.values.T]
    assert np.allclose(rows, np.column_stack(expected), rtol=0, atol=1e-5)  # float32 weights in [0, 1]


@pytest.mark.parametrize("format", ["track", "livelink", "a2f", "glb", "bvh", "npz", "azure", "wav"])
def test_memory_does_not_grow_with_length(format, tmp_path):
    channels = ARKIT_SHAPES if format in {"livelink", "a2f"} else FACE.shape_names
    face = None if format in {"livelink", "a2f"} else FACE
    piece = made_clip(300, 30.0, channels)

    def peak(n_pieces):
        tracemalloc.start()
        tts2face.export((piece for _ in range(n_pieces)), tmp_path / "a", face=face, format=format)
        most = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return most

    peak(1)
    few, many = peak(3), peak(9)  # 30 s and 90 s; motion and sound of these grow by 4 MB
    assert many - few < 1.5e6


def test_a_stream_is_read_as_it_is_written(tmp_path):
    taken = []

    def stream():
        for number, piece in enumerate(made_stream(3)):
            taken.append(number)
            yield piece

    with pytest.raises(InputError, match="must share fps"):
        tts2face.export((clip for clip in [*islice(stream(), 1), made_clip(fps=25.0), *stream()]), tmp_path / "a.npz")
    tts2face.export(stream(), tmp_path / "b.npz")
    assert np.load(tmp_path / "b.npz")["motion"].shape == (90, 4)


def test_constant_motion_stays_constant_at_any_rate():
    clip = silent_clip(10)
    still = replace(clip, motion=Trajectory(clip.motion.channels, np.full((10, 4), 0.25), 30.0))
    grid = FrameGrid(still, 50.0)
    rows = np.concatenate([grid.place(still, "").motion, grid.remainder().motion])
    assert np.array_equal(rows, np.full((17, 4), 0.25, np.float32))
