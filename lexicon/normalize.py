"""Spoken form of a text, the input of a voice: English numbers, dates, money, units and symbols become words.

One scan from left to right: each written form has a pattern and a reader. The result consists of words, with
apostrophes and hyphens inside them, and sentence punctuation; normalisation is idempotent and linear in time.
"""

import functools
import re
from collections.abc import Iterator
from dataclasses import replace

from lexicon import form_readers as forms
from lexicon.canonical import canonical_text, signs_before_vowels
from lexicon.capitals import sentence_case
from lexicon.form_table import form_table
from lexicon.japanese import numbers_in_kana
from lexicon.kept_signs import keep_signs, written_signs
from lexicon.number_words import MAX_CARDINAL_DIGITS
from lexicon.pauses import MARKS, last_mark
from lexicon.scripts import name_foreign_letters, name_letters_in_words
from lexicon.sources import with_written_sources, written_groups
from lexicon.vowels import add_vowels
from lexicon.written_forms import WrittenForm
from lexicon.written_words import spaced_words

_SINGLE_LETTER = re.compile(r"(?<![^\W\d_])[^\W\d_](?![^\W\d_])")
MAX_LETTERS = 100  # of a word: espeak-ng omits what follows the first 160; the longest in use have 85
# espeak-ng reads aujourd’hui in English, and 12 345 with a narrow space as two numbers
_AS_ESPEAK_READS = str.maketrans({"’": "'", "ʼ": "'", "\u00a0": " ", "\u202f": " ", "\u2009": " "})
_WORD = re.compile(r"\s*\S+\s*")
_NEEDED_SIGNS = {"#": frozenset("0123456789"), "/": frozenset("/@+∖")}
_LONG_NUMBER = re.compile(rf"[0-9]{{{MAX_CARDINAL_DIGITS + 1},}}")


@functools.cache
def _scanner(start: str, lacking: str) -> re.Pattern[str]:
    """Pattern of the forms that begin with a letter (a), a digit (0) or another sign (.); few texts have all three.

    Parameters
    ----------
    lacking
        Signs that the text lacks (#: digits, /: those of addresses), without which some forms cannot be.
    """
    rows = (
        f"(?P<f_{name}>{pattern})"
        for name, starts, pattern, _ in form_table()
        if start in starts and not any(sign in starts for sign in lacking)
    )
    return re.compile("|".join(rows))


@functools.cache
def _readers() -> dict[str, forms.Reader]:
    """Readers by the group of a form."""
    return {f"f_{name}": reader for name, _, _, reader in form_table()}


def _find_forms(text: str) -> Iterator[tuple[re.Match[str], forms.Reader]]:
    """Written forms one after another, with their readers; every character belongs to one."""
    readers = _readers()
    lacking = "".join(sign for sign, signs in _NEEDED_SIGNS.items() if signs.isdisjoint(text))
    at = 0
    while at < len(text):
        sign = text[at]
        start = "0" if sign in "0123456789" else "a" if sign.isalnum() else "."
        match = _scanner(start, lacking).match(text, at)
        if match is None:  # the last form of each pattern is any character
            raise AssertionError(f"no form begins with {sign!r}")
        yield match, readers[match.lastgroup or ""]
        at = match.end()


def split_tokens(text: str) -> Iterator[WrittenForm]:
    """Written forms of an English text in order, with their words; the text between them is white space."""
    return with_written_sources(_tokens(text), text)


def _tokens(text: str) -> Iterator[WrittenForm]:
    previous = ""
    for match, read in _find_forms(name_letters_in_words(sentence_case(canonical_text(keep_signs(text))))):
        spoken = _name_letters(read(match, previous))
        if spoken:
            yield WrittenForm(written_signs(match.group()), spoken)
            previous = spoken[-1] if spoken[-1] in MARKS else spoken.rpartition(" ")[2]


def _name_letters(spoken: str) -> str:
    """Words of a form, with the names of foreign letters that became single ones (#Ͱ, A.Ͱ)."""
    if spoken.isascii():
        return spoken
    return _SINGLE_LETTER.sub(lambda letter: forms.read_letter(letter, ""), name_letters_in_words(spoken))


