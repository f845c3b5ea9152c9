"""Fit of speech to cues, with a voice whose durations are known."""

import re

import pytest

from tts2face.serving.batch.fit import EASY_S, RELEASE_S, Fit, Limits, Room, fit_speech, without_overlap

TEN = "abcdefghij"  # 1 s at rate 1 with 0.1 s a letter


def measure(text: str, rate: float) -> list[float]:
    """0.1 s a letter, and 0.5 s a comma unless a pause mark follows it."""
    words = re.sub(r"\[[^\]]*\]", "", text)
    return [0.1 * sum(letter.isalpha() for letter in words) / rate + 0.5 * len(re.findall(r",(?! \[)", text)) / rate]


def limits(window: float, slot: float | None = None, policy: str = "extend", **room: object) -> Limits:
    return Limits((Room(window, window if slot is None else slot, **room),), policy=policy)


def test_speech_that_fits_keeps_its_rate() -> None:
    fit = fit_speech(TEN, limits(1.0), measure)
    assert (fit.rate, fit.overflow_s, fit.n_steps, fit.text) == (1.0, 0.0, 1, TEN)


def test_speech_keeps_its_rate_in_the_silence_after_its_cue() -> None:
    fit = fit_speech(TEN, limits(0.6, slot=2.0), measure)
    assert (fit.rate, fit.overlap_s) == (1.0, 0.0)
    assert fit.overflow_s == pytest.approx(0.4)
    longer = fit_speech(TEN, limits(0.3, slot=2.0), measure)
    assert 1.0 < longer.rate < 1.4
    assert longer.speech_s <= 0.3 + EASY_S
    assert fit_speech(TEN, limits(0.6, slot=2.0, policy="report"), measure).rate == 1.4


def test_a_margin_stays_before_the_next_cue() -> None:
    fit = fit_speech(TEN, limits(0.7, slot=1.02), measure)
    assert fit.rate > 1.0
    assert fit.speech_s <= 1.02 - RELEASE_S


@pytest.mark.parametrize("window", [0.95, 0.9, 0.8, 0.73])
def test_the_rate_is_raised_as_little_as_needed(window: float) -> None:
    fit = fit_speech(TEN, limits(window), measure)
    assert fit.speech_s <= window
    assert fit.speech_s > 0.95 * window
    assert fit.rate <= 1.4
    assert fit.overflow_s == 0.0


def test_a_voice_that_ignores_part_of_the_rate_is_measured_again() -> None:
    fit = fit_speech(TEN, limits(0.9), lambda text, rate: measure(text, 1.0 + 0.5 * (rate - 1.0)))
    assert fit.speech_s <= 0.9
    assert fit.n_steps > 2


def test_what_remains_too_long_is_reported_at_the_largest_rate() -> None:
    fit = fit_speech(TEN, limits(0.1, slot=2.0), measure)
    assert fit.rate == 1.4
    assert fit.overflow_s == pytest.approx(1.0 / 1.4 - 0.1)


def test_the_last_words_sound_on_before_the_rate_exceeds_its_limit() -> None:
    fit = fit_speech(TEN, limits(0.5, slot=0.6, overlap_s=0.2), measure)
    assert fit.rate == 1.4
    assert fit.overlap_s == pytest.approx(1.0 / 1.4 - 0.6)


def test_speech_overlaps_only_where_the_next_cue_has_begun() -> None:
    room = {"slot": 0.6, "overlap_s": 0.2}
    assert fit_speech(TEN, limits(0.5, silence_s=0.2, **room), measure).overlap_s == 0.0
    assert fit_speech(TEN, limits(0.5, silence_s=0.1, **room), measure).overlap_s == pytest.approx(1.0 / 1.4 - 0.7)


def test_the_next_cue_raises_the_rate_beyond_the_limit() -> None:
    fit = fit_speech(TEN, limits(0.5, slot=0.6), measure)
    assert 1.4 < fit.rate <= 2.0
    assert fit.speech_s <= 0.6
    assert fit_speech(TEN, limits(0.5, slot=0.6, policy="report"), measure).rate == 1.4


def test_a_speaker_speaks_faster_before_two_of_his_own_lines_sound_at_once() -> None:
    fit = fit_speech(TEN, limits(0.5, slot=0.6, overlap_s=0.2, is_shared=True), measure)
    assert 1.4 < fit.rate <= 2.0
    assert fit.overlap_s == 0.0
    assert fit_speech(TEN * 2, limits(0.5, slot=0.6, overlap_s=0.5, is_shared=True), measure).rate == 2.0


def test_speech_that_is_shorter_than_its_cue_is_slowed_down_to_the_smallest_rate() -> None:
    room = (Room(1.2, 2.0),)
    fit = fit_speech(TEN, Limits(room, min_rate=0.5), measure)
    assert 1.15 < fit.speech_s <= 1.2
    assert fit_speech(TEN, Limits(room, min_rate=0.9), measure).rate == 0.9
    assert fit_speech(TEN, Limits(room), measure).rate == 1.0
    assert fit_speech(TEN, Limits((Room(0.9, 0.9),), min_rate=0.5), measure).rate > 1.0


def test_a_sentence_has_the_rate_at_which_all_its_parts_fit() -> None:
    rooms = Room(1.0, 1.0), Room(0.8, 0.8)

    def ends(text: str, rate: float) -> list[float]:
        return [0.5 / rate, 1.0 / rate]

    fits = [fit_speech("a b", Limits(rooms, part=part), ends) for part in (0, 1)]
    assert fits[0].rate == fits[1].rate == pytest.approx(1.25 / 0.985)
    assert [round(fit.speech_s, 2) for fit in fits] == [0.39, 0.79]


def test_pauses_are_cut_only_if_the_rate_is_not_enough() -> None:
    text = "abc, defg, hij"
    fitting = fit_speech(text, limits(1.5, policy="cut-pauses"), measure)
    assert fitting.text == text
    short = fit_speech(text, limits(1.1, policy="cut-pauses"), measure)
    assert short.text == "abc, [pause 0] defg, [pause 0] hij"
    assert (short.rate, short.overflow_s) == (1.0, 0.0)


@pytest.mark.parametrize(("overlap_s", "n_kept"), [(0.0, 3), (0.25, 5), (0.5, 8), (9.0, 10)])
def test_whole_words_are_left_out_where_the_next_cue_leaves_no_time(overlap_s: float, n_kept: int) -> None:
    fit = Fit("", 2.0, 1.0)
    assert without_overlap(fit, 10, lambda n: 0.1 * n, Room(0.2, 0.35, overlap_s)) == n_kept
