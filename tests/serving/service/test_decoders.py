"""The queue of decoders: turns of keys, shares of places, memory that is free before a file is decoded."""

import asyncio
import io
import subprocess
import sys
from collections import Counter
from collections.abc import Mapping
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import httpx
import pytest
from PIL import Image

from lexicon.errors import DataError
from tests.processes.answered import answered
from tests.running import HostService, eventually
from tests.serving.service.in_process import DecoderHere
from tests.serving.service.raw import connect
from tests.serving.service.test_uploads import png
from tts2face.processes.message import Message
from tts2face.serving.service import decoders
from tts2face.serving.service.decoders import (
    BODIES_OF_KEY,
    MEMORY_BYTES,
    UPLOADS,
    Decoders,
    KeyTurns,
    MemoryBudget,
    Shares,
)
from tts2face.serving.service.errors import RefusedError
from tts2face.serving.service.keys import add_key
from tts2face.serving.work.uploaded_file import CHILD_BYTES, DECODE, HANDLERS, MEASURE, PICTURE, FileOrder
from tts2face.storage import pictures
from tts2face.storage.pictures import decoding_bytes, open_picture

FORMATS: Mapping[str, Mapping[str, Any]] = {
    "PNG": {}, "WEBP": {"lossless": True}, "JPEG": {}, "progressive": {"format": "JPEG", "progressive": True},
    "BMP": {}, "TIFF": {},
}  # fmt: skip
MEASURE_HERE = """
import resource, sys
from PIL import Image
from tts2face.storage.pictures import decoding_bytes
with Image.open(sys.argv[2]) as small:
    small.load()
before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
with Image.open(sys.argv[1]) as picture:
    expected = decoding_bytes(picture)
    picture.load()
print((resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) << 10, expected)
"""


def one_colour(name: str, side: int) -> bytes:
    content = io.BytesIO()
    options = {"format": name, **FORMATS[name]}
    Image.new("RGB", (side, side), (10, 200, 30)).save(content, **options)
    return content.getvalue()


async def settle() -> None:
    for _ in range(10):
        await asyncio.sleep(0)


def test_keys_take_turns_within_their_shares() -> None:
    async def run() -> list[str]:
        turns, begun, ended = KeyTurns(Shares(3, 2, 50)), [], asyncio.Event()

        async def work(key: str) -> None:
            async with turns.turn(key):
                begun.append(key)
                await ended.wait()
                ended.clear()

        tasks = [asyncio.create_task(work("greedy")) for _ in range(8)]
        await settle()
        assert begun == ["greedy"] * 2  # the third place stays free for others
        tasks += [asyncio.create_task(work("modest")) for _ in range(3)]
        await settle()
        assert begun == ["greedy", "greedy", "modest"]
        while not all(task.done() for task in tasks):
            ended.set()
            await settle()
        return begun

    begun = asyncio.run(run())
    assert Counter(begun) == {"greedy": 8, "modest": 3}
    assert begun.index("modest", 3) < 6


def test_a_key_whose_files_wait_is_refused_and_no_other_one() -> None:
    async def run() -> None:
        turns = KeyTurns(Shares(1, 1, 2))

        async def work(key: str) -> None:
            async with turns.turn(key):
                await asyncio.sleep(3600)

        tasks = [asyncio.create_task(work("greedy")) for _ in range(3)]
        await settle()
        with pytest.raises(RefusedError, match="2 files of the key greedy wait to be decoded") as refused:
            await work("greedy")
        assert (refused.value.status, refused.value.headers["Retry-After"]) == (429, "10")
        modest = asyncio.create_task(work("modest"))
        await settle()
        tasks[1].cancel()  # whose client has left
        await settle()
        tasks.append(asyncio.create_task(work("greedy")))
        await settle()
        assert not tasks[-1].done()
        tasks[0].cancel()
        await settle()
        for task in (*tasks, modest):
            task.cancel()
        await asyncio.gather(*tasks, modest, return_exceptions=True)
        async with asyncio.timeout(60), turns.turn("modest"):
            pass  # no place is lost

    asyncio.run(run())


