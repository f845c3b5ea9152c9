"""Films and exports of projects: queued, made one after another behind previews, kept until they are deleted.

What waits or runs lies beside the files as ``ID.json``, with the project as it was; the next server queues it again.
"""

import asyncio
import json
import re
import secrets
from collections.abc import Callable
from contextlib import aclosing
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from lexicon.errors import DataError, InputError, Tts2faceError
from lexicon.inputs import LARGEST_JSON_BYTES, parse_json, read_text
from tts2face.interchange.exports.table import all_formats, find_format
from tts2face.picture.movie import MOVIE_KINDS
from tts2face.picture.sound_stream import SOUND_KINDS
from tts2face.serving.service.errors import RefusedError
from tts2face.serving.service.keys import LOCAL_KEY, ApiKey
from tts2face.serving.service.logs import log_event
from tts2face.serving.service.messages import Work
from tts2face.serving.service.state import ServiceState
from tts2face.serving.studio.requests import project_work
from tts2face.serving.studio.store import RENDERS
from tts2face.serving.studio.workspace import Workspace
from tts2face.session.project_file import parse_project, project_json
from tts2face.storage.files import translate_disk_errors, write_atomically

WAITING, RUNNING, DONE, FAILED, CANCELLED = "waiting", "running", "done", "failed", "cancelled"
PRIORITY = 1  # below that of previews and of all requests over HTTP
MAX_OPEN = 20  # of an owner, waiting or running
MAX_TRIES = 3  # of a file by servers that ended meanwhile
ORDER = re.compile(r"([0-9a-f]{12})\.json")
FILE = re.compile(r"([0-9a-f]{12})-(.+)")


@dataclass(slots=True)
class Render:
    """A file of a project that is made, or was made.

    Parameters
    ----------
    name
        Name under which it is downloaded.
    seconds, total
        Seconds of the clip that are done, and of the whole clip.
    """

    id: str
    project: str
    owner: str
    name: str
    path: Path
    state: str = WAITING
    seconds: float = 0.0
    total: float = 0.0
    message: str = ""
    task: "asyncio.Task[None] | None" = field(default=None, repr=False)

    @property
    def order(self) -> Path:
        """File with what is to be made, while it is not done."""
        return self.path.with_name(f"{self.id}.json")

    @property
    def share(self) -> float:
        """Done part, 0 to 1."""
        return 1.0 if self.state == DONE else min(self.seconds / self.total, 1.0) if self.total else 0.0


