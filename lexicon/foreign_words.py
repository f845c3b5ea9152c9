"""Words within a text that its language does not read: each is spoken in a language of its writing system, or spelled.

A text in one language names words of another one ("The word 你好 means hello."). Such words become runs of the language
that most people write in these letters; letters that no language of espeak-ng reads are spoken by their names.
"""

import re
import unicodedata
from bisect import bisect_right
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from lexicon.g2p import languages
from lexicon.japanese import has_kanji, has_reader
from lexicon.marked_text import Mark, MarkedText, PhoneMark, StyleRun
from lexicon.scripts import SCRIPTS, blank_given_words, foreign_runs, letter_name, letter_script, run_name, script_name
from lexicon.text_language import guess_language
from lexicon.vowels import vowel_note
from lexicon.written_forms import read_table

_KANJI = re.compile(r"[^\W\d_\u3040-\u30ff]+|[\u3040-\u30ff]+")  # Chinese characters, or kana


@dataclass(frozen=True, slots=True)
class ForeignWords:
    """Words of a text that are not spoken in its language.

    Parameters
    ----------
    start, end
        Half-open range of characters.
    language
        In which they are spoken; empty: their letters are spelled by name.
    script
        Name of their writing system.
    """

    start: int
    end: int
    language: str
    script: str

    @property
    def note(self) -> str:
        """How they are spoken."""
        return f"{self.script} words are " + (f"spoken in {self.language}" if self.language else "spelled")


def make_readable(text: MarkedText, language: str) -> tuple[MarkedText, tuple[str, ...]]:
    """A text of which each run can be read in its language, and what is done with words of other writing systems.

    Single letters with a name (π, Ж), units, and words with given phones stay as they are. Linear in the length of the
    text.
    """
    if text.text.isascii():
        return text, ()
    unread = blank_given_words(text)
    found = list[ForeignWords]()
    runs = list[StyleRun]()
    ends = [*(run.start for run in text.runs[1:]), len(unread)]
    for run, end in zip(text.runs, ends, strict=True):
        runs.append(run)
        for words in _foreign_words(unread, (run.start, end), run.language or language):
            found.append(words)
            if words.language:
                runs.append(replace(run, start=words.start, language=words.language))
                runs.append(replace(run, start=words.end))
    kept = [run for run, after in zip(runs, [*runs[1:], None], strict=True) if after is None or run.start < after.start]
    notes = [*(word.note for word in found), vowel_note(text.text, language)]
    return _rewritten(replace(text, runs=tuple(kept)), found), tuple(dict.fromkeys(note for note in notes if note))


def _foreign_words(text: str, span: tuple[int, int], language: str) -> Iterator[ForeignWords]:
    """Words of a span that a language does not read.

    Those of one writing system with only signs and digits between them are one, in which single letters are words too.
    """
    first, last = span
    group: list[tuple[int, int]] = []
    for start, end in ((first + a, first + b) for a, b in foreign_runs(text[first:last], language)):
        if group and all(unicodedata.category(mark)[0] == "M" for mark in text[group[-1][1] : start]):
            group[-1] = (group[-1][0], end)  # marks that distinguish no words are dropped when the text is read
            continue
        if group and not _is_joined(text, group[-1], (start, end)):
            yield from _of_group(text, group)
            group = []
        group.append((start, end))
    yield from _of_group(text, group)


def _is_joined(text: str, before: tuple[int, int], after: tuple[int, int]) -> bool:
    """Whether two runs are of one writing system, without a letter between them."""
    scripts = [_script_of(text[slice(*run)]) for run in (before, after)]
    is_one = scripts[0] == scripts[1] or set(scripts) <= SCRIPTS["ja"]
    return is_one and not any(letter.isalpha() for letter in text[before[1] : after[0]])


def _script_of(run: str) -> str:
    """Writing system of the first letter of a run, which may be written as a sign (㌔ is キロ)."""
    letters = unicodedata.normalize("NFKC", run)
    return letter_script(next((letter for letter in letters if letter.isalpha()), letters[0]))


