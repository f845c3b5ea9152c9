"""Jobs of kind ``subtitles``: a batch of subtitle files, whose clips and manifest are the results."""

from pathlib import Path
from typing import Any

from lexicon.errors import DataError
from tts2face.picture.options import Picture
from tts2face.request import Request
from tts2face.serving.batch.cast import cast_from_tables
from tts2face.serving.batch.manifest import CSV_NAME, JSON_NAME
from tts2face.serving.batch.options import BatchOptions
from tts2face.serving.batch.output import Plan
from tts2face.serving.batch.plan import plan_batch
from tts2face.serving.batch.report import measure_plan, write_table
from tts2face.serving.batch.run import run_batch
from tts2face.serving.work.clip_job import BACKGROUND
from tts2face.serving.work.kinds import JobTask, Products, products_of
from tts2face.session.named_models import Models

LINES = "lines.csv"
N_SHOWN = 3  # reasons of failed clips


def run_subtitles(task: JobTask) -> Products:
    """Make the clips of all files."""
    plan = plan_of(task)
    if not plan.outputs:
        reasons = "; ".join(warning.message for warning in plan.warnings[:N_SHOWN])
        raise DataError(f"no cue can be spoken: {reasons}")
    out = task.folder / "clips"
    result = run_batch(
        plan,
        out,
        store=task.store,
        engine=task.engine,
        on_progress=lambda done, of: _report(task, done, of),
        signer=task.signer,
    )
    for name in (JSON_NAME, CSV_NAME):
        _remove_folders(out / name, task)
    if LINES in task.inputs:
        write_table(out / LINES, plan, measure_plan(plan, task.store))
    failed = [f"{name}: {reason}" for name, reason in result.failed]
    if result.n_made == 0:
        raise DataError("; ".join(failed[:N_SHOWN]))
    error = f"{len(failed)} clips are missing: {'; '.join(failed[:N_SHOWN])}" if failed else None
    return products_of([path for path in sorted(out.iterdir()) if path.is_file()], error)


def plan_of(task: JobTask) -> Plan:
    """Plan of the subtitle files, which are all inputs whose names the request lists."""
    content = task.request
    options: dict[str, Any] = dict(content["options"]) | {"exports": tuple(content["options"].get("exports", ()))}
    if content.get("has_audio"):
        options["audio"] = next(path for name, path in task.inputs.items() if name.endswith(".wav")).parents[1]
    picture = dict(content["picture"])
    if BACKGROUND in task.inputs:
        picture["background"] = str(task.inputs[BACKGROUND])
    return plan_batch(
        [task.inputs[name] for name in content["subtitles"]],
        BatchOptions(**options),
        request=Request(**content["request"]),
        picture=Picture(**picture),
        models=Models(**content["models"]),
        cast=cast_from_tables(content.get("cast", {}), "the cast"),
        lines=task.inputs.get(LINES),
    )


def _report(task: JobTask, done: int, of: int) -> None:
    task.check()
    task.report({"type": "progress", "done": done, "of": of})


def _remove_folders(path: Path, task: JobTask) -> None:
    """Leave only the names of the job's files in a manifest."""
    text = path.read_text(encoding="utf-8")
    for folder in {str(path.parent) for path in task.inputs.values()}:
        text = text.replace(f"{folder}/", "")
    path.write_text(text, encoding="utf-8")
