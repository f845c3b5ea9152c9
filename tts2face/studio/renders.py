"""Films and exports of projects: queued, made one after another behind previews, kept until they are deleted."""

import asyncio
import re
import secrets
from collections.abc import Callable
from contextlib import aclosing
from dataclasses import dataclass, field
from pathlib import Path

from lexicon.errors import InputError, Tts2faceError
from tts2face.exports.formats import FORMATS, find_format
from tts2face.render.movie_stream import MOVIE_KINDS
from tts2face.render.sound_stream import SOUND_KINDS
from tts2face.service.access.keys import ApiKey
from tts2face.service.errors import RefusedError
from tts2face.service.state import ServiceState
from tts2face.service.synthesis.messages import MessageKind
from tts2face.service.synthesis.work import Work
from tts2face.storage.files import translate_disk_errors
from tts2face.studio.store import RENDERS
from tts2face.studio.workspace import Workspace

WAITING, RUNNING, DONE, FAILED, CANCELLED = "waiting", "running", "done", "failed", "cancelled"
PRIORITY = 1  # below that of previews and of all requests over HTTP
MAX_OPEN = 20  # of an owner, waiting or running
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
        work = await workspace.work(kind, **more)
        made = Render(number, workspace.id, owner, name, path, total=workspace.preview.current.duration)
        self._renders[number] = made
        made.task = asyncio.get_running_loop().create_task(self._make(made, work, workspace.key))
        self._notify()
        return made

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
        self._notify()

    def forget(self, project: str) -> None:
        """Cancel and forget all renders of a project that is removed."""
        for one in [one for one in self._renders.values() if one.project == project]:
            if one.task is not None:
                one.task.cancel()
            del self._renders[one.id]

    async def close(self) -> None:
        """Cancel all."""
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
        except (RefusedError, Tts2faceError) as wrong:
            render.state, render.message = FAILED, wrong.message if isinstance(wrong, RefusedError) else str(wrong)
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
                        if message.kind == MessageKind.DATA:
                            file.write(message.payload)
                        render.seconds += message.seconds
                        self._notify()

    def _notify(self) -> None:
        for listener in list(self.listeners):
            listener()


def formats() -> dict[str, str]:
    """Formats of files with what they hold."""
    films = dict.fromkeys(MOVIE_KINDS, "film")
    sounds = {name: "the sound" for name in SOUND_KINDS if name not in {"pcm", "wav"}}
    return {**films, **sounds, **{one.suffixes[0][1:]: one.summary for one in FORMATS if one.is_installed}}


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
