"""Reading a text takes time in proportion to its length, whatever it repeats."""

import time
from collections.abc import Callable
from contextlib import suppress

import pytest

from lexicon.chunks import split_chunks, split_phrase
from lexicon.dictionary import parse_dictionary, word_set
from lexicon.errors import DataError, InputError
from lexicon.growing_text import GrowingText
from lexicon.ipa import parse_ipa
from lexicon.normalize import normalize
from lexicon.pronounce import pronounce
from lexicon.scripts import check_script
from lexicon.sentences import split_sentences
from lexicon.text_marks import parse_marks
from tts2face.interchange.subtitles.spoken_text import spoken_text

UNITS = (
    *word_set(". ! !? … a. ( ) ' [ < & 1 1, 1. 1: 1/ - a- — 1– ~ ^ ^1 * _ / @ a@ a@b. w. http:// $ $1 5' 1e + # #a"),
    *word_set(
        '" “ é A a 漢 。 カ ー 한 ไ अ 👍🏽 ² π ٣ e\u0301 \u0301 \u200b ♪ （ 【 { <v. <v <rt> </ <br \x02 [style [nod] ˈ'
    ),
    *("\n", "\n\n", " ", "\t", "\n\t", "a ", "A ", "x, ", "! A", "Dr. ", "St. ", "Mr. A. ", "3rd ", "1-", "&amp;"),
    *("It cost $5.20 (e.g. 10 pm). ", "JO: ", "#\n", "- x\n", "[style:x]a[/style]", "<v a ", "'s "),
    *(
        r"\(",
        r"\[",
        r"$\frac{",
        "$x^2$ ",
        "$$\n",
        "==a ",
        "[a][1] ",
        "<|a|>",
        "- a\n  - b\n",
        "1'000 ",
        "John 5:3 ",
        "112 or ",
        "-1/",
    ),
)
WORDS = ("#", "1", "a", "A", "😀", " .", "½", "the ", "read ", "multiply ", "I read it. ", "'s ")  # slow to pronounce
MOST_GROWTH = 8.0  # of CPU time from n to 4 n; 4 where the time is linear, 16 where it is quadratic
UNSEEN_S = 0.04  # CPU seconds, too few to tell growth from noise


def in_parts(text: str) -> None:
    live = GrowingText("en-us")
    for at in range(0, len(text), 50):
        live.add(text[at : at + 50])
    live.flush()


def subtitle(text: str) -> None:
    spoken_text(f"<v a>x <v b>y\n- x\n- y\n{text}")


# Each function, the characters of its longer text, in which a quadratic cost shows, and what the text repeats.
FUNCTIONS: tuple[tuple[Callable[[str], object], int, tuple[str, ...]], ...] = (
    (lambda text: [*split_chunks(text, 300)], 12_000, UNITS),
    (lambda text: split_phrase(text, 90), 12_000, UNITS),
    (in_parts, 4_000, UNITS),
    (subtitle, 12_000, UNITS),
    (parse_marks, 12_000, UNITS),
    (parse_ipa, 12_000, UNITS),
    (parse_dictionary, 12_000, UNITS),
    (lambda text: check_script(text, "de"), 12_000, UNITS),
    (normalize, 3_000, UNITS),
    (lambda text: normalize(text, "de"), 3_000, UNITS),
    (lambda text: [*split_sentences(parse_marks(text), "ru")], 3_000, UNITS),
    (lambda text: [*split_sentences(parse_marks(text), "en-us")], 6_000, WORDS),  # a fourth is longer than a sentence
    (pronounce, 1_500, WORDS),
)


def cpu_seconds(function: Callable[[str], object], text: str) -> float:
    begin = time.process_time()
    with suppress(InputError, DataError):
        function(text)
    return time.process_time() - begin


def grows_faster(function: Callable[[str], object], unit: str, n: int) -> bool:
    """Whether four times the text takes much more than four times the time, each at its best of three."""
    long = (unit * n)[:n]
    if cpu_seconds(function, long) < UNSEEN_S:
        return False
    longer, shorter = (min(cpu_seconds(function, text) for _ in range(3)) for text in (long, long[: n // 4]))
    return longer > max(UNSEEN_S, MOST_GROWTH * shorter)


def too_slow(function: Callable[[str], object], n: int, units: tuple[str, ...]) -> list[str]:
    cpu_seconds(function, "A dog reads 5 books.")  # loads tables
    return [unit for unit in units if grows_faster(function, unit, n)]


@pytest.mark.parametrize(("function", "n", "units"), FUNCTIONS)
def test_time_grows_with_the_length_of_a_text(
    function: Callable[[str], object], n: int, units: tuple[str, ...]
) -> None:
    assert not too_slow(function, n, units)


@pytest.mark.smoke
def test_time_grows_with_the_length_of_the_text_of_old_defects() -> None:
    """20,000 "!?" took 20 s of processor time, and 8,000 "#" 5 s."""
    for function, n, units in (FUNCTIONS[0], FUNCTIONS[1], FUNCTIONS[-1]):
        assert not too_slow(function, n, tuple({"!", "?", ".", "#"} & set(units)))
