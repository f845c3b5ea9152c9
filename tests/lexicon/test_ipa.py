"""IPA strings to phones."""

import pytest

from lexicon.errors import InputError
from lexicon.ipa import IpaPhone, parse_ipa
from lexicon.phones import PHONES


def _phones(text: str) -> str:
    return " ".join(segment.phone for segment in parse_ipa(text))


@pytest.mark.parametrize(
    ("written", "phones"),
    [
        ("həˈloʊ", "h ə l oʊ"),
        ("h_ə_l_ˈoʊ", "h ə l oʊ"),
        ("t͡ʃɜːt͡ʃ", "tʃ ɜ tʃ"),
        ("kætʃ", "k æ tʃ"),
        ("kæt.ʃu", "k æ t ʃ u"),
        ("t_ʃ", "t ʃ"),
        ("bɔ̃", "b ɔ̃"),
        ("pɐ̃ʊ̃", "p ɐ̃ʊ̃"),
        ("ˈç", "ç"),
        ("tʰaːp̚˥˩", "t a p"),
        ("ni2χˈɑu2", "n i χ ɑu"),
        ("go", "ɡ o"),
        ("ʧ", "tʃ"),
        ("ts̻", "ts"),
        ("", ""),
    ],
)
def test_symbols(written: str, phones: str) -> None:
    assert _phones(written) == phones


def test_stress_is_assigned_to_the_next_vowel() -> None:
    assert [(s.phone, s.stress) for s in parse_ipa("ˌstɹɔˈb_ɛɹi")] == [
        ("s", 0), ("t", 0), ("ɹ", 0), ("ɔ", 2), ("b", 0), ("ɛ", 1), ("ɹ", 0), ("i", 0),
    ]  # fmt: skip


def test_length_and_syllabic_marks() -> None:
    assert parse_ipa("ˈr̩ːk") == (IpaPhone("r", 1, is_long=True, is_syllabic=True), IpaPhone("k"))


def test_every_symbol_is_read_as_itself(subtests: pytest.Subtests) -> None:
    for symbol in (symbol for symbol, phone in PHONES.items() if phone.kind != "silence"):
        with subtests.test(symbol):
            assert _phones(symbol) == symbol


def test_an_unknown_letter_is_named() -> None:
    with pytest.raises(InputError, match=r"'Ж' \(CYRILLIC CAPITAL LETTER ZHE\) in 'aЖ' is not a phone"):
        parse_ipa("aЖ")
