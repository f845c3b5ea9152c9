"""Waveform, Trajectory, Speech and Clip: validation, parts, padding and resampling, and joining of clips."""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lexicon.errors import InputError
from lexicon.sequence import SILENCE, PhoneSequence, WordSpan
from tts2face.types import HEAD_CHANNELS, Clip, Speech, Trajectory, Waveform, concatenate_clips, frame_count

RATE = 8000


def clip_of(n_frames: int, fps: float, phones: tuple[str, ...] = (SILENCE, "p", SILENCE)) -> Clip:
    n_samples = round(n_frames / fps * RATE)
    edges = np.linspace(0, n_samples / RATE, len(phones) + 1)
    speech = Speech(
        Waveform(np.zeros(n_samples), RATE), PhoneSequence(phones, edges), (WordSpan("p", 1, 2),)
    )  # fmt: skip
    ramp = np.arange(n_frames, dtype=np.float32)[:, None]
    return Clip(Trajectory(["jawOpen"], ramp, fps), Trajectory(HEAD_CHANNELS, np.tile(ramp, 6), fps), speech)


@pytest.mark.parametrize(
    ("seconds", "fps", "frames"), [(0.0, 30, 1), (1.0, 30, 30), (1.001, 30, 31), (1 / 30, 30, 1), (0.4, 25, 10)]
)
def test_frames_cover_the_duration(seconds: float, fps: float, frames: int) -> None:
    assert frame_count(seconds, fps) == frames


@given(st.integers(1, 100_000), st.sampled_from([24.0, 25.0, 30000 / 1001, 30.0, 60.0, 120.0]))
def test_whole_frames_survive_rounding_to_samples(n_frames: int, fps: float) -> None:
    assert frame_count(round(n_frames / fps * 24000) / 24000, fps) == n_frames


@pytest.mark.parametrize(
    ("samples", "rate", "reason"),
    [
        ([0.0, 1.5], 8000, r"lie in \[-1, 1\]; the largest is 1.500"),
        ([0.0, np.nan], 8000, "finite"),
        ([[0.0]], 8000, r"1 dimension\(s\), not shape \(1, 1\)"),
        ([0.0], 0, r"above 0 and at most 1e\+06 Hz, not 0"),
    ],
)
def test_waveform_refusals(samples: list[float], rate: int, reason: str) -> None:
    with pytest.raises(InputError, match=reason):
        Waveform(samples, rate)


@pytest.mark.parametrize(
    ("channels", "values", "fps", "reason"),
    [
        (["a", "a"], np.zeros((2, 2)), 30, "different names"),
        (["a"], np.zeros((2, 2)), 30, "1 channels need 1 columns, not 2"),
        (["a"], np.zeros((2, 1)), 0, r"above 0 and at most 1e\+06, not 0"),
        (["a"], np.full((2, 1), np.inf), 30, "finite"),
    ],
)
def test_trajectory_refusals(channels: list[str], values: np.ndarray, fps: float, reason: str) -> None:
    with pytest.raises(InputError, match=reason):
        Trajectory(channels, values, fps)


def test_phones_must_cover_the_sound() -> None:
    with pytest.raises(InputError, match=r"phones cover 0.0-1.0 s but the sound lasts 2.0 s"):
        Speech(Waveform(np.zeros(2 * RATE), RATE), PhoneSequence(["p"], [0.0, 1.0]), ())


def test_a_word_must_lie_within_the_phones() -> None:
    with pytest.raises(InputError, match="beyond the last phone"):
        Speech(Waveform(np.zeros(RATE), RATE), PhoneSequence(["p"], [0.0, 1.0]), (WordSpan("x", 0, 2),))


def test_a_clip_has_one_clock() -> None:
    clip = clip_of(10, 25)
    late = Trajectory(HEAD_CHANNELS, np.zeros((9, 6)), 25)
    with pytest.raises(InputError, match="the same frames"):
        Clip(clip.motion, late, clip.speech)
    other = Trajectory([*HEAD_CHANNELS[:5], "w"], np.zeros((10, 6)), 25)
    with pytest.raises(InputError, match="needs the channels"):
        Clip(clip.motion, other, clip.speech)
    short = Trajectory(["jawOpen"], np.zeros((9, 1)), 25)
    with pytest.raises(InputError, match="needs 10 frames, the motion has 9"):
        Clip(short, Trajectory(HEAD_CHANNELS, np.zeros((9, 6)), 25), clip.speech)


def test_joined_clips_are_one_clip() -> None:
    joined = concatenate_clips([clip_of(10, 25), clip_of(5, 25)])
    assert len(joined.motion) == 15
    assert joined.speech.phones.phones == (SILENCE, "p", SILENCE, "p", SILENCE)
    assert [joined.speech.phones.phones[word.first] for word in joined.speech.words] == ["p", "p"]
    assert joined.speech.waveform.duration == pytest.approx(0.6)


def test_sound_is_cut_padded_and_resampled() -> None:
    sound = Waveform([0.0, 0.5, -0.5, 1.0], 4)
    assert sound.part(1, 3).samples.tolist() == [0.5, -0.5]
    assert sound.part(2, 9).padded(4).samples.tolist() == [-0.5, 1.0, 0.0, 0.0]
    assert sound.padded(2).samples.tolist() == sound.samples.tolist()
    assert sound.resampled(4) is sound
    whole = Waveform(np.sin(2 * np.pi * 100 * np.arange(RATE) / RATE), RATE)
    there = whole.resampled(2 * RATE)
    assert there.rate == 2 * RATE
    expected = np.sin(2 * np.pi * 100 * np.arange(2 * RATE) / there.rate)
    np.testing.assert_allclose(there.samples[1000:-1000], expected[1000:-1000], atol=1e-3)  # the ends ring
    speech = Speech.without_phones(sound)
    assert (speech.phones.phones, speech.phones.edges.tolist(), speech.words) == ((SILENCE,), [0.0, 1.0], ())


def test_trajectories_are_read_by_channel_frame_and_second() -> None:
    motion = Trajectory(("a", "b"), [[1.0, 2.0], [3.0, 4.0], [5.0, 8.0]], 2.0)
    assert (motion.duration, motion.times.tolist()) == (1.5, [0.0, 0.5, 1.0])
    assert motion.columns(["b", "a"]).tolist() == [[2.0, 1.0], [4.0, 3.0], [8.0, 5.0]]
    part = motion.part(1, 9)
    assert (part.channels, part.values.tolist(), part.fps) == (("a", "b"), [[3.0, 4.0], [5.0, 8.0]], 2.0)
    assert motion.at(np.array([-1.0, 0.25, 9.0])).tolist() == [[1.0, 2.0], [2.0, 3.0], [5.0, 8.0]]


@pytest.mark.parametrize(
    ("make", "reason"),
    [
        (lambda: Waveform([0.0], "b"), '^rate must be a number, not "b"'),  # type: ignore[arg-type]
        (lambda: Waveform(["a"], 8000), "^samples must be numbers"),
        (lambda: Trajectory(["a"], [[0.0]], "b"), '^fps must be a number, not "b"'),  # type: ignore[arg-type]
        (lambda: Trajectory(["a"], [["b"]], 30.0), "^trajectory values must be numbers"),
    ],
)
def test_values_of_other_types_are_refused(make: Callable[[], object], reason: str) -> None:
    with pytest.raises(InputError, match=reason):
        make()
