"""Jobs of kind ``clip``: one clip in a format of `Session.stream_file`, as a complete file.

Jobs of kind ``subtitles``: a batch of subtitle files, whose clips and manifest are the results.

Jobs of kind ``talker``: a talker from an uploaded recording, which becomes a model of the key.

The building runs in a process of its own (the tool ``talker``) with limits of memory and time.
"""

import os
import shutil
import time
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from lexicon.errors import DataError
from tts2face.picture.options import Picture
from tts2face.processes.message import Message
from tts2face.processes.parent import Child, ChildEndedError
from tts2face.processes.program import ProcessLimits, Program
from tts2face.request import Request
from tts2face.serving.batch.cast import cast_from_tables
from tts2face.serving.batch.options import BatchOptions
from tts2face.serving.batch.output import CSV_NAME, JSON_NAME, Plan
from tts2face.serving.batch.plan import plan_batch
from tts2face.serving.batch.report import measure_plan, write_table
from tts2face.serving.batch.run import run_batch
from tts2face.serving.batch.segment import FILE_PREFIX, Segment, input_hashes
from tts2face.serving.work.connection import DatabaseAwayError
from tts2face.serving.work.resource_check import TALKER
from tts2face.serving.work.resources import ResourceTable, Usage, keep_files, over_quota, resource_from_folder
from tts2face.serving.work.run import JobTask, Product, Products, products_of
from tts2face.session.encoded_stream import line_formats, media_types
from tts2face.session.named_models import Models

# Fields of a request: names of the job's files.
FILES = {"audio": "audio.wav", "partner": "partner.wav", "timeline": "timeline.json"}
BACKGROUND = "background.png"
LINES = "lines.csv"


def run_clip(task: JobTask) -> Products:
    """Render the clip as one segment, whichever worker takes it.

    Raises
    ------
    DataError
        It could not be rendered; the message says why.
    """
    format = str(task.request["format"])
    segment = clip_segment(task)
    missing = {} if task.store.result(segment.address) is not None else {segment.address: segment}
    for rendered in task.engine.render(missing, task.store):
        if rendered.result is None:
            raise DataError(rendered.reason)
    suffix = line_formats()[format].suffixes[0] if format in line_formats() else f".{format}"
    path = task.store.fetch(segment.address, task.folder)
    return Products((Product(path, f"clip{suffix}", media_types()[format]),))


def clip_segment(task: JobTask) -> Segment:
    """The segment that is the whole clip."""
    models = Models(**task.request["models"])
    request: dict[str, Any] = dict(task.request["request"])
    request |= {field: str(task.inputs[name]) for field, name in FILES.items() if name in task.inputs}
    picture: dict[str, Any] = dict(task.request["picture"])
    if BACKGROUND in task.inputs:
        picture["background"] = str(task.inputs[BACKGROUND])
    medium = f"{FILE_PREFIX}{task.request['format']}"
    hashes = input_hashes(models, request, picture)
    return Segment(request, picture, models, 1, file_hashes=hashes, medium=medium)


N_SHOWN = 3  # reasons of failed clips