def join_words(words: list[str]) -> str:
    """Join words with single spaces and marks after their word; of adjacent marks the strongest is kept."""
    pieces: list[str] = []
    for piece in words:
        if piece not in MARKS:
            pieces += [" ", piece] if pieces else [piece]
        elif pieces and pieces[-1][-1] in MARKS:
            pieces[-1] = pieces[-1][:-1] + max(pieces[-1][-1], piece, key=",;:.!?".find)
        elif pieces:
            pieces.append(piece)
    return "".join(pieces).rstrip(" ,;:")


def normalize(text: str, language: str = "en-us") -> str:
    """Normalise an English text to words, and a text of another language to canonical characters.

    Numbers in other languages are read by espeak-ng.
    """
    if not language.startswith("en"):
        return canonical_text(text, keep_marks=True)
    return join_words([token.spoken for token in split_tokens(text)])


def spoken_forms(text: str, language: str) -> list[WrittenForm]:
    """Parts of a text that is not English, with their spoken forms, which a voice of the language reads.

    Numbers, dates, abbreviations and signs of a language with a table (`lexicon.locales`) become words. Single letters
    of other writing systems are replaced by their names; a word of more than 100 letters is divided, as are the digits
    of a longer number than English names.
    """
    from lexicon.locales.reading import read_forms  # with its patterns, of which English needs none

    forms = read_forms(text, language)
    if language == "ja":
        forms = [form if form.source == form.spoken else _in_kana(form) for form in forms]
    return [part for form in forms for part in _readable_parts(form, language)]


def _in_kana(form: WrittenForm) -> WrittenForm:
    return replace(form, spoken=numbers_in_kana(form.spoken))


def _readable_parts(form: WrittenForm, language: str) -> Iterator[WrittenForm]:
    """A form in letters that the language reads; of words that differ from what is written each is one for itself."""
    spoken = _readable(form.spoken, language)
    if spoken == form.spoken or len(form.source) != len(form.spoken):
        yield replace(form, spoken=spoken)
        return
    for word in _WORD.finditer(form.spoken):
        yield WrittenForm(form.source[slice(*word.span())], _readable(word.group(), language))


def _readable(spoken: str, language: str) -> str:
    text = name_foreign_letters(spoken.translate(_AS_ESPEAK_READS), language)
    text = _LONG_NUMBER.sub(lambda number: " ".join(number.group()), text)
    return _with_parted_words(text)


@functools.cache
def _long_word() -> re.Pattern[str]:
    """The first letters of a long word; from U+0900 on, scripts without spaces between words begin."""
    return re.compile(rf"[^\W\d_\u0900-\U0010ffff]{{{MAX_LETTERS}}}(?=[^\W\d_\u0900-\U0010ffff])")


def _with_parted_words(text: str) -> str:
    """A text with spaces in words of more than `MAX_LETTERS` letters."""
    if all(len(word) <= MAX_LETTERS for word in text.split()):
        return text
    return _long_word().sub(r"\g<0> ", text)


def written_pieces(text: str, language: str) -> list[tuple[str, str]]:
    """Words of a text that is not English as they are written (3,50 €), and the punctuation after each."""
    forms = spoken_forms(text, language)
    pieces = spaced_words("".join(form.spoken for form in forms), language)
    found: list[tuple[str, str]] = []
    for written, at in written_groups(pieces, forms):
        last = pieces[at.stop - 1]
        found.append((written, "" if written == last else last_mark(last)))
    return found


def spoken_form(text: str, language: str) -> str:
    """Spoken form of a text: English is normalised; of other languages see `spoken_forms`.

    Arabic and Hebrew get vowels where a model of them is installed.
    """
    if language.startswith("en"):
        return _with_parted_words(normalize(text))
    text = "".join(form.spoken for form in spoken_forms(text, language))
    return signs_before_vowels(add_vowels(text, language))
