"""Measure the default synthesis on held-out recordings and write the tables of accuracy.md.

Run: python docs/make_accuracy.py ../shared/recordings/grid_s1 ../shared/recordings/livelink/testset_arkit61_60fps.csv \
    ../shared/recordings/address_tracks
"""

import argparse
import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from corpus_tools.measures.scores import FIGURES, Scores
from corpus_tools.measures.splits import split_by_words, split_randomly
from corpus_tools.recordings.observe import observe
from corpus_tools.run_options import RunOptions
from corpus_tools.studies.evaluation.evaluate import evaluate, evaluate_across_talkers
from corpus_tools.studies.evaluation.livelink import observe_livelink
from corpus_tools.studies.evaluation.tables import Evaluation
from corpus_tools.training.pooling.lip_tracks import read_lip_tracks
from tts2face.lips.options import METHOD_OPTIONS
from tts2face.sound.voice_pool import load_voice

HERE = Path(__file__).parent
PAGE, FIGURES_FILE = HERE / "accuracy.md", HERE / "accuracy.json"
HELD_OUT, SEED, WORDS = 100, 0, ("please", "seven", "m")
LANGUAGE = "en-us"
ALL = tuple(name for name, _, _ in FIGURES)
MAIN = ("r_opening", "r_width", "dtw_cost", "closure")
TABLES = {"utterances": ALL, "own durations": MAIN, "words": MAIN}  # figures of each table; accuracy.json has all
# The paper does not state k; ours is 10, and 30 is better.
METHODS = {**METHOD_OPTIONS, "theobald2007, k = 30": replace(METHOD_OPTIONS["theobald2007"], k=30)}


def measured(recordings: Path, other: Path, tracks: Path, run_options: RunOptions) -> dict[str, Any]:
    """The figures of both splits and of another talker, and the options that were measured."""
    kept = observe(recordings, run_options=run_options).kept
    lips = read_lip_tracks(tracks)
    split, voice = split_randomly(kept, hold_out=HELD_OUT, seed=SEED), load_voice(None, LANGUAGE)
    utterances, _ = evaluate([split], options=METHODS, voice=voice, lips=lips)
    words, _ = evaluate([split_by_words(kept, WORDS)], options=METHODS, lips=lips)
    across, _ = evaluate_across_talkers(kept, observe_livelink(other, run_options), lips=lips)
    return {
        "options": {name: asdict(options) for name, options in METHODS.items()},
        "utterances": _plain(utterances.scores, utterances),
        "as tracked": _plain(utterances.as_tracked, utterances),
        "own durations": _plain(utterances.own, utterances),
        "words": _plain(words.scores, words),
        "another talker": _plain(across.scores, across),
    }


def _plain(scores: Sequence[Scores], found: Evaluation) -> dict[str, Any]:
    told = [asdict(one) for one in scores]
    for one in told:
        del one["utterances"], one["real_time_factor"]  # one is long, the other the machine's
    return {"n_train": found.n_train, "n_test": found.n_test, "scores": told}


def table(split_figures: Mapping[str, Any], names: Sequence[str]) -> str:
    """Markdown table of named figures of one split, with intervals for the headline."""
    heads = [figure for figure in FIGURES if figure[0] in names and figure[0] in split_figures["scores"][0]["figures"]]
    lines = [f"| method | {' | '.join(head for _, head, _ in heads)} |", "| --- |" + " --- |" * len(heads)]
    for scores in split_figures["scores"]:
        cells = []
        for name, _, digits in heads:
            figure = scores["figures"][name]
            text = f"{figure['value']:.{digits}f}"
            if name == "dtw_cost":
                text += f" ({figure['low']:.2f}-{figure['high']:.2f})"
            cells.append(text)
        lines.append(f"| {scores['method']} | {' | '.join(cells)} |")
    return "\n".join(lines)


def with_tables(page: str, figures: Mapping[str, Any]) -> str:
    """The page with the tables of the figures between its marks."""
    for name, shown in TABLES.items():
        begin, end = f"<!-- {name} -->\n", f"<!-- end of {name} -->"
        before, _, rest = page.partition(begin)
        _, _, behind = rest.partition(end)
        page = f"{before}{begin}{table(figures[name], shown)}\n{end}{behind}"
    return page


def main() -> None:
    """Measure and write."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("recordings", type=Path)
    parser.add_argument("other", type=Path)
    parser.add_argument("tracks", type=Path)
    parser.add_argument("--cache", type=Path)
    arguments = parser.parse_args()
    figures = measured(arguments.recordings, arguments.other, arguments.tracks, RunOptions(arguments.cache))
    FIGURES_FILE.write_text(json.dumps(figures, indent=1) + "\n", encoding="utf-8")
    PAGE.write_text(with_tables(PAGE.read_text(encoding="utf-8"), figures), encoding="utf-8")


if __name__ == "__main__":
    main()
