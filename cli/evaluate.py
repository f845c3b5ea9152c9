"""``tts2face corpus evaluate``: the split of the recordings and the output of the measures.

``tts2face corpus evaluate --learning-curve``: accuracy against the amount of a person's own material.

``tts2face corpus evaluate --people``: a finished talker on landmark tracks of other people.
"""

import csv
import io
import json
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from cli.flags import Cache, Jobs, Model, switch, whole_number
from cli.photo import Yes
from cli.process import progress_bar, stage_bar, write_message
from lexicon.errors import InputError
from tts2face.storage.output_paths import check_file_name, refuse_overwriting

if TYPE_CHECKING:
    from corpus_tools.measures.splits import Split
    from corpus_tools.recordings.observation import Observation
    from corpus_tools.run_options import RunOptions
    from corpus_tools.studies.evaluation.evaluate import SplitResult
    from corpus_tools.studies.evaluation.people import PeopleEvaluation
    from corpus_tools.studies.evaluation.tables import Evaluation
    from tts2face.sound.voice import Voice


OUTPUT_SUFFIXES = (".html", ".json", ".csv")


@Parameter(name="*")
@dataclass(frozen=True, slots=True, kw_only=True)
class SplitFlags:
    """The flags that select training and test recordings."""

    recordings: Annotated[
        Path | None, Parameter(help="Folder of recordings to split into training and held-out utterances.")
    ] = None
    hold_out: Annotated[
        int | None, whole_number("Number of utterances held out of --recordings; by default a fifth, at most 100.")
    ] = None
    seed: Annotated[int, whole_number("Seed of the random choice of held-out utterances.")] = 0
    folds: Annotated[int | None, whole_number("Number of folds for cross-validation, instead of --hold-out.")] = None
    hold_out_words: Annotated[
        str | None,
        Parameter(
            help="Instead of --hold-out: hold out utterances that contain one of these words, e.g. please,seven."
        ),
    ] = None
    train: Annotated[Path | None, Parameter(help="Folder of training recordings, instead of --recordings.")] = None
    test: Annotated[Path | None, Parameter(help="Folder of test recordings, with --train.")] = None
    cross_talker: Annotated[
        Path | None,
        Parameter(help="Test on recordings of another talker, or a Live Link Face .csv with its sound; z-scored."),
    ] = None

    def check(self) -> None:
        """Refuse flags that contradict each other."""
        if self.cross_talker is not None:
            self._check_cross_talker()
        elif (self.recordings is None) == (self.train is None) or (self.train is None) != (self.test is None):
            raise InputError("the recordings are not selected; use either --recordings, or both --train and --test")
        elif self.folds is not None and self.hold_out_words is not None:
            raise InputError("--folds cannot be combined with --hold-out-words; remove one of them")
        elif self.train is not None and (self.folds is not None or self.hold_out_words is not None):
            raise InputError(
                "--folds and --hold-out-words cannot be combined with --train and --test; use them with --recordings"
            )

    def check_people(self, people: list[Path], comparison: "ComparisonFlags") -> None:
        """Refuse flags that contradict --people."""
        if not people:
            raise InputError("--talker has no effect without --people; give a folder of tracks, or remove it")
        chosen = (self.recordings, *self._other_selections())
        if comparison.own_durations or comparison.pool is not None or any(value is not None for value in chosen):
            raise InputError(
                "--people tests a finished talker and can be combined only with --talker, --tracks, --sounds and "
                "--out; remove the other flags"
            )

    def curve_recordings(self, comparison: "ComparisonFlags") -> Path:
        """The folder of recordings of a learning curve; refuse flags that contradict --learning-curve."""
        chosen = (*self._other_selections(), comparison.tracks, comparison.pool)
        if self.recordings is None:
            raise InputError("--learning-curve needs the recordings of one person; give --recordings")
        if comparison.own_durations or any(value is not None for value in chosen):
            raise InputError(
                "--learning-curve can be combined only with --recordings, --hold-out, --seed, --base and --out; "
                "remove the other flags"
            )
        return self.recordings

    def _other_selections(self) -> tuple[object, ...]:
        """What selects utterances otherwise than --recordings and --hold-out."""
        return self.train, self.test, self.folds, self.hold_out_words, self.cross_talker

    def _check_cross_talker(self) -> None:
        if (self.recordings is None) == (self.train is None):
            raise InputError(
                "--cross-talker needs one folder of training recordings; use either --recordings or --train"
            )
        if self.test is not None or self.folds is not None or self.hold_out_words is not None:
            raise InputError("--cross-talker cannot be combined with --test, --folds or --hold-out-words; remove them")


