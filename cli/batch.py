"""``tts2face batch``: subtitles to clips."""

import json
import sys
from collections.abc import Sequence
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import Parameter

from cli.batch_plan import place_of, print_plan
from cli.flags import (
    Face,
    Hair,
    HairColor,
    Person,
    Sign,
    TimeStamp,
    add_option_flags,
    open_signer,
    options_from_flags,
    switch,
    whole_number,
)
from cli.process import WhatRemains, write_message
from cli.progress import progress_bar
from lexicon.errors import DataError, InputError
from tts2face.picture.options import Picture
from tts2face.request import Request
from tts2face.serving.batch.options import BatchOptions

if TYPE_CHECKING:
    from tts2face.serving.batch.engine import Engine
    from tts2face.serving.batch.output import Plan
    from tts2face.serving.batch.run import BatchResult
    from tts2face.serving.batch.store import Store
    from tts2face.storage.signing import Signer

NOT_IN_BATCH = frozenset(
    {"text", "spoken_mark", "exports", "audio", "audio_map", "idle", "listen", "partner", "timeline", "expression"}
)
MAX_WARNINGS = 40  # on the terminal; all are in the manifest


@add_option_flags(("Batch", BatchOptions), ("Speech and motion", Request), ("Picture", Picture), without=NOT_IN_BATCH)
def batch(  # noqa: PLR0913 - one parameter a flag
    *subtitles: Annotated[
        Path,
        Parameter(
            help="Subtitle files: .srt, .vtt, .ass, .ssa, .ttml, .sbv, .sub, .lrc, .smi, or films with a track of them."
        ),
    ],
    out: Annotated[Path, Parameter(help="Folder of the clips and of manifest.json and manifest.csv.", alias="-o")],
    cast: Annotated[
        Path | None, Parameter(help="TOML file that gives speakers their talker, voice, face, style, ...")
    ] = None,
    lines: Annotated[
        Path | None,
        Parameter(help="CSV table with rate, voice, offset_s or spoken (yes, no) of single lines; see --write-lines."),
    ] = None,
    write_lines: Annotated[
        Path | None,
        Parameter(help="Write the table of all lines, with how each is spoken, to this CSV file; --lines reads it."),
    ] = None,
    talker: Annotated[str, Parameter(help="Talker whose articulation is used.")] = "grid_s1",
    face: Face = None,
    identity: Annotated[str | None, Parameter(help="Preset of the face's age, sex and ancestry.")] = None,
    hair: Hair = None,
    hair_color: HairColor = None,
    person: Person = None,
    palette: Annotated[str, Parameter(help="Palette of gesture styles.")] = "starter",
    audio: Annotated[
        Path | None,
        Parameter(
            help="Folder of recordings in place of a voice: STEM-0001.wav or STEM/0001.wav for cue 1 of STEM.srt, or "
            "STEM.wav for all of it (any sound or video file)."
        ),
    ] = None,
    export: Annotated[
        list[str] | None,
        Parameter(
            help="Files for other programs beside every clip, by ending (glb, track.json, csv, ...; see `tts2face "
            "formats`); several times if wanted.",
            negative="",
        ),
    ] = None,
    jobs: Annotated[int, whole_number("Number of processes on this machine.")] = 1,
    store: Annotated[
        str | None, Parameter(help="Store of rendered segments: a folder, or a URL (s3://, gs://, az://, file://).")
    ] = None,
    database: Annotated[
        str | None,
        Parameter(
            help="Queue of segments for `tts2face worker`: a SQLite file, or postgresql://... for many machines. "
            "Without it the processes of --jobs render."
        ),
    ] = None,
    priority: Annotated[int, whole_number("With --database: jobs with smaller numbers are taken first; from 1.")] = 10,
    sign: Sign = None,
    time_stamp: TimeStamp = None,
    dry_run: Annotated[
        bool, switch("Print speakers, rates, cuts, expected time and disk space; render nothing.")
    ] = False,
    progress: Annotated[
        Literal["bar", "json"], Parameter(help="Progress bar, or one line of JSON for each step on standard output.")
    ] = "bar",
    quiet: Annotated[bool, switch("Print no progress, no warnings and no summary.")] = False,
    **options: Any,
) -> None:
    """Make clips of subtitle files, fitted to their cues. Running it again makes only what is missing or changed."""
    _check_work(jobs, priority, has_database=database is not None)
    _check_places(out, write_lines, subtitles)
    from tts2face.serving.batch.cast import Cast, read_cast
    from tts2face.serving.batch.plan import plan_batch
    from tts2face.session.named_models import Models

    plan = plan_batch(
        subtitles,
        options_from_flags(BatchOptions, options, audio=audio, exports=tuple(export or ())),
        request=options_from_flags(Request, options),
        picture=options_from_flags(Picture, options),
        models=Models(talker, face or "", identity, palette, hair, hair_color, person),
        cast=read_cast(cast) if cast is not None else Cast(),
        lines=lines,
    )
    if not quiet:
        _print_warnings(plan)
    if not plan.outputs:
        raise InputError("no cue can be spoken, so there is nothing to make; the warnings say why")
    if dry_run:
        return print_plan(plan, out, (store, write_lines), quiet=quiet)
    for note in () if quiet else plan.notes:
        write_message(f"tts2face: note: {place_of(note)}: {note.message}")
    from tts2face.serving.batch.report import measure_plan, write_table
    from tts2face.serving.batch.run import SEGMENT_FOLDER
    from tts2face.serving.batch.store import open_store

    # absolute: workers of a database may run in other folders
    signer = open_signer(sign, time_stamp, quiet=quiet)
    place = store if store is not None else str((out / SEGMENT_FOLDER).resolve())
    opened = open_store(place)
    engine = _open_engine(database, place, jobs, priority)
    try:
        result = _run((plan, out, signer), (opened, engine), is_json=progress == "json", quiet=quiet)
    except KeyboardInterrupt as interrupt:
        interrupt.add_note(WhatRemains(f"what is finished is in {out}; the same command continues"))
        raise
    if write_lines is not None:
        write_table(write_lines, plan, measure_plan(plan, opened))
    _finish(result, out, quiet=quiet)
    return None


