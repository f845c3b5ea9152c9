"""Each kind of background work: what the next server goes on with, and what cancelling leaves."""

import asyncio
import json
from collections.abc import Awaitable, Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from lexicon.errors import InputError
from tests.serving.studio.background import OWNER, settle, until
from tts2face.serving.service import decoders
from tts2face.serving.service.access import KeyRing
from tts2face.serving.service.keys import LOCAL_KEY
from tts2face.serving.studio import recorded_talker, recording_work, reports, styles
from tts2face.serving.studio.palette_store import PaletteStore
from tts2face.serving.studio.recording_work import Recordings
from tts2face.serving.studio.recordings import GOOD, REFUSED, WEAK, RecordingStore
from tts2face.serving.studio.renders import Renders
from tts2face.serving.studio.reports import Reports
from tts2face.serving.studio.styles import Styles
from tts2face.serving.studio.take_store import READY, TakeStore
from tts2face.serving.studio.takes import Takes
from tts2face.serving.studio.work import MAX_TRIES, BackgroundWork, WorkList
from tts2face.serving.work.jobs import CANCELLED, DONE, FAILED, RUNNING
from tts2face.session.project import Project
from tts2face.session.project_file import project_json

PROMPTS = {"prompts": [{"text": "Hello there.", "phones": [], "triphones": []}] * 2, "running": {}}


class Host(SimpleNamespace):
    """A studio with nothing but its work."""

    def __init__(self, folder: Path) -> None:
        library = SimpleNamespace(resolve=lambda key, kind, name: (f"/models/{name}", {}))
        state = SimpleNamespace(keys=KeyRing(None), library=library, decoders=decoders.Decoders())
        super().__init__(folder=folder, work=WorkList(folder), state=state, open_projects=lambda key: [])


def serve_twice(
    folder: Path, tool: "Tool", begin: Callable[[Host], Awaitable[None]], go_on: Callable[[Host], Any]
) -> list[Any]:
    """Begin work on a server that ends once the tool has its order, and let the next one do it; the second's work."""

    async def first() -> None:
        host = Host(folder)
        await begin(host)
        await until(lambda: tool.orders)
        assert any(work.state == RUNNING for work in host.work._all.values())
        await host.work.close()

    async def second() -> list[BackgroundWork]:
        host = Host(folder)
        go_on(host)
        await host.work.resume()
        found = list(host.work._all.values())
        await settle(*found)
        return found

    asyncio.run(first())
    return asyncio.run(second())


class Tool:
    """Orders of a tool: the first one never ends, the others are answered, and make a file."""

    def __init__(self, answer: dict[str, Any], made: Path | None = None) -> None:
        self.answer, self.made, self.orders = answer, made, list[Any]()

    async def __call__(self, *order: Any, **_: Any) -> dict[str, Any]:
        self.orders.append(order)
        if len(self.orders) == 1:
            await asyncio.Event().wait()
        if self.made is not None:
            self.made.touch()
        return self.answer


def test_a_report_goes_on(tmp_path, monkeypatch):
    tool = Tool({})
    monkeypatch.setattr(reports, "run_tool", tool)

    async def begin(host: Host) -> None:
        await Reports(host.state, tmp_path, host.work).add(LOCAL_KEY, "similarity", "grid_s1")

    (found,) = serve_twice(tmp_path, tool, begin, lambda host: Reports(host.state, tmp_path, host.work))
    assert (found.state, found.title) == (DONE, "Visual similarity of phones: grid_s1")
    assert [order[2]["model"] for order in tool.orders] == ["/models/grid_s1"] * 2
    entry = json.loads((found.files[0] / "report.json").read_text())
    assert entry == {"id": found.id, "owner": OWNER, **found.content, "created": found.created}
    (found.files[0] / "report.html").touch()
    (kept,) = Reports(Host(tmp_path).state, tmp_path, WorkList(tmp_path)).of_owner(OWNER)
    assert (kept.id, kept.state, kept.title, kept.files) == (found.id, DONE, found.title, found.files)
    assert kept.created == found.created


def make_take(folder: Path) -> Path:
    take = folder / "upload.webm"
    take.write_bytes(b"video")
    return take


