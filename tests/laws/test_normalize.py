"""Normalisation never fails and changes its own output no more, also for long and monotonous texts."""

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from lexicon.normalize import MARKS, normalize

FORMS = st.sampled_from(
    [
        "Dr.",
        "St.",
        "Main",
        "No.",
        "5",
        "12:30",
        "$3.50",
        "50%",
        "e.g.",
        "etc.",
        "U.S.",
        "1/2",
        "-7",
        "3-4",
        "mp3",
        "a@b.com",
        "#Tag",
        "www.x.org",
        "VIII",
        "Henry",
        "'em",
        "it's",
        "(",
        ")",
        "“",
        "…",
        "—",
        "–",
        "-",
        "/",
        "&",
        "½",
        "²",
        "😀",
        "👍🏽",
        "1990s",
        "km",
        "5",
        "m²",
        "March",
        "3,",
        "2024",
        ".",
        ",",
        "!",
        "?",
        ":",
        ";",
        "\n",
        "\n\n",
        "\u200b",
        "́",
        "™",
        "I.",
        "A.B",
        "p.m.",
        "007",
        "1,000",
        "10^",
        "^2",
        "٣",
        "π",
        "漢",
        "ß",
        "ﬁ",
    ]
)
TEXTS = st.one_of(st.text(), st.lists(FORMS, max_size=12).map("".join), st.lists(FORMS, max_size=12).map(" ".join))


@given(TEXTS)
@example("Dr .")
@example("St™.")
@example("St).")
@example('E.g."I."A')
@example("5\u0301 km")
@example("\ud800")
@example("#\u0370")
@example("A.\u0370")
@example("I.I")
def test_normalising_twice_is_normalising_once(text: str) -> None:
    once = normalize(text)
    assert normalize(once) == once


@given(TEXTS)
def test_all_digits_and_symbols_are_replaced(text: str) -> None:
    spoken = normalize(text)
    assert not any(character.isdigit() and character.isascii() for character in spoken)
    assert not set(spoken) & set('$£€%&@#*_()[]{}<>"/\\+=~^|\n\t')
    assert "  " not in spoken
    assert not spoken[:1] or spoken[0] not in MARKS


@given(st.text(), st.sampled_from(["de", "fr-fr", "hi", "ja", "ar"]))
def test_other_languages_never_fail(text: str, language: str) -> None:
    once = normalize(text, language)
    assert normalize(once, language) == once


@pytest.mark.parametrize(
    "piece",
    [
        "It cost $5.20 on March 3, 2024 (e.g. 10:30 pm). ",
        "a.",
        "1",
        "1,",
        "a@",
        "-",
        "'",
        "x ",
        "....",
        "w.",
        "Dr ",
        "\u0301",
        "V",
    ],
)
def test_long_repetitions_are_done_at_once(piece: str) -> None:
    once = normalize(piece * (30_000 // len(piece)))  # minutes where a pattern tries each place to the end of the text
    assert normalize(once) == once
