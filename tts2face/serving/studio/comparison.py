"""The comparison of an open project: the preview of its A, kept on disk, and how alike both are."""

import asyncio
import json
import shutil
import tempfile
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from lexicon.errors import DataError, InputError, Tts2faceError
from lexicon.values.files import read_text
from lexicon.values.json_text import LARGEST_JSON_BYTES, parse_json
from tts2face.serving.service.keys import ApiKey
from tts2face.serving.service.messages import Work
from tts2face.serving.service.state import ServiceState
from tts2face.serving.studio.preview_bundle import Preview, read_bundle
from tts2face.serving.studio.previews import ProjectPreview
from tts2face.serving.studio.reference import TAKE, Reference, parse_reference, reference_json, reference_project
from tts2face.serving.studio.requests import check_options, events_of, project_work
from tts2face.session.project import Project
from tts2face.session.project_file import project_json
from tts2face.storage.files import translate_disk_errors, write_atomically
from tts2face.storage.memory import ResultMemory

FOLDER = "compare"  # in the folder of a project
FILE, TAKE_FILE = "reference.json", "take.csv"
MAX_TAKE_BYTES = 100_000_000
NOT_READY = "the comparison is not made yet; wait a moment"


class OpenProject(Protocol):
    """The project of a comparison (`tts2face.serving.studio.workspace.Workspace`)."""

    key: ApiKey
    folder: Path
    preview: ProjectPreview

    @property
    def project(self) -> Project:
        """The project as it is now."""

    async def work(self, kind: str, **more: Any) -> Work:
        """A task of the project."""