def _check_work(jobs: int, priority: int, *, has_database: bool) -> None:
    # with a database, workers elsewhere may do all the work
    if jobs < (0 if has_database else 1):
        raise InputError(f"--jobs must be 1 or more (0 with --database: other workers only), not {jobs}")
    if priority < 1:
        raise InputError(f"--priority must be 1 or more, not {priority}")


def _check_places(out: Path, table: Path | None, subtitles: Sequence[Path]) -> None:
    # a Path has made s3:/bucket of s3://bucket
    if "://" in str(out) or str(out).startswith(("s3:", "gs:", "az:")):
        raise InputError(f"--out must be a folder of this machine, not {out}; give a bucket by --store")
    if table is not None and not table.resolve().parent.is_dir():
        raise InputError(f"--write-lines: there is no folder {table.parent}; create it, or choose another")
    if table is not None and table.resolve() in {path.resolve() for path in subtitles}:
        raise InputError(f"--write-lines would replace the subtitles {table}; choose another name")


def _open_engine(database: str | None, place: str, jobs: int, priority: int) -> "Engine":
    """Processes of this machine, or the workers of a database."""
    if database is None:
        from tts2face.serving.batch.engine import LocalEngine

        return LocalEngine(jobs, write_message)
    from tts2face.serving.work.engine import DatabaseEngine

    return DatabaseEngine(database, place, jobs, priority, write_message)


def _run(
    work: "tuple[Plan, Path, Signer | None]", parts: "tuple[Store, Engine]", *, is_json: bool, quiet: bool
) -> "BatchResult":
    from tts2face.serving.batch.run import run_batch

    (plan, out, signer), (store, engine) = work, parts
    with nullcontext(_write_progress) if is_json else progress_bar("segments", quiet) as on_progress:
        return run_batch(
            plan, out, store=store, engine=engine, on_progress=on_progress,
            on_output=_write_output if is_json else None, signer=signer,
        )  # fmt: skip


def _write_progress(done: int, of: int) -> None:
    _write_line({"event": "progress", "done": done, "of": of})


def _write_output(entry: dict[str, Any]) -> None:
    _write_line({"event": "output", **{name: value for name, value in entry.items() if name != "cues"}})


def _write_line(content: dict[str, Any]) -> None:
    sys.stdout.write(json.dumps(content, ensure_ascii=False) + "\n")
    # a program that reads a pipe would get its lines late, many at once
    sys.stdout.flush()


def _finish(result: "BatchResult", out: Path, *, quiet: bool) -> None:
    """Print the summary."""
    if not quiet:
        for warning in result.warnings[:MAX_WARNINGS]:
            write_message(f"tts2face: warning: {warning}")
        if len(result.warnings) > MAX_WARNINGS:
            write_message(f"{len(result.warnings) - MAX_WARNINGS} more warnings are in {out / 'manifest.json'}")
        write_message(
            f"made {result.n_made} clips ({result.seconds:.1f} s) from {result.n_rendered} new segments in "
            f"{result.took_s:.1f} s; {result.n_current} clips were up to date"
        )
    if result.failed:
        name, reason = result.failed[0]
        raise DataError(
            f"{len(result.failed)} clips failed, the first is {name}: {reason}; all are in {out / 'manifest.json'}"
        )


def _print_warnings(plan: "Plan") -> None:
    for warning in plan.warnings[:MAX_WARNINGS]:
        write_message(f"tts2face: warning: {place_of(warning)}: {warning.message}")
    if len(plan.warnings) > MAX_WARNINGS:
        write_message(f"{len(plan.warnings) - MAX_WARNINGS} more warnings will be in the manifest")