@Parameter(name="*")
@dataclass(frozen=True, slots=True, kw_only=True)
class ComparisonFlags:
    """The flags that add trajectories to the comparison."""

    own_durations: Annotated[
        bool, switch("Also evaluate synthesis from text with the durations of the default English voice.")
    ] = False
    tracks: Annotated[
        Path | None,
        Parameter(help="Also evaluate external trajectories: CSV with utterance, time and one column per channel."),
    ] = None
    sounds: Annotated[
        Path | None,
        Parameter(help="With --people: also lips from their sounds in this folder (NAME.flac), as a user gets them."),
    ] = None
    pool: Annotated[
        Path | None, Parameter(help="Train the networks also with lip tracks of this folder, as `corpus pool` does.")
    ] = None


NO_SPLIT, NO_COMPARISON = SplitFlags(), ComparisonFlags()


def evaluate(  # noqa: PLR0913 - one parameter a flag
    *,
    split: SplitFlags = NO_SPLIT,
    people: Annotated[
        list[Path] | None,
        Parameter(help="Test --talker on a folder of landmark tracks of one person (.npz); z-scored; can be repeated."),
    ] = None,
    talker: Annotated[str | None, Parameter(help="Finished talker that --people tests; by default grid_s1.")] = None,
    comparison: ComparisonFlags = NO_COMPARISON,
    learning_curve: Annotated[
        str | None,
        Parameter(
            help="Learn from parts of --recordings of so many seconds, e.g. 10,20,40, or auto: 10 s to 40 minutes."
        ),
    ] = None,
    base: Annotated[
        str | None,
        Parameter(help="With --learning-curve: as --base of corpus build; by default grid_s1."),
    ] = None,
    out: Annotated[
        Path | None,
        Parameter(
            help="Write measures and plots (.html), measures (.json, .csv), or a learning curve (.svg, .png, too).",
            alias="-o",
        ),
    ] = None,
    jobs: Jobs = None,
    cache: Cache = None,
    model: Model = None,
    yes: Yes = False,
) -> None:
    """Compare synthesised lip motion with held-out recordings."""
    del yes  # read where the model is missing
    inputs = {"--recordings": split.recordings, "--train": split.train, "--test": split.test}
    inputs |= {"--cross-talker": split.cross_talker, "--tracks": comparison.tracks, "--sounds": comparison.sounds}
    inputs |= {"--model": model}
    refuse_overwriting({"--out": out}, inputs)
    if learning_curve is not None and not people and talker is None:
        run_learning_curve(learning_curve, split, comparison, base, out, (cache, jobs, model))
        return
    if base is not None or learning_curve is not None:
        reason = "--base has no effect without --learning-curve" if base else "--learning-curve tests no --talker"
        raise InputError(f"{reason}; remove it")
    if people or talker is not None:
        split.check_people(people or [], comparison)
        run_people_evaluation(talker or DEFAULT_TALKER, people or [], comparison, out)
        return
    run_evaluation(split, comparison, out, (cache, jobs, model))


def run_evaluation(
    split_flags: SplitFlags,
    comparison: ComparisonFlags,
    out: Path | None,
    run_options: tuple[Path | None, int | None, Path | None],
) -> None:
    """Evaluate every method on the held-out recordings; print the measures, and write them to `out`."""
    split_flags.check()
    if split_flags.cross_talker is not None and (comparison.tracks is not None or comparison.own_durations):
        raise InputError("--cross-talker cannot be combined with --tracks or --own-durations; remove them")
    if out is not None:
        check_file_name(out, "an evaluation", OUTPUT_SUFFIXES)
    from corpus_tools.run_options import RunOptions
    from corpus_tools.studies.plots import load_matplotlib

    if out is not None and out.suffix == ".html":
        load_matplotlib()  # a missing package is reported before the measurement
    result, runs = _evaluate(split_flags, comparison, RunOptions(*run_options))
    for warning in result.warnings:
        write_message(f"warning: {warning}")
    print(f"{result.table()}\n\n{result.class_table()}")  # noqa: T201 - the result
    if out is not None:
        _write_evaluation(out, result, runs)
        kind = "of another talker" if result.is_across else "held out"
        write_message(f"wrote {out}: {result.n_test} utterances {kind}, {result.n_train} for training")


