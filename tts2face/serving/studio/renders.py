"""Films and exports of projects: queued, made one after another behind previews, kept until they are deleted.

``renders/ID-NAME`` in the folder of a project is such a file; until it is made, the order ``ID.json`` beside it holds
the project as it was.
"""

import re
import secrets
from contextlib import aclosing
from pathlib import Path

from lexicon.errors import InputError
from tts2face.interchange.exports.table import all_formats, find_format
from tts2face.picture.sound_stream import SOUND_KINDS
from tts2face.picture.streamed_movie import MOVIE_KINDS
from tts2face.serving.service.state import ServiceState
from tts2face.serving.studio.project_store import RENDERS
from tts2face.serving.studio.requests import key_of, project_work
from tts2face.serving.studio.work import ID, BackgroundWork, WorkKind, WorkList
from tts2face.serving.studio.workspace import Workspace
from tts2face.serving.work.jobs import DONE
from tts2face.session.project_file import parse_project, project_json
from tts2face.storage.files import translate_disk_errors

RENDER = "render"  # kind of work
PRIORITY = 1  # below that of previews and of all requests over HTTP
MAX_OPEN = 20  # of an owner, waiting or running
FILE = re.compile(f"({ID})-(.+)")


class Renders:
    """Files of all projects; at most one of each owner is made at a time.

    The first of the files of a render is the one that is downloaded, by its title; `done` and `of` are seconds of the
    clip.
    """

    def __init__(self, state: ServiceState, work: WorkList) -> None:
        self._state, self._work = state, work
        orders = f"projects/*/{RENDERS}/{ID}.json"
        work.register(WorkKind(RENDER, orders, self._make, _prepare, max_open=MAX_OPEN, noun="files"))

    async def add(self, workspace: Workspace, form: str) -> BackgroundWork:
        """Queue a file of a project as it is now.

        Parameters
        ----------
        form
            A movie or sound of `Session.stream_file`, or the ending of an export.

        Raises
        ------
        InputError
            There is no such format, too many files wait, or the project names what does not exist.
        """
        _, kind, more = _plan(workspace.project.name, form)
        await workspace.work(kind, **more)  # refuses what cannot be made
        content = {
            "format": form, "total": workspace.preview.current.duration,
            "project": project_json(workspace.project, workspace.folder),
        }  # fmt: skip
        order = workspace.folder / RENDERS / f"{secrets.token_hex(6)}.json"
        return self._work.add(RENDER, workspace.key.name, order, content)

    def of_project(self, owner: str, folder: Path) -> list[BackgroundWork]:
        """Files of a project by its folder, those made before this server began too."""
        known = {render.id: render for render in self._work.of(RENDER, owner) if render.order.parents[1] == folder}
        for path in sorted((folder / RENDERS).glob("*")):
            found = FILE.fullmatch(path.name)
            if found is not None and found[1] not in known and not path.name.endswith(".part"):
                order = path.with_name(f"{found[1]}.json")
                known[found[1]] = BackgroundWork(RENDER, owner, order, {}, found[2], DONE, files=(path,))
        return list(known.values())

    def find(self, owner: str, folder: Path, number: str) -> BackgroundWork:
        """A file of a project.

        Raises
        ------
        InputError
            There is none.
        """
        for render in self.of_project(owner, folder):
            if render.id == number:
                return render
        raise InputError(f"there is no file {number[:20]!r} of this project; choose one from its list")

    def cancel(self, render: BackgroundWork) -> None:
        """Cancel a file that waits or runs; delete one that is done, or forget it."""
        if render.is_open:
            self._work.cancel(render)
        else:
            self._work.remove(render)

    async def _make(self, render: BackgroundWork) -> str:
        (path, part), folder = render.files, render.order.parents[1]
        key = key_of(self._state, render.owner)
        project = parse_project(render.content["project"], render.order.name, folder)
        _, kind, more = _plan(project.name, render.content["format"])
        work = await project_work(self._state, key, project, folder, kind, **more)
        with translate_disk_errors(path):
            with part.open("wb") as file:
                async with aclosing(self._state.results.messages(work, key, priority=PRIORITY)) as messages:  # type: ignore[type-var]
                    async for message in messages:
                        file.write(message.payload)
                        render.show("", render.done + message.content["seconds"], render.of)
            part.replace(path)
        return ""


def _prepare(render: BackgroundWork) -> None:
    render.title, _, _ = _plan(render.content["project"]["name"], render.content["format"])
    render.of = render.content["total"]
    path = render.order.with_name(f"{render.id}-{render.title}")
    render.files = path, path.with_name(f"{path.name}.part")


def formats() -> dict[str, str]:
    """Formats of files with what they hold."""
    films = dict.fromkeys(MOVIE_KINDS, "film")
    sounds = {name: "the sound" for name in SOUND_KINDS if name not in {"pcm", "wav"}}
    return {
        **films,
        **sounds,
        **{form.suffixes[0][1:]: form.summary for form in all_formats() if form.is_installed},
    }


def _plan(title: str, form: str) -> tuple[str, str, dict[str, str]]:
    """Name of the file, kind of the work, and further fields of its request."""
    if form not in formats():
        raise InputError(f"there is no format {form[:20]!r}; choose one of {', '.join(formats())}")
    # a title becomes the name of a file: letters and digits alone
    stem = re.sub(r"[^A-Za-z0-9]+", "-", title).strip("-")[:60] or "clip"
    name = f"{stem}.{form}"
    if form in MOVIE_KINDS or (form in SOUND_KINDS and form != "wav"):
        return name, "project-file", {"format": form}
    has_more = find_format(Path(name)).has_sound_beside
    return (f"{name}.zip" if has_more else name), "project-export", {"name": name}
