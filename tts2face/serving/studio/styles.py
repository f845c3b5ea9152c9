"""Own styles of the studio: made of takes by the tools, derived, renamed and deleted, in projects, too."""

import asyncio
import os
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from lexicon.errors import InputError, Tts2faceError
from tts2face.models.palette import Palette
from tts2face.models.palette_editing import (
    StyleMix,
    add_derivation,
    check_new_style,
    mix_styles,
    remove_style,
    rename_style,
)
from tts2face.models.palette_file import read_palette
from tts2face.serving.service.keys import ApiKey
from tts2face.serving.studio.palette_store import CACHE, MADE, SHIPPED, TAKE, PaletteStore, is_own_palette
from tts2face.serving.studio.project_store import ProjectEntry
from tts2face.serving.studio.recordings import REFUSED, judge
from tts2face.serving.studio.requests import data_of, key_of
from tts2face.serving.studio.studio_host import StudioHost
from tts2face.serving.studio.work import BackgroundWork, WorkKind
from tts2face.serving.work.jobs import FAILED
from tts2face.session import project as style_names
from tts2face.session.project import Project
from tts2face.storage.files import translate_disk_errors, write_atomically

CHECKING, MAKING = "checking", "making"  # tasks of the work on a take
WORK, ORDER = "style", "work.json"  # kind of work, and its order in the folder of the take
N_SHOWN = 5  # names of projects in a sentence


@dataclass(frozen=True, slots=True)
class TakeState:
    """The take of an owner: the work on it with its stage, steps done and of all, then what came of it.

    ``doing`` is `CHECKING`, `MAKING` or empty; ``state`` is that of `recordings.judge` after the check; ``advice`` one
    sentence.
    """

    doing: str = ""
    stage: str = ""
    done: float = 0
    of: float = 0
    state: str = ""
    advice: str = ""


