"""Visible targets of every phone of the table."""

from dataclasses import astuple

import pytest

from lexicon.articulation import visible_targets
from lexicon.errors import InputError
from lexicon.phones import PHONES


def test_targets_follow_from_the_features_of_the_phone(subtests: pytest.Subtests) -> None:
    for label, phone in PHONES.items():
        with subtests.test(label):
            for target in visible_targets(label):
                assert all(value is None or 0 <= value <= 1 for value in astuple(target))
                assert (target.rounding is None) == (target.spreading is None)
                assert not (target.rounding or 0) * (target.spreading or 0)  # never both
                assert bool(target.lip_contact) == (phone.place == "bilabial")
                if not phone.is_vowel:
                    assert not target.opening
                    assert bool(target.rounding) == (bool(phone.rounding) and phone.place != "bilabial")
                if phone.kind == "silence":
                    assert not any(astuple(target))


def test_classes_hold_in_every_language() -> None:
    first = {label: visible_targets(label)[0] for label in PHONES}
    rounded = {"u", "y", "ʏ", "ʊ", "w", "ɥ", "ʍ", "ʃ", "ʒ", "ʂ", "tʃ", "dʒ", "ø", "o", "ũ"}
    assert all(first[label].rounding > 0.6 for label in rounded)
    assert all(first[label].spreading > 0 for label in ("i", "ɪ", "e", "ĩ", "s", "z", "ɕ", "ts", "j"))
    assert all(first[label].opening > 0.7 for label in ("a", "ɑ", "æ", "ã", "ɐ"))
    assert all(first[label].incisor_contact == 1 for label in ("f", "v", "ɱ", "pf"))
    assert all(first[label].tongue_out == 1 for label in ("θ", "ð"))
    assert all(first[label].tongue_up > 0 for label in ("l", "n", "t", "d", "ɾ", "ʈ", "ɳ", "r"))
    assert all(first[label].rounding is None for label in ("p", "b", "m", "t", "k", "h", "θ"))
    assert first["u"].rounding > first["ɔ"].rounding > first["ɒ"].rounding


def test_the_halves_of_a_diphthong_differ() -> None:
    first, last = visible_targets("aɪ")
    assert (first.opening, last.opening) == (1.0, 0.0)
    assert last.spreading > first.spreading == 0
    assert visible_targets("u")[0] == visible_targets("u")[1]


def test_an_unknown_label_is_refused() -> None:
    with pytest.raises(InputError, match="did you mean"):
        visible_targets("AH")
