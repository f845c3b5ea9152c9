"""How long sentences are with the silence in them, and where long ones are divided."""

import unicodedata
from bisect import bisect_left, bisect_right
from collections.abc import Iterator, Mapping, Sequence

from lexicon.chunks import middle_place, split_chunks, split_phrase
from lexicon.dictionary import word_key
from lexicon.errors import InputError
from lexicon.ipa import IpaPhone
from lexicon.marked_text import MarkedText, PauseMark, PhoneMark, StyleRun
from lexicon.normalize import spoken_form

MAX_SENTENCE_CHARACTERS = 300  # longer sentences are split at a clause mark or a space
# Letters of the spoken form; a sentence with more (of numbers, symbols, given phones) is divided. 65 s of English.
MAX_SPOKEN_LETTERS = 1000
LETTERS_PER_S = MAX_SPOKEN_LETTERS / 65.0
_DIGIT_LETTERS, _SYMBOL_LETTERS = 5, 10  # of the words that espeak-ng speaks for one in other languages than English
FIRST_PIECE_CHARACTERS = 90  # of a text; its first sound and picture wait for this piece (docs/decisions)
FIRST_SPOKEN_LETTERS = 270  # of this piece, which cannot be divided beside numbers otherwise; 18 s of English
MAX_SILENCE_S = 3600.0  # of the marked pauses of a text, besides the time of its words


def marked_silence_s(text: MarkedText) -> float:
    """Seconds of all marked pauses of a text."""
    return sum(mark.seconds for mark in text.marks if isinstance(mark, PauseMark))


def check_silence(text: MarkedText) -> None:
    """Refuse a text whose marked pauses last longer than its words and `MAX_SILENCE_S` besides.

    Raises
    ------
    InputError
        They do: a few characters would make hours of a clip.
    """
    silence_s = marked_silence_s(text)
    most_s = MAX_SILENCE_S + n_letters(text.text) / LETTERS_PER_S
    if silence_s > most_s:
        raise InputError(
            f"the pauses of the text last {silence_s:.0f} s together, more than {most_s:.0f} s (an hour, and the time "
            "of its words); shorten them, or divide the text"
        )


def n_letters(text: str) -> int:
    """Number of characters other than white space."""
    return len("".join(text.split()))


def pieces_of_text(
    placed: MarkedText, language: str, own: Mapping[str, tuple[IpaPhone, ...]]
) -> Iterator[tuple[str, bool]]:
    """Parts of a text that become sentences, and whether the written sentence continues after a part."""
    phones = [mark for mark in placed.marks if isinstance(mark, PhoneMark)]
    pauses = [mark for mark in placed.marks if isinstance(mark, PauseMark)]
    pause_places, run_places = [mark.at for mark in pauses], [run.start for run in placed.runs]
    starts, start = [mark.at for mark in phones], 0
    for number, chunk in enumerate(split_chunks(placed.text, MAX_SENTENCE_CHARACTERS, language)):
        first, rest = split_phrase(chunk, FIRST_PIECE_CHARACTERS) if number == 0 else (chunk, "")
        waiting = [rest, first] if rest else [first]
        while waiting:
            part = waiting.pop()
            end = start + n_letters(part)
            given = phones[bisect_left(starts, start) : bisect_left(starts, end)]
            inside = pauses[bisect_right(pause_places, start) : bisect_left(pause_places, end)]
            runs = overlapping_runs(placed.runs, run_places, start, end)
            n_spoken = _spoken_letters(part, language, given, own)
            silent = LETTERS_PER_S * sum(mark.seconds for mark in inside)
            is_long = n_spoken > (MAX_SPOKEN_LETTERS if start else FIRST_SPOKEN_LETTERS)
            is_slow = n_spoken * _slowness(runs, start, end) + silent > MAX_SPOKEN_LETTERS
            at = _dividing_place(part, start, given, () if is_long else inside) if is_long or is_slow else 0
            if at > 0:
                waiting += [part[at:], part[:at].rstrip()]
                continue
            start = end
            yield part, bool(waiting)


def _spoken_letters(
    chunk: str, language: str, given: Sequence[PhoneMark], own: Mapping[str, tuple[IpaPhone, ...]]
) -> int:
    """About the number of letters of the spoken form of a text, where each given phone is a letter."""
    text = spoken_form(chunk, language)
    n = len(text) + sum(len(mark.segments) for mark in given)
    if not language.startswith("en"):
        n += (_DIGIT_LETTERS - 1) * sum(map(str.isdigit, text))
        n += (_SYMBOL_LETTERS - 1) * sum(unicodedata.category(character)[0] == "S" for character in text)
    if own:
        n += sum(len(own.get(word_key(word.strip(".,;:!?")), ())) for word in text.split())
    return n


def _slowness(runs: Sequence[StyleRun], start: int, end: int) -> float:
    """Duration of the letters of a range of letters at the rates of its runs, in units of that at a rate of 1."""
    ends = [*(run.start for run in runs[1:]), end]
    lasting = sum((last - max(run.start, start)) / run.rate for run, last in zip(runs, ends, strict=True))
    return lasting / (end - start) if end > start else 1.0


def _dividing_place(chunk: str, start: int, given: Sequence[PhoneMark], pauses: Sequence[PauseMark]) -> int:
    """Index near the middle of a chunk that is not within a word with given phones; 0 if there is none.

    It is that of a pause if there are `pauses`.
    """
    places = [at for at, character in enumerate(chunk) if not character.isspace()]
    middle = start + bisect_left(places, middle_place(chunk))
    at = min((mark.at for mark in pauses), key=lambda place: abs(place - middle), default=middle)
    # a word with given phones stays whole
    at = next((mark.at if mark.at > start else mark.end for mark in given if mark.at < at < mark.end), at)
    return places[at - start] if start < at < start + len(places) else 0


def overlapping_runs(runs: tuple[StyleRun, ...], starts: list[int], start: int, end: int) -> tuple[StyleRun, ...]:
    """Runs that cover letters of a range; `starts` are those of all runs."""
    return runs[bisect_right(starts, start) - 1 : bisect_right(starts, end - 1)]
