"""Reports of talkers and palettes: made one after another by processes of the tools, kept until they are deleted.

``reports/ID/report.html`` is a page that fetches nothing, ``report.json`` beside it says whose it is and of what.
"""

import asyncio
import json
import re
import secrets
import shutil
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from types import MappingProxyType

from lexicon.errors import DataError, InputError, Tts2faceError
from lexicon.inputs import LARGEST_JSON_BYTES, parse_json, read_text
from tts2face.processes.program import ProcessLimits, Program
from tts2face.processes.tools import run_tool
from tts2face.serving.service.errors import RefusedError
from tts2face.serving.service.keys import ApiKey
from tts2face.serving.service.library import Library
from tts2face.serving.studio.renders import CANCELLED, DONE, FAILED, RUNNING, WAITING
from tts2face.serving.work.resource_check import PALETTE, TALKER
from tts2face.storage.files import translate_disk_errors, write_atomically

REPORT_TOOL = "report"
LIMITS = ProcessLimits(memory_bytes=6 << 30, cpu_s=3600, file_bytes=200 << 20, n_files=256)
REPORT_S = 5.0 * LIMITS.cpu_s  # of one report, on a machine that has other work
MAX_OPEN = 5  # of an owner, waiting or running
ID = re.compile(r"[0-9a-f]{12}")
PAGE, ENTRY = "report.html", "report.json"
KINDS: Mapping[str, tuple[str, str]] = MappingProxyType(  # the kind of model, and what the report is of
    {
        "similarity": (TALKER, "Visual similarity of phones"),
        "accuracy": (TALKER, "Accuracy of the lips"),
        "gestures": (PALETTE, "Gestures"),
    }
)


@dataclass(slots=True)
class Report:
    """A report of a model that is made, or was made; `created` in seconds since 1970."""

    id: str
    owner: str
    kind: str
    model: str
    created: float
    state: str = WAITING
    stage: str = ""
    done: int = 0
    of: int = 0
    message: str = ""
    task: "asyncio.Task[None] | None" = field(default=None, repr=False)

    @property
    def title(self) -> str:
        """What it reports."""
        return f"{KINDS[self.kind][1]}: {self.model}"

    @property
    def share(self) -> float:
        """Done part, 0 to 1."""
        return 1.0 if self.state == DONE else self.done / self.of if self.of else 0.0

    def show(self, stage: str, done: int, of: int) -> None:
        """Set stage and steps."""
        self.stage, self.done, self.of = stage, done, of


class Reports:
    """Reports of all owners in a folder; at most one of each owner is made at a time."""

    def __init__(self, library: Library, folder: Path) -> None:
        self._library, self._folder = library, folder / "reports"
        self._open: dict[str, Report] = {}
        self._turns: dict[str, asyncio.Lock] = {}
        self.listeners: set[Callable[[], None]] = set()

    async def add(self, key: ApiKey, kind: str, model: str) -> Report:
        """Queue a report of a shipped model or of one of the key's.

        Raises
        ------
        InputError
            There is no such report or model, or too many wait.
        """
        if kind not in KINDS:
            raise InputError(f"there is no report {kind[:20]!r}; choose one of {', '.join(KINDS)}")
        if sum(one.owner == key.name and one.state in {WAITING, RUNNING} for one in self._open.values()) >= MAX_OPEN:
            raise InputError(f"{MAX_OPEN} reports are being made already; wait, or cancel one")
        try:
            path, _ = await asyncio.to_thread(self._library.resolve, key, KINDS[kind][0], model)
        except RefusedError as refused:
            raise InputError(refused.message) from refused
        made = Report(secrets.token_hex(6), key.name, kind, model, time.time())
        self._open[made.id] = made
        made.task = asyncio.get_running_loop().create_task(self._make(made, path))
        self._notify()
        return made

    def of_owner(self, owner: str) -> list[Report]:
        """Reports of an owner, the newest first; those made before this server began too."""
        found = {one.id: one for one in self._open.values() if one.owner == owner}
        for entry in self._folder.glob(f"*/{ENTRY}"):
            if ID.fullmatch(entry.parent.name) and entry.parent.name not in found:
                kept = _read(entry)
                if kept is not None and kept.owner == owner:
                    found[kept.id] = kept
        return sorted(found.values(), key=lambda one: -one.created)

    def find(self, owner: str, number: str) -> Report:
        """A report of an owner.

        Raises
        ------
        InputError
            There is none.
        """
        for one in self.of_owner(owner):
            if one.id == number:
                return one
        raise InputError(f"there is no report {number[:20]!r}; choose one from the list")

    def page(self, report: Report) -> Path:
        """Path of a finished report.

        Raises
        ------
        InputError
            It is not finished.
        """
        if report.state != DONE:
            raise InputError(f"the report is {report.state}; wait until it is done")
        return self._folder / report.id / PAGE

    def remove(self, report: Report) -> None:
        """Cancel a report that waits or runs; delete one that is done."""
        if report.task is not None:
            report.task.cancel()
        self._open.pop(report.id, None)
        with translate_disk_errors(self._folder):
            shutil.rmtree(self._folder / report.id, ignore_errors=True)
        self._notify()

    async def close(self) -> None:
        """Cancel all."""
        tasks = [one.task for one in self._open.values() if one.task is not None and not one.task.done()]
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    async def _make(self, report: Report, path: str) -> None:
        folder = self._folder / report.id
        try:
            async with self._turns.setdefault(report.owner, asyncio.Lock()):
                report.state = RUNNING
                self._notify()
                with translate_disk_errors(folder):
                    folder.mkdir(parents=True)
                order = {"kind": report.kind, "model": path, "name": report.model, "out": str(folder / PAGE)}
                await run_tool(
                    Program(REPORT_TOOL, LIMITS), REPORT_TOOL, order, partial(self._show, report), what="it",
                    timeout_s=REPORT_S,
                )  # fmt: skip
                entry = {name: getattr(report, name) for name in ("id", "owner", "kind", "model", "created")}
                write_atomically(folder / ENTRY, json.dumps(entry, ensure_ascii=False).encode())
                report.state = DONE
        except Tts2faceError as wrong:
            report.state, report.message = FAILED, str(wrong)
        except TimeoutError:
            report.state, report.message = FAILED, "the report took too long; try it on a faster machine"
        except asyncio.CancelledError:
            report.state = CANCELLED
            raise
        finally:
            if report.state != DONE:
                shutil.rmtree(folder, ignore_errors=True)
            report.task = None
            self._notify()

    def _show(self, report: Report, stage: str, done: int, of: int) -> None:
        report.show(stage, done, of)
        self._notify()

    def _notify(self) -> None:
        for listener in list(self.listeners):
            listener()


def _read(entry: Path) -> Report | None:
    try:
        content = parse_json(read_text(entry, LARGEST_JSON_BYTES), ENTRY)
        found = Report(
            entry.parent.name, str(content["owner"]), str(content["kind"]), str(content["model"]),
            float(content["created"]), DONE,
        )  # fmt: skip
    except (OSError, DataError, KeyError, TypeError, ValueError):
        return None
    return found if found.kind in KINDS and (entry.parent / PAGE).is_file() else None
