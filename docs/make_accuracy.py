"""Measure the default synthesis on held-out recordings and write the tables of accuracy.md.

Run: python docs/make_accuracy.py ../shared/recordings/grid_s1 [--cache FOLDER]
"""

import argparse
import json
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

from corpus_tools.effort import Effort
from corpus_tools.evaluation.evaluate import Evaluation, evaluate
from corpus_tools.evaluation.scores import FIGURES
from corpus_tools.evaluation.splits import split, without_words
from corpus_tools.observe import observe
from tts2face.exemplar.options import METHODS

HERE = Path(__file__).parent
PAGE, FIGURES_FILE = HERE / "accuracy.md", HERE / "accuracy.json"
HELD_OUT, SEED, WORDS = 100, 0, ("please", "seven", "m")


def measured(recordings: Path, effort: Effort) -> dict[str, Any]:
    """The figures of both splits, and the options that were measured."""
    kept = observe(recordings, effort=effort).kept
    splits = {"utterances": split(kept, hold_out=HELD_OUT, seed=SEED), "words": without_words(kept, WORDS)}
    return {
        "options": {name: asdict(options) for name, options in METHODS.items()},
        **{name: _plain(evaluate([parts])[0]) for name, parts in splits.items()},
    }


def _plain(found: Evaluation) -> dict[str, Any]:
    told = found.to_json()
    for scores in told["scores"]:
        del scores["utterances"], scores["real_time_factor"]  # one is long, the other the machine's
    return told


def table(split_figures: Mapping[str, Any]) -> str:
    """Markdown table of one split, with intervals for the headline."""
    lines = [f"| method | {' | '.join(head for _, head, _ in FIGURES)} |", "| --- |" + " --- |" * len(FIGURES)]
    for scores in split_figures["scores"]:
        cells = []
        for name, _, digits in FIGURES:
            figure = scores["figures"][name]
            text = f"{figure['value']:.{digits}f}"
            if name == "dtw_cost":
                text += f" ({figure['low']:.2f}-{figure['high']:.2f})"
            cells.append(text)
        lines.append(f"| {scores['method']} | {' | '.join(cells)} |")
    return "\n".join(lines)


def with_tables(page: str, figures: Mapping[str, Any]) -> str:
    """The page with the tables of the figures between its marks."""
    for name in ("utterances", "words"):
        begin, end = f"<!-- {name} -->\n", f"<!-- end of {name} -->"
        before, _, rest = page.partition(begin)
        _, _, behind = rest.partition(end)
        page = f"{before}{begin}{table(figures[name])}\n{end}{behind}"
    return page


def main() -> None:
    """Measure and write."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("recordings", type=Path)
    parser.add_argument("--cache", type=Path)
    arguments = parser.parse_args()
    figures = measured(arguments.recordings, Effort(arguments.cache))
    FIGURES_FILE.write_text(json.dumps(figures, indent=1) + "\n", encoding="utf-8")
    PAGE.write_text(with_tables(PAGE.read_text(encoding="utf-8"), figures), encoding="utf-8")


if __name__ == "__main__":
    main()
