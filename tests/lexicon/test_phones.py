"""The phone table, ARPABET, articulatory distance and replacements."""

import itertools

import pytest

from lexicon.errors import DataError, InputError
from lexicon.phones import (
    ARPABET,
    PHONES,
    arpabet_to_ipa,
    ipa_to_arpabet,
    look_up_phone,
    nearest_phones,
    phone_distance,
    read_phones,
    vowel_symbols,
)
from lexicon.sequence import SILENCE

CMU = [
    "AA", "AE", "AH", "AO", "AW", "AY", "B", "CH", "D", "DH", "EH", "ER", "EY", "F", "G", "HH", "IH", "IY", "JH", "K",
    "L", "M", "N", "NG", "OW", "OY", "P", "R", "S", "SH", "T", "TH", "UH", "UW", "V", "W", "Y", "Z", "ZH",
]  # fmt: skip
HEADER = (
    "symbol\tarpabet\tkind\tplace\tmanner\tvoicing\theight\tbackness\trounding\tnasality\tparts\taliases\texample\n"
)


@pytest.mark.parametrize("name", CMU)
def test_arpabet_is_converted_to_ipa_and_back(name: str) -> None:
    assert ipa_to_arpabet(arpabet_to_ipa(name)) == name
    if look_up_phone(arpabet_to_ipa(name)).is_vowel:
        for stress in (1, 2):
            assert ipa_to_arpabet(arpabet_to_ipa(f"{name}{stress}"), stress) == f"{name}{stress}"


def test_there_are_39_names_and_two_reduced_vowels() -> None:
    assert set(ARPABET) == {*CMU, "AH0", "ER0"}
    assert (arpabet_to_ipa("AH0"), arpabet_to_ipa("AH1"), arpabet_to_ipa("ER0")) == ("ə", "ʌ", "ɚ")
    assert ipa_to_arpabet("ə", 0) == "AH0"


@pytest.mark.parametrize("name", ["XX", "P1", "AH3", ""])
def test_an_unknown_arpabet_name_is_refused(name: str) -> None:
    with pytest.raises(InputError, match=f"{name!r} is not an ARPABET name"):
        arpabet_to_ipa(name)


def test_unknown_labels_are_named() -> None:
    with pytest.raises(InputError, match="'Q' is not a phone of the table"):
        look_up_phone("Q")
    with pytest.raises(InputError, match=r"'AA' is not a phone.*did you mean ɑ"):
        phone_distance("p", "AA")
    with pytest.raises(InputError, match="ARPABET has no name for y"):
        ipa_to_arpabet("y")
    with pytest.raises(InputError, match="stress must be 0, 1 or 2, not 3"):
        ipa_to_arpabet("i", 3)


def test_silence_is_the_label_of_phone_sequences() -> None:
    assert look_up_phone(SILENCE).kind == "silence"
    assert SILENCE not in vowel_symbols()


def test_every_phone_has_the_features_of_its_kind() -> None:
    for phone in PHONES.values():
        if phone.kind == "vowel":
            assert phone.height, phone.symbol
            assert phone.backness, phone.symbol
            assert phone.rounding, phone.symbol
        elif phone.kind in {"diphthong", "affricate"}:
            assert len(phone.parts) == 2, phone.symbol
        elif phone.kind != "silence":
            assert phone.place, phone.symbol
            assert phone.manner, phone.symbol


def test_distance_is_symmetric_and_keeps_the_triangle_inequality() -> None:
    some = list(PHONES)[::5]
    for a, b in itertools.combinations(some, 2):
        assert phone_distance(a, b) == phone_distance(b, a)
        assert phone_distance(a, a) == 0
    for a, b, c in itertools.permutations(some[::3], 3):
        assert phone_distance(a, c) <= phone_distance(a, b) + phone_distance(b, c) + 1e-12


def _order(label: str, others: str) -> list[str]:
    return sorted(others.split(), key=lambda other: phone_distance(label, other))


@pytest.mark.parametrize(
    ("label", "nearest_first"),
    [
        ("v", "f b p"),  # the same lips count more than the same voice
        ("p", "b m f s"),
        ("m", "b f n"),
        ("y", "u i ɑ"),  # rounding is seen, backness is not
        ("ø", "o e ɑ"),
        ("ɯ", "i u"),
        ("w", "u ʌ"),
        ("θ", "ð s k"),
        ("ʃ", "tʃ s k"),
        ("ɑ", "a ʌ ɔ u"),
        ("ɛ̃", "ɛ i"),
        ("ʁ", "x p"),
        ("ɲ", "n m"),
    ],
)
def test_visually_similar_phones_are_near(label: str, nearest_first: str) -> None:
    assert _order(label, " ".join(reversed(nearest_first.split()))) == nearest_first.split()


@pytest.mark.parametrize(
    ("label", "available", "answer"),
    [
        ("p", "p b", ("p",)),
        ("v", "f b d", ("f",)),
        ("aɪ", "ɑ ɪ t", ("ɑ", "ɪ")),
        ("tʃ", "t ʃ i", ("t", "ʃ")),
        ("ts", "t s ʃ", ("t", "s")),
        ("əʊ", "oʊ ɑ i", ("oʊ",)),
        ("aɪ", "t", ("t",)),
        (SILENCE, "p sil", ("sil",)),
        ("əʊ", "ə ʊ oʊ", ("ə", "ʊ")),
        ("p", "sil k", ("k",)),
    ],
)
def test_stand_ins(label: str, available: str, answer: tuple[str, ...]) -> None:
    assert nearest_phones(label, frozenset(available.split())) == answer


def test_nothing_available_is_refused() -> None:
    with pytest.raises(InputError, match="no phone can replace p"):
        nearest_phones("p", {SILENCE})


@pytest.mark.parametrize(
    ("lines", "reason"),
    [
        ("p\tP\tstop\n", "line 2: 3 cells instead of 13"),
        ("p\tP\tplop\tbilabial\tplosive\tvoiceless\t\t\t\t\t\t\tpea\n", "line 2: p has the value 'plop'; use one of"),
        ("p\tP\tstop\tbilabial\tplosive\tvoiceless\t\t\t\t\t\t\tpea\n" * 2, "line 3: p occurs twice"),
        ("pf\t\taffricate\tlabiodental\taffricate\tvoiceless\t\t\t\t\tp f\t\tPferd\n", "pf has the part p"),
    ],
)
def test_wrong_tables_are_refused(lines: str, reason: str) -> None:
    with pytest.raises(DataError, match=reason):
        read_phones(HEADER + lines)
