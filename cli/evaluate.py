"""``tts2face corpus evaluate``: the split of the recordings and the output of the measures."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from cli.evaluation_flags import ComparisonFlags, SplitFlags
from cli.learning_curve import run_learning_curve
from cli.people import DEFAULT_TALKER, run_people_evaluation
from cli.process import write_message
from cli.progress import progress_bar
from cli.tool_flags import READING_DEFAULTS, ReadingFlags, ToolFlags
from lexicon.errors import InputError
from tts2face.storage.output_paths import check_file_name, refuse_overwriting

if TYPE_CHECKING:
    from corpus_tools.measures.splits import Split
    from corpus_tools.recordings.observation import Observation
    from corpus_tools.run_options import RunOptions
    from corpus_tools.studies.evaluation.evaluate import SplitResult
    from corpus_tools.studies.evaluation.tables import Evaluation
    from tts2face.sound.voice import Voice

OUTPUT_SUFFIXES = (".html", ".json", ".csv")
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
    tool: ReadingFlags = READING_DEFAULTS,
) -> None:
    """Compare synthesised lip motion with held-out recordings."""
    inputs = {"--recordings": split.recordings, "--train": split.train, "--test": split.test}
    inputs |= {"--cross-talker": split.cross_talker, "--tracks": comparison.tracks, "--sounds": comparison.sounds}
    inputs |= {"--model": tool.model}
    refuse_overwriting({"--out": out}, inputs)
    if learning_curve is not None and not people and talker is None:
        run_learning_curve(learning_curve, split, comparison, base, out, tool)
        return
    if base is not None or learning_curve is not None:
        reason = "--base has no effect without --learning-curve" if base else "--learning-curve tests no --talker"
        raise InputError(f"{reason}; remove it")
    if people or talker is not None:
        split.check_people(people or [], comparison)
        run_people_evaluation(talker or DEFAULT_TALKER, people or [], comparison, out)
        return
    run_evaluation(split, comparison, out, tool)


def run_evaluation(
    split_flags: SplitFlags,
    comparison: ComparisonFlags,
    out: Path | None,
    tool: ToolFlags,
) -> None:
    """Evaluate every method on the held-out recordings; print the measures, and write them to `out`."""
    split_flags.check()
    if split_flags.cross_talker is not None and (comparison.tracks is not None or comparison.own_durations):
        raise InputError("--cross-talker cannot be combined with --tracks or --own-durations; remove them")
    if out is not None:
        check_file_name(out, "an evaluation", OUTPUT_SUFFIXES)
    from corpus_tools.studies.plots import load_matplotlib

    if out is not None and out.suffix == ".html":
        load_matplotlib()  # a missing package is reported before the measurement
    result, runs = _evaluate(split_flags, comparison, tool.run_options())
    for warning in result.warnings:
        write_message(f"warning: {warning}")
    print(f"{result.table()}\n\n{result.class_table()}")  # noqa: T201 - the result
    if out is not None:
        from corpus_tools.studies.evaluation.page import REPORT
        from tts2face.storage.files import write_atomically

        write_atomically(out, REPORT.formats[out.suffix]((result, runs)))
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
    for note in found.notes:
        write_message(f"note: {note}")
    return found.kept