class RenderQueue:
    """Renders of all projects; at most one of each owner runs."""

    def __init__(self, state: ServiceState) -> None:
        self._state = state
        self._renders: dict[str, Render] = {}
        self._turns: dict[str, asyncio.Lock] = {}
        self.listeners: set[Callable[[], None]] = set()

    async def add(self, workspace: Workspace, form: str) -> Render:
        """Queue a file of a project as it is now.

        Parameters
        ----------
        form
            A movie or sound of `Session.stream_file`, or the ending of an export.

        Raises
        ------
        InputError
            There is no such format, or too many files wait.
        """
        owner = workspace.key.name
        if sum(one.owner == owner and one.state in {WAITING, RUNNING} for one in self._renders.values()) >= MAX_OPEN:
            raise InputError(f"{MAX_OPEN} files are being made already; wait, or cancel one")
        number = secrets.token_hex(6)
        name, kind, more = _plan(workspace.project.name, form)
        path = workspace.folder / RENDERS / f"{number}-{name}"
        total = workspace.preview.current.duration
        content = project_json(workspace.project, workspace.folder)
        order = {"owner": owner, "format": form, "total": total, "tries": 1, "project": content}
        work = await workspace.work(kind, **more)
        made = Render(number, workspace.id, owner, name, path, total=total)
        await asyncio.to_thread(_write_order, made.order, order)
        self._begin(made, work, workspace.key)
        return made

    async def resume(self, projects: Path) -> None:
        """Queue again what an earlier server did not finish.

        Parameters
        ----------
        projects
            Folder of the folders of projects.
        """
        for path, order in await asyncio.to_thread(_read_orders, projects):
            try:
                await self._resume(path, order)
            except (Tts2faceError, RefusedError, KeyError, TypeError) as wrong:
                log_event("file not queued again", file=path.name, reason=str(wrong))
                path.unlink(missing_ok=True)

    async def _resume(self, path: Path, order: dict[str, Any]) -> None:
        folder, owner = path.parent.parent, order["owner"]
        key = next((one for one in self._state.keys or (LOCAL_KEY,) if one.name == owner), None)
        if key is None or order["tries"] >= MAX_TRIES:
            raise InputError("its key is gone" if key is None else f"{MAX_TRIES} servers ended while it was made")
        project = parse_project(order["project"], path.name, folder)
        name, kind, more = _plan(project.name, order["format"])
        work = await project_work(self._state, key, project, folder, kind, **more)
        await asyncio.to_thread(_write_order, path, order | {"tries": order["tries"] + 1})
        file = path.with_name(f"{path.stem}-{name}")
        self._begin(Render(path.stem, folder.name, owner, name, file, total=order["total"]), work, key)

    def _begin(self, render: Render, work: Work, key: ApiKey) -> None:
        self._renders[render.id] = render
        render.task = asyncio.get_running_loop().create_task(self._make(render, work, key))
        self._notify()

    def of_project(self, project: str, owner: str, folder: Path) -> list[Render]:
        """Renders of a project, those made before this server began too."""
        known = {one.id: one for one in self._renders.values() if (one.project, one.owner) == (project, owner)}
        for path in sorted((folder / RENDERS).glob("*")):
            found = FILE.fullmatch(path.name)
            if found is not None and found[1] not in known and not path.name.endswith(".part"):
                known[found[1]] = Render(found[1], project, owner, found[2], path, DONE)
        return list(known.values())

    def find(self, project: str, owner: str, folder: Path, number: str) -> Render:
        """A render of a project.

        Raises
        ------
        InputError
            There is none.
        """
        for one in self.of_project(project, owner, folder):
            if one.id == number:
                return one
        raise InputError(f"there is no file {number[:20]!r} of this project; choose one from its list")

    def cancel(self, render: Render) -> None:
        """Cancel a render that waits or runs; delete the file of one that is done."""
        if render.task is not None:
            render.task.cancel()
        if render.state in {WAITING, RUNNING}:
            render.state = CANCELLED
        else:
            self._renders.pop(render.id, None)
        render.path.unlink(missing_ok=True)
        render.order.unlink(missing_ok=True)
        self._notify()

    def forget(self, project: str) -> None:
        """Cancel and forget all renders of a project that is removed."""
        for one in [one for one in self._renders.values() if one.project == project]:
            if one.task is not None:
                one.task.cancel()
            del self._renders[one.id]

    async def close(self) -> None:
        """End all; a later server makes what is not done."""
        tasks = [one.task for one in self._renders.values() if one.task is not None and not one.task.done()]
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    async def _make(self, render: Render, work: Work, key: ApiKey) -> None:
        part = render.path.with_name(f"{render.path.name}.part")
        try:
            async with self._turns.setdefault(render.owner, asyncio.Lock()):
                render.state = RUNNING
                await self._write(render, part, work, key)
                part.replace(render.path)
                render.state = DONE
                render.order.unlink(missing_ok=True)
        except (RefusedError, Tts2faceError) as wrong:
            render.state, render.message = FAILED, wrong.message if isinstance(wrong, RefusedError) else str(wrong)
            render.order.unlink(missing_ok=True)
        except asyncio.CancelledError:
            render.state = CANCELLED
            raise
        finally:
            part.unlink(missing_ok=True)
            render.task = None
            self._notify()

    async def _write(self, render: Render, part: Path, work: Work, key: ApiKey) -> None:
        with translate_disk_errors(render.path):
            part.parent.mkdir(exist_ok=True)
            with part.open("wb") as file:
                async with aclosing(self._state.messages(work, key, priority=PRIORITY)) as messages:  # type: ignore[type-var]
                    async for message in messages:
                        file.write(message.payload)
                        render.seconds += message.content["seconds"]
                        self._notify()

    def _notify(self) -> None:
        for listener in list(self.listeners):
            listener()


def _write_order(path: Path, order: dict[str, Any]) -> None:
    with translate_disk_errors(path):
        path.parent.mkdir(exist_ok=True)
    write_atomically(path, json.dumps(order, ensure_ascii=False).encode())


def _read_orders(projects: Path) -> list[tuple[Path, dict[str, Any]]]:
    """Orders of all projects, the oldest first; what an ended server left of their files is removed."""
    found = []
    for path in projects.glob(f"*/{RENDERS}/*.json"):
        if ORDER.fullmatch(path.name):
            for part in path.parent.glob(f"{path.stem}-*.part"):
                part.unlink(missing_ok=True)
            try:
                found.append(
                    (path.stat().st_mtime, path, dict(parse_json(read_text(path, LARGEST_JSON_BYTES), path.name)))
                )
            except (OSError, DataError, TypeError, ValueError):
                path.unlink(missing_ok=True)
    return [(path, order) for _, path, order in sorted(found, key=lambda one: one[0])]


def formats() -> dict[str, str]:
    """Formats of files with what they hold."""
    films = dict.fromkeys(MOVIE_KINDS, "film")
    sounds = {name: "the sound" for name in SOUND_KINDS if name not in {"pcm", "wav"}}
    return {**films, **sounds, **{one.suffixes[0][1:]: one.summary for one in all_formats() if one.is_installed}}


def _plan(title: str, form: str) -> tuple[str, str, dict[str, str]]:
    """Name of the file, kind of the work, and further fields of its request."""
    if form not in formats():
        raise InputError(f"there is no format {form[:20]!r}; choose one of {', '.join(formats())}")
    stem = re.sub(r"[^A-Za-z0-9]+", "-", title).strip("-")[:60] or "clip"
    name = f"{stem}.{form}"
    if form in MOVIE_KINDS or (form in SOUND_KINDS and form != "wav"):
        return name, "project-file", {"format": form}
    has_more = find_format(Path(name)).has_sound_beside
    return (f"{name}.zip" if has_more else name), "project-export", {"name": name}
