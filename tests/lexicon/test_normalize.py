"""Written English in words: a table of cases to read, and what other languages keep."""

import csv
from pathlib import Path

import pytest

import lexicon.normalize
from lexicon.normalize import normalize, split_tokens

TABLE = Path(__file__).with_name("normalization.tsv")
CLASSES = csv.DictReader(
    TABLE.with_name("written_classes.tsv").read_text(encoding="utf-8").splitlines(), delimiter="\t", quoting=3
)
CASES = [line.split("\t") for line in TABLE.read_text(encoding="utf-8").splitlines()[1:]]


def test_written_forms_are_normalised(subtests: pytest.Subtests) -> None:
    for written, spoken in CASES:
        with subtests.test(written):
            assert normalize(written.replace("\\n", "\n")) == spoken


def test_forms_that_a_text_cannot_have_are_none_of_it(monkeypatch: pytest.MonkeyPatch) -> None:
    texts = [written for written, _ in CASES] + [row["text"] for row in CLASSES]
    found = [[*split_tokens(text)] for text in texts]
    monkeypatch.setattr(lexicon.normalize, "_NEEDED_SIGNS", {})
    assert found == [[*split_tokens(text)] for text in texts]


def test_the_table_is_large() -> None:
    assert len(CASES) >= 120


def test_a_token_keeps_its_written_form() -> None:
    assert [(t.source, t.spoken) for t in split_tokens("It cost $5.")] == [
        ("It", "It"), ("cost", "cost"), ("$5", "five dollars"), (".", "."),
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("written", "kept", "language"),
    [
        ("Das kostet 25 €.", "Das kostet 25 €.", "de"),
        ("हिन्दी।", "हिन्दी.", "hi"),
        ("«Bonjour»…", "Bonjour.", "fr-fr"),
        ("你好，世界。", "你好, 世界.", "cmn"),
    ],
)
def test_other_languages_keep_their_numbers_and_marks(written: str, kept: str, language: str) -> None:
    assert normalize(written, language) == kept


def test_a_megabyte_is_normalised() -> None:
    sentence = "We met Dr. Smith on March 3, 2024; it cost $5.20. "
    spoken = normalize(sentence * (1_000_000 // len(sentence)))
    assert spoken.startswith(
        "We met Doctor Smith on March third, twenty twenty-four; it cost five dollars and twenty cents. We"
    )
    assert spoken.count("twenty twenty-four") == 1_000_000 // len(sentence)
