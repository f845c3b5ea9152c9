"""Edges of phones in the sound of a voice that states their durations."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lexicon.errors import DataError
from lexicon.sequence import SILENCE
from tts2face.models.phone_classifier import PhoneClassifier, load_phone_classifier, write_phone_classifier
from tts2face.sound.alignment import Aligner
from tts2face.sound.heart import NeuralVoice
from tts2face.sound.heart_letters import LETTERS_OF_PHONE
from tts2face.sound.prosody import Prosody
from tts2face.sound.segments import StatedPhone, find_edges
from tts2face.types import Waveform

TEXT = "The third witness slowly carved a box of matches, while singing."


@pytest.fixture(scope="module")
def voice() -> NeuralVoice:
    return NeuralVoice({})


@pytest.fixture(scope="module")
def classifier() -> PhoneClassifier:
    return load_phone_classifier("heart")


@pytest.mark.parametrize("rate", [0.5, 1.0, 2.0])
def test_edges_agree_with_those_of_the_aligner(voice: NeuralVoice, rate: float) -> None:
    speech = voice.speak(TEXT, rate=rate)
    (part,) = voice.parts(TEXT, Prosody(rate))
    aligned = Aligner().align(part.sound, [(word.text, [word.phones]) for word in part.words])
    apart = []
    for mine, other in zip(speech.words, aligned.words, strict=True):
        edges = speech.phones.edges[mine.first : mine.last + 1] - aligned.phones.edges[other.first : other.last + 1]
        apart += np.abs(edges).tolist()
    assert np.median(apart) < 0.012 / min(rate, 1.0)
    assert np.quantile(apart, 0.9) < 0.05 / min(rate, 1.0)


def test_every_sound_lies_in_a_phone_and_every_pause_in_a_silence(voice: NeuralVoice) -> None:
    speech = voice.speak(TEXT)
    spoken = ["".join(speech.phones.phones[word.first : word.last]) for word in speech.words]
    assert spoken[:3] == ["ðə", "θɝd", "wɪtnəs"]
    assert speech.phones.start == 0.0
    assert speech.phones.end == speech.waveform.duration
    silences = [at for at, phone in enumerate(speech.phones.phones) if phone == SILENCE]
    comma = speech.words[8].last  # after "matches"
    assert silences == [0, comma, len(speech.phones) - 1]
    inside = [round(edge * speech.waveform.rate) for edge in speech.phones.edges[comma : comma + 2]]
    pause = speech.waveform.samples[inside[0] : inside[1]]
    assert np.sqrt(np.mean(np.square(pause))) < 0.1 * np.sqrt(np.mean(np.square(speech.waveform.samples)))


def test_what_the_voice_states_may_be_wrong(voice: NeuralVoice, classifier: PhoneClassifier) -> None:
    (part,) = voice.parts(TEXT)
    sound, stated = part.sound, part.stated
    late = [stated[0], *(replace(one, start=one.start + 0.06) for one in stated[1:])]
    assert np.median(np.abs(find_edges(sound, late, classifier) - find_edges(sound, stated, classifier))) < 0.005


def test_sound_that_is_too_short_for_its_phones(classifier: PhoneClassifier) -> None:
    stated = [StatedPhone(SILENCE, 0.0), *(StatedPhone("t", 0.01 * at, 0.01) for at in range(30))]
    edges = find_edges(Waveform(np.zeros(1600), 16000), [*stated, StatedPhone(SILENCE, 0.1)], classifier)
    assert edges[0] == 0.0
    assert edges[-1] == 0.1
    assert (np.diff(edges) > 0).all()


def test_all_phones_of_the_voice_are_known(classifier: PhoneClassifier) -> None:
    assert set(classifier.inventory) >= {*LETTERS_OF_PHONE, SILENCE}


def test_a_classifier_in_a_file(tmp_path: Path, classifier: PhoneClassifier) -> None:
    write_phone_classifier(tmp_path / "own.phones", classifier)
    again = load_phone_classifier(str(tmp_path / "own.phones"))
    assert again.inventory == classifier.inventory
    features = np.ones((3, len(classifier.mean)), np.float32)
    np.testing.assert_array_equal(again.log_probabilities(features), classifier.log_probabilities(features))
    (tmp_path / "own.phones").write_bytes(b"no")
    with pytest.raises(DataError, match=r"own\.phones"):
        load_phone_classifier(str(tmp_path / "own.phones"))
    write_phone_classifier(
        tmp_path / "own.phones", replace(classifier, inventory=("t", *classifier.inventory[1:-1], "t"))
    )
    with pytest.raises(DataError, match="listed twice"):
        load_phone_classifier(str(tmp_path / "own.phones"))