def _evaluate(
    split_flags: SplitFlags, comparison: ComparisonFlags, run_options: "RunOptions"
) -> "tuple[Evaluation, tuple[SplitResult, ...]]":
    from corpus_tools.studies.evaluation.evaluate import evaluate, evaluate_across_talkers
    from corpus_tools.studies.evaluation.tracks import read_tracks
    from corpus_tools.training.pooling.lip_tracks import read_lip_tracks

    lips = read_lip_tracks(comparison.pool) if comparison.pool is not None else ()
    training_folder = split_flags.recordings or split_flags.train
    if split_flags.cross_talker is not None and training_folder is not None:
        train = _read_observations(training_folder, run_options)
        others = _observe_other_talker(split_flags.cross_talker, run_options)
        with progress_bar("evaluating") as on_progress:
            return evaluate_across_talkers(train, others, lips=lips, on_progress=on_progress)
    tracks = read_tracks(comparison.tracks) if comparison.tracks is not None else None
    voice = _load_default_voice() if comparison.own_durations else None
    parts = _make_splits(split_flags, run_options)
    with progress_bar("evaluating") as on_progress:
        return evaluate(parts, tracks=tracks, voice=voice, lips=lips, on_progress=on_progress)


def _load_default_voice() -> "Voice":
    from tts2face.request import Request
    from tts2face.sound.voice_pool import load_voice

    return load_voice(None, Request(text="").language)


def _observe_other_talker(recordings: Path, run_options: "RunOptions") -> "tuple[Observation, ...]":
    from corpus_tools.studies.evaluation.livelink import LIVELINK_SUFFIX, observe_livelink

    return (
        observe_livelink(recordings, run_options)
        if recordings.suffix == LIVELINK_SUFFIX
        else _read_observations(recordings, run_options)
    )


def _make_splits(split_flags: SplitFlags, run_options: "RunOptions") -> "tuple[Split, ...]":
    from corpus_tools.measures.splits import split_by_words, split_into_folds, split_randomly

    if split_flags.train is not None and split_flags.test is not None:
        return (
            (_read_observations(split_flags.train, run_options), _read_observations(split_flags.test, run_options)),
        )
    if split_flags.recordings is None:
        raise InputError("the recordings are not selected; use --recordings")
    found = _read_observations(split_flags.recordings, run_options)
    if split_flags.folds is not None:
        return split_into_folds(found, n_folds=split_flags.folds, seed=split_flags.seed)
    if split_flags.hold_out_words is not None:
        return (split_by_words(found, [word for word in split_flags.hold_out_words.replace(",", " ").split() if word]),)
    return (split_randomly(found, hold_out=split_flags.hold_out, seed=split_flags.seed),)


def _read_observations(folder: Path, run_options: "RunOptions") -> "tuple[Observation, ...]":
    from corpus_tools.recordings.observe import observe

    with progress_bar(f"reading {folder.name}") as on_progress:
        found = observe(folder, run_options=run_options, on_progress=on_progress)
    for refusal in found.refused:
        write_message(f"rejected {refusal.name}: {refusal.reason}")
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
        from corpus_tools.studies.evaluation.page import evaluation_page

        write_atomically(out, evaluation_page(result, runs).encode())


DEFAULT_BASE = "grid_s1"
AUTOMATIC = "auto"