def test_memory_is_shared_in_the_order_of_asking_and_a_file_beyond_all_of_it_runs_alone() -> None:
    async def run() -> None:
        budget, running, most = MemoryBudget(10), [0], []

        async def work(n_bytes: int) -> None:
            async with budget.reserved(n_bytes):
                running.append(n_bytes)
                most.append(sum(running))
                await asyncio.sleep(0)
                running.remove(n_bytes)

        tasks = [asyncio.create_task(work(n_bytes)) for n_bytes in (6, 3, 25, 1, 6, 4, 5)]
        await asyncio.sleep(0)
        tasks[3].cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
        assert 25 in most
        assert max(one for one in most if one != 25) <= 10
        async with asyncio.timeout(60), budget.reserved(10):
            pass

    asyncio.run(run())


def test_twenty_clips_with_small_files_of_large_pictures_share_the_memory(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """20 PNGs of 6300 x 6300 in 131 KB started 20 children with 6.9 GB; here the children only note what they take."""
    needs = {"png": CHILD_BYTES + 4 * 6300**2, "webp": CHILD_BYTES + 16 * 6300**2}
    used: list[int] = []
    most = [0, 0]

    class Noting(DecoderHere):
        async def call(self, kind: str, content: Mapping[str, Any], **_: Any) -> Message:
            n_bytes = needs[Path(content["source"]).suffix[1:]]
            if kind == MEASURE:
                return Message(MEASURE, {"memory_bytes": n_bytes})
            used.append(n_bytes)
            most[:] = max(most[0], sum(used)), max(most[1], len(used))
            await settle()
            used.remove(n_bytes)
            return Message(DECODE, {"is_full": False, "notes": []})

    monkeypatch.setattr(decoders, "started", Noting)

    async def run() -> None:
        queue = Decoders()
        asked = [(f"key{number % 4}", tmp_path / f"a.{'webp' if number % 3 else 'png'}") for number in range(20)]
        orders = [(key, FileOrder(PICTURE, path, path, 4e7)) for key, path in asked]
        await asyncio.gather(*(queue.decode(key, order, "it", 60.0) for key, order in orders))

    asyncio.run(run())
    assert 0 < most[0] <= MEMORY_BYTES
    assert 0 < most[1] <= UPLOADS.running


def test_videos_of_the_studio_have_places_of_their_own(monkeypatch: pytest.MonkeyPatch) -> None:
    """Their tool may take 6 GB and half an hour: so many at a time as there are keys would take all of a machine."""
    running: list[str] = []
    most: list[tuple[int, int]] = []

    async def tool(kind: str, order: Mapping[str, Any], *_: Any, **__: Any) -> Mapping[str, Any]:
        running.append(order["key"])
        most.append((len(running), max(Counter(running).values())))
        await settle()
        running.remove(order["key"])
        return {}

    monkeypatch.setattr(decoders, "run_take_tool", tool)

    async def run() -> None:
        queue = Decoders()
        keys = [f"key{number % 5}" for number in range(20)]
        reading = [queue.read_take(key, "check", {"key": key}, lambda **_: None) for key in keys]
        async with queue._uploads.turn("key0"):
            await asyncio.gather(*reading)

    asyncio.run(run())
    assert max(most) == (2, 1)


def test_a_picture_is_measured_by_its_head_and_format(tmp_path: Path) -> None:
    def measure(content: bytes) -> Any:
        (tmp_path / "given").write_bytes(content)
        order = {"kind": PICTURE, "source": str(tmp_path / "given"), "target": "", "limit": 1e8}
        return answered(HANDLERS[MEASURE], order)[-1].content["memory_bytes"]

    sizes = {name: (measure(one_colour(name, 200)) - CHILD_BYTES) / 200**2 for name in FORMATS}
    assert sizes == {"PNG": 4, "WEBP": 16, "JPEG": 4, "progressive": 7, "BMP": 4, "TIFF": 4}
    transparent = io.BytesIO()
    Image.new("RGBA", (200, 200)).save(transparent, "PNG")
    assert (measure(transparent.getvalue()) - CHILD_BYTES) / 200**2 == 8  # its copy as RGB


@pytest.mark.skipif(sys.platform != "linux", reason="ru_maxrss is in KB on Linux only")
@pytest.mark.parametrize("name", FORMATS)
def test_no_format_takes_more_memory_than_is_said(tmp_path: Path, name: str) -> None:
    """Of the real decoder, in a process whose largest memory is that of this picture."""
    (tmp_path / "large").write_bytes(one_colour(name, 4000))
    (tmp_path / "small").write_bytes(one_colour(name, 40))
    command = [sys.executable, "-c", MEASURE_HERE, str(tmp_path / "large"), str(tmp_path / "small")]
    taken, expected = map(int, subprocess.run(command, capture_output=True, check=True, text=True).stdout.split())
    assert taken <= 1.1 * expected + (8 << 20)


@pytest.mark.skipif(sys.platform != "linux", reason="other processes have limits on Linux only")
def test_a_decoder_takes_no_more_than_is_reserved_for_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever a file makes of its head: here the decoder gets 100 MB too little."""
    (tmp_path / "given").write_bytes(one_colour("PNG", 6300))
    asked = FileOrder(PICTURE, tmp_path / "given", tmp_path / "made", 4e7)
    asyncio.run(Decoders().decode("a", asked, "it", 120.0))
    with Image.open(tmp_path / "made") as made:
        assert made.size == (6300, 6300)
    monkeypatch.setattr(decoders, "ADDRESS_BYTES", -(100 << 20))
    with pytest.raises(RefusedError, match=r"it cannot be used: it (is no picture that can be decoded|needs too much)"):
        asyncio.run(Decoders().decode("a", asked, "it", 120.0))


def test_a_picture_that_takes_too_much_memory_is_refused_before_it_is_decoded(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The command line's own reader of pictures, too."""
    monkeypatch.setattr(pictures, "MAX_DECODING_BYTES", 10 << 20)
    path = tmp_path / "a.webp"
    path.write_bytes(one_colour("WEBP", 900))
    message = "takes 12 MB to decode, a WEBP of 900 x 900 pixels, more than 10; save it in"
    with pytest.raises(DataError, match=message), open_picture(path, "the background image"):
        pass
    with open_picture(png(900, 900), "the background image") as picture:
        assert decoding_bytes(picture) == 4 * 900**2


@pytest.mark.server
def test_who_sends_recordings_slowly_holds_places_of_the_own_key_only(host: HostService, tmp_path: Path) -> None:
    """Two builds whose bodies never end; the turn of a check was taken before the body came."""
    keys = {name: add_key(tmp_path / "keys.toml", name, ["build", "speak"]) for name in ("mallory", "ann")}
    with host(keys=tmp_path / "keys.toml", workers=0) as running, ExitStack() as stack:
        path = running.url + "/v1/talkers/build"
        head = (
            "POST /v1/talkers/build HTTP/1.1\r\nHost: localhost\r\nContent-Type: multipart/form-data; boundary=x\r\n"
            f"Authorization: Bearer {keys['mallory']}\r\nContent-Length: 1000000\r\n\r\n--x\r\n"
        )
        held = [stack.enter_context(connect(running.url)) for _ in range(BODIES_OF_KEY)]
        for one in held:
            one.sendall(head.encode())
        form = {"job": '{"kind": "talker", "request": {"name": "anna"}}'}

        def build(name: str) -> httpx.Response:
            headers = {"Authorization": f"Bearer {keys[name]}"}
            return httpx.post(path, data=form, files={"video": b"none"}, headers=headers, timeout=60.0)

        assert build("ann").json()["error"]["message"].startswith("video cannot be used: it is no video")
        refused = eventually(lambda: (answer := build("mallory")).status_code == 429 and answer)
        assert refused.json()["error"]["message"].startswith("the key mallory sends 4 recordings already")
