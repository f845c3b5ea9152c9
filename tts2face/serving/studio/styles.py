"""Own styles of the studio: made of takes by the tools, derived, renamed and deleted, in projects, too."""

import asyncio
import os
from collections.abc import Callable
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

from lexicon.errors import InputError, Tts2faceError
from tts2face.models.palette import Palette, read_palette
from tts2face.models.palette_editing import (
    StyleMix,
    add_derivation,
    check_new_style,
    mix_styles,
    remove_style,
    rename_style,
)
from tts2face.processes.tools import run_take_tool
from tts2face.serving.service.keys import ApiKey
from tts2face.serving.studio.importing import StudioHost
from tts2face.serving.studio.requests import data_of
from tts2face.serving.studio.store import CACHE, MADE, SHIPPED, PaletteStore, ProjectEntry, is_own_palette
from tts2face.session import project as style_names
from tts2face.session.project import Project
from tts2face.storage.files import translate_disk_errors, write_atomically

GOOD, WEAK, REFUSED = "good", "weak", "refused"  # states of a take that was checked
CHECKING, MAKING, CHECKED = "checking", "making", "checked"
N_SHOWN = 5  # names of projects in a sentence


@dataclass(slots=True)
class TakeWork:
    """Work on the take of an owner: its stage with steps done and of all, then what came of it.

    ``doing`` is `CHECKING`, `MAKING` or empty; ``state`` is `GOOD`, `WEAK` or `REFUSED` after the check; ``advice`` one
    sentence.
    """

    doing: str = ""
    stage: str = ""
    done: int = 0
    of: int = 0
    state: str = ""
    advice: str = ""
    task: "asyncio.Task[None] | None" = field(default=None, repr=False)

    def show(self, stage: str, done: int, of: int) -> None:
        """Set the stage and its steps."""
        self.stage, self.done, self.of = stage, done, of


