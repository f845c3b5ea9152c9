"""Saving of an open project while the disk refuses it; its preview while pages come and go."""

import asyncio
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

import pytest

from lexicon.errors import BackendError
from tts2face.processes.message import EVENT, Message
from tts2face.request import Request
from tts2face.serving.service.keys import LOCAL_KEY
from tts2face.serving.service.results import Results
from tts2face.serving.service.settings import ServiceSettings
from tts2face.serving.service.state import ServiceState
from tts2face.serving.studio import workspace as opened
from tts2face.serving.studio.history import History
from tts2face.serving.studio.project_store import ProjectStore
from tts2face.serving.studio.workspace import Listener, Workspace
from tts2face.session.project import Project
from tts2face.storage.memory import ResultMemory


class FullDisk(ProjectStore):
    """Refuses to write so many times."""

    n_refused = 0

    def write(self, number: str, history: History) -> None:
        if self.n_refused:
            self.n_refused -= 1
            raise BackendError("the disk is full; free some space")
        super().write(number, history)


@pytest.fixture
def store(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> FullDisk:
    monkeypatch.setattr(opened, "SAVE_S", 0.0)
    monkeypatch.setattr(opened, "SAVE_AGAIN_S", 0.01)
    return FullDisk(tmp_path)


def rename(store: FullDisk, number: str, *, n_refused: int, closes_at_once: bool) -> list[str]:
    """What a page is told while a project is renamed and closed."""

    async def run() -> list[str]:
        workspace = Workspace(
            ServiceState(ServiceSettings(processes=1)), store, LOCAL_KEY, number, ResultMemory(1000)
        )  # fmt: skip
        told = list[str]()
        workspace.listeners.add(lambda what: told.append(f"{what} {workspace.save_error}".strip()))
        store.n_refused = n_refused
        await workspace.edit({"kind": "name", "name": "Second"})
        while not closes_at_once and not workspace.is_saved:
            await asyncio.sleep(0.001)
        await workspace.close()
        return told

    return asyncio.run(run())


def test_a_full_disk_is_told_and_tried_again(store: FullDisk) -> None:
    number = store.create(LOCAL_KEY.name, Project(name="First"))
    told = rename(store, number, n_refused=2, closes_at_once=False)
    failed = "failed the disk is full; free some space"
    assert [one for one in told if one != "project"][:3] == [failed, failed, "saved"]
    assert store.read(number, LOCAL_KEY.name).present.name == "Second"


def test_closing_saves_at_once_and_survives_a_full_disk(store: FullDisk) -> None:
    number = store.create(LOCAL_KEY.name, Project(name="First"))
    rename(store, number, n_refused=1, closes_at_once=True)
    assert store.read(number, LOCAL_KEY.name).present.name == "First"
    rename(store, number, n_refused=0, closes_at_once=True)
    assert store.read(number, LOCAL_KEY.name).present.name == "Second"


class HangingPool:
    """A pool whose works never end."""

    def __init__(self) -> None:
        self.n_begun = self.n_running = 0

    async def stream(self, *_: Any) -> AsyncIterator[Message]:
        self.n_begun += 1
        self.n_running += 1
        try:
            await asyncio.Event().wait()
            yield Message(EVENT)
        finally:
            self.n_running -= 1


def test_the_preview_ends_with_the_last_page_and_begins_again_with_the_next(store: FullDisk) -> None:
    number = store.create(LOCAL_KEY.name, Project(request=Request(text="Hello.")))

    async def run() -> None:
        state = ServiceState(ServiceSettings(processes=1))
        pool: Any = HangingPool()
        state.results = Results(state.settings, state.permissions, pool, state.metrics, None)
        workspace = Workspace(state, store, LOCAL_KEY, number, ResultMemory(1000))

        async def expect(n_begun: int, n_running: int) -> None:
            async with asyncio.timeout(30):
                while (pool.n_begun, pool.n_running) != (n_begun, n_running):
                    await asyncio.sleep(0.01)

        pages: list[Listener] = [lambda _: None, lambda _: None]
        for page in pages:
            workspace.listeners.add(page)
            workspace.show()
        await expect(1, 1)
        workspace.leave(pages[0])
        assert workspace.preview.is_running
        workspace.leave(pages[1])
        await expect(1, 0)
        workspace.listeners.add(pages[0])
        workspace.show()
        await expect(2, 1)
        await workspace.close()

    asyncio.run(run())
