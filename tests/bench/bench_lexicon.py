"""How fast text becomes words and phones: run ``python tests/bench/bench_lexicon.py``."""

import time
from collections.abc import Callable

from lexicon.normalize import normalize, spoken_form
from lexicon.pronounce import pronounce
from lexicon.sentences import split_sentences
from lexicon.text_marks import parse_marks

SENTENCE = (
    "We met Dr. Smith on March 3, 2024 at 10:30 pm in St. Paul; it cost $5.20 (about 5%), see www.example.com. "
    "The quick brown fox jumps over the lazy dog, and nobody cared at all. "
)
GERMAN = "Schöne Grüße aus München, zwölf Boxkämpfer jagen Viktor quer über den großen Sylter Deich. "
# Texts of 100 KB whose first piece is hard to end: amounts, digits, symbols, letters, and abbreviations.
HARD = ("$1,234,567.89 ", "1234567890", "👍🏽", "a", "Mr. ")

HARD_NUMBERS = ("1/2/", "-5", "½", "€", "1,", "XIV ", "3,5 km ", "1 234 ", "Dr. ")


def _report(name: str, text: str, work: Callable[[str], object]) -> None:
    began = time.perf_counter()
    work(text)
    seconds = time.perf_counter() - began
    print(f"{name:36} {len(text):9,} characters {seconds:7.3f} s {len(text) / seconds / 1e3:9.0f} kB/s")


def _first_piece(text: str) -> None:
    next(split_sentences(parse_marks(text), "en-us"))


def _all_pieces(text: str) -> None:
    for _ in split_sentences(parse_marks(text), "en-us"):
        pass


def _report_languages() -> None:
    for language in ("de", "ru", "tr"):
        spoken_form("5", language)
        for piece in (GERMAN, *HARD_NUMBERS):
            text = (piece * 100_000)[:100_000]
            _report(
                f"words, {language}, {piece[:12]!r}", text, lambda text, language=language: spoken_form(text, language)
            )


def main() -> None:
    """Print one line a measurement."""
    normalize("warm")
    for size in (10_000, 100_000, 1_000_000):
        _report("normalize", SENTENCE * (size // len(SENTENCE)), normalize)
    for piece in ("....", "a.", "1,", "- ", "Dr ", '5" ', "1 - ", "a/b ", "w-w-", "x_y@", "Ca2+", "|a|", "★"):
        for size in (100_000, 1_000_000):
            _report(f"normalize, {piece!r} over and over", piece * (size // len(piece)), normalize)
    for piece in HARD:
        for size in (10_000, 30_000, 100_000):
            _report(f"first piece of {piece!r}", (piece * size)[:size], _first_piece)
            _report(f"all pieces of {piece!r}", (piece * size)[:size], _all_pieces)
    _report_languages()
    pronounce("warm")
    for size in (200, 10_000, 100_000):
        _report("pronounce en-us", SENTENCE * max(1, size // len(SENTENCE)), pronounce)
        _report("pronounce de", GERMAN * max(1, size // len(GERMAN)), lambda text: pronounce(text, "de"))


if __name__ == "__main__":
    main()
