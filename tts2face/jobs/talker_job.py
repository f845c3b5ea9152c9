"""Jobs of kind ``talker``: a talker from an uploaded recording, which becomes a model of the key.

The building runs in a process of its own (`corpus_tools.build_process`) with limits of memory and time.
"""

import json
import os
import queue
import shutil
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import asdict, replace
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from lexicon.errors import BackendError, DataError
from lexicon.inputs import parse_json
from tts2face.batch.render_process import KINDS
from tts2face.jobs.connection import DatabaseAwayError
from tts2face.jobs.job_kinds import JobTask, Product, Products
from tts2face.jobs.resource_check import TALKER
from tts2face.jobs.resource_table import ResourceTable, Usage, keep_files, over_quota, resource_from_folder
from tts2face.limited_process import ProcessLimits, bare_environment

BUILDER = "corpus_tools.build_process"  # by name: the tools stand above this package
LIMITS = ProcessLimits(memory_bytes=4 << 30, cpu_s=0, file_bytes=2 << 30, n_files=256)
CPU_S, CPU_S_PER_S = 1200, 40  # of any recording, and for each of its seconds; 256 x 256 pixels take 1 s a second
SLOWNESS = 5.0  # elapsed time in units of the processor time, on a machine that has other work
LOOK_S, AWAY_S = 1.0, 2.0  # between two looks whether the job is wanted, and between tries to reach the database
N_SHOWN = 20  # refused parts, and warnings, that are reported


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


def _built_event(result: dict[str, Any]) -> dict[str, Any]:
    shown = {part: [f"{name}: {text}" for name, text in result[part][:N_SHOWN]] for part in ("refused", "warnings")}
    return {"type": "built", **{name: result[name] for name in ("n_kept", "minutes", "notes")}, **shown}


def _place(source: Path, target: Path) -> None:
    """Place a file beside the others."""
    try:
        os.link(source.resolve(), target)
    except OSError:  # another file system
        shutil.copyfile(source, target)


def _build(task: JobTask) -> dict[str, Any]:
    """Run the builder; its result."""
    asked = task.request
    cpu_s = int(CPU_S + CPU_S_PER_S * float(asked["seconds"]))
    order = {
        "folder": str(task.folder), "name": asked["name"], "provenance": asked["provenance"],
        "consent": asked["consent"], "with_appearance": asked["appearance"],
        "with_report": find_spec("matplotlib") is not None, "max_bytes": asked["limits"]["n_bytes"],
        "limits": asdict(replace(LIMITS, cpu_s=cpu_s)),
    }  # fmt: skip
    for content in _messages(task, order, time.monotonic() + SLOWNESS * cpu_s):
        if "error" in content:
            raise KINDS.get(content["error"], BackendError)(content["message"])
        if "n_kept" in content:
            return content
        with suppress(DatabaseAwayError):
            task.report({"type": "progress", **content})
    raise DataError("the recording needs too much memory or time; send a shorter or smaller one")


def _messages(task: JobTask, order: dict[str, Any], deadline: float) -> Iterator[dict[str, Any]]:
    """Messages of the builder until it ends; it is ended when the job is no longer wanted, or late."""
    child = subprocess.Popen(
        [sys.executable, "-m", BUILDER], stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
        text=True, encoding="utf-8", env=bare_environment(),
    )  # fmt: skip
    assert child.stdin is not None
    assert child.stdout is not None
    lines: queue.SimpleQueue[str] = queue.SimpleQueue()
    reader = threading.Thread(target=_read_lines, args=(child.stdout, lines), daemon=True)
    try:
        child.stdin.write(json.dumps(order) + "\n")
        child.stdin.flush()
        reader.start()
        while time.monotonic() < deadline:
            with suppress(DatabaseAwayError):
                task.check()
            try:
                line = lines.get(timeout=LOOK_S)
            except queue.Empty:
                continue
            if not line:
                return
            yield parse_json(line, "the builder")
    finally:
        child.kill()
        child.wait()
        with suppress(OSError):
            child.stdin.close()
        if reader.ident is not None:
            reader.join()
        child.stdout.close()


def _read_lines(file: Any, lines: "queue.SimpleQueue[str]") -> None:
    """Pass lines on; an empty one at the end."""
    for line in file:
        lines.put(line)
    lines.put("")


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
