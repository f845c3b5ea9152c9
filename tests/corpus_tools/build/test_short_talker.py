"""Talkers of few sentences on a base: what they hold, what is chosen, and what is recommended."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from cli.main import run
from corpus_tools.clone_talker import transfer_talker
from corpus_tools.recordings.observation import Observation, Quality
from corpus_tools.recordings.observe import Observations, QualityWarning
from corpus_tools.training.adapt_talker import Adaptation, Base, adapted_talker, separate_lips
from corpus_tools.training.choose_adaptation import (
    ADAPTATIONS,
    BASE_ONLY,
    RANGE_RATIO,
    USUAL,
    HeldOutScore,
    choose_adaptation,
)
from corpus_tools.training.short_talker import learn_short_talker, needs_base, recording_advice
from lexicon.sequence import SILENCE, PhoneSequence
from tts2face.lips.exemplar import build_exemplar_model, speech_trajectory
from tts2face.lips.lip_gaps import facing_gaps
from tts2face.models.landmarks import MOUTH_CORNER_LEFT, MOUTH_CORNER_RIGHT, lip_opening
from tts2face.models.talker import Talker
from tts2face.models.talker_file import load_talker, read_talker, write_talker

METADATA = dict.fromkeys(("name", "language", "sources", "licence", "attribution", "command", "created"), "own")


@pytest.fixture(scope="module")
def shipped() -> Talker:
    return load_talker("grid_s1")


@pytest.fixture(scope="module")
def base(shipped: Talker) -> Base:
    """The starter with 60 utterances."""
    return Base.of(replace(shipped, utterances=shipped.utterances[:60]))


@pytest.fixture(scope="module")
def person(shipped: Talker) -> list[Observation]:
    """Ten other utterances of the starter on a face 1.1 times as large, opened twice as far."""
    found, rest = [], shipped.model.shapes(shipped.model.rest[None])[0].astype(np.float64)
    for one in shipped.utterances[100:110]:
        landmarks = 1.1 * (rest + 2.0 * (shipped.model.shapes(one.shape) - rest))
        quality = Quality(-3000.0, 1.0, 0, 0.0)
        found.append(
            Observation(
                one.name, shipped.fps, landmarks.astype(np.float32), one.head, one.phones, one.words, one.intensity,
                quality, Path(f"{one.name}.mkv"),
            )
        )  # fmt: skip
    return found


def test_the_talker_holds_own_utterances_then_the_base_s(base: Base, person: list[Observation]) -> None:
    made = adapted_talker(base, person[:3], ADAPTATIONS[1], METADATA)
    assert [one.name for one in made.utterances[:3]] == [one.name for one in person[:3]]
    assert [one.name for one in made.utterances[3:]] == [one.name for one in base.talker.utterances]
    assert made.network is not None
    assert set(made.audio_maps) == set(base.talker.audio_maps)
    flat = made.model.basis.reshape(len(made.model.basis), -1).astype(np.float64)
    assert flat @ flat.T == pytest.approx(np.eye(len(flat)), abs=1e-5)
    own = made.utterances[0]
    error = made.model.shapes(own.shape) - person[0].landmarks
    assert np.sqrt(np.square(error).mean()) < 0.5  # mm; 30 modes of three sentences and the base


def test_carried_utterances_have_the_size_and_range_of_the_person(base: Base, person: list[Observation]) -> None:
    """The person opens the lips twice as far."""
    made = adapted_talker(base, person, choose_adaptation(base, person).adaptation, METADATA)
    carried = np.concatenate([lip_opening(made.model.shapes(one.shape)) for one in made.utterances[10:40]])
    before = np.concatenate([lip_opening(base.talker.model.shapes(one.shape)) for one in base.talker.utterances[:30]])
    assert 1.4 < carried.std() / before.std() < 2.2  # regression from ten sentences moves less than the person


def test_lips_of_carried_utterances_do_not_cross(base: Base, person: list[Observation]) -> None:
    made = adapted_talker(base, person[:3], Adaptation(trust=0.3, penalty=30.0, gain=(1.5, 1.5)), METADATA)
    gaps = facing_gaps(made.model)
    frames = np.concatenate([one.shape for one in made.utterances[3:]]).astype(np.float64)
    assert (frames @ gaps[:, :-1].T + gaps[:, -1]).min() > -1e-3  # mm; parameters are rounded to float32
    plain = frames[:50, : made.model.n_speech]
    assert separate_lips(plain, made.model) == pytest.approx(plain, abs=1e-3)


def test_a_base_of_another_frame_rate_is_resampled(base: Base, person: list[Observation]) -> None:
    faster = [
        replace(one, fps=50.0, landmarks=np.repeat(one.landmarks, 2, axis=0), head=np.repeat(one.head, 2, axis=0),
                intensity=np.repeat(one.intensity, 2))
        for one in person[:2]
    ]  # fmt: skip
    made = adapted_talker(base, faster, BASE_ONLY, METADATA)
    assert made.fps == 50.0
    for before, after in zip(base.talker.utterances, made.utterances[2:], strict=True):
        assert len(after.shape) == 2 * len(before.shape) - 1


def test_the_choice_is_better_than_the_base_on_held_out_sentences(base: Base, person: list[Observation]) -> None:
    chosen = choose_adaptation(base, person)
    assert chosen.score is not None
    assert chosen.adaptation.penalty < BASE_ONLY.penalty
    wanted = np.clip(0.77 / np.array(chosen.score.ranges), 0.5, 2.0) ** 0.75
    assert chosen.adaptation.gain == pytest.approx(tuple(wanted))
    assert chosen.score.is_surely_better(chosen.alternatives["base alone"])
    assert {"base alone", "mean face", "mean pose", "own examples"} <= set(chosen.alternatives)
    assert chosen.message.startswith(f"held-out r opening {chosen.score.opening:.2f}, width {chosen.score.width:.2f};")


def test_a_difference_within_its_standard_error_is_no_improvement() -> None:
    base = HeldOutScore(0.5, 0.4, 0.9, (0.8, 0.8), (1.0, 0.8, 0.9))
    assert not replace(base, costs=(0.7, 1.0, 0.9)).is_surely_better(base)
    assert replace(base, costs=(0.8, 0.7, 0.7)).is_surely_better(base)


@pytest.mark.parametrize(("costs", "expected"), [((0.7, 1.0, 0.9), USUAL), ((0.8, 0.7, 0.7), BASE_ONLY)])
def test_the_usual_adaptation_is_chosen_unless_another_is_surely_better(
    base: Base,
    person: list[Observation],
    monkeypatch: pytest.MonkeyPatch,
    costs: tuple[float, ...],
    expected: Adaptation,
) -> None:
    """Few sentences do not tell: the base alone was kept in most choices of five sentences, all of which help."""
    plain = HeldOutScore(0.5, 0.4, 0.9, (RANGE_RATIO, RANGE_RATIO), (1.0, 0.8, 0.9))
    answers = iter([replace(plain, cost=0.8, costs=costs), *[plain] * 7])  # the base is the first that is tried
    monkeypatch.setattr("corpus_tools.training.choose_adaptation.cross_validate", lambda *_: next(answers))
    chosen = choose_adaptation(base, person[:3]).adaptation
    assert replace(chosen, gain=(1.0, 1.0)) == expected


def test_a_single_recording_keeps_the_base_with_the_range_of_the_person(base: Base, person: list[Observation]) -> None:
    chosen = choose_adaptation(base, person[:1])
    assert (replace(chosen.adaptation, gain=(1.0, 1.0)), chosen.score) == (BASE_ONLY, None)
    assert "record two sentences or more" in chosen.message
    corners, landmarks = [MOUTH_CORNER_RIGHT, MOUTH_CORNER_LEFT], person[0].landmarks.copy()
    landmarks[:, corners] -= 0.5 * (landmarks[:, corners] - landmarks[:, corners].mean(axis=0))
    narrower = replace(person[0], landmarks=landmarks)
    assert choose_adaptation(base, [narrower]).adaptation.gain[1] < 0.8 * chosen.adaptation.gain[1]


def test_a_short_talker_is_written_and_cloned_both_ways(base: Base, person: list[Observation], tmp_path: Path) -> None:
    write_talker(tmp_path / "base.talker", base.talker)
    short = learn_short_talker(person[:8], str(tmp_path / "base.talker"), metadata=METADATA)
    assert short.n_own == 8
    write_talker(tmp_path / "me.talker", short.talker)
    read = read_talker(tmp_path / "me.talker")
    stated = read.metadata["base"]
    assert stated["name"] == base.talker.metadata["name"]
    assert read.metadata["licence"] == f"recordings: own; base: {base.talker.metadata['licence']}"
    phones = PhoneSequence([SILENCE, "ʃ", "ɑ", "p", SILENCE], [0.0, 0.3, 0.4, 0.6, 0.7, 1.0])
    lips = [
        speech_trajectory(phones, build_exemplar_model(one), fps=25.0, n_frames=26).values
        for one in (read, short.talker)
    ]
    assert lips[0] == pytest.approx(lips[1], abs=0.2)  # mm; 16-bit weights and parameters
    few = replace(base.talker, utterances=base.talker.utterances[:2])
    assert len(transfer_talker(few, read).talker.utterances) == 2
    assert len(transfer_talker(read, few).talker.utterances) == 68


def test_the_build_tells_what_to_expect_and_what_to_record_next(
    base: Base, person: list[Observation], face_model: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    write_talker(tmp_path / "base.talker", base.talker)
    warned = QualityWarning(person[0].name, "it is weak")
    monkeypatch.setattr(
        "corpus_tools.build_talker.observe", lambda *_, **__: Observations(tuple(person[:4]), (), (warned,))
    )
    command = ["corpus", "build", str(tmp_path / "recordings"), "--model", str(face_model), "--out"]
    assert run([*command, str(tmp_path / "me.talker"), "--base", str(tmp_path / "base.talker")]) == 0
    messages = capsys.readouterr().err
    assert f"warning about {person[0].name}: it is weak" in messages
    assert "me.talker: 4 recordings, 0.2 minutes, 0 rejected" in messages
    assert "held-out r opening 0." in messages
    assert "record words with these phones next (times spoken so far): " in messages
    assert len(read_talker(tmp_path / "me.talker").utterances) == 64
    assert run([*command, str(tmp_path / "alone.talker"), "--base", "none"]) == 0
    assert "held-out" not in capsys.readouterr().err
    alone = read_talker(tmp_path / "alone.talker")
    assert [one.name for one in alone.utterances] == [one.name for one in person[:4]]
    assert "base" not in alone.metadata


def test_ten_minutes_need_no_base(person: list[Observation]) -> None:
    seconds = sum(len(one.landmarks) / one.fps for one in person)
    assert needs_base(person)
    assert not needs_base(person * (int(600 / seconds) + 1))


def test_rare_phones_are_recommended(person: list[Observation]) -> None:
    labels = ["s", "i", "ʃ", "i"] * 3 + ["ʒ"]
    phones = PhoneSequence(labels, np.arange(len(labels) + 1) * 0.1)
    rare, narrow = recording_advice([replace(person[0], phones=phones)])
    assert "AA as in father (0)" in rare
    assert "SH" not in rare
    assert set(narrow.removeprefix("record these phones between other phones: ").split(", ")) == {"S", "SH"}