class ComparedProject:
    """The other side of a project, its preview, and measures. All methods belong to the event loop.

    Parameters
    ----------
    on_change
        Called after each change.
    """

    def __init__(
        self, state: ServiceState, workspace: OpenProject, memory: ResultMemory, on_change: Callable[[], None]
    ) -> None:
        self._state, self._workspace = state, workspace
        self._on_change = on_change
        self._folder = workspace.folder / FOLDER
        self.preview = ProjectPreview(
            lambda work: state.results.messages(work, workspace.key),
            memory,
            on_change=on_change,
            on_fit=self._finish,
            on_speech=lambda seconds: state.limits.add_speech(workspace.key, seconds),
        )
        self.reference: Reference | None = self._read()
        self.is_ready = False
        self._made_of = ""
        self._measured: tuple[tuple[int, int], dict[str, Any]] | None = None
        self._turn = asyncio.Lock()

    @property
    def error(self) -> str:
        """Why there is no preview; empty if nothing is wrong."""
        return "" if self.is_ready or self.preview.is_running else self.preview.current.error

    async def keep(self, label: str) -> None:
        """Compare from now on with the project as it is now."""
        await self._set(Reference("kept", label, project=self._workspace.project))

    async def choose(self, content: Any) -> None:
        """Compare with settings, a recording or a take of a client."""
        found = parse_reference(content, self._workspace.folder)
        if found.project is not None:
            raise InputError("a project is kept as it is now; give the kind kept without a project")
        for part in ("request", "models"):
            options = getattr(found, part)
            if options:
                checked = await check_options(self._state, self._workspace.key, self._workspace.folder, part, options)
                found = replace(found, request=checked) if part == "request" else replace(found, models=checked)
        if found.kind == TAKE and not (self._folder / TAKE_FILE).is_file():
            raise InputError("there is no take; import a Live Link file first")
        reference_project(found, self._workspace.project)
        await self._set(found)

    async def import_take(self, source: Path, name: str) -> None:
        """Keep a Live Link file, and compare with it."""
        if Path(name).suffix.lower() != ".csv" or source.stat().st_size > MAX_TAKE_BYTES:
            raise InputError(
                f"{name[-40:]!r} is no take; give a .csv file of Live Link Face of at most {MAX_TAKE_BYTES / 1e6:g} MB"
            )
        await asyncio.to_thread(_copy, source, self._folder / TAKE_FILE)
        self._made_of = ""
        await self._set(Reference(TAKE, f"take {Path(name).stem[-60:]}"))

    async def clear(self) -> None:
        """Compare with nothing."""
        self.preview.cancel()
        self.reference, self._measured = None, None
        self.is_ready, self._made_of = False, ""
        # nothing was compared
        with translate_disk_errors(self._folder), suppress(FileNotFoundError):
            await asyncio.to_thread(shutil.rmtree, self._folder)
        self._on_change()

    def follow(self) -> None:
        """Make the preview unless it is that of the project as it is now."""
        if self.reference is None:
            return
        try:
            project = reference_project(self.reference, self._workspace.project)
        except Tts2faceError as wrong:
            self._refuse(str(wrong))
            return
        folder, key = self._workspace.folder, self._workspace.key
        more = self._source(self.reference)
        made_of = json.dumps([project_json(project, folder), more], sort_keys=True, default=str)
        # an edit that the A does not depend on
        if made_of == self._made_of and (self.is_ready or self.preview.is_running):
            return
        self._made_of, self.is_ready = made_of, False
        kind = "recorded" if self.reference.is_recorded else "project"

        async def ask(have: tuple[str, ...]) -> Work:
            return await project_work(self._state, key, project, folder, kind, have=have, **more)

        self.preview.start(ask)
        self._on_change()

    async def measures(self) -> dict[str, Any]:
        """How alike the project and its A are: fields of `tts2face.session.comparison.MotionComparison`.

        Raises
        ------
        InputError
            There is no comparison, it is not made yet, or the two have nothing in common.
        """
        async with self._turn:
            state = self.preview.current.revision, self._workspace.preview.current.revision
            if self._measured is None or self._measured[0] != state:
                self._measured = state, await self._measure()
            return self._measured[1]

    async def recordings(self) -> list[tuple[str, str]]:
        """Names of the talker's recordings with their words."""
        work = await self._workspace.work("recordings")
        async for event, _ in events_of(self._state.results.messages(work, self._workspace.key)):
            return [(name, words) for name, words in event["recordings"]]
        return []

    async def _measure(self) -> dict[str, Any]:
        content = self.preview.bundle(None) if self.is_ready and self.reference is not None else None
        if content is None or self.reference is None:
            raise InputError(NOT_READY)
        header, motion, head, _ = read_bundle(content)
        with tempfile.TemporaryDirectory(prefix="tts2face-compare-") as folder:
            path = Path(folder, "motion.npz")
            await asyncio.to_thread(np.savez, path, motion=motion, head=head)
            work = await self._workspace.work(
                "measure", motion=str(path), channels=header["channels"], fps=header["fps"],
                sentences=[] if self.reference.is_recorded else header["sentences"],
            )  # fmt: skip
            async for event, _ in events_of(self._state.results.messages(work, self._workspace.key)):
                return {name: value for name, value in event.items() if name != "type"}
        raise InputError(NOT_READY)

    def _source(self, reference: Reference) -> dict[str, Any]:
        if not reference.is_recorded:
            return {}
        take = str(self._folder / TAKE_FILE) if reference.kind == TAKE else ""
        return {"recording": reference.recording, "take": take, "offset": reference.offset}

    async def _set(self, reference: Reference) -> None:
        content = json.dumps(reference_json(reference, self._workspace.folder), ensure_ascii=False)
        with translate_disk_errors(self._folder):
            self._folder.mkdir(exist_ok=True)
        await asyncio.to_thread(write_atomically, self._folder / FILE, content.encode())
        self.reference, self._measured = reference, None
        self.is_ready = False
        self._on_change()
        self.follow()

    def _read(self) -> Reference | None:
        path = self._folder / FILE
        try:
            return parse_reference(parse_json(read_text(path, LARGEST_JSON_BYTES), FILE), self._workspace.folder)
        except (OSError, DataError, InputError):
            return None  # nothing is compared, or what was kept is damaged

    def _finish(self, _: Preview, dropped: list[tuple[str, int]], cut_to: float | None) -> list[str]:
        self.is_ready = True
        return ["some of what was kept no longer fits its text; A is made without it"] if dropped or cut_to else []

    def _refuse(self, message: str) -> None:
        self.preview.cancel()
        self.preview.fail(message)
        self.is_ready, self._made_of = False, ""


def _copy(source: Path, target: Path) -> None:
    with translate_disk_errors(target):
        target.parent.mkdir(exist_ok=True)
        shutil.copyfile(source, target.with_name(f".{target.name}"))
        target.with_name(f".{target.name}").replace(target)
