"""The plan of ``tts2face batch --dry-run``: outputs, speakers, rates and what is cut."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from cli.progress import progress_bar

if TYPE_CHECKING:
    from tts2face.serving.batch.output import Plan, PlanWarning
    from tts2face.serving.batch.segment_result import SegmentResult


def place_of(warning: "PlanWarning") -> str:
    """File and line of a warning or note."""
    return f"{warning.file}, line {warning.line}" if warning.line else warning.file


def print_plan(plan: "Plan", out: Path, files: tuple[str | None, Path | None], *, quiet: bool) -> None:
    """Print what a batch will make; `files` are the store and the table of lines to write."""
    from tts2face.serving.batch.estimate import estimate_batch
    from tts2face.serving.batch.report import measure_plan, write_table
    from tts2face.serving.batch.run import SEGMENT_FOLDER
    from tts2face.serving.batch.store import open_store

    store, table = files
    place = store if store is not None else str(out / SEGMENT_FOLDER)
    opened = open_store(place) if "://" in place or Path(place).is_dir() else None
    estimate = estimate_batch(plan, out, opened)
    with progress_bar("lines", quiet) as on_progress:
        results = measure_plan(plan, opened, on_progress)
    for output in plan.outputs:
        length = max((cue.end_s for cue in output.cues), default=output.begin_s) - output.begin_s
        print(f"{output.name}  {output.begin_s:.2f} s  {length:.2f} s  {len(output.cues)} cues")  # noqa: T201 - the result
    for note in plan.notes:
        print(f"note: {place_of(note)}: {note.message}")  # noqa: T201 - the result
    _print_speakers(plan)
    _print_rates(plan, results)
    print(  # noqa: T201 - the result
        f"{plan.n_cues} cues, {plan.n_silent} of them silent; {estimate.n_outputs} clips, {estimate.n_stale} to make "
        f"({_duration(estimate.seconds)}); {estimate.n_segments} segments, {estimate.n_missing} to render; about "
        f"{_duration(estimate.core_s)} of one core and {estimate.n_bytes / 1e6:.0f} MB on disk"
    )
    if table is not None:
        write_table(table, plan, results)


def _print_speakers(plan: "Plan") -> None:
    """Print who speaks, with which face and voice."""
    from tts2face.serving.batch.report import planned_speakers

    for speaker in planned_speakers(plan):
        role = "no role" if speaker.role is None else f"role {speaker.role}"
        if not speaker.n_lines:
            print(f"speaker {speaker.name}: silent, {_lines(speaker.n_silent)}, {role}")  # noqa: T201 - the result
            continue
        lines = _lines(speaker.n_lines) + (f" and {speaker.n_silent} silent" if speaker.n_silent else "")
        print(f"speaker {speaker.name}: {lines}, {role}, face {speaker.face}, voice {speaker.voice}")  # noqa: T201 - the result


def _lines(number: int) -> str:
    return f"{number} line{'s' * (number != 1)}"


def _print_rates(plan: "Plan", results: "Mapping[str, SegmentResult]") -> None:
    """Print the lines that are not spoken as usual, and how many there are."""
    from tts2face.serving.batch.report import fitted_lines, line_notes, summarise

    for line, result in fitted_lines(plan, results):
        notes = line_notes(line, result)
        if not notes:
            continue
        where = f"{line.file}, cue {line.number}" + (f", part {line.part}" if line.part else "")
        print(f"{where}: {'; '.join(notes)}")  # noqa: T201 - the result
    found = summarise(plan, results)
    missing = sum(line.segment is not None for line in plan.lines) - found.n_lines
    if missing:
        print(f"{missing} lines cannot be spoken as planned, and will fail: see the errors of the run")  # noqa: T201
    print(  # noqa: T201 - the result
        f"{found.n_lines} lines: {found.n_faster} faster than usual ({found.n_over_limit} than --max-rate), "
        f"{found.n_slower} slower, {found.n_overlapping} sound on into the next cue, {found.n_cut} lose words"
    )


def _duration(seconds: float) -> str:
    """Seconds in the unit that fits them."""
    if seconds < 100.0:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} minutes" if seconds < 6000.0 else f"{seconds / 3600:.1f} hours"
