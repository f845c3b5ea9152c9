"""Sound processed in blocks gives the result of the whole sound, within the stated delay."""

import numpy as np
import pytest

from corpus_tools.training.linear_audio_map import TrainingUtterance, learn_linear_map
from corpus_tools.training.network_audio_map import NetworkMapOptions, learn_network_map
from lexicon.errors import InputError
from tests.oracles.test_features import babble
from tts2face.models.audio_map import AudioMap
from tts2face.sound.features import FEATURE_KINDS, FEATURE_RATE, speech_features
from tts2face.sound.listener import StreamingAudioMap, StreamingFeatures
from tts2face.types import frame_count

SOUND = babble(2.3)


def linear_map(feature: str, before: int, after: int, *, bends: bool) -> AudioMap:
    features = speech_features(SOUND, feature, fps=25.0, n_frames=57).values
    moved = np.random.default_rng(1).normal(size=(57, 3)).astype(np.float32)
    lessons = [TrainingUtterance(features, moved)] * 3
    if bends:
        options = NetworkMapOptions(n_hidden=4, before=before, after=after)
        return learn_network_map(lessons, feature=feature, options=options)
    return learn_linear_map(lessons, feature=feature, before=before, after=after)


def blocks(*sizes: int) -> list[np.ndarray]:
    """The sound cut into blocks of these sizes, over and over."""
    cut, at = [], 0
    while at < len(SOUND.samples):
        size = sizes[len(cut) % len(sizes)]
        cut.append(SOUND.samples[at : at + size])
        at += size
    return cut


@pytest.mark.parametrize("sizes", [(1600,), (7, 4001, 0, 350), (100_000,)])
@pytest.mark.parametrize("fps", [25.0, 29.97])
@pytest.mark.parametrize("kind", [*FEATURE_KINDS, "mfcc+lsf"])
def test_features_of_blocks_are_those_of_the_whole(kind: str, fps: float, sizes: tuple[int, ...]) -> None:
    ear = StreamingFeatures(kind, fps)
    found = np.concatenate([*(ear.add_samples(block) for block in blocks(*sizes)), ear.finish()])
    whole = speech_features(SOUND, kind, fps=fps, n_frames=frame_count(SOUND.duration, fps))
    np.testing.assert_array_equal(found, whole.values)


@pytest.mark.parametrize("sizes", [(800,), (7, 4001, 0, 350), (100_000,)])
@pytest.mark.parametrize(("before", "after", "bends"), [(0, 0, False), (2, 3, False), (3, 1, True)])
def test_lips_of_blocks_are_those_of_the_whole(before: int, after: int, bends: bool, sizes: tuple[int, ...]) -> None:
    audio_map = linear_map("mfcc", before, after, bends=bends)
    listener = StreamingAudioMap(audio_map)
    made = np.concatenate([*(listener.add_samples(block) for block in blocks(*sizes)), listener.finish()])
    features = speech_features(SOUND, "mfcc", fps=25.0, n_frames=frame_count(SOUND.duration, 25.0))
    np.testing.assert_array_equal(made, audio_map.parameters(features.values))


def test_lips_come_no_later_than_stated() -> None:
    audio_map = linear_map("lsf", 2, 3, bends=True)
    listener = StreamingAudioMap(audio_map)
    assert listener.look_ahead_s == pytest.approx(3 / 25 + 0.0427, abs=1e-3)
    known, n_received = 0, 0
    for block in blocks(160):
        known += len(listener.add_samples(block))
        n_received += len(block)
        frames_due = int(np.floor((n_received / FEATURE_RATE - listener.look_ahead_s) * 25.0 + 1e-9)) + 1
        assert known >= max(frames_due, 0)


def test_a_sound_shorter_than_the_look_ahead_has_lips() -> None:
    listener = StreamingAudioMap(linear_map("mfcc", 2, 5, bends=False))
    assert len(listener.add_samples(SOUND.samples[:1000])) == 0
    made = listener.finish()
    assert made.shape == (2, 3)
    assert np.isfinite(made).all()


def test_memory_does_not_grow_with_the_length_of_the_sound() -> None:
    ear = StreamingFeatures("level", 25.0)
    for block in blocks(1600) * 20:
        ear.add_samples(block)
    assert ear.n_samples == 20 * len(SOUND.samples)
    assert len(ear._buffer) < 4000


@pytest.mark.parametrize("block", [np.zeros((2, 10)), np.array([0.0, np.nan])])
def test_what_is_no_sound_is_refused(block: np.ndarray) -> None:
    with pytest.raises(InputError, match="vector of finite samples"):
        StreamingFeatures("mfcc", 25.0).add_samples(block)