class Styles:
    """Own styles of all keys of a studio; methods belong to the event loop."""

    def __init__(self, studio: StudioHost) -> None:
        self._studio = studio
        self.store = PaletteStore(studio.folder)
        self._found: dict[str, tuple[str, str]] = {}  # states of the takes of owners, and advice
        self._drawing: dict[Path, asyncio.Lock] = {}
        self._drawn: dict[str, tuple[StyleMix, bytes]] = {}  # last mixes of owners
        late = "the take needs too much time; record a shorter one"
        orders = f"palettes/*.styles/{TAKE}/{ORDER}"
        studio.work.register(WorkKind(WORK, orders, self._run, end=self._end, stage="starting", late=late))

    def take_state(self, key: ApiKey) -> TakeState:
        """State of the key's take; one that came before the server started is checked anew."""
        work = self._studio.work.get(self._order(key.name))
        if key.name not in self._found and work is None and self.store.take(key.name) is not None:
            work = self._start(key, {"task": CHECKING})
        state, advice = self._found.get(key.name, ("", ""))
        if work is None:
            return TakeState(state=state, advice=advice)
        doing = work.content["task"] if work.is_open else ""
        return TakeState(doing, work.stage, work.done, work.of, state, advice)

    async def add_take(self, key: ApiKey, source: Path, suffix: str, sound: Path | None = None) -> None:
        """Check a new take, which replaces an earlier one; the file is moved, the sound of a table is copied."""
        self.check_scope(key)
        await self._end_work(key)
        await asyncio.to_thread(self.store.put_take, key.name, source, suffix, sound)
        self._found[key.name] = "", ""
        self._start(key, {"task": CHECKING})

    async def delete_take(self, key: ApiKey) -> None:
        """Delete the take and end the work on it."""
        await self._end_work(key)
        await asyncio.to_thread(self.store.delete_take, key.name)
        self._found[key.name] = "", ""

    async def make(self, key: ApiKey, name: str) -> None:
        """Begin to make a style of the take, which is deleted then.

        Raises
        ------
        InputError
            There is no usable take, or the name cannot be used.
        """
        self.check_scope(key)
        take = self.take_state(key)
        if take.doing or self.store.take(key.name) is None:
            raise InputError("there is no checked take; record or upload one, and wait for its check")
        if take.state == REFUSED:
            raise InputError("the take cannot be used; record it again, or upload another one")
        name = check_new_style(await asyncio.to_thread(self.store.read, key.name), name)
        self._start(key, {"task": MAKING, "name": name})

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
            await self._revise(key, await self._projects(key, lambda project: True), _with_shipped)
        await self._change(key, lambda palette: remove_style(palette, name))

    async def users(self, key: ApiKey, name: str) -> list[ProjectEntry]:
        """Projects of a key that use an own style."""
        return await self._projects(key, lambda project: name in style_names.used_styles(project))

    async def swatch(self, key: ApiKey, name: str) -> Path:
        """File of the moving picture of a style; made at its first use."""
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
        if "build" not in self._studio.state.keys.current(key).scopes:
            raise InputError(f"the key {key.name} lacks the scope build, which recordings need; use another key")

    async def _draw(self, key: ApiKey, request: dict[str, Any]) -> bytes:
        models = {"palette": self.store.base(key.name)}
        state = self._studio.state
        return await data_of(state, key, state.results.work(kind="swatch", models=models, request=request))

    def _order(self, owner: str) -> Path:
        return self.store.take_folder(owner) / ORDER

    def _start(self, key: ApiKey, content: dict[str, Any]) -> BackgroundWork:
        return self._studio.work.add(WORK, key.name, self._order(key.name), content)

    async def _run(self, work: BackgroundWork) -> str:
        take = self.store.take(work.owner)
        if take is None:
            raise InputError("the take is gone; record or upload it again")
        order = {"take": str(take), "cache": str(take.with_name(CACHE))}
        if work.content["task"] == MAKING:
            return await self._make(work, take, order)
        found = await self._studio.state.decoders.read_take(work.owner, "check", order, work.show)
        state, advice = judge(found["findings"])
        self._found[work.owner] = state, advice or f"a good take of {found['seconds']:.0f} s"
        return advice

    async def _make(self, work: BackgroundWork, take: Path, order: dict[str, str]) -> str:
        made, name = take.with_name(MADE), work.content["name"]
        order = {**order, "base": self.store.base(work.owner), "name": name, "out": str(made)}
        built = await self._studio.state.decoders.read_take(work.owner, "style", order, work.show)
        learnt = await asyncio.to_thread(read_palette, made)
        # The palette may have changed meanwhile: only the new style is taken.
        key = key_of(self._studio.state, work.owner)
        await self._change(key, lambda palette: _with_recorded(palette, learnt, name))
        await asyncio.to_thread(self.store.delete_take, work.owner)
        advice = f"the style {name} is made of {built['seconds']:.0f} s; its take is deleted"
        self._found[work.owner] = "", advice
        return advice

    def _end(self, work: BackgroundWork) -> None:
        if work.state == FAILED:
            self._found[work.owner] = REFUSED, work.message

    async def _change(self, key: ApiKey, change: Callable[[Palette], Palette]) -> None:
        await asyncio.to_thread(self.store.change, key.name, change)
        self._drawn.pop(key.name, None)
        for workspace in self._studio.open_projects(key):
            workspace.tell_styles()

    async def _check_own(self, key: ApiKey, name: str) -> None:
        if name not in await asyncio.to_thread(self.store.own_names, key.name):
            raise InputError(f"{name[:40]!r} is not one of your own styles; choose one of them")

    async def _projects(self, key: ApiKey, uses: Callable[[Project], bool]) -> list[ProjectEntry]:
        """Projects with the own palette of which something holds; an open one as it is now."""
        own, found = self.store.path(key.name), []
        present = {workspace.id: workspace.project for workspace in self._studio.open_projects(key)}
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
        self._found.setdefault(key.name, ("", ""))  # no check begins while the take is replaced or deleted
        await self._studio.work.forget(self.store.take_folder(key.name))


def named(entries: list[ProjectEntry]) -> str:
    """Names of projects for a sentence."""
    more = f" and {len(entries) - N_SHOWN} more" if len(entries) > N_SHOWN else ""
    return ", ".join(repr(entry.name) for entry in entries[:N_SHOWN]) + more


def _with_recorded(palette: Palette, learnt: Palette, name: str) -> Palette:
    return replace(palette, styles={**palette.styles, check_new_style(palette, name): learnt.styles[name]})


def _with_shipped(project: Project) -> Project:
    palette = project.models.palette
    # a name is a shipped palette
    if palette is None or os.sep not in palette:
        return project
    return replace(project, models=replace(project.models, palette=SHIPPED))
