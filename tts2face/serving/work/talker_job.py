"""Jobs of kind ``talker``: a talker from an uploaded recording, which becomes a model of the key."""

import os
import shutil
import time
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

from lexicon.errors import DataError
from tts2face.processes.message import Message
from tts2face.processes.parent import Child
from tts2face.serving.work.kinds import JobTask, Product, Products
from tts2face.serving.work.resource_check import TALKER
from tts2face.serving.work.resources import ResourceTable, Usage, keep_files, over_quota, resource_from_folder
from tts2face.serving.work.tools import TALKER_TOOL, limits_of, talker_build
from tts2face.storage.sql import DatabaseAwayError

AWAY_S = 2.0  # between tries to reach the database
N_SHOWN_NOTES = 20  # refused parts, and warnings, that are reported


def run_talker(task: JobTask) -> Products:
    """Build a talker and store it as a model of the key."""
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
    order = {
        "folder": str(task.folder), "name": asked["name"], "consent": asked["consent"],
        "provenance": asked["provenance"], "with_appearance": asked["appearance"],
        "max_bytes": asked["limits"]["n_bytes"],
    }  # fmt: skip
    build = talker_build(float(asked["seconds"]))

    def report(event: Message) -> None:
        with suppress(DatabaseAwayError):
            task.report({"type": "progress", **event.content})

    def check() -> None:
        with suppress(DatabaseAwayError):
            task.check()

    child = Child(build.program)
    try:
        with limits_of("the recording"):
            return child.call(TALKER_TOOL, order, on_event=report, check=check, timeout_s=build.timeout_s).content
    finally:
        child.close()


def _store(task: JobTask) -> None:
    """Store the talker as a model of the key; while the database cannot be reached, it is tried again."""
    assert task.resources is not None
    asked = task.request
    blobs = task.resources()
    checked = task.folder / "checked"
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
