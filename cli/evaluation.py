"""``tts2face corpus evaluate``: which utterances are held out, and where the figures go."""

import csv
import io
import json
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from cli.progress import progress_bar, say
from lexicon.errors import InputError

if TYPE_CHECKING:
    from corpus_tools.effort import Effort
    from corpus_tools.evaluation.evaluate import Evaluation, Run
    from corpus_tools.evaluation.splits import Parts
    from corpus_tools.observation import Observation

SUFFIXES = (".html", ".json", ".csv")


@dataclass(frozen=True, slots=True)
class Asked:
    """The flags that say what is learnt from and what is held out."""

    recordings: Path | None
    hold_out: int
    seed: int
    folds: int | None
    words: str | None
    train: Path | None
    test: Path | None

    def check(self) -> None:
        """Refuse flags that contradict each other."""
        if (self.recordings is None) == (self.train is None) or (self.train is None) != (self.test is None):
            raise InputError("give --recordings to split, or both --train and --test")
        if self.folds is not None and self.words is not None:
            raise InputError("give either --folds or --hold-out-words")
        if self.train is not None and (self.folds is not None or self.words is not None):
            raise InputError("--folds and --hold-out-words split --recordings; --train and --test are split already")


def evaluated(
    asked: Asked, out: Path | None, tracks: Path | None, effort: tuple[Path | None, int | None, Path | None]
) -> None:
    """Read recordings, measure every method on what is held out, and tell or write the figures."""
    asked.check()
    if out is not None and out.suffix not in SUFFIXES:
        raise InputError(f"an evaluation is written as {', '.join(SUFFIXES)}, not {out.name}")
    from corpus_tools.effort import Effort
    from corpus_tools.evaluation.evaluate import evaluate
    from corpus_tools.evaluation.tracks import read_tracks

    theirs = read_tracks(tracks) if tracks is not None else None
    parts = _parts(asked, Effort(*effort))
    with progress_bar("measuring") as on_progress:
        result, runs = evaluate(parts, tracks=theirs, on_progress=on_progress)
    print(result.table())  # noqa: T201 - the answer
    if out is not None:
        _write(out, result, runs)
        say(f"wrote {out}: {result.n_test} utterances held out, {result.n_train} learnt from")


def _parts(asked: Asked, effort: "Effort") -> "tuple[Parts, ...]":
    from corpus_tools.evaluation.splits import folds, split, without_words

    if asked.train is not None and asked.test is not None:
        return ((_observations(asked.train, effort), _observations(asked.test, effort)),)
    if asked.recordings is None:
        raise InputError("give --recordings to split")
    found = _observations(asked.recordings, effort)
    if asked.folds is not None:
        return folds(found, n_folds=asked.folds, seed=asked.seed)
    if asked.words is not None:
        return (without_words(found, [word for word in asked.words.replace(",", " ").split() if word]),)
    return (split(found, hold_out=asked.hold_out, seed=asked.seed),)


def _observations(folder: Path, effort: "Effort") -> "tuple[Observation, ...]":
    from corpus_tools.observe import observe

    with progress_bar(f"reading {folder.name}") as on_progress:
        found = observe(folder, effort=effort, on_progress=on_progress)
    for refusal in found.refused:
        say(f"refused {refusal.name}: {refusal.reason}")
    return found.kept


def _write(out: Path, result: "Evaluation", runs: "tuple[Run, ...]") -> None:
    from tts2face.files import write_whole

    if out.suffix == ".json":
        write_whole(out, json.dumps(result.to_json(), indent=1).encode())
    elif out.suffix == ".csv":
        table = io.StringIO()
        csv.writer(table, lineterminator="\n").writerows(result.rows())
        write_whole(out, table.getvalue().encode())
    else:
        from corpus_tools.report.evaluation import evaluation_page

        write_whole(out, evaluation_page(result, runs).encode())
