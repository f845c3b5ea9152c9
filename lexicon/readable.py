"""Whether every word of a marked text can be read in the language of its span."""

from lexicon.g2p import check_language
from lexicon.marked_text import MarkedText, PhoneMark
from lexicon.writing_systems import check_script


def check_readable(text: MarkedText, language: str) -> None:
    """Refuse words that the language of their span cannot read; words with given phones need no reading.

    Raises
    ------
    InputError
        There is such a word, or no such language.
    BackendError
        It is Japanese with Chinese characters, and the library that reads them is not installed.
    """
    read = _without_given(text)
    ends = [*(run.start for run in text.runs[1:]), len(read)]
    if all(run.language is None for run in text.runs):
        check_script(read, language)
        return
    for run, end in zip(text.runs, ends, strict=True):
        spoken = run.language or language
        check_language(spoken)
        check_script(read[run.start : end], spoken)


def _without_given(text: MarkedText) -> str:
    pieces, behind = [], 0
    for mark in text.marks:
        if isinstance(mark, PhoneMark):
            pieces += [text.text[behind : mark.at], " " * (mark.end - mark.at)]
            behind = mark.end
    return "".join([*pieces, text.text[behind:]])
