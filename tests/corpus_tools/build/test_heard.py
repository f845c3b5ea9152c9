"""Lips of a talker from the sounds of test utterances, with their words and without."""

import wave
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from cli.main import run
from corpus_tools.recordings.observation import Observation
from corpus_tools.studies.evaluation.heard import (
    OWN_ALIGNMENT,
    SOUND_ALONE,
    find_sounds,
    heard_phones,
    with_hand_edges,
)
from corpus_tools.studies.evaluation.people import DEFAULT_METHOD, evaluate_people
from corpus_tools.studies.evaluation.person_tracks import TRACKED
from lexicon.errors import DataError, InputError
from tests.corpus_tools.speaking import track_arrays
from tts2face.lips.exemplar import build_exemplar_model, speech_trajectory
from tts2face.models.talker_file import load_talker
from tts2face.sound.voice_pool import load_voice

TEXTS = (
    "The young chef usually pushes five big maps.",
    "Nobody saw the dog again before noon.",
    "We may buy some fish.",
)
FPS = 25.0


@pytest.fixture(scope="module")
def person(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, tuple[Observation, ...]]:
    """Sentences of the project's voice, with the lips of the shipped talker."""
    folder = tmp_path_factory.mktemp("sounds")
    voice, talker = load_voice("heart", "en-us"), load_talker("grid_s1")
    model, found = build_exemplar_model(talker), []
    for number, text in enumerate(TEXTS):
        speech = voice.speak(text)
        with wave.open(str(folder / f"s{number}.wav"), "wb") as file:
            file.setparams((1, 2, speech.waveform.rate, 0, "NONE", "not compressed"))
            file.writeframes((speech.waveform.samples * 32767).astype("<i2").tobytes())
        n_frames = int(speech.waveform.duration * FPS)
        motion = speech_trajectory(speech.phones, model, fps=FPS, n_frames=n_frames).values
        landmarks = talker.model.shapes(motion).astype(np.float32)
        head, level = np.zeros((n_frames, 6), np.float32), np.zeros(n_frames, np.float32)
        found.append(
            Observation(
                f"s{number}", FPS, landmarks, head, speech.phones, speech.words, level, TRACKED, folder / "none"
            )
        )
    return folder, tuple(found)


def test_lips_from_sound_are_nearly_those_of_the_given_phones(person: tuple[Path, tuple[Observation, ...]]) -> None:
    folder, utterances = person
    sounds = find_sounds(folder, utterances)
    figures = evaluate_people(load_talker("grid_s1"), [utterances], sounds=sounds).figures
    opening = {name: values["r_opening"].value for name, values in figures.items()}
    assert opening[DEFAULT_METHOD] > 0.99
    assert opening[OWN_ALIGNMENT] > 0.93
    assert opening[SOUND_ALONE] > 0.75
    assert opening[SOUND_ALONE] > opening["audio map network"]


def test_the_command_reports_both(
    person: tuple[Path, tuple[Observation, ...]], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder, utterances = person
    for one in utterances[:2]:
        np.savez(tmp_path / f"{one.name}.npz", **track_arrays(one))
    assert run(["corpus", "evaluate", "--people", str(tmp_path), "--sounds", str(folder)]) == 0
    heads = [line.split(" | ")[0] for line in capsys.readouterr().out.splitlines()]
    assert {f"| {OWN_ALIGNMENT}", f"| {SOUND_ALONE}"} <= set(heads)


def test_edges_by_hand_replace_those_of_the_track(person: tuple[Path, tuple[Observation, ...]]) -> None:
    folder, utterances = person
    sounds = find_sounds(folder, utterances)
    rows = "start\tend\tipa\n0.0\t0.5\tsil\n0.5\t0.7\tb\n"
    (folder / "s1.phones.tsv").write_text(f"phone\t{rows}".replace("\n0", "\nx\t0"), encoding="utf-8")
    first, second, _ = with_hand_edges(utterances, sounds)
    assert first is utterances[0]
    assert (second.phones.phones, second.phones.edges.tolist()) == (("sil", "b"), [0.0, 0.5, 0.7])
    (folder / "s1.phones.tsv").write_text("start\tend\n0.0\t0.5\n", encoding="utf-8")
    with pytest.raises(DataError, match="has no column ipa"):
        with_hand_edges(utterances, sounds)
    (folder / "s1.phones.tsv").unlink()


def test_every_utterance_needs_a_sound(person: tuple[Path, tuple[Observation, ...]]) -> None:
    folder, utterances = person
    with pytest.raises(InputError, match="holds no sound of other"):
        find_sounds(folder, [replace(utterances[0], name="other")])
    assert set(heard_phones(utterances[:1], find_sounds(folder, utterances))) == {OWN_ALIGNMENT, SOUND_ALONE}