class Styles:
    """Own styles of all keys of a studio; methods belong to the event loop."""

    def __init__(self, studio: StudioHost) -> None:
        self._studio = studio
        self.store = PaletteStore(studio.folder)
        self._works: dict[str, TakeWork] = {}
        self._drawing: dict[Path, asyncio.Lock] = {}
        self._drawn: dict[str, tuple[StyleMix, bytes]] = {}  # last mixes of owners

    def work(self, key: ApiKey) -> TakeWork:
        """What is done with the key's take; one that came before the server started is checked anew."""
        found = self._works.setdefault(key.name, TakeWork())
        if not found.doing and not found.state and self.store.take(key.name) is not None:
            self._start(key, CHECKING, lambda one: self._check(key, one))
        return found

    async def add_take(self, key: ApiKey, source: Path, suffix: str, sound: Path | None = None) -> None:
        """Check a new take, which replaces an earlier one; the file is moved, the sound of a table is copied.

        Raises
        ------
        InputError
            The key may not build, or the file is of another kind.
        """
        self.check_scope(key)
        await self._end_work(key)
        await asyncio.to_thread(self.store.put_take, key.name, source, suffix, sound)
        self._works[key.name] = TakeWork()
        self._start(key, CHECKING, lambda one: self._check(key, one))

    async def delete_take(self, key: ApiKey) -> None:
        """Delete the take and end the work on it."""
        await self._end_work(key)
        await asyncio.to_thread(self.store.delete_take, key.name)
        self._works[key.name] = TakeWork()

    async def make(self, key: ApiKey, name: str) -> None:
        """Begin to make a style of the take, which is deleted then.

        Raises
        ------
        InputError
            There is no usable take, or the name cannot be used.
        """
        self.check_scope(key)
        work, take = self.work(key), self.store.take(key.name)
        if take is None or work.doing:
            raise InputError("there is no checked take; record or upload one, and wait for its check")
        if work.state == REFUSED:
            raise InputError("the take cannot be used; record it again, or upload another one")
        name = check_new_style(await asyncio.to_thread(self.store.read, key.name), name)
        self._start(key, MAKING, lambda one: self._make(key, one, take, name))

    async def derive(self, key: ApiKey, name: str, mix: StyleMix) -> str:
        """Name of a new style that is mixed of others; errors as `mix_styles` and `add_derivation`."""
        self._studio.check_scope(key)
        name = " ".join(name.split())
        await self._change(key, lambda palette: add_derivation(palette, name, mix_styles(palette, mix)))
        return name

    async def rename(self, key: ApiKey, name: str, new: str) -> None:
        """Rename an own style, in all projects, too; errors as `rename_style`."""
        await self._check_own(key, name)
        new = " ".join(new.split())
        used = await self.users(key, name)
        await self._change(key, lambda palette: rename_style(palette, name, new))
        await self._revise(key, used, lambda project: style_names.rename_style(project, name, new))

    async def remove(self, key: ApiKey, name: str) -> None:
        """Delete an own style, and what is painted in it in projects; errors as `remove_style`.

        Without own styles left, projects return to the shipped palette.
        """
        await self._check_own(key, name)
        remove_style(await asyncio.to_thread(self.store.read, key.name), name)  # refuses before a project is changed
        # Projects first: none has a style or a palette that is gone.
        await self._revise(key, await self.users(key, name), lambda project: style_names.drop_style(project, name))
        if await asyncio.to_thread(self.store.own_names, key.name) == (name,):
            await self._revise(key, await self._projects(key, lambda one: True), _with_shipped)
        await self._change(key, lambda palette: remove_style(palette, name))

    async def users(self, key: ApiKey, name: str) -> list[ProjectEntry]:
        """Projects of a key that use an own style."""
        return await self._projects(key, lambda project: name in style_names.used_styles(project))

    async def swatch(self, key: ApiKey, name: str) -> Path:
        """File of the moving picture of a style; made at its first use.

        Raises
        ------
        InputError
            There is no such style.
        """
        palette = await asyncio.to_thread(self.store.read, key.name)
        path = self.store.swatch(key.name, palette.require(name))
        async with self._drawing.setdefault(path, asyncio.Lock()):
            if not path.is_file():
                content = await self._draw(key, {"style": name})
                (await asyncio.to_thread(self.store.read, key.name)).require(name)  # it may have been deleted meanwhile
                with translate_disk_errors(path):
                    path.parent.mkdir(parents=True, exist_ok=True)
                await asyncio.to_thread(write_atomically, path, content)
        return path

    async def draw_mix(self, key: ApiKey, mix: StyleMix) -> bytes:
        """Moving picture of a style that is not kept yet, the last one from memory; errors as `mix_styles`."""
        last = self._drawn.get(key.name)
        if last is None or last[0] != mix:
            mix_styles(await asyncio.to_thread(self.store.read, key.name), mix)
            last = self._drawn[key.name] = mix, await self._draw(key, {"mix": asdict(mix)})
        return last[1]

    def check_scope(self, key: ApiKey) -> None:
        """Refuse keys that may not build models of people."""
        if "build" not in key.scopes:
            raise InputError(f"the key {key.name} lacks the scope build, which recordings need; use another key")

    async def close(self) -> None:
        """End all work; takes stay, and are checked after the next start."""
        for work in self._works.values():
            if work.task is not None:
                work.task.cancel()
        await asyncio.gather(
            *(one.task for one in self._works.values() if one.task is not None), return_exceptions=True
        )

    async def _draw(self, key: ApiKey, request: dict[str, Any]) -> bytes:
        models = {"palette": self.store.base(key.name)}
        state = self._studio.state
        return await data_of(state, key, state.work(kind="swatch", models=models, request=request))

    def _start(self, key: ApiKey, doing: str, run: Callable[[TakeWork], Any]) -> None:
        work = self._works.setdefault(key.name, TakeWork())
        work.doing, work.stage, work.done, work.of = doing, "starting", 0, 0

        async def follow() -> None:
            try:
                await run(work)
            except Tts2faceError as error:
                work.state, work.advice = REFUSED, str(error)
            except TimeoutError:
                work.state, work.advice = REFUSED, "the take needs too much time; record a shorter one"
            finally:
                work.doing, work.task = "", None

        work.task = asyncio.get_running_loop().create_task(follow())

    async def _check(self, key: ApiKey, work: TakeWork) -> None:
        take = self.store.take(key.name)
        assert take is not None
        order = {"take": str(take), "cache": str(take.with_name(CACHE))}
        found = await run_take_tool("check", order, work.show)
        findings = found["findings"]
        work.state = GOOD if not findings else REFUSED if findings[0]["severity"] == "refusal" else WEAK
        work.advice = findings[0]["message"] if findings else f"a good take of {found['seconds']:.0f} s"

    async def _make(self, key: ApiKey, work: TakeWork, take: Path, name: str) -> None:
        made = take.with_name(MADE)
        order = {
            "take": str(take), "cache": str(take.with_name(CACHE)), "base": self.store.base(key.name),
            "name": name, "out": str(made),
        }  # fmt: skip
        built = await run_take_tool("style", order, work.show)
        learnt = await asyncio.to_thread(read_palette, made)
        # The palette may have changed meanwhile: only the new style is taken.
        await self._change(key, lambda palette: _with_recorded(palette, learnt, name))
        await asyncio.to_thread(self.store.delete_take, key.name)
        work.state, work.advice = "", f"the style {name} is made of {built['seconds']:.0f} s; its take is deleted"

    async def _change(self, key: ApiKey, change: Callable[[Palette], Palette]) -> None:
        await asyncio.to_thread(self.store.change, key.name, change)
        self._drawn.pop(key.name, None)
        for one in self._studio.open_projects(key):
            one.tell_styles()

    async def _check_own(self, key: ApiKey, name: str) -> None:
        if name not in await asyncio.to_thread(self.store.own_names, key.name):
            raise InputError(f"{name[:40]!r} is not one of your own styles; choose one of them")

    async def _projects(self, key: ApiKey, uses: Callable[[Project], bool]) -> list[ProjectEntry]:
        """Projects with the own palette of which something holds; an open one as it is now."""
        own, found = self.store.path(key.name), []
        present = {one.id: one.project for one in self._studio.open_projects(key)}
        for entry in await self._studio.entries(key):
            try:
                project = (
                    present.get(entry.id)
                    or (await asyncio.to_thread(self._studio.store.read, entry.id, key.name)).present
                )
            except Tts2faceError:
                continue  # a damaged project uses nothing
            palette = project.models.palette
            if palette is not None and is_own_palette(palette, own) and uses(project):
                found.append(entry)
        return found

    async def _revise(self, key: ApiKey, entries: list[ProjectEntry], change: Callable[[Project], Project]) -> None:
        for entry in entries:
            workspace = await self._studio.open(key, entry.id)
            workspace.revise(change)
            await workspace.save()

    async def _end_work(self, key: ApiKey) -> None:
        work = self._works.get(key.name)
        if work is not None and work.task is not None:
            work.task.cancel()
            await asyncio.wait([work.task])


def named(entries: list[ProjectEntry]) -> str:
    """Names of projects for a sentence."""
    more = f" and {len(entries) - N_SHOWN} more" if len(entries) > N_SHOWN else ""
    return ", ".join(repr(entry.name) for entry in entries[:N_SHOWN]) + more


def _with_recorded(palette: Palette, learnt: Palette, name: str) -> Palette:
    return replace(palette, styles={**palette.styles, check_new_style(palette, name): learnt.styles[name]})


def _with_shipped(project: Project) -> Project:
    palette = project.models.palette
    if palette is None or os.sep not in palette:
        return project
    return replace(project, models=replace(project.models, palette=SHIPPED))