def run_learning_curve(
    amounts: str, split_flags: SplitFlags, comparison: ComparisonFlags, base: str | None, out: Path | None,
    run_options: tuple[Path | None, int | None, Path | None],
) -> None:  # fmt: skip
    """Measure a learning curve on the recordings; print its tables, and write them or a picture to `out`."""
    folder = split_flags.curve_recordings(comparison)
    from corpus_tools.measures.splits import split_randomly
    from corpus_tools.run_options import RunOptions, ignore_stage
    from corpus_tools.studies.evaluation.curve_page import WRITERS
    from corpus_tools.studies.evaluation.curve_tables import curve_tables
    from corpus_tools.studies.evaluation.learning_curve import DEFAULT_AMOUNTS_S, measure_learning_curve
    from corpus_tools.studies.evaluation.material import read_material
    from corpus_tools.studies.pages import report_writer
    from corpus_tools.training.adapt_talker import Base
    from corpus_tools.training.choose_adaptation import NO_BASE
    from tts2face.models.talker_file import load_talker
    from tts2face.storage.files import write_atomically

    amounts_s = DEFAULT_AMOUNTS_S if amounts == AUTOMATIC else _parse_seconds(amounts)
    writer = None if out is None else report_writer(out, WRITERS)
    name = base or DEFAULT_BASE
    indexed = None if name == NO_BASE else Base.of(load_talker(name))
    with stage_bar() as stages:
        talker = None if indexed is None else indexed.talker
        observations = read_material(
            folder, talker, run_options=RunOptions(*run_options), stages=stages or ignore_stage
        )
    train, test = split_randomly(observations, hold_out=split_flags.hold_out, seed=split_flags.seed)
    with progress_bar("learning from parts of the material") as on_progress:
        curve = measure_learning_curve(
            train, test, indexed, amounts_s=amounts_s, seed=split_flags.seed, on_progress=on_progress
        )
    print(curve_tables(curve))  # noqa: T201 - the result
    if out is not None and writer is not None:
        write_atomically(out, writer(curve))
        write_message(f"wrote {out}: {len(curve.points)} amounts of material, {curve.n_test} utterances held out")


def _parse_seconds(amounts: str) -> tuple[float, ...]:
    try:
        return tuple(float(amount) for amount in amounts.split(","))
    except ValueError as wrong:
        raise InputError(
            f"--learning-curve must be {AUTOMATIC} or seconds separated by commas, such as 10,20,40, not {amounts!r}"
        ) from wrong


PEOPLE_SUFFIXES = (".json", ".csv")
DEFAULT_TALKER = "grid_s1"
DEFAULT_METHOD = "exemplar"
SHOWN_METHODS = (DEFAULT_METHOD, "networks alone")  # in the table by phone


def run_people_evaluation(talker: str, people: list[Path], comparison: ComparisonFlags, out: Path | None) -> None:
    """Evaluate every method of a talker on the people's tracks; print the tables, and write them to `out`."""
    if out is not None:
        check_file_name(out, "an evaluation of people", PEOPLE_SUFFIXES)
    if len({folder.resolve() for folder in people}) < len(people):
        raise InputError("--people names a folder twice; remove one")
    from corpus_tools.studies.evaluation.heard import find_sounds, with_hand_edges
    from corpus_tools.studies.evaluation.people import evaluate_people
    from corpus_tools.studies.evaluation.people_tables import difference_table, people_table, phone_table
    from corpus_tools.studies.evaluation.person_tracks import read_person
    from corpus_tools.studies.evaluation.tracks import read_tracks
    from corpus_tools.training.train_talker import correct_pose
    from tts2face.models.talker_file import load_talker

    tests = [correct_pose(read_person(folder)) for folder in people]
    external = read_tracks(comparison.tracks) if comparison.tracks is not None else None
    sounds = None
    if comparison.sounds is not None:
        sounds = find_sounds(comparison.sounds, [one for person in tests for one in person])
        tests = [with_hand_edges(person, sounds) for person in tests]
    found = evaluate_people(load_talker(talker), tests, external, sounds)
    for warning in found.warnings:
        write_message(f"warning: {warning}")
    methods = [name for name in SHOWN_METHODS if name in found.figures]
    tables = (people_table(found), difference_table(found, DEFAULT_METHOD), phone_table(found, methods))
    print("\n\n".join(tables))  # noqa: T201 - the result
    if out is not None:
        _write_people(out, found)
        write_message(f"wrote {out}: {found.n_utterances} utterances of {found.n_people} people")


def _write_people(out: Path, found: "PeopleEvaluation") -> None:
    from corpus_tools.studies.evaluation.people_tables import people_rows
    from tts2face.storage.files import write_atomically

    if out.suffix == ".json":
        write_atomically(out, json.dumps(found.to_json(), indent=1).encode())
        return
    table = io.StringIO()
    csv.writer(table, lineterminator="\n").writerows(people_rows(found))
    write_atomically(out, table.getvalue().encode())
