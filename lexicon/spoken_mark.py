"""Words before a text that say that its voice is synthetic."""

from collections.abc import Mapping
from dataclasses import replace
from functools import cache

from lexicon.errors import InputError
from lexicon.marked_text import MarkedText, PhoneMark, StyleRun
from lexicon.written_forms import read_table

AUTO = "auto"
END = "\n\n"  # of a paragraph, behind which a voice pauses


@cache
def sentences() -> Mapping[str, str]:
    """Sentence of each language that has one, by the first part of its code."""
    return {code: row[0] for code, row in read_table("spoken_marks.tsv").items()}


def mark_words(spoken_mark: str, language: str) -> str:
    """Words of a mark: those that are given, or the sentence of a language.

    Raises
    ------
    InputError
        The words are empty, or the language has no sentence.
    """
    if not spoken_mark.strip():
        raise InputError("--spoken-mark is empty; give its words, or auto, or remove it")
    if spoken_mark != AUTO:
        return spoken_mark.strip()
    known = sentences()
    code = language.partition("-")[0].lower()
    if code not in known:
        raise InputError(f"--spoken-mark auto has no sentence in {language}; give your own words")
    return known[code]


def with_spoken_mark(text: MarkedText, spoken_mark: str, language: str) -> MarkedText:
    """A text behind the words of a mark, which are spoken as the request says, without marks of their own.

    Raises
    ------
    InputError
        As `mark_words`.
    """
    head = mark_words(spoken_mark, text.language or language) + END
    shift = len(head)
    runs = (StyleRun(0), *(replace(run, start=run.start + shift) for run in text.runs))
    marks = tuple(
        replace(mark, at=mark.at + shift, end=mark.end + shift)
        if isinstance(mark, PhoneMark)
        else replace(mark, at=mark.at + shift)
        for mark in text.marks
    )
    return replace(text, text=head + text.text, runs=runs, marks=marks)
