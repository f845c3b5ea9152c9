"""``tts2face corpus evaluate``: which utterances are held out, and where the figures go."""

import csv
import io
import json
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from cli.progress import progress_bar, write_message
from lexicon.errors import InputError
from tts2face.storage.output_names import check_file_name

if TYPE_CHECKING:
    from corpus_tools.evaluation.evaluate import SplitResult
    from corpus_tools.evaluation.splits import Split
    from corpus_tools.evaluation.tables import Evaluation
    from corpus_tools.recordings.observation import Observation
    from corpus_tools.run_options import RunOptions
    from tts2face.voice.engine import Voice

OUTPUT_SUFFIXES = (".html", ".json", ".csv")


@dataclass(frozen=True, slots=True)
class SplitFlags:
    """The flags that say what is learnt from and what is held out."""

    recordings: Path | None
    hold_out: int
    seed: int
    folds: int | None
    words: str | None
    train: Path | None
    test: Path | None
    cross_talker: Path | None

    def check(self) -> None:
        """Refuse flags that contradict each other."""
        if self.cross_talker is not None:
            self._check_cross_talker()
        elif (self.recordings is None) == (self.train is None) or (self.train is None) != (self.test is None):
            raise InputError("give --recordings to split, or both --train and --test")
        elif self.folds is not None and self.words is not None:
            raise InputError("give either --folds or --hold-out-words")
        elif self.train is not None and (self.folds is not None or self.words is not None):
            raise InputError("--folds and --hold-out-words split --recordings; --train and --test are split already")

    def _check_cross_talker(self) -> None:
        if (self.recordings is None) == (self.train is None):
            raise InputError("with --cross-talker give either --recordings or --train: all of it is learnt from")
        if self.test is not None or self.folds is not None or self.words is not None:
            raise InputError("--cross-talker tests on somebody else; leave out --test, --folds and --hold-out-words")


@dataclass(frozen=True, slots=True)
class ComparisonFlags:
    """The flags that say what is measured beside the methods."""

    tracks: Path | None
    own_durations: bool


def run_evaluation(
    asked: SplitFlags, beside: ComparisonFlags, out: Path | None, effort: tuple[Path | None, int | None, Path | None]
) -> None:
    """Read recordings, measure every method on what is held out, and tell or write the figures."""
    asked.check()
    if asked.cross_talker is not None and (beside.tracks is not None or beside.own_durations):
        raise InputError("--cross-talker takes no --tracks and no --own-durations; measure them on the talker's own")
    if out is not None:
        check_file_name(out, "an evaluation", OUTPUT_SUFFIXES)
    from corpus_tools.report.drawing import load_matplotlib
    from corpus_tools.run_options import RunOptions

    if out is not None and out.suffix == ".html":
        load_matplotlib()  # a missing package is reported before the measurement
    result, runs = _evaluate(asked, beside, RunOptions(*effort))
    print(f"{result.table()}\n\n{result.class_table()}")  # noqa: T201 - the answer
    if out is not None:
        _write_evaluation(out, result, runs)
        kind = "of somebody else" if result.is_across else "held out"
        write_message(f"wrote {out}: {result.n_test} utterances {kind}, {result.n_train} learnt from")


def _evaluate(
    asked: SplitFlags, beside: ComparisonFlags, effort: "RunOptions"
) -> "tuple[Evaluation, tuple[SplitResult, ...]]":
    from corpus_tools.evaluation.evaluate import evaluate, evaluate_across_talkers
    from corpus_tools.evaluation.tracks import read_tracks

    learnt_from = asked.recordings or asked.train
    if asked.cross_talker is not None and learnt_from is not None:
        train, others = _read_observations(learnt_from, effort), _observe_other_talker(asked.cross_talker, effort)
        with progress_bar("measuring") as on_progress:
            return evaluate_across_talkers(train, others, on_progress=on_progress)
    tracks = read_tracks(beside.tracks) if beside.tracks is not None else None
    voice = _load_default_voice() if beside.own_durations else None
    parts = _make_splits(asked, effort)
    with progress_bar("measuring") as on_progress:
        return evaluate(parts, tracks=tracks, voice=voice, on_progress=on_progress)


def _load_default_voice() -> "Voice":
    from tts2face.request import Request
    from tts2face.voice.loading import load_voice

    return load_voice(None, Request(text="").language)


def _observe_other_talker(recordings: Path, effort: "RunOptions") -> "tuple[Observation, ...]":
    from corpus_tools.evaluation.livelink_reference import LIVELINK_SUFFIX, observe_livelink

    return (
        observe_livelink(recordings, effort)
        if recordings.suffix == LIVELINK_SUFFIX
        else _read_observations(recordings, effort)
    )


def _make_splits(asked: SplitFlags, effort: "RunOptions") -> "tuple[Split, ...]":
    from corpus_tools.evaluation.splits import split_by_words, split_into_folds, split_randomly

    if asked.train is not None and asked.test is not None:
        return ((_read_observations(asked.train, effort), _read_observations(asked.test, effort)),)
    if asked.recordings is None:
        raise InputError("give --recordings to split")
    found = _read_observations(asked.recordings, effort)
    if asked.folds is not None:
        return split_into_folds(found, n_folds=asked.folds, seed=asked.seed)
    if asked.words is not None:
        return (split_by_words(found, [word for word in asked.words.replace(",", " ").split() if word]),)
    return (split_randomly(found, hold_out=asked.hold_out, seed=asked.seed),)


def _read_observations(folder: Path, effort: "RunOptions") -> "tuple[Observation, ...]":
    from corpus_tools.recordings.observe import observe

    with progress_bar(f"reading {folder.name}") as on_progress:
        found = observe(folder, effort=effort, on_progress=on_progress)
    for refusal in found.refused:
        write_message(f"refused {refusal.name}: {refusal.reason}")
    return found.kept


def _write_evaluation(out: Path, result: "Evaluation", runs: "tuple[SplitResult, ...]") -> None:
    from tts2face.storage.files import write_atomically

    if out.suffix == ".json":
        write_atomically(out, json.dumps(result.to_json(), indent=1).encode())
    elif out.suffix == ".csv":
        table = io.StringIO()
        csv.writer(table, lineterminator="\n").writerows(result.rows())
        write_atomically(out, table.getvalue().encode())
    else:
        from corpus_tools.report.evaluation import evaluation_page

        write_atomically(out, evaluation_page(result, runs).encode())
