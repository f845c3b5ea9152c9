"""Where a sound stands in encoded files, sent and complete: at the time that it had before, for every decoder."""

import io
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path

import av
import numpy as np
import pytest
from numpy.typing import NDArray

from lexicon.errors import InputError
from tests.packages import package
from tests.picture.bursts import BURSTS_S, MOVIES, SECONDS, STREAMED, TOLERANCE_S, encoded, encoded_movie, onsets
from tts2face.picture.sound_stream import PCM_RATE, SOUND_KINDS
from tts2face.storage import wave_files

pytestmark = pytest.mark.formats

RATES = (16_000, 22_050, 24_000, 44_100, 48_000)


def decoded(content: bytes) -> tuple[NDArray[np.float64], int]:
    """Samples and their rate by PyAV."""
    with av.open(io.BytesIO(content)) as file:
        frames = list(file.decode(audio=0))
    planes = [frame.to_ndarray().astype(float).ravel() for frame in frames]
    return np.concatenate(planes), frames[0].sample_rate


@pytest.fixture(params=["sent", "complete"])
def place(request: pytest.FixtureRequest, tmp_path: Path) -> Callable[[str], Path | None]:
    return lambda kind: tmp_path / f"sound.{kind}" if request.param == "complete" else None


@pytest.mark.parametrize("kind", [kind for kind in SOUND_KINDS if kind != "pcm"])
@pytest.mark.parametrize("rate", RATES)
def test_a_sound_stands_where_it_stood(kind: str, rate: int, place: Callable[[str], Path | None]) -> None:
    samples, found_rate = decoded(encoded(kind, rate, place(kind)))
    assert onsets(samples, found_rate) == pytest.approx(BURSTS_S, abs=TOLERANCE_S)
    assert SECONDS - TOLERANCE_S <= len(samples) / found_rate <= SECONDS + 0.1  # the last packet of a stream is whole


@pytest.mark.parametrize("kind", ["wav", "mp3", "opus", "flac"])
def test_libsndfile_finds_it_there_too(kind: str, place: Callable[[str], Path | None]) -> None:
    soundfile = package("soundfile")
    path = place(kind)
    if path is None and SOUND_KINDS[kind].is_sent_whole:
        pytest.skip(f"{kind} is sent when all is made")
    samples, rate = soundfile.read(io.BytesIO(encoded(kind, 24_000, path)))
    assert onsets(samples, rate) == pytest.approx(BURSTS_S, abs=TOLERANCE_S)


@pytest.mark.parametrize("rate", RATES)
def test_samples_without_a_header_have_one_rate(rate: int, place: Callable[[str], Path | None]) -> None:
    samples = np.frombuffer(encoded("pcm", rate, place("pcm")), "<i2")
    assert len(samples) == pytest.approx(SECONDS * PCM_RATE, abs=2)
    assert onsets(samples, PCM_RATE) == pytest.approx(BURSTS_S, abs=0.001)


@pytest.mark.parametrize("name", MOVIES)
@pytest.mark.parametrize("fps", [Fraction(30), Fraction(24000, 1001)], ids=["30", "23.976"])
def test_pictures_and_sound_of_a_movie_begin_together(name: str, fps: Fraction, tmp_path: Path) -> None:
    content = encoded_movie(MOVIES[name], fps, None if name.startswith(STREAMED) else tmp_path / f"clip.{name}")
    samples, rate = decoded(content)
    assert onsets(samples, rate) == pytest.approx(BURSTS_S, abs=TOLERANCE_S)
    with av.open(io.BytesIO(content)) as file:
        stream = file.streams.video[0]
        times = [frame.pts * stream.time_base for frame in file.decode(video=0)]
        written_rate = stream.average_rate
    assert np.array(times, float) == pytest.approx(np.arange(len(times)) / float(fps), abs=0.001)  # WebM: whole ms
    assert written_rate is not None
    assert float(written_rate) == pytest.approx(float(fps), rel=1e-3)


def test_a_wave_file_that_is_too_long_is_refused_with_the_reason(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(wave_files, "MOST_BYTES", 60_000)
    with pytest.raises(InputError, match="at most 4 GB"):
        encoded("wav", 24_000, tmp_path / "long.wav")