def _of_group(text: str, group: Sequence[tuple[int, int]]) -> Iterator[ForeignWords]:
    if not all(_is_read(text[start:end]) for start, end in group):
        yield from _divided(text, group[0][0], group[-1][1])


def _is_read(run: str) -> bool:
    """Whether every language reads a run: a letter with a name, or a unit."""
    return bool(run_name(run)) or unicodedata.normalize("NFKC", run) in read_table("units.tsv")


def _divided(text: str, start: int, end: int) -> Iterator[ForeignWords]:
    """Foreign words with their language, by parts where no language reads all of them."""
    words = text[start:end]
    script, spoken = script_name(_script_of(words)), guess_language(unicodedata.normalize("NFKC", words), "")
    if spoken == "ja" and has_kanji(words) and not has_reader():
        starts = [part.start() for part in _KANJI.finditer(words)]
        parts = list(zip(starts, [*starts[1:], len(words)], strict=True))
    elif spoken in languages() and not any(True for _ in foreign_runs(words, spoken)):
        yield ForeignWords(start, end, spoken, script)
        return
    else:
        parts = list(_scripts(words))
    if len(parts) == 1:
        yield ForeignWords(start, end, "", script)
        return
    for first, last in parts:
        yield from _divided(text, start + first, start + last)


def _scripts(words: str) -> Iterator[tuple[int, int]]:
    """Longest parts of letters of one writing system, with what follows each."""
    start, before = 0, ""
    for at, letter in enumerate(words):
        script = letter_script(letter) if letter.isalpha() else before
        if before and script != before:
            yield start, at
            start = at
        before = script
    yield start, len(words)


def _rewritten(text: MarkedText, words: Sequence[ForeignWords]) -> MarkedText:
    """A text with some words as they are spoken, and its marks where they belong then.

    Words that no language reads are the names of their letters; signs that stand for letters (㌔) are these letters.
    """
    pieces = list[str]()
    at = 0
    ends = [0]
    shifts = [0]
    for word in words:
        written = text.text[word.start : word.end]
        if word.language and not any(map(_is_sign, written)):
            continue
        spoken = unicodedata.normalize("NFKC", written) if word.language else letter_names(written)
        before, after = text.text[word.start - 1 : word.start], text.text[word.end : word.end + 1]
        spoken = " " * before.isalnum() + spoken + " " * after.isalnum()
        pieces += [text.text[at : word.start], spoken]
        at = word.end
        ends.append(word.end)
        shifts.append(shifts[-1] + len(spoken) - (word.end - word.start))
    if at == 0:
        return text

    def moved(position: int) -> int:
        return position + shifts[bisect_right(ends, position) - 1]

    def moved_mark(mark: Mark) -> Mark:
        if isinstance(mark, PhoneMark):
            return replace(mark, at=moved(mark.at), end=moved(mark.end))
        return replace(mark, at=moved(mark.at))

    runs = tuple(replace(run, start=moved(run.start)) for run in text.runs)
    marks = tuple(moved_mark(mark) for mark in text.marks)
    return replace(text, text="".join([*pieces, text.text[at:]]), runs=runs, marks=marks)


def _is_sign(character: str) -> bool:
    """Whether a character is no letter and stands for some."""
    is_letter = unicodedata.category(character)[0] in "LM"
    return not is_letter and any(map(str.isalpha, unicodedata.normalize("NFKC", character)))


def letter_names(word: str) -> str:
    """Names of the letters of a word; of letters without a name the one of their writing system, once."""
    names: list[str] = []
    for letter in unicodedata.normalize("NFKC", word):
        name = letter_name(letter) if letter.isalpha() else ""
        if letter.isalpha() and not name:
            name = f"{script_name(letter_script(letter))} sign".lower()
            if names and names[-1] == name:
                continue
        if name:
            names.append(name)
    return " ".join(names)
