"""Sentences of each language with a table, written down with their reading before anything was run."""

import re
from pathlib import Path

import pytest

from lexicon.normalize import spoken_form

TABLES = sorted(Path(__file__).parent.glob("*.tsv"))
_WORD = re.compile(r"[^\W_]+(?:['’][^\W_]+)*")


def _rows() -> list[tuple[str, str, str]]:
    found = []
    for path in TABLES:
        for line in path.read_text(encoding="utf-8").splitlines()[1:]:
            _, text, spoken, guide = line.split("\t")
            assert guide
            found.append((path.stem, text, spoken))
    return found


def _words(text: str) -> list[str]:
    return _WORD.findall(text.casefold())


@pytest.mark.parametrize(("language", "text", "spoken"), _rows())
def test_a_sentence_is_read_as_its_grammar_says(language: str, text: str, spoken: str) -> None:
    said = spoken_form(text, language)
    assert _words(said) == _words(spoken)
    assert spoken_form(said, language) == said
