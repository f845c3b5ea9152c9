"""Windows and slots of cues on the frames of a film."""

from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tts2face.interchange.subtitles.cues import Cue
from tts2face.serving.batch.windows import cue_windows, scenes


def cue(begin: float, end: float, text: str = "abc", number: int = 1) -> Cue:
    return Cue(number, begin, end, text, 1)


def frames(*cues: Cue) -> list[tuple[int, int, int]]:
    return [(one.begin, one.end, one.slot_end) for one in cue_windows(cues, Fraction(10))]


def test_slots_reach_the_next_cue_or_two_seconds_beyond_it_or_one_beyond_the_last() -> None:
    assert frames(cue(1, 2), cue(3, 4), cue(9, 10)) == [(10, 20, 30), (30, 40, 60), (90, 100, 110)]


@pytest.mark.parametrize("text", ["abc", "x" * 62, "2024 1999 1848", "你好" * 20])
@pytest.mark.parametrize("rate", [1.0, 0.5])
def test_a_longer_silence_gives_no_less_time(text: str, rate: float) -> None:
    def slot(gap: float) -> int:
        cues = [cue(20, 20.3, text), *([cue(20.3 + gap, 30 + gap)] if gap < 60 else [])]
        return cue_windows(cues, Fraction(30), rate_of=lambda _cue, _part: rate)[0].slot_end

    slots = [slot(n / 10) for n in range(1, 200)]
    assert slots == sorted(slots)
    needed = {"abc": 8, "x" * 62: 155}.get(text, 0) / rate  # frames at 12 characters a second
    assert slot(3.0) >= min(609 + 90, 600 + needed)
    if text != "abc":
        assert slot(60.0) >= slot(2.0)


def test_overlapping_cues_end_where_the_next_begins() -> None:
    assert frames(cue(1, 5), cue(2, 4)) == [(10, 20, 20), (20, 40, 50)]


def test_cues_of_one_instant_divide_their_time_by_their_letters() -> None:
    assert frames(cue(1, 3, "abc"), cue(1, 3, "a")) == [(10, 25, 25), (25, 30, 40)]


@given(st.lists(st.tuples(st.floats(0, 60), st.floats(0.01, 8)), min_size=1, max_size=20))
def test_windows_never_overlap_and_are_within_a_frame_of_their_cues(times: list[tuple[float, float]]) -> None:
    cues = [cue(begin, begin + length) for begin, length in sorted(times)]
    windows = cue_windows(cues, Fraction(25))
    assert [one.cue for one in windows] == cues
    at = 0
    for window in windows:
        assert at <= window.begin < window.end <= window.slot_end
        at = window.slot_end
    assert windows[0].begin == round(Fraction(cues[0].begin_s) * 25)


def test_scenes_are_divided_by_silences() -> None:
    windows = cue_windows([cue(0, 1), cue(2, 3), cue(9, 10)], Fraction(10))
    assert [len(scene) for scene in scenes(windows, 40)] == [2, 1]
    assert [len(scene) for scene in scenes(windows, 10)] == [1, 1, 1]
