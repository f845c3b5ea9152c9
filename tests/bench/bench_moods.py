"""Moods of labelled sentences: ``python tests/bench/bench_moods.py [FILE]``; a confusion matrix for each use.

FILE has the columns use, mood, text; by default the sentences of tests/lexicon. Only rows of the use *given* were
looked at when the words were chosen.
"""

import csv
import sys
from collections import Counter
from pathlib import Path

from lexicon.moods import MOODS, sentence_mood

SENTENCES = Path(__file__).parents[1] / "lexicon" / "mood_sentences.tsv"
NAMES = (*MOODS, "neutral")


def read_sentences(path: Path = SENTENCES) -> list[dict[str, str]]:
    """Rows with use, mood and text."""
    with path.open(encoding="utf-8") as file:
        return list(csv.DictReader(file, delimiter="\t", quoting=csv.QUOTE_NONE))


def main() -> None:
    """Print for each use: right, and what each mood is taken for."""
    rows = read_sentences(Path(sys.argv[1]) if len(sys.argv) > 1 else SENTENCES)
    for use in dict.fromkeys(row["use"] for row in rows):
        pairs = [(row, sentence_mood(row["text"])) for row in rows if row["use"] == use]
        counts = Counter((row["mood"], mood.name or "neutral") for row, mood in pairs)
        right = sum(counts[name, name] for name in NAMES)
        print(f"{use}: {right} of {len(pairs)} right")
        print("| is \\ taken for | " + " | ".join(NAMES) + " |")
        for name in NAMES:
            print(f"| {name} | " + " | ".join(str(counts[name, other]) for other in NAMES) + " |")
        if use == "given":
            for row, mood in pairs:
                if row["mood"] != (mood.name or "neutral"):
                    print(f"{row['mood']} -> {mood.name}: {row['text']} ({mood.reason})")


if __name__ == "__main__":
    main()
