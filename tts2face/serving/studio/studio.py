"""The studio of a service: its projects, those that are open, and what is made of them."""

import asyncio
import gzip
import hashlib
import json
from collections.abc import Awaitable, Callable
from contextlib import suppress
from dataclasses import asdict, replace
from functools import partial
from pathlib import Path

from lexicon.errors import InputError, Tts2faceError
from tts2face import __version__
from tts2face.serving.service.errors import RefusedError
from tts2face.serving.service.keys import ApiKey
from tts2face.serving.service.messages import Work
from tts2face.serving.service.state import ServiceState
from tts2face.serving.studio.project_store import ProjectEntry, ProjectStore
from tts2face.serving.studio.recording_work import Recordings
from tts2face.serving.studio.renders import Renders
from tts2face.serving.studio.reports import Reports
from tts2face.serving.studio.requests import data_of, studio_folder
from tts2face.serving.studio.styles import Styles
from tts2face.serving.studio.takes import Takes
from tts2face.serving.studio.work import WorkList
from tts2face.serving.studio.workspace import Workspace
from tts2face.serving.work.resources import MB
from tts2face.session.project import Project
from tts2face.storage.files import translate_disk_errors, write_atomically
from tts2face.storage.memory import ResultMemory

MAX_IDLE = 10  # open projects that no page shows
MAX_FACES = 40  # faces kept on disk for pages