def test_the_check_of_a_take_for_a_style_goes_on(tmp_path, monkeypatch):
    tool = Tool({"findings": [], "seconds": 20.0})
    monkeypatch.setattr(decoders, "run_take_tool", tool)

    async def begin(host: Host) -> None:
        await Styles(host).add_take(LOCAL_KEY, make_take(tmp_path), ".webm")

    made: list[Styles] = []
    (found,) = serve_twice(tmp_path, tool, begin, lambda host: made.append(Styles(host)))
    assert found.state == DONE
    state = made[0].take_state(LOCAL_KEY)
    assert (state.doing, state.state, state.advice) == ("", GOOD, "a good take of 20 s")


def test_the_making_of_a_style_goes_on(tmp_path, monkeypatch):
    tool = Tool({"seconds": 20.0})
    monkeypatch.setattr(decoders, "run_take_tool", tool)
    learnt = PaletteStore(tmp_path).read(OWNER)
    recorded = next(iter(learnt.styles))

    def read(_: Path) -> Any:
        return SimpleNamespace(styles={"mine": learnt.styles[recorded]})

    monkeypatch.setattr(styles, "read_palette", read)

    async def begin(host: Host) -> None:
        made = Styles(host)
        take = make_take(tmp_path)
        made.store.put_take(OWNER, take, ".webm")
        made._found[OWNER] = WEAK, "a short take"
        await made.make(LOCAL_KEY, "mine")
        assert made.take_state(LOCAL_KEY).doing == "making"

    made: list[Styles] = []
    (found,) = serve_twice(tmp_path, tool, begin, lambda host: made.append(Styles(host)))
    assert (found.state, found.message) == (DONE, "the style mine is made of 20 s; its take is deleted")
    assert [order[0] for order in tool.orders] == ["style"] * 2
    store = PaletteStore(tmp_path)
    assert (store.own_names(OWNER), store.take(OWNER)) == (("mine",), None)
    assert made[0].take_state(LOCAL_KEY).advice == found.message


def test_the_reading_of_a_take_goes_on_and_its_video_is_deleted(tmp_path, monkeypatch):
    tool = Tool({"seconds": 3.0, "has_sound": True})
    monkeypatch.setattr(decoders, "run_take_tool", tool)
    checked = SimpleNamespace(check_scope=lambda key: None)

    async def begin(host: Host) -> None:
        await Takes(host, checked).add(LOCAL_KEY, make_take(tmp_path), ".webm", "One")

    def go_on(host: Host) -> None:
        (entry,) = TakeStore(tmp_path).entries(OWNER)
        TakeStore(tmp_path).rename(OWNER, entry.id, "Two")
        Takes(host, checked)

    (found,) = serve_twice(tmp_path, tool, begin, go_on)
    (entry,) = TakeStore(tmp_path).entries(OWNER)
    assert (found.state, entry.state, entry.name, entry.seconds, entry.has_sound) == (DONE, READY, "Two", 3.0, True)
    assert sorted(path.name for path in found.order.parent.iterdir()) == ["owner", "take.json"]


def test_a_take_that_nothing_reads_on_has_failed(tmp_path):
    store = TakeStore(tmp_path)
    entry = store.create("ann", "One")
    video = store.folder("ann", entry.id) / "video.webm"
    video.write_bytes(b"video")
    Takes(Host(tmp_path), SimpleNamespace()).start()
    assert not video.exists()
    assert store.entry("ann", entry.id).state == FAILED
    assert store.entries("bob") == []


def make_recording(folder: Path) -> tuple[RecordingStore, str]:
    store = RecordingStore(folder)
    number = store.create(OWNER, "Ada", PROMPTS)
    return store, number


def test_checks_of_recordings_go_on_and_a_take_that_ends_servers_is_refused(tmp_path, monkeypatch):
    answer = {"findings": [], "key": "k"}
    tool = Tool(answer)
    monkeypatch.setattr(Recordings, "_ask", lambda self, *order: tool(*order))
    store, number = make_recording(tmp_path)

    async def begin(host: Host) -> None:
        recordings = Recordings(tmp_path, host.work)
        for at in range(2):
            recordings.check(number, at, store.add_take(number, at, make_take(tmp_path), "video/webm"))

    def go_on(host: Host) -> None:
        first = next(host.folder.glob("recordings/*/unchecked/take-0001-*.json"))
        first.write_text(json.dumps(json.loads(first.read_text()) | {"tries": MAX_TRIES}))
        Recordings(tmp_path, host.work)

    (found,) = serve_twice(tmp_path, tool, begin, go_on)
    found_takes = store.takes(number)
    assert (found.content["at"], found.state) == (1, DONE)
    assert [found_takes[at].state for at in (0, 1)] == [REFUSED, GOOD]
    assert found_takes[0].advice == f"{MAX_TRIES} servers ended while it was made"
    assert list((store.at(number) / "unchecked").iterdir()) == []


