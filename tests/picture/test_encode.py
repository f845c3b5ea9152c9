"""Encoded files, decoded again: frame counts, times, colours, coverage and sound; failures leave no file."""

import resource
import signal
import wave
from fractions import Fraction

import av
import numpy as np
import pytest
from PIL import Image

from lexicon.errors import BackendError, InputError
from lexicon.sequence import SILENCE, PhoneSequence
from tests.picture.tiny_face import tiny_face
from tts2face.picture import film
from tts2face.picture.film import ClipWriter, check_output, write_clips
from tts2face.picture.options import Picture
from tts2face.picture.renderer import mesh_renderer
from tts2face.types import HEAD_CHANNELS, Clip, Speech, Trajectory, Waveform, exact_rate, frame_count

pytestmark = pytest.mark.usefixtures("few_directions")
RATE = 24_000
SMALL = Picture(size="64x48", background="#3050a0")
CLEAR = Picture(size="64x48", background="transparent")


@pytest.fixture(scope="module")
def renderer():
    return mesh_renderer(tiny_face(), SMALL)


@pytest.fixture(scope="module")
def transparent():
    return mesh_renderer(tiny_face(), CLEAR)


def clip_of(seconds, fps=30.0, click=None, rate=RATE):
    """A clip whose jaw opens halfway through, with a click of 2 ms."""
    samples = np.zeros(round(seconds * rate), np.float32)
    if click is not None:
        at = round(click * rate)
        samples[at : at + rate // 500] = 0.9 * np.sin(np.arange(rate // 500) * 1.2)
    n_frames = frame_count(len(samples) / rate, fps)
    motion = np.zeros((n_frames, 4), np.float32)
    motion[n_frames // 2 :, 0] = 1.0
    speech = Speech(Waveform(samples, rate), PhoneSequence([SILENCE], [0, len(samples) / rate]), ())
    return Clip(
        Trajectory(tiny_face().shape_names, motion, fps),
        Trajectory(HEAD_CHANNELS, np.zeros((n_frames, 6)), fps),
        speech,
    )


def read(path):
    """Pictures (T, H, W, 3), their times, the sound, and its rate and first instant."""
    with av.open(str(path)) as container:
        pictures, times, sound, starts, rate = [], [], [], [], 0
        for frame in container.decode():
            if isinstance(frame, av.VideoFrame):
                pictures.append(frame.to_ndarray(format="rgb24"))
                times.append(Fraction(frame.pts) * frame.time_base)
            else:
                samples = frame.to_ndarray()
                full_scale = 32_768.0 if samples.dtype == np.int16 else 1.0
                sound.append(samples.mean(axis=0) / full_scale)
                starts.append(float(frame.pts * frame.time_base))
                rate = frame.sample_rate
    return np.array(pictures), times, np.concatenate(sound) if sound else np.zeros(0), (rate, starts[:1])


def write_all(path, renderer, clips):
    with ClipWriter(path, renderer) as writer:
        for clip in clips:
            writer.add(clip)


def loud_at(sound, rate, first, level=0.3):
    """Seconds of the first loud sample."""
    return first + float(np.argmax(np.abs(sound) > level)) / rate


@pytest.mark.parametrize(
    ("fps", "frame_s"),
    [
        (30.0, Fraction(1, 30)), (29.97, Fraction(1001, 30_000)), (23.976, Fraction(1001, 24_000)),
        (59.94, Fraction(1001, 60_000)), (25.0, Fraction(1, 25)), (12.5, Fraction(2, 25)),
    ],
)  # fmt: skip
def test_an_mp4_has_every_frame_at_its_exact_time(tmp_path, renderer, fps, frame_s):
    clip = clip_of(1.3, fps)
    write_clips(tmp_path / "a.mp4", [clip], renderer)
    pictures, times, sound, (rate, (first,)) = read(tmp_path / "a.mp4")
    assert len(pictures) == len(clip.motion)
    assert [time - times[0] for time in times] == [i * frame_s for i in range(len(pictures))]
    picture_end = float(len(pictures) * frame_s)
    assert abs(first + len(sound) / rate - picture_end) <= 1 / fps + 1024 / rate  # an AAC frame holds 1024 samples
    with av.open(str(tmp_path / "a.mp4")) as container:
        ends = [float(stream.duration * stream.time_base) for stream in container.streams]
    assert abs(ends[0] - ends[1]) <= 1 / fps


@pytest.mark.parametrize("suffix", [".mp4", ".webm", ".mov"])
@pytest.mark.parametrize("rate", [16_000, 22_050, 24_000])
def test_a_click_keeps_its_time(tmp_path, renderer, suffix, rate):
    path = tmp_path / f"a{suffix}"
    write_clips(path, [clip_of(1.0, click=0.4, rate=rate)], renderer)
    _, _, sound, (decoded_rate, (first,)) = read(path)
    assert decoded_rate == 48_000
    assert loud_at(sound, decoded_rate, first) == pytest.approx(0.4, abs=0.003)
    assert 0.6 < np.abs(sound).max() < 1.2


@pytest.mark.parametrize("fps", [30.0, 29.97])
def test_clips_follow_each_other_with_sound_and_picture_together(tmp_path, renderer, fps):
    clips = [clip_of(0.51, fps, click=0.2) for _ in range(12)]
    write_all(tmp_path / "a.mp4", renderer, clips)
    pictures, _, sound, (rate, (first,)) = read(tmp_path / "a.mp4")
    n = len(clips[0].motion)
    assert len(pictures) == 12 * n
    for k in range(12):
        start = float(k * n / exact_rate(fps))
        around = sound[round((start + 0.1 - first) * rate) : round((start + 0.3 - first) * rate)]
        assert start + 0.1 + loud_at(around, rate, 0.0) == pytest.approx(start + 0.2, abs=0.003)


def test_decoded_pictures_equal_the_drawn_ones_and_carry_colour_tags(tmp_path):
    renderer, clip = mesh_renderer(tiny_face(), Picture(size="256x256", background="#3050a0")), clip_of(0.2)
    write_clips(tmp_path / "a.mp4", [clip], renderer)
    with av.open(str(tmp_path / "a.mp4")) as container:
        context = container.streams.video[0].codec_context
        tags = context.color_primaries, context.color_trc, context.colorspace, context.color_range
        assert tags == (1, 1, 1, 1)
        assert context.pix_fmt == "yuv420p"
        frame = next(container.decode(video=0)).reformat(
            format="rgb24", src_colorspace="ITU709", src_color_range="MPEG", dst_color_range="JPEG"
        )
        shown = frame.to_ndarray().astype(int)
    drawn = renderer.draw(clip.motion.values[0]).astype(int)
    assert np.abs(shown - drawn).mean() <= 2
    assert np.abs(shown[2, 2] - drawn[2, 2]).max() <= 3


def test_an_mp4_can_be_played_while_it_loads(tmp_path, renderer):
    write_clips(tmp_path / "a.mp4", [clip_of(0.3)], renderer)
    content = (tmp_path / "a.mp4").read_bytes()
    assert 0 < content.find(b"moov") < content.find(b"mdat")


@pytest.mark.parametrize("suffix", [".mp4", ".mov"])
def test_a_file_without_transparency_is_refused(tmp_path, transparent, suffix):
    with pytest.raises(InputError, match=r"cannot be transparent; give \.webm, \.gif or a folder"):
        write_clips(tmp_path / f"a{suffix}", [clip_of(0.3)], transparent)
    assert not list(tmp_path.iterdir())


def test_a_webm_keeps_the_coverage(tmp_path, transparent):
    clip = clip_of(0.5)
    write_clips(tmp_path / "a.webm", [clip], transparent)
    decoder = av.CodecContext.create("libvpx-vp9", "r")
    with av.open(str(tmp_path / "a.webm")) as container:
        shown = [f for packet in container.demux(video=0) for f in decoder.decode(packet)]
    assert len(shown) == len(clip.motion)
    assert shown[0].format.name == "yuva420p"
    coverage = shown[0].to_ndarray(format="rgba")[:, :, 3].astype(int)
    assert np.abs(coverage - transparent.draw(clip.motion.values[0])[:, :, 3]).mean() <= 4
    assert coverage[0, 0] <= 4
    assert coverage[24, 32] >= 251


def test_a_gif_has_true_colours_and_times(tmp_path, renderer):
    clip = clip_of(1.0)
    write_clips(tmp_path / "a.gif", [clip], renderer)
    with Image.open(tmp_path / "a.gif") as file:
        duration = 0
        for i in range(file.n_frames):
            file.seek(i)
            duration += file.info["duration"]
            if i == 0:
                shown = np.array(file.convert("RGB")).astype(int)
        assert file.info["loop"] == 0
        assert duration == pytest.approx(1000, abs=40)
    assert np.abs(shown - renderer.draw(clip.motion.values[0])).mean() <= 6  # 256 colours


def test_a_fast_gif_drops_frames_and_keeps_its_duration(tmp_path, renderer):
    write_clips(tmp_path / "a.gif", [clip_of(1.0, fps=120.0)], renderer)
    with Image.open(tmp_path / "a.gif") as file:
        durations = []
        for i in range(file.n_frames):
            file.seek(i)
            durations.append(file.info["duration"])
    assert min(durations) >= 20
    assert sum(durations) == pytest.approx(1000, abs=40)


def test_a_transparent_gif_is_empty_around_the_head(tmp_path, transparent):
    write_clips(tmp_path / "a.gif", [clip_of(0.3)], transparent)
    with Image.open(tmp_path / "a.gif") as file:
        coverage = np.array(file.convert("RGBA"))[:, :, 3]
    assert coverage[0, 0] == 0
    assert coverage[24, 32] == 255


@pytest.mark.parametrize("name", ["pictures", "pictures/"])
def test_a_folder_holds_the_drawn_pictures_and_the_sound(tmp_path, transparent, name):
    clip = clip_of(0.5, click=0.25)
    for _ in range(2):  # the second time, it replaces its own
        write_clips(f"{tmp_path}/{name}", [clip], transparent)
    folder = tmp_path / "pictures"
    assert sorted(path.name for path in folder.iterdir()) == [f"{i:06d}.png" for i in range(15)] + ["sound.wav"]
    for i in (0, 14):
        np.testing.assert_array_equal(
            np.array(Image.open(folder / f"{i:06d}.png")), transparent.draw(clip.motion.values[i])
        )
    with wave.open(str(folder / "sound.wav")) as file:
        samples = np.frombuffer(file.readframes(file.getnframes()), "<i2") / 32767
        assert file.getframerate() == RATE
    np.testing.assert_allclose(samples, clip.speech.waveform.samples, atol=1 / 32767)


def test_progress_counts_every_frame(tmp_path, renderer):
    calls = []
    write_clips(tmp_path / "a.mp4", [clip_of(0.5)], renderer, on_progress=lambda done, of: calls.append((done, of)))
    assert calls == [(i + 1, 15) for i in range(15)]


@pytest.mark.parametrize("name", ["a.avi", "a.mkv", "a.MP3", "a.mp4.bak"])
def test_unknown_suffixes_are_refused_with_the_known_ones(tmp_path, name):
    with pytest.raises(InputError, match=r"unknown suffix.*\.mp4, \.webm, \.mov, \.gif"):
        check_output(tmp_path / name)


def test_a_missing_folder_is_refused(tmp_path):
    with pytest.raises(InputError, match="there is no folder"):
        check_output(tmp_path / "none" / "a.mp4")


def test_a_folder_with_other_files_is_not_changed(tmp_path):
    (tmp_path / "notes").mkdir()
    (tmp_path / "notes" / "letter.txt").write_text("text")
    with pytest.raises(InputError, match="files other than the pictures"):
        check_output(tmp_path / "notes")


def test_a_folder_named_like_a_movie_is_refused(tmp_path):
    (tmp_path / "a.mp4").mkdir()
    with pytest.raises(InputError, match="is a folder"):
        check_output(tmp_path / "a.mp4")


def test_a_folder_that_cannot_be_written_is_refused(tmp_path, renderer, monkeypatch):
    def refuse(*_, **__):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr("pathlib.Path.touch", refuse)
    with (
        pytest.raises(BackendError, match=r"cannot write .*a\.mp4: Permission denied"),
        ClipWriter(tmp_path / "a.mp4", renderer),
    ):
        pass


def test_no_clip_is_refused_and_leaves_no_file(tmp_path, renderer):
    with pytest.raises(InputError, match="no clip to write"), ClipWriter(tmp_path / "a.mp4", renderer):
        pass
    assert list(tmp_path.iterdir()) == []


def test_clips_of_another_clock_are_refused(tmp_path, renderer):
    clips = clip_of(0.2), clip_of(0.2, fps=25.0)
    with pytest.raises(InputError, match="share fps and sound rate"):
        write_all(tmp_path / "a.mp4", renderer, clips)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", ["a.mp4", "a.webm", "a.mov", "a.gif", "pictures"])
@pytest.mark.parametrize("error", [KeyboardInterrupt, MemoryError])
def test_an_interrupted_file_is_removed(tmp_path, renderer, name, error):
    def stop(done, _of):
        if done == 5:
            raise error

    with pytest.raises(error):
        write_clips(tmp_path / name, [clip_of(0.5)], renderer, on_progress=stop)
    assert list(tmp_path.iterdir()) == []


def test_an_older_file_stays_when_the_new_one_fails(tmp_path, renderer):
    (tmp_path / "a.mp4").write_bytes(b"older")
    with pytest.raises(InputError, match="share fps and sound rate"):
        write_all(tmp_path / "a.mp4", renderer, (clip_of(0.2), clip_of(0.2, fps=25.0)))
    assert [path.name for path in tmp_path.iterdir()] == ["a.mp4"]
    assert (tmp_path / "a.mp4").read_bytes() == b"older"


@pytest.mark.parametrize("name", ["a.mp4", "a.webm", "a.mov", "a.gif", "pictures"])
def test_a_full_disk_is_reported_and_leaves_no_file(tmp_path, renderer, name):
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    ignored = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (3000, before[1]))  # no file beyond 3 kB, as if the disk were full
    try:
        with pytest.raises(BackendError, match=r"cannot write .*: .*; free some space or choose another folder"):
            write_clips(tmp_path / name, [clip_of(2.0, click=0.5)], renderer)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
        signal.signal(signal.SIGXFSZ, ignored)
    assert list(tmp_path.iterdir()) == []


def test_an_error_of_the_encoder_reaches_the_caller(tmp_path, renderer, monkeypatch):
    def fail(self, pixels):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(film.MovieWriter, "picture", fail)
    with pytest.raises(BackendError, match="No space left on device; free some space"):
        write_clips(tmp_path / "a.mp4", [clip_of(2.0)], renderer)
    assert list(tmp_path.iterdir()) == []
