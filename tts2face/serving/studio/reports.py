"""Reports of talkers and palettes: made one after another by processes of the tools, kept until they are deleted.

``reports/ID/report.html`` is a page that fetches nothing, ``report.json`` beside it says whose it is and of what; until
it is made, the order ``reports/ID.json`` says so.
"""

import asyncio
import json
import secrets
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType

from lexicon.errors import DataError, InputError
from lexicon.values.files import read_text
from lexicon.values.json_text import LARGEST_JSON_BYTES, parse_json
from tts2face.processes.program import ProcessLimits, Program
from tts2face.serving.service.errors import RefusedError
from tts2face.serving.service.keys import ApiKey
from tts2face.serving.service.state import ServiceState
from tts2face.serving.studio.requests import key_of
from tts2face.serving.studio.work import ID, BackgroundWork, WorkKind, WorkList
from tts2face.serving.work.jobs import DONE
from tts2face.serving.work.resource_check import PALETTE, TALKER
from tts2face.serving.work.tools import run_tool
from tts2face.storage.files import translate_disk_errors, write_atomically

REPORT_TOOL = REPORT = "report"  # the tool, and the kind of work
LIMITS = ProcessLimits(memory_bytes=6 << 30, cpu_s=3600, file_bytes=200 << 20, n_files=256)
REPORT_S = 5.0 * LIMITS.cpu_s  # of one report, on a machine that has other work
MAX_OPEN = 5  # of an owner, waiting or running
PAGE, ENTRY = "report.html", "report.json"
KINDS: Mapping[str, tuple[str, str]] = MappingProxyType(  # the kind of model, and what the report is of
    {
        "similarity": (TALKER, "Visual similarity of phones"),
        "accuracy": (TALKER, "Accuracy of the lips"),
        "gestures": (PALETTE, "Gestures"),
    }
)


class Reports:
    """Reports of all owners; at most one of each owner is made at a time.

    The content of an order has the ``kind`` of the report and the ``model``.
    """

    def __init__(self, state: ServiceState, folder: Path, work: WorkList) -> None:
        self._state = state
        self._folder = folder / "reports"
        self._work = work
        late = "the report took too long; try it on a faster machine"
        orders = f"reports/{ID}.json"
        work.register(WorkKind(REPORT, orders, self._make, _prepare, max_open=MAX_OPEN, noun="reports", late=late))

    async def add(self, key: ApiKey, kind: str, model: str) -> BackgroundWork:
        """Queue a report of a shipped model or of one of the key's.

        Raises
        ------
        InputError
            There is no such report or model, or too many wait.
        """
        if kind not in KINDS:
            raise InputError(f"there is no report {kind[:20]!r}; choose one of {', '.join(KINDS)}")
        try:
            await self._path(key, kind, model)
        except RefusedError as refused:
            raise InputError(refused.message) from refused
        order = self._folder / f"{secrets.token_hex(6)}.json"
        return self._work.add(REPORT, key.name, order, {"kind": kind, "model": model})

    def of_owner(self, owner: str) -> list[BackgroundWork]:
        """Reports of an owner, the newest first; those made before this server began too."""
        found = {report.id: report for report in self._work.of(REPORT, owner)}
        for entry in self._folder.glob(f"{ID}/{ENTRY}"):
            kept = None if entry.parent.name in found else _read(entry)
            if kept is not None and kept.owner == owner:
                found[kept.id] = kept
        return sorted(found.values(), key=lambda report: -report.created)

    def find(self, owner: str, number: str) -> BackgroundWork:
        """A report of an owner.

        Raises
        ------
        InputError
            There is none.
        """
        for report in self.of_owner(owner):
            if report.id == number:
                return report
        raise InputError(f"there is no report {number[:20]!r}; choose one from the list")

    def page(self, report: BackgroundWork) -> Path:
        """Path of a finished report.

        Raises
        ------
        InputError
            It is not finished.
        """
        if report.state != DONE:
            raise InputError(f"the report is {report.state}; wait until it is done")
        return report.files[0] / PAGE

    async def _make(self, report: BackgroundWork) -> str:
        folder, (kind, model) = report.files[0], (report.content["kind"], report.content["model"])
        path = await self._path(key_of(self._state, report.owner), kind, model)
        with translate_disk_errors(folder):
            folder.mkdir(parents=True)
        order = {"kind": kind, "model": path, "name": model, "out": str(folder / PAGE)}
        program = Program(REPORT_TOOL, LIMITS)
        await run_tool(program, REPORT_TOOL, order, report.show, what="it", timeout_s=REPORT_S)
        entry = {"id": report.id, "owner": report.owner, **report.content, "created": report.created}
        write_atomically(folder / ENTRY, json.dumps(entry, ensure_ascii=False).encode())
        return ""

    async def _path(self, key: ApiKey, kind: str, model: str) -> str:
        """Path of the model of a report."""
        path, _ = await asyncio.to_thread(self._state.library.resolve, key, KINDS[kind][0], model)
        return path


def _prepare(report: BackgroundWork) -> None:
    report.title = f"{KINDS[report.content['kind']][1]}: {report.content['model']}"
    report.files = (report.order.with_suffix(""),)


def _read(entry: Path) -> BackgroundWork | None:
    """A report that was made before this server began; None if its files are damaged."""
    folder = entry.parent
    try:
        content = parse_json(read_text(entry, LARGEST_JSON_BYTES), ENTRY)
        described, created = {name: str(content[name]) for name in ("kind", "model")}, float(content["created"])
        order = folder.with_suffix(".json")
        found = BackgroundWork(REPORT, str(content["owner"]), order, described, state=DONE, created=created)
        _prepare(found)
    except (OSError, DataError, KeyError, TypeError, ValueError):
        return None
    return found if (folder / PAGE).is_file() else None