@pytest.mark.parametrize("task", ["build", "say"])
def test_a_talker_and_its_first_sentence_go_on(tmp_path, monkeypatch, task):
    store, number = make_recording(tmp_path)
    folder = store.at(number)
    tool = Tool({"n_kept": 1, "minutes": 0.1, "refused": []}, folder / "made.talker")
    child = (recording_work, "run_tool") if task == "build" else (recorded_talker, "call_once")
    monkeypatch.setattr(*child, tool)

    async def begin(host: Host) -> None:
        recordings = Recordings(tmp_path, host.work)
        take = store.add_take(number, 0, make_take(tmp_path), "video/webm")
        store.judge(number, 0, replace(take, state=GOOD))
        if task == "build":
            recordings.build(number, "me")
        else:
            (folder / "talker.talker").touch()
            recordings.speak(number, "Hello.")
        with pytest.raises(InputError, match="the last order still runs"):
            recordings._start(number, {})

    (found,) = serve_twice(tmp_path, tool, begin, lambda host: Recordings(tmp_path, host.work))
    assert found.state == DONE, found.message
    assert found.message.startswith("The talker Ada is made of 1 takes" if task == "build" else "The clip is ready.")
    assert len(tool.orders) == 2


def test_cancelled_work_on_a_recording_says_so(tmp_path, monkeypatch):
    monkeypatch.setattr(recording_work, "run_tool", Tool({}))
    store, number = make_recording(tmp_path)

    async def check() -> None:
        host = Host(tmp_path)
        recordings = Recordings(tmp_path, host.work)
        take = store.add_take(number, 0, make_take(tmp_path), "video/webm")
        store.judge(number, 0, replace(take, state=GOOD))
        recordings.build(number, "me")
        await until(lambda: recordings.work_on(number).state == RUNNING)
        recordings.cancel(number)
        assert (recordings.work_on(number).state, recordings.work_on(number).message) == (CANCELLED, "")
        await recordings.delete(number)
        assert recordings.work_on(number) is None
        assert [path for path in tmp_path.rglob("*") if path.is_file()] == []

    asyncio.run(check())


def test_the_order_of_an_earlier_version_is_a_file_of_its_project(tmp_path, monkeypatch):
    folder = tmp_path / "projects" / "0123456789abcdef"
    order = folder / "renders" / "0123456789ab.json"
    order.parent.mkdir(parents=True)
    left = order.with_name("0123456789ab-My-clip.mp4.part")
    left.write_bytes(b"half of a film")
    (order.parent / "ba9876543210-One.json").write_text("{}")  # a file that was made
    project = project_json(Project(name="My clip"), folder)
    order.write_text(json.dumps({"owner": OWNER, "format": "mp4", "total": 2.0, "tries": 1, "project": project}))

    async def messages(work, key, *, priority):
        assert work.request["project"] == project
        for _ in range(2):
            yield SimpleNamespace(payload=b"film", content={"seconds": 1.0})

    async def check() -> None:
        host = Host(tmp_path)
        host.state.results = SimpleNamespace(messages=messages)
        host.state.settings = SimpleNamespace(data_folder=tmp_path.parent, visible_mark=False)
        monkeypatch.setattr("tts2face.serving.studio.requests.resolve_models", resolve)
        renders = Renders(host.state, host.work)
        await host.work.resume()
        found = host.work.of("render", OWNER)
        await settle(*found)
        assert [(one.state, one.done, one.of, one.message) for one in found] == [(DONE, 2.0, 2.0, "")]
        listed = {one.title: (one.state, one.files[0].read_bytes()) for one in renders.of_project(OWNER, folder)}
        assert listed == {"My-clip.mp4": (DONE, b"filmfilm"), "One.json": (DONE, b"{}")}

    async def resolve(library, key, models):
        return dict(models)

    asyncio.run(check())
    assert sorted(path.name for path in order.parent.iterdir()) == [
        "0123456789ab-My-clip.mp4", "ba9876543210-One.json",
    ]  # fmt: skip