class Studio:
    """Projects of all keys of a service."""

    def __init__(self, state: ServiceState) -> None:
        self.state = state
        self._folder: Path = studio_folder(state)
        self.store = ProjectStore(self._folder)
        self.memory = ResultMemory(state.settings.previews_mb * MB)
        self.work = WorkList(self._folder)
        self.renders = Renders(state, self.work)
        self.styles = Styles(self)
        self.takes = Takes(self, self.styles)
        self.recordings = Recordings(self._folder, self.work)
        self.reports = Reports(state, self._folder, self.work)
        self._open: dict[tuple[str, str], Workspace] = {}
        self._opening = asyncio.Lock()
        self._preparing: asyncio.Task[None] | None = None
        self._making: dict[str, asyncio.Lock] = {}  # of faces by name

    @property
    def folder(self) -> Path:
        """Folder of projects, recordings and faces."""
        return self._folder

    async def entries(self, key: ApiKey) -> list[ProjectEntry]:
        """Projects of a key, those changed last first."""
        return await asyncio.to_thread(self.store.entries, key.name)

    async def create(self, key: ApiKey, project: Project) -> str:
        """Id of a new project, with the pronunciations that the key keeps.

        Raises
        ------
        InputError
            The key may not use the studio.
        """
        self.check_scope(key)
        words = await asyncio.to_thread(self.store.words, key.name)
        project = replace(project, pronunciations={**words, **project.pronunciations})
        return await asyncio.to_thread(self.store.create, key.name, project)

    async def open(self, key: ApiKey, number: str) -> Workspace:
        """An open project.

        Raises
        ------
        InputError
            The key has no such project.
        DataError
            It is damaged.
        """
        self.check_scope(key)
        async with self._opening:
            found = self._open.get((key.name, number))
            if found is None:
                found = Workspace(self.state, self.store, key, number, self.memory)
                self._open[key.name, number] = found
                await self._close_idle()
        found.key = key
        return found

    async def remove(self, key: ApiKey, number: str) -> None:
        """Remove a project with everything that was made of it; errors as `open`."""
        self.check_scope(key)
        found = self._open.pop((key.name, number), None)
        if found is not None:
            await found.close()
            found.tell_removed()
        await self.work.forget(self.store.folder(number, key.name))
        await asyncio.to_thread(self.store.remove, number, key.name)

    async def start(self) -> None:
        """Begin what an earlier server did not finish, and the face of new projects, as the settings say."""
        await self.work.resume()
        self.recordings.start()
        self.takes.start()
        if self.state.settings.warm_studio:
            self.prepare()

    def prepare(self) -> None:
        """Begin to make the face of new projects, so that the first one shows it at once; only the first call does."""
        if self._preparing is None:
            self._preparing = asyncio.get_running_loop().create_task(self._prepare())

    async def _prepare(self) -> None:
        """Make the face in a process of its own: it takes seconds, in which one of the service would answer nobody."""
        project = Project()
        work = self.state.results.work(kind="face", models=asdict(project.models), request={"has_gestures": True})
        # nobody waits for it
        with suppress(RefusedError, Tts2faceError):  # the first page says why
            await self._face_file(project, work, self.state.pool.make_aside)

    async def face(self, workspace: Workspace) -> tuple[str, Path]:
        """Look of a project and the file of its face, compressed by gzip; made at its first use, and kept.

        Raises
        ------
        InputError
            It is a talker's own face, which has no mesh.
        """
        while True:
            appearance, project = workspace.appearance, workspace.project
            work = await workspace.work("face", has_gestures=project.request.has_gestures)
            try:
                # In any process: making a face takes seconds, in which the project's own process makes its preview.
                return appearance, await self._face_file(
                    project, replace(work, affinity=""), self._maker(workspace.key)
                )
            except RefusedError:
                if appearance == workspace.appearance:
                    raise
                # The project has changed meanwhile, and what its face was made of may have been removed.

    async def plain_face(self, key: ApiKey) -> Path:
        """File of the default head without gestures, as takes move it; errors as `face`."""
        project = Project()
        project = replace(project, request=replace(project.request, gestures="none"))
        work = self.state.results.work(kind="face", models=asdict(project.models), request={"has_gestures": False})
        return await self._face_file(project, work, self._maker(key))

    def _maker(self, key: ApiKey) -> Callable[[Work], Awaitable[bytes]]:
        return partial(data_of, self.state, key)

    async def _face_file(self, project: Project, work: Work, make: Callable[[Work], Awaitable[bytes]]) -> Path:
        parts = [asdict(project.models), dict(work.models), project.request.has_gestures, __version__]
        name = hashlib.sha256(json.dumps(parts, default=str, sort_keys=True).encode()).hexdigest()[:24]
        path = self._folder / "faces" / f"{name}.glb.gz"
        async with self._making.setdefault(name, asyncio.Lock()):
            if not path.is_file():
                with translate_disk_errors(path):
                    path.parent.mkdir(parents=True, exist_ok=True)
                content = await make(work)
                # without a time equal faces have equal files
                await asyncio.to_thread(lambda: write_atomically(path, gzip.compress(content, mtime=0)))
                await asyncio.to_thread(_keep_last, path.parent, MAX_FACES)
        return path

    def open_projects(self, key: ApiKey) -> list[Workspace]:
        """Open projects of a key."""
        return [workspace for (owner, _), workspace in self._open.items() if owner == key.name]

    async def close(self) -> None:
        """Save all projects, and end what is being made."""
        await self.work.close()
        await self.recordings.close()
        if self._preparing is not None:
            self._preparing.cancel()
        for workspace in self._open.values():
            await workspace.close()

    def check_scope(self, key: ApiKey) -> None:
        """Refuse keys that may not make speech."""
        if "speak" not in self.state.keys.current(key).scopes:
            raise InputError(f"the key {key.name} lacks the scope speak; use another key")

    async def _close_idle(self) -> None:
        """Close the projects used least recently that no page shows."""
        idle = sorted(
            (entry for entry in self._open.items() if not entry[1].listeners and not entry[1].preview.is_running),
            key=lambda entry: entry[1].used_at,
        )
        for name, workspace in idle[: max(0, len(idle) - MAX_IDLE)]:
            await workspace.close()
            del self._open[name]


def _keep_last(folder: Path, count: int) -> None:
    files = sorted(folder.glob("*.glb*"), key=lambda path: path.stat().st_mtime)
    for path in files[: max(0, len(files) - count)]:
        path.unlink(missing_ok=True)
