"""Sound whose clock is not that of its samples: the times of the file decide."""

from collections.abc import Callable
from fractions import Fraction
from pathlib import Path

import av
import numpy as np
import pytest
from numpy.typing import NDArray

from tts2face.serving.work.uploaded_file import decode_sound
from tts2face.video.media import read_sound, sound_blocks
from tts2face.video.sound_survey import sound_notes

RATE, SECONDS, STEP = 16_000, 60, 1024
CHIRPS_S = np.arange(1.0, SECONDS - 1, 2.5)  # places of sounds, by the samples


def chirp() -> NDArray[np.float64]:
    times = np.arange(RATE // 5) / RATE
    return 0.4 * np.hanning(len(times)) * np.sin(2 * np.pi * (300 * times + 4000 * times**2))


def recorded() -> NDArray[np.float64]:
    sound = np.zeros(SECONDS * RATE)
    for at in CHIRPS_S:
        sound[round(at * RATE) :][: RATE // 5] = chirp()
    return sound


def written(path: Path, time_of: Callable[[float], float], sound: NDArray[np.float64], codec: str = "flac") -> Path:
    """A file in which the sample at a second of the sound has another time."""
    with av.open(str(path), "w") as container:
        stream = container.add_stream(codec, rate=RATE, layout="mono")
        stream.time_base = Fraction(1, RATE)
        for at in range(0, len(sound), STEP):
            block = av.AudioFrame.from_ndarray(
                np.round(sound[None, at : at + STEP] * 32767).astype(np.int16), "s16", "mono"
            )
            block.sample_rate, block.time_base = RATE, Fraction(1, RATE)
            block.pts = round(time_of(at / RATE) * RATE)
            container.mux(stream.encode(block))
        container.mux(stream.encode(None))
    return path


def places(sound: NDArray[np.floating], expected: NDArray[np.float64]) -> NDArray[np.float64]:
    """Seconds at which the chirps are, each looked for within .3 s."""
    found = []
    for at in expected:
        first = max(round((at - 0.3) * RATE), 0)
        part = sound[first : first + round(0.8 * RATE)]
        found.append((first + np.correlate(part, chirp(), "valid").argmax()) / RATE)
    return np.array(found)


CLOCKS: dict[str, Callable[[float], float]] = {
    "slower by .05 %": lambda at: 0.9995 * at, "faster by .05 %": lambda at: 1.0005 * at,
    "slower by .5 %": lambda at: 0.995 * at, "faster by .5 %": lambda at: 1.005 * at,
    "slower by 2 %": lambda at: 0.98 * at, "slower, then right": lambda at: max(0.99 * at, at - 0.3),
    "right, then slower": lambda at: at if at < 30 else 30 + 0.99 * (at - 30),
    "warming up": lambda at: at - 0.3 * at * at / SECONDS**2,
}  # fmt: skip


DAILY = {"slower by .5 %", "right, then slower"}  # by default; the others are a group's


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[] if name in DAILY else pytest.mark.fuzz) for name in CLOCKS]
)
def test_sound_stays_where_its_times_are(name: str, tmp_path: Path) -> None:
    time_of = CLOCKS[name]
    path = written(tmp_path / "a.mka", time_of, recorded())
    sound = read_sound(path, RATE)
    expected = np.array([time_of(at) for at in CHIRPS_S])
    np.testing.assert_allclose(places(sound.samples, expected), expected, atol=0.011)
    assert sound.duration == pytest.approx(time_of(SECONDS), abs=0.02)
    np.testing.assert_allclose(np.concatenate(list(sound_blocks(path, RATE))), sound.samples, atol=1e-4)
    (note,) = sound_notes([path])
    assert note.startswith("the sound of a.mka drifts by 0.") or "2 %" in name
    assert note.endswith("it is resampled to them; give a file of the sound alone to keep its samples")


@pytest.mark.parametrize("share", [0.9995, 1.0005, 0.99])
def test_a_tone_has_no_click(share: float, tmp_path: Path) -> None:
    times = np.arange(20 * RATE) / RATE
    path = written(tmp_path / "a.mka", lambda at: share * at, 0.5 * np.sin(2 * np.pi * 1000 * times))
    sound = read_sound(path, RATE).samples[RATE:-RATE]
    spectrum = np.square(np.abs(np.fft.rfft(sound * np.blackman(len(sound)))))
    tone = np.abs(np.fft.rfftfreq(len(sound), 1 / RATE) - 1000 / share) < 3
    assert 10 * np.log10(spectrum[tone].sum() / spectrum[~tone].sum()) > 50  # a click has 20


@pytest.mark.parametrize(("suffix", "codec"), [("mka", "flac"), ("mka", "libopus"), ("m4a", "aac"), ("ts", "aac")])
def test_rounded_and_unsteady_times_are_no_drift(suffix: str, codec: str, tmp_path: Path) -> None:
    """Those of milliseconds, and of recordings of a browser."""
    jitter = np.random.default_rng(0).uniform(-0.004, 0.004, SECONDS * RATE)
    even = written(tmp_path / f"even.{suffix}", lambda at: at, recorded(), codec)
    path = written(tmp_path / f"a.{suffix}", lambda at: at + jitter[round(at * RATE)] * (at > 0), recorded(), codec)
    assert sound_notes([even, path]) == ()
    if codec == "flac":
        np.testing.assert_array_equal(read_sound(path, RATE).samples, read_sound(even, RATE).samples)


def test_drift_goes_on_after_a_gap(tmp_path: Path) -> None:
    def time_of(at: float) -> float:
        return 0.995 * at + 3.0 * (at >= 20)

    path = written(tmp_path / "a.mka", time_of, recorded())
    expected = np.array([time_of(at) for at in CHIRPS_S])
    np.testing.assert_allclose(places(read_sound(path, RATE).samples, expected), expected, atol=0.011)
    gap, drift = sound_notes([path])
    assert gap.startswith("the sound of a.mka has a gap at 19.9")
    assert "(3.00 s): silence is there" in gap
    assert drift.startswith("the sound of a.mka drifts by 0.3")


@pytest.mark.parametrize("share", [0.3, 1.5])
def test_times_without_sense_do_not_move_sound(share: float, tmp_path: Path) -> None:
    path = written(tmp_path / "a.mka", lambda at: share * at, recorded(), "pcm_s16le")
    assert read_sound(path, RATE).duration == pytest.approx(SECONDS, abs=0.01)


def test_an_upload_is_resampled_as_a_file_is(tmp_path: Path) -> None:
    path = written(tmp_path / "a.mka", CLOCKS["slower by .05 %"], recorded())
    decode_sound(path, tmp_path / "sent.wav", 90.0)
    np.testing.assert_allclose(
        read_sound(tmp_path / "sent.wav", RATE).samples, read_sound(path, RATE).samples, atol=1e-3
    )
