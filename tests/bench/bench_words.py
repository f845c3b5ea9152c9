"""Words of no dictionary that are pronounced as they should be: run ``python tests/bench/bench_words.py [LIST ...]``.

A list has the columns kind, word and right (ARPABET without stress, answers between `` | ``); without one, the words of
`tests/lexicon/unlisted_words.tsv` are counted. A word is right within .65 phones of an answer, where weak vowels, and
the vowels of lot and thought, differ by .2.
"""

import argparse
import csv
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path

from lexicon.dictionary import named_pronunciation
from lexicon.pronounce import pronounce

UNLISTED_WORDS = Path(__file__).parents[1] / "lexicon" / "unlisted_words.tsv"
WEAK_VOWELS = frozenset({"AH", "IH", "EH", "UH", "IY"})
LOT = frozenset({"AA", "AO"})
NEAR = 0.2  # phones, between vowels that hardly differ
RIGHT = 0.65  # phones of distance


def _distance(a: str, b: str) -> float:
    """Distance of two phones."""
    if a == b:
        return 0.0
    return NEAR if {a, b} <= WEAK_VOWELS or {a, b} <= LOT else 1.0


def word_distance(said: Sequence[str], right: Sequence[str]) -> float:
    """Edit distance of two words in phones."""
    row = [float(at) for at in range(len(right) + 1)]
    for i, phone in enumerate(said, 1):
        before, row[0] = row[0], float(i)
        for j, other in enumerate(right, 1):
            before, row[j] = row[j], min(row[j] + 1, row[j - 1] + 1, before + _distance(phone, other))
    return row[-1]


def read_words(path: Path) -> Iterator[tuple[str, str, list[list[str]]]]:
    """Kind, word and its right pronunciations."""
    with path.open(encoding="utf-8", newline="") as file:
        for row in csv.DictReader(file, delimiter="\t", quoting=csv.QUOTE_NONE):
            yield row["kind"], row["word"], [answer.split() for answer in row["right"].split(" | ")]


def said(word: str) -> list[str]:
    """ARPABET of a word by itself, without stress."""
    return [name.rstrip("012") for part in pronounce(word).words for name in part.arpabet]


def main() -> None:
    """Print the shares of each list by kind, and the words that are wrong."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("lists", nargs="*", type=Path, default=[UNLISTED_WORDS])
    parser.add_argument("--show", action="store_true", help="Print each wrong word.")
    options = parser.parse_args()
    for path in options.lists:
        right, total, listed = Counter[str](), Counter[str](), Counter[bool]()
        for kind, word, answers in read_words(path):
            spoken = said(word)
            is_right = min(word_distance(spoken, answer) for answer in answers) <= RIGHT
            total[kind] += 1
            right[kind] += is_right
            listed[named_pronunciation(word) is None] += is_right
            if options.show and not is_right:
                print(kind, word, " ".join(spoken), "|", " | ".join(map(" ".join, answers)), sep="\t")
        kinds = ", ".join(f"{kind} {right[kind]}/{n}" for kind, n in total.items())
        print(f"{path.name}: {right.total()} of {total.total()} ({listed[True]} of them in no table of names); {kinds}")


if __name__ == "__main__":
    main()
