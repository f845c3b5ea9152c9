"""Phones in time."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lexicon.errors import InputError
from lexicon.sequence import SILENCE, PhoneSequence, WordSpan, concatenate_phones


@st.composite
def sequences(draw: st.DrawFn) -> PhoneSequence:
    durations = draw(st.lists(st.floats(0.001, 10), min_size=1, max_size=20))
    phones = draw(st.lists(st.sampled_from([SILENCE, "p", "ɑ"]), min_size=len(durations), max_size=len(durations)))
    return PhoneSequence(phones, np.concatenate([[0.0], np.cumsum(durations)]))


def test_edges_are_shared_and_locked() -> None:
    sequence = PhoneSequence(["p", "ɑ"], [0.0, 0.1, 0.3])
    assert sequence.durations == pytest.approx([0.1, 0.2])
    with pytest.raises(ValueError, match="read-only"):
        sequence.edges[0] = 1.0


@pytest.mark.parametrize(
    ("phones", "edges", "reason"),
    [
        ([], [0.0], "at least one phone"),
        (["p"], [0.0], r"1 phones need 2 edges, not an array of shape \(1,\)"),
        (["p", "ɑ"], [0.0, 0.2, 0.2], r"must increase; phone 1 \(ɑ\)"),
        (["p"], [0.0, np.nan], "edge 1 is not"),
    ],
)
def test_refusals(phones: list[str], edges: list[float], reason: str) -> None:
    with pytest.raises(InputError, match=reason):
        PhoneSequence(phones, edges)


@pytest.mark.parametrize(("seconds", "index"), [(-1.0, 0), (0.0, 0), (0.0999, 0), (0.1, 1), (0.3, 1), (9.0, 1)])
def test_spans_are_half_open(seconds: float, index: int) -> None:
    assert PhoneSequence(["p", "ɑ"], [0.0, 0.1, 0.3]).index_at(seconds) == index


def test_silences_that_meet_become_one_and_words_keep_their_phones() -> None:
    first = PhoneSequence(["p", "ɑ", SILENCE], [0.0, 0.1, 0.2, 0.3])
    second = PhoneSequence([SILENCE, "t", "i"], [0.0, 0.1, 0.2, 0.4])
    joined, words = concatenate_phones([first, second], [[WordSpan("pa", 0, 2)], [WordSpan("tea", 1, 3)]])
    assert joined.phones == ("p", "ɑ", SILENCE, "t", "i")
    assert joined.edges == pytest.approx([0.0, 0.1, 0.2, 0.4, 0.5, 0.7])
    assert [joined.phones[word.first : word.last] for word in words] == [("p", "ɑ"), ("t", "i")]


def test_joining_needs_parts_that_begin_at_zero() -> None:
    with pytest.raises(InputError, match=r"begins at 1\.0 s"):
        concatenate_phones([PhoneSequence(["p"], [1.0, 2.0])], [[]])


def test_a_word_needs_phones() -> None:
    with pytest.raises(InputError, match="range of phones"):
        WordSpan("word", 2, 2)


@given(st.lists(sequences(), min_size=1, max_size=5))
def test_joining_keeps_length_and_sounding_phones(parts: list[PhoneSequence]) -> None:
    joined, _ = concatenate_phones(parts, [[] for _ in parts])
    assert joined.end == pytest.approx(sum(part.end for part in parts))
    sounding = [phone for part in parts for phone in part.phones if phone != SILENCE]
    assert [phone for phone in joined.phones if phone != SILENCE] == sounding
