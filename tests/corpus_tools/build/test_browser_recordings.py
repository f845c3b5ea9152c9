"""Files as a browser's MediaRecorder writes them: variable frame rate, no duration, VP8, VP9 or H.264 with Opus."""

from fractions import Fraction
from pathlib import Path

import av
import numpy as np
import pytest

from tts2face.video.media import read_frames, read_media_info, read_sound
from tts2face.video.resampling import resample_to_grid

RATE = 48_000
KINDS = {
    "vp8.webm": ("webm", {"live": "1"}, "libvpx", "libopus"),
    "vp9.webm": ("webm", {"live": "1"}, "libvpx-vp9", "libopus"),
    "h264.mp4": ("mp4", {"movflags": "frag_keyframe+empty_moov+default_base_moof"}, "libx264", "libopus"),
}
VIDEO_OPTIONS = {
    "libvpx": {"deadline": "realtime", "cpu-used": "8"},
    "libvpx-vp9": {"deadline": "realtime", "cpu-used": "8"},
    "libx264": {"preset": "ultrafast", "tune": "zerolatency"},
}


def write_browser_file(
    kind: str, out: Path, pictures: list[np.ndarray], times: np.ndarray, samples: np.ndarray
) -> None:
    """Pictures (H, W, 3) at `times` in seconds, and samples at 48 kHz, muxed in order of time without a duration."""
    form, options, picture_codec, sound_codec = KINDS[kind]
    with av.open(str(out), "w", format=form, options=options) as container:
        video = container.add_stream(picture_codec, rate=30, options=VIDEO_OPTIONS[picture_codec])
        video.height, video.width = pictures[0].shape[:2]
        video.pix_fmt, video.bit_rate = "yuv420p", 2_500_000
        video.codec_context.time_base = Fraction(1, 1000)
        audio = container.add_stream(sound_codec, rate=RATE, layout="mono")
        heard, step = 0, 960
        for picture, time in zip(pictures, times, strict=True):
            frame = av.VideoFrame.from_ndarray(np.ascontiguousarray(picture), format="rgb24")
            frame.pts, frame.time_base = round(time * 1000), Fraction(1, 1000)
            container.mux(video.encode(frame))
            while heard / RATE < time and heard + step <= len(samples):
                block = samples[None, heard : heard + step].astype(np.float32)
                sound = av.AudioFrame.from_ndarray(block, "flt", "mono")
                sound.sample_rate, sound.pts, sound.time_base = RATE, heard, Fraction(1, RATE)
                container.mux(audio.encode(sound))
                heard += step
        container.mux(video.encode(None))
        container.mux(audio.encode(None))


def uneven_times(seconds: float, seed: int = 0) -> np.ndarray:
    """Times of a camera that slows down in the dark: 30 to 15 frames a second, with jitter, and one gap of 0.2 s."""
    steps = np.random.default_rng(seed).choice([0.033, 0.034, 0.05, 0.067], size=int(seconds * 40))
    steps[12] = 0.2
    times = np.concatenate([[0.0], np.cumsum(steps)])
    return times[times < seconds]


@pytest.mark.parametrize("kind", KINDS)
def test_flashes_and_clicks_stay_together(kind, tmp_path):
    seconds, events = 4.0, (0.9, 1.7, 2.6, 3.3)
    times = uneven_times(seconds)
    lit = [min(times[times >= event]) for event in events]  # when a camera first sees them
    pictures = [np.full((96, 128, 3), 230 if any(0 <= t - on < 0.12 for on in lit) else 25, np.uint8) for t in times]
    samples = np.zeros(int(seconds * RATE), np.float32)
    for event in lit:
        at = round(event * RATE)
        samples[at : at + 1200] = 0.8 * np.sin(np.arange(1200) * 0.2)
    path = tmp_path / kind
    write_browser_file(kind, path, pictures, times, samples)

    info = read_media_info(path)
    assert 15 < info.fps < 31
    frames = list(read_frames(path))
    found = np.array([frame.time for frame in frames])
    begin = float(np.median(found - times))  # in MP4 all but the first come later by the padding of the sound's codec
    assert 0 <= begin < 0.01
    assert list(found[1:] - begin) == pytest.approx(list(times[1:]), abs=0.0015)
    brightness = np.array([frame.pixels.mean() for frame in frames])
    rises = [frames[at + 1].time - begin for at in np.flatnonzero((brightness[1:] > 128) & (brightness[:-1] <= 128))]
    sound = read_sound(path, 16_000)
    loud = np.abs(sound.samples) > 0.3
    clicks = np.flatnonzero(loud & ~np.concatenate([np.zeros(800, bool), loud])[: len(loud)]) / 16_000 - begin
    clicks = clicks[np.concatenate([[True], np.diff(clicks) > 0.3])]
    assert rises == pytest.approx(lit, abs=0.0015)
    assert clicks == pytest.approx(lit, abs=0.008)


@pytest.mark.parametrize("kind", ["vp8.webm", "h264.mp4"])
def test_lips_of_a_converted_recording_are_where_they_were(kind, tmp_path, rendered_takes, face_model):
    from corpus_tools.recordings.video import CachedTracker
    from tts2face.models.landmarks import lip_opening
    from tts2face.video.pose import remove_pose

    source = min((rendered_takes / "clips").glob("*.mkv"))
    original = list(read_frames(source))
    times = uneven_times(original[-1].time)
    nearest = [original[int(np.argmin([abs(frame.time - time) for frame in original]))] for time in times]
    path = tmp_path / kind
    side = [length // 2 * 2 for length in original[0].pixels.shape[:2]]
    pictures = [frame.pixels[: side[0], : side[1]] for frame in nearest]
    write_browser_file(kind, path, pictures, times, read_sound(source, RATE).samples)
    (tmp_path / "cache").mkdir()
    tracker = CachedTracker(tmp_path / "cache", face_model)

    def opening(video):
        tracked = tracker.track(video)
        points, first = resample_to_grid(tracked.tracking.points, tracked.times, 100.0)
        return first, lip_opening(remove_pose(points, 100.0).landmarks)

    (first, before), (start, after) = opening(source), opening(path)
    n = min(len(before), len(after)) - 60
    lags = range(-15, 16)
    steady = before[20 : 20 + n] - before[20 : 20 + n].mean()
    found = [np.corrcoef(steady, after[20 + first - start + lag : 20 + first - start + lag + n])[0, 1] for lag in lags]
    assert max(found) > 0.9
    assert abs(lags[int(np.argmax(found))]) <= 2  # of 10 ms; the nearest of 25 frames a second is up to 20 ms away
