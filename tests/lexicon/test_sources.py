"""Written forms of spoken words."""

import pytest

from lexicon.locales.harmony import with_tail
from lexicon.marked_text import MarkedText
from lexicon.normalize import split_tokens, spoken_forms, written_pieces
from lexicon.sources import english_groups, sources_of, written_groups
from lexicon.spoken_words import pronounce_marked
from lexicon.written_forms import WrittenForm


@pytest.mark.parametrize(
    ("language", "text", "pieces"),
    [
        ("fr-fr", "Il a 1 234 567 € et 2 2 pommes.", "Il|a|1 234 567 €|et|2|2|pommes."),
        ("de", "Vom 3.-5. Mai, d. h. 10-15 km.", "Vom|3.-5. Mai,|d. h|10-15 km."),
        ("fr-fr", "L'1 et l'an 2000 !", "L'1|et|l'an|2000|!"),
        ("sv", "Det är 1 234 kr.", "Det|är|1|234|kr."),
        ("de", "Ohne Zahlen, ganz so.", "Ohne|Zahlen,|ganz|so."),
    ],
)
def test_pieces_are_those_of_the_text(language: str, text: str, pieces: str) -> None:
    assert "|".join(written + after for written, after in written_pieces(text, language)) == pieces


@pytest.mark.parametrize(
    ("text", "written"),
    [
        ('It costs "$3.50", 1,250 km away.', "It|costs|$3.50|1,250 km|away"),
        ("Open 6-8pm (THE WHO), x^2 & 10-15 km!", "Open|6-8pm|THE|WHO|x^2|&|10-15 km"),
        ("Dr. Lee's well-known 27\" TV — café №5.", "Dr|Lee's|well-known|27\"|TV|café|№5"),
        ("No numbers, at all.", "No|numbers|at|all"),
    ],
)
def test_english_words_are_those_of_the_text(text: str, written: str) -> None:
    words = [word.text for word in pronounce_marked(MarkedText(text)).words]
    groups = english_groups(words, list(split_tokens(text)), text)
    assert "|".join(group for group, _ in groups) == written
    assert [at for _, inside in groups for at in inside] == list(range(len(words)))


def test_words_that_are_not_those_of_the_english_text_stay_as_they_are() -> None:
    text = "Ich habe 5 km."
    groups = english_groups(["Ich", "habe", "5 km"], list(split_tokens(text)), text)
    assert [written for written, _ in groups] == ["Ich", "habe", "5 km"]


def test_words_of_another_text_have_no_written_forms() -> None:
    forms = spoken_forms("Es sind 5 km.", "de")
    assert sources_of(["Es", "sind", "sechs", "Kilometer"], forms) is None
    assert written_groups(["ganz", "anders"], forms) == [("ganz", range(1)), ("anders", range(1, 2))]
    assert sources_of([], []) is None


def test_forms_side_by_side_are_one_word() -> None:
    forms = [WrittenForm("a ", "a "), WrittenForm("10-", "ten to "), WrittenForm("15", "fifteen")]
    assert written_groups(["a", "ten", "to", "fifteen"], forms) == [("a", range(1)), ("10-15", range(1, 4))]


@pytest.mark.parametrize(
    ("said", "tail", "joined"),
    [("lira", "ye", "liraya"), ("kuruş", "dir", "kuruşdur"), ("dört", "te", "dörtte"), ("yirmi", "si", "yirmisi"),
     ("beş", "", "beş"), ("", "e", "e")],
)  # fmt: skip
def test_endings_follow_the_last_vowel(said: str, tail: str, joined: str) -> None:
    assert with_tail(said, tail) == joined


@pytest.mark.parametrize(
    ("text", "sources"),
    [
        ("It is 5 cm² wide.", ["It", "is", "5 cm²", "5 cm²", "5 cm²", "wide"]),
        ("Drink H₂O, and ½ cup.", ["Drink", "H₂O", "H₂O", "H₂O", "and", "½", "½", "cup"]),
        ("It’s №5 at 10 °C.", ["It’s", "№", "5", "at", "10 °C", "10 °C", "10 °C"]),
        ("x² costs €5", ["x", "²", "costs", "€5", "€5"]),
    ],
)
def test_english_sources_are_what_is_written(text: str, sources: list[str]) -> None:
    assert [word.source for word in pronounce_marked(MarkedText(text)).words] == sources
