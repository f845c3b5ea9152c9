"""Evaluation from text alone: words with the durations of a voice, aligned with the real ones."""

from dataclasses import replace

import numpy as np
import pytest

from corpus_tools.measures.own_durations import VoicedUtterance, compare_own_durations, map_word_times
from corpus_tools.measures.splits import split_randomly
from corpus_tools.recordings.observation import Observation
from corpus_tools.studies.evaluation.evaluate import SplitResult, evaluate
from corpus_tools.studies.evaluation.page import evaluation_page
from corpus_tools.studies.evaluation.tables import Evaluation
from lexicon.errors import InputError
from lexicon.sequence import SILENCE, PhoneSequence, WordSpan
from tests.corpus_tools.speaking import OwnVoice, observation, with_words
from tts2face.types import Speech, Waveform


@pytest.fixture(scope="module")
def observations() -> list[Observation]:
    return [with_words(observation(number)) for number in range(40)]


def measured(observations: list[Observation], stretch) -> tuple[Evaluation, tuple[SplitResult, ...]]:
    return evaluate([split_randomly(observations, hold_out=8, seed=0)], voice=OwnVoice(observations, stretch))


def on_clock(ours: list[float], real: list[float]) -> VoicedUtterance:
    """Two words of one phone each between silences, with a silence of our own between them."""
    speech = Speech(
        Waveform(np.zeros(round(ours[-1] * 1000)), 1000),
        PhoneSequence([SILENCE, "ɑ", SILENCE, "i", SILENCE], ours),
        (WordSpan("one", 1, 2), WordSpan("two", 3, 4)),
    )
    phones = PhoneSequence([SILENCE, "ɑ", "i", SILENCE], real)
    return map_word_times(speech, phones, (WordSpan("one", 1, 2), WordSpan("two", 2, 3)), 25.0)


def test_words_fall_on_words_and_time_runs_evenly_between() -> None:
    said = on_clock([0.0, 0.3, 0.5, 0.9, 1.0, 1.4], [0.0, 0.2, 0.6, 0.8, 1.0])
    real = np.array([0.1, 0.2, 0.4, 0.6, 0.7, 0.8, 0.95])
    np.testing.assert_allclose(said.times(real), [0.2, 0.3, 0.4, 0.9, 0.95, 1.0, 1.15], atol=1e-6)
    assert said.n_frames == 35


def test_a_voice_with_the_real_durations_changes_nothing(observations: list[Observation]) -> None:
    result, _ = measured(observations, lambda durations: durations)
    for true, own in zip(result.scores, result.own, strict=False):
        assert own.method == true.method
        assert own["r_opening"] == pytest.approx(true["r_opening"], abs=1e-3)  # read between instants 10 ms apart
        assert own["dtw_cost"] == pytest.approx(true["dtw_cost"], abs=1e-3)
        assert own["closure"] == pytest.approx(true["closure"], abs=0.05)
    assert [one.method for one in result.own] == [one.method for one in result.scores[:-1]]  # no voice is the camera


def test_tempo_is_removed_and_timing_within_words_is_kept(observations: list[Observation]) -> None:
    slow = measured(observations, lambda durations: 1.3 * durations)[0]
    assert slow.own[2]["r_opening"] > 0.97
    unequal = np.array([1.0, 1.6, 0.4, 1.6, 0.4, 1.6, 0.4, 1.6, 0.4, 1.0])
    wrong = measured(observations, lambda durations: unequal * durations)[0]
    assert wrong.own[2]["r_opening"] < slow.own[2]["r_opening"] - 0.05
    assert wrong.own[2]["peak_offset_ms"] > slow.own[2]["peak_offset_ms"] + 10
    assert wrong.scores[2]["r_opening"] == slow.scores[2]["r_opening"]


def test_what_lips_do_in_phones_is_looked_at_on_the_clock_of_the_voice(observations: list[Observation]) -> None:
    """A mouth that is shut until its own 0.8 s and open afterwards."""
    _, (run,) = measured(observations, lambda durations: 2.0 * durations)
    one, n_speech = run.real[0], run.model.n_speech

    def clockwork(phones: PhoneSequence, n_frames: int, fps: float) -> np.ndarray:
        made = np.zeros((n_frames, n_speech), np.float32)
        made[:, 0] = np.arange(n_frames) / fps
        return made

    (word, *_) = one.observation.words
    doubled = PhoneSequence(one.observation.phones.phones, 2 * one.observation.phones.edges)
    said = map_word_times(
        Speech(Waveform(np.zeros(round(doubled.end * 1e5)), 100_000), doubled, one.observation.words),
        one.observation.phones,
        one.observation.words,
        25.0,
    )
    judged = compare_own_durations(clockwork, one, said, run.model)
    assert judged.own is not None
    np.testing.assert_allclose(judged.own.values[:, 0], np.arange(said.n_frames) / 25.0, atol=1e-5)
    begin, end = one.observation.phones.edges[[word.first, one.observation.words[-1].last]]
    times = np.arange(len(judged.synthesised)) / 25.0
    within = (times >= begin) & (times <= end)
    np.testing.assert_allclose(judged.synthesised[within, 0], 2 * times[within], atol=1e-3)


def test_the_second_table_is_in_every_answer(observations: list[Observation]) -> None:
    result, runs = measured(observations, lambda durations: 1.2 * durations)
    assert "own durations\n\n| method |" in result.table()
    assert "DTW cost, free" in result.table()
    assert [row[0] for row in result.rows()[1:]] == ["true durations"] * 5 + ["own durations"] * 4
    assert result.to_json()["own"][2]["figures"]["free_cost"]["value"] > 0
    assert "<h2>With own durations</h2>\n<p>8 utterances." in evaluation_page(result, runs)


def test_unpronounceable_utterances_are_omitted_and_none_at_all_is_refused(
    observations: list[Observation],
) -> None:
    train, test = split_randomly(observations, hold_out=8, seed=0)
    mute = tuple(replace(one, words=()) for one in test)
    voice = OwnVoice(observations, lambda durations: durations)
    result, _ = evaluate([(train, (*test[:5], *mute[5:]))], voice=voice)
    assert (len(result.own[0].utterances), len(result.scores[0].utterances)) == (5, 8)
    recognised = tuple(replace(one, is_recognised=True) for one in test)
    for unknown in (mute, recognised):
        with pytest.raises(InputError, match="own durations need recordings whose words are known"):
            evaluate([(train, unknown)], voice=voice)
