"""The audio map of any voice: learnt from damaged speech of one voice, it holds for another sound of it."""

from dataclasses import replace

import numpy as np
import pytest

from corpus_tools.shipped.training import voices_audio_map
from corpus_tools.shipped.training.damage import damage
from corpus_tools.shipped.training.spoken_material import KnownSpeech, resampled
from lexicon.sequence import PhoneSequence
from tts2face.models.talker import Talker
from tts2face.models.talker_file import load_talker
from tts2face.sound.voice_pool import load_voice

TEXTS = (
    "We may buy some fish.", "Nobody saw the dog again.", "The young chef pushes five big maps.", "She saw a moth.",
    "Five boys play in the park.", "Her bother may move away.", "Please shut the door before noon.", "I do know you.",
)  # fmt: skip


@pytest.fixture(scope="module")
def talker() -> Talker:
    return load_talker("grid_s1")


@pytest.fixture(scope="module")
def known() -> list[KnownSpeech]:
    voice = load_voice("heart", "en-us")
    spoken = [voice.speak(text) for text in TEXTS]
    return [KnownSpeech(resampled(one.waveform), one.phones) for one in spoken]


@pytest.mark.needs("sklearn")
def test_a_map_learns_the_lips_of_damaged_speech(
    talker: Talker, known: list[KnownSpeech], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of eight sentences, four times; r of 0.5 is far above that of the mean face, and below that of all sentences."""
    monkeypatch.setattr(voices_audio_map, "N_DAMAGED", 4)
    monkeypatch.setattr(voices_audio_map, "N_UNITS", (64, 32))
    monkeypatch.setattr(voices_audio_map, "BATCH", 64)
    told: list[int] = []
    lessons = voices_audio_map._lessons(talker, known, np.random.default_rng(0), lambda done, of: told.append(of))
    assert told == [32] * 32
    assert [one.is_test for one in lessons] == [True, *[False] * 7] * 4
    learnt = voices_audio_map._fit([one for one in lessons if not one.is_test])
    made = np.concatenate([learnt.parameters(one.features) for one in lessons if one.is_test])
    real = np.concatenate([one.lips for one in lessons if one.is_test])
    assert np.corrcoef(made[:, 0], real[:, 0])[0, 1] > 0.5


def test_phones_move_with_damaged_speech(known: list[KnownSpeech]) -> None:
    one = known[0]
    damaged = damage(one.sound, [two.sound for two in known], np.random.default_rng(3))
    moved = damaged.phones(one.phones)
    assert isinstance(moved, PhoneSequence)
    assert moved.phones == one.phones.phones
    assert moved.end == damaged.sound.duration
    assert moved.durations[1:-1] == pytest.approx(one.phones.durations[1:-1] / damaged.faster)
    assert replace(damaged, lead=0.0).phones(one.phones).edges[1] < moved.edges[1]