def run_subtitles(task: JobTask) -> Products:
    """Make the clips of all files.

    Raises
    ------
    InputError, DataError
        As `plan_batch`; or no clip could be made.
    """
    plan = plan_of(task)
    if not plan.outputs:
        reasons = "; ".join(one.message for one in plan.warnings[:N_SHOWN])
        raise DataError(f"no cue can be spoken: {reasons}")
    out = task.folder / "clips"
    result = run_batch(
        plan, out, store=task.store, engine=task.engine, on_progress=lambda done, of: _report(task, done, of)
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
    for folder in {str(one.parent) for one in task.inputs.values()}:
        text = text.replace(f"{folder}/", "")
    path.write_text(text, encoding="utf-8")


BUILDER = TOOL = "talker"  # the program, and its handler
LIMITS = ProcessLimits(memory_bytes=4 << 30, cpu_s=0, file_bytes=2 << 30, n_files=256)
CPU_S, CPU_S_PER_S = 1200, 40  # of any recording, and for each of its seconds; 256 x 256 pixels take 1 s a second
SLOWNESS = 5.0  # elapsed time in units of the processor time, on a machine that has other work
AWAY_S = 2.0  # between tries to reach the database
N_SHOWN_NOTES = 20  # refused parts, and warnings, that are reported


def run_talker(task: JobTask) -> Products:
    """Build a talker and store it as a model of the key.

    Raises
    ------
    InputError, DataError, BackendError
        The recording is not suitable, as `tts2face corpus build` says; or the name or the quota is used up.
    """
    recordings = task.folder / "recordings"
    recordings.mkdir()
    for name, path in task.inputs.items():
        _place(path, recordings / name)
    result = _build(task)
    task.report(_built_event(result))
    _store(task)
    products = [
        Product(task.folder / "checked" / "content", f"{task.request['name']}.talker", "application/octet-stream")
    ]
    if (task.folder / "report.html").is_file():  # not as text/html: a page of this origin could use its keys
        products.append(Product(task.folder / "report.html", "report.html", "application/octet-stream"))
    return Products(tuple(products))


def _built_event(result: Mapping[str, Any]) -> dict[str, Any]:
    shown = {
        part: [f"{name}: {text}" for name, text in result[part][:N_SHOWN_NOTES]] for part in ("refused", "warnings")
    }
    return {"type": "built", **{name: result[name] for name in ("n_kept", "minutes", "notes")}, **shown}


def _place(source: Path, target: Path) -> None:
    """Place a file beside the others."""
    try:
        os.link(source.resolve(), target)
    except OSError:  # another file system
        shutil.copyfile(source, target)


def _build(task: JobTask) -> Mapping[str, Any]:
    """Run the builder; its result."""
    asked = task.request
    cpu_s = int(CPU_S + CPU_S_PER_S * float(asked["seconds"]))
    order = {
        "folder": str(task.folder), "name": asked["name"], "provenance": asked["provenance"],
        "consent": asked["consent"], "with_appearance": asked["appearance"],
        "with_report": find_spec("matplotlib") is not None, "max_bytes": asked["limits"]["n_bytes"],
    }  # fmt: skip

    def tell(event: Message) -> None:
        with suppress(DatabaseAwayError):
            task.report({"type": "progress", **event.content})

    def look() -> None:
        with suppress(DatabaseAwayError):
            task.check()

    child = Child(Program(BUILDER, replace(LIMITS, cpu_s=cpu_s)))
    try:
        return child.call(TOOL, order, on_event=tell, look=look, timeout_s=SLOWNESS * cpu_s).content
    except ChildEndedError as ended:
        raise DataError("the recording needs too much memory or time; send a shorter or smaller one") from ended
    finally:
        child.close()


def _store(task: JobTask) -> None:
    """Store the talker as a model of the key; while the database cannot be reached, it is tried again."""
    assert task.resources is not None
    asked, blobs, checked = task.request, task.resources(), task.folder / "checked"
    made = resource_from_folder(asked["owner"], TALKER, asked["name"], checked, blobs)
    made = replace(made, description={**made.description, "order": asked["order"]})
    limits = Usage(**asked["limits"])

    def check(usage: Usage) -> None:
        reason = over_quota(made.owner, usage, limits, made.n_bytes)
        if reason is not None:
            raise DataError(reason)

    table = ResourceTable(task.database)
    try:
        while True:
            try:
                if table.add(made, check=check, keep=lambda: keep_files(made, checked, blobs)):
                    return
                found = table.find(made.owner, TALKER, made.name)
            except DatabaseAwayError:
                time.sleep(AWAY_S)
                continue
            if found is not None and found.description.get("order") == asked["order"]:
                return  # by a worker that died afterwards
            raise DataError(f"there is a talker {made.name} already; delete it, or choose another name")
    finally:
        table.close()
