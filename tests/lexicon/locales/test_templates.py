"""Rows of tables that state a pattern and a template of their own."""

import re

import pytest

from lexicon.locales.place import amount_pattern
from lexicon.locales.tables import find_locale
from lexicon.locales.templates import template_forms
from lexicon.normalize import spoken_form

LANGUAGES = ("ar", "hi", "cmn", "ja", "ko", "vi")
READERS = frozenset({"number", "digits", "cardinal", "ordinal", "year"})
PIECES = (
    "1",
    "1,",
    "12:30",
    "2024-",
    "1/",
    "5%",
    "5~",
    "-5℃ ",
    "010-1234-5678 ",
    "1st",
    "个2",
    "ال1",
    "TP. ",
    "は1",
    "3시",
)


@pytest.mark.parametrize("language", LANGUAGES)
def test_fields_are_groups_and_are_read_by_something(language: str) -> None:
    locale = find_locale(language)
    assert locale is not None
    assert locale.rows("form")
    for written, row in locale.rows("form").items():
        pattern = re.compile(written.replace("#", amount_pattern(locale)))
        fields = re.findall(r"\{([a-z]+):([a-z_]+)[a-z ]*\}", row.spoken)
        assert row.spoken.count("{") == len(fields), written
        for group, reader in fields:
            assert group in pattern.groupindex, written
            assert reader in READERS or locale.rows(reader) or f"{reader}" in locale.rows("rule"), reader
        assert not re.search(r"[0-9]", row.spoken), written


@pytest.mark.parametrize("language", LANGUAGES)
def test_forms_at_a_place_begin_there(language: str) -> None:
    locale = find_locale(language)
    assert locale is not None
    for places, pattern, _ in template_forms(locale):
        for place in places:
            assert re.match(rf"(?:\(\?[<=!:][^)]*\))*[\[(]?{re.escape(place[0])}|\[", pattern), pattern


@pytest.mark.parametrize("language", LANGUAGES)
def test_long_repetitions_are_read_at_once(language: str) -> None:
    for piece in PIECES:  # minutes where a pattern tries each place to the end of the text
        spoken = spoken_form(piece * (3000 // len(piece)), language)
        assert not re.search(r"[0-9]", spoken)
