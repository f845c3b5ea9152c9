"""Files that one has to open to follow seven data through the product, in the table of docs/architecture.md.

``python -m tests.docs.walks [ROOT] [NAME...]`` runs the walks on a checkout (by default this one) and prints for each:

- the files that run: a function of them is called while the datum passes, in whichever process;
- the files to open: such a function decides about the datum. A decision is a condition, a comparison, a `match` or a
  look-up in a table of the module that names the datum as in `Walk.names`; any condition in `Walk.home`, which serves
  this datum alone; or a method of a class of `Walk.kinds`, whose kinds are chosen by the datum. Names of
  numpy are no data: ``np.clip`` makes no clip;
- the moves between rooms: how often the room changes from file to file, in the order in which they are entered.
"""

import ast
import json
import os
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import httpx
import numpy as np
from PIL import Image

from corpus_tools.prompts.coverage import count_units, sentence_units
from corpus_tools.tools.recordings import prompts_answer
from tests.api.rooms import ROOT, room_of
from tests.photo.pictures import still
from tests.rendered_takes import TAKES as TAKES_FOLDER
from tests.running import ServeProcess, eventually
from tests.serving.service.job_requests import SMALL
from tests.serving.service.receiver import Receiver
from tests.serving.studio.chromium import Browser
from tests.serving.studio.consents import give_consent
from tts2face.serving.service.keys import LOCAL_KEY
from tts2face.serving.studio.recordings import RecordingStore
from tts2face.serving.work.database import database_url
from tts2face.serving.work.workers import Workers

TEXT = "We were away a year ago, but Bob may move five big maps."
IDLE_S = 10.0  # of a server that is asked for the list of voices and a page alone
OTHERS = ("/v1/voices", "/studio/")
PICTURE = ("--size", "96x96", "--fps", "10")
SRT = b"1\n00:00:00,500 --> 00:00:02,500\nANN: Hello there.\n"
TAKES = {
    "bin blue at f two now": "bbaf2n", "lay white in z eight please": "lwiz8p", "place red by g four again": "prbg4a",
    "set green with o nine soon": "sgwo9s",
}  # fmt: skip


Function = ast.FunctionDef | ast.AsyncFunctionDef
SERVICE, WORK = "tts2face/serving/service/", "tts2face/serving/work/"
JOB = (SERVICE, WORK)
TAKE = ("tts2face/serving/studio/", WORK, "corpus_tools/tools/")
KINDS = frozenset(("Spoken", "Recorded", "Idle", "Listening", "_OfHead", "Lamps", "Baked", "Photographed"))
CLIP = r"request|picture|text|prepared|piece|speech|clip|source|audio|idle|format|photo\w*|lamps|baked"
# The kind of a light stands beside `light` or is a class; `kind` alone is that of an array, a phone, a field or a file.
PHOTO = r"\w*[Pp]hoto\w*|light|Lamps|Baked|is_flat"


class Called(NamedTuple):
    """A function of the product by its file, relative to the checkout, its first line and its name."""

    file: str
    line: int
    name: str


class Traced:
    """A checkout whose processes record their calls into a folder.

    Parameters
    ----------
    root
        The checkout.
    folder
        Folder of the records and of files of the walk.
    """

    def __init__(self, root: Path, folder: Path) -> None:
        self.root, self.folder = root, folder
        self._idle: set[Called] = set()
        self._switch(0)
        path = os.pathsep.join(map(str, (Path(__file__).with_name("walk_trace"), root)))
        self._environment = {"PYTHONWALK": str(folder), "PYTHONWALK_ROOT": str(root), "PYTHONPATH": path}
        os.chdir(root)  # ``python -m`` finds modules there first

    @contextmanager
    def recorded(self) -> Iterator[None]:
        """Calls within the block are recorded, of processes that run already, too."""
        self._switch(1)
        yield
        self._switch(0)

    def _switch(self, value: int) -> None:
        place = os.open(self.folder / "on", os.O_RDWR | os.O_CREAT)  # not truncated: processes have mapped it
        os.write(place, bytes([value]))
        os.close(place)

    def command(self, *words: str) -> None:
        """Run a command line."""
        command = [sys.executable, "-m", "tts2face", *words]
        subprocess.run(command, env=os.environ | self._environment, check=True)

    def speak(self, *options: str) -> None:
        """Make a small clip of the text, and record it."""
        with self.recorded():
            self.command(TEXT, *PICTURE, *options, "--out", str(self.folder / "clip.mp4"))

    @contextmanager
    def server(self, **settings: str) -> Iterator[ServeProcess]:
        """A service that is ready, with one synthesis process and one worker, which both have begun to wait."""
        process = ServeProcess(environment=self._environment | settings)
        try:
            process.wait_until_ready()
            with Workers(database_url(Path(process.data.name) / "service.sqlite")) as workers:
                eventually(workers.alive, 120)
            with self.recorded():
                for path in OTHERS:
                    httpx.get(f"{process.url}{path}", timeout=120).raise_for_status()
                time.sleep(IDLE_S)
            self._idle = set(self._read())
            yield process
        finally:
            process.close()

    def called(self) -> list[Called]:
        """Functions that were called, in the order of time, without those of an idle server and of any request."""
        return [function for function in self._read() if function not in self._idle]

    def _read(self) -> list[Called]:
        lines = (line.split("\t") for path in self.folder.glob("*.calls") for line in path.read_text().splitlines())
        rows = sorted((int(time_ns), written.split(":", 2)) for time_ns, written in lines)
        return list(dict.fromkeys(Called(file, int(line), name) for _, (file, line, name) in rows))


def speak_audio(traced: Traced) -> None:
    """A clip of a recording whose words are known."""
    sound = str(traced.folder / "words.wav")
    traced.command(TEXT, "--out", sound)
    traced.speak("--audio", sound)


def speak_photo(traced: Traced) -> None:
    """A clip of the face in a picture that was never seen before: faces of others are kept."""
    path, pixels = traced.folder / "me.png", still("head", 512)
    pixels[0, :8, 0] = np.frombuffer(time.time_ns().to_bytes(8), np.uint8)
    Image.fromarray(pixels).save(path)
    traced.speak("--photo", str(path), "--consent", "me")


def post_clip(traced: Traced) -> None:
    """A clip over HTTP."""
    with traced.server() as server, traced.recorded():
        request = {"text": TEXT, "size": "96x96", "fps": 10, "format": "mp4"}
        httpx.post(f"{server.url}/v1/clips", json=request, timeout=120).raise_for_status()


def subtitle_job(traced: Traced) -> None:
    """A file of subtitles as a job, up to the message of its end."""
    with Receiver() as receiver, traced.server(**receiver.environment) as server, traced.recorded():
        job = {"kind": "subtitles", "request": SMALL, "webhook": f"http://{receiver.host}/"}
        form = {"job": json.dumps(job)}
        answer = httpx.post(f"{server.url}/v1/jobs", data=form, files={"subtitles": ("a.srt", SRT)}, timeout=120)
        answer.raise_for_status()
        eventually(lambda: receiver.messages, 240)


def take_to_talker(traced: Traced) -> None:
    """Takes as a webcam sends them to the studio, up to the talker of them."""
    with traced.server() as server:
        store = RecordingStore(Path(server.data.name) / "studio")
        units = [sentence_units(prompt, "en-us") for prompt in TAKES]
        number = store.create(LOCAL_KEY.name, "Test person", prompts_answer(list(TAKES), units, count_units(units)))
        place = f"/studio/api/recordings/{number}/takes"
        with traced.recorded():
            for at, name in enumerate(TAKES.values()):
                content = (TAKES_FOLDER / "clips" / f"{name}.mkv").read_bytes()
                answer = httpx.put(f"{server.url}{place}/{at}", content=content, headers={"content-type": "video/webm"})
                answer.raise_for_status()
            eventually(lambda: not list(store.unchecked()), 240, lambda: str(store.takes(number)))
            build_in_browser(f"{server.url}/studio/record/{number}")


def build_in_browser(page: str) -> None:
    """Build the talker of a recording on its page."""
    browser = Browser()
    try:
        browser.open(page)
        give_consent(browser, "Test person", "2026-01-02")
        browser.click("Build the talker")
        browser.wait("return document.body.innerText.match(/The talker .* is made of.*/)?.[0]", seconds=400)
    finally:
        browser.close()


@dataclass(frozen=True)
class Walk:
    """The way of a datum.

    Parameters
    ----------
    run
        Lets the datum pass through a checkout.
    names
        Pattern of the names that the datum and its parts have in the code.
    home
        Beginning of the paths of files that serve this datum alone.
    within
        Beginning of the paths of files that are counted; what lies below is counted by another walk.
    most
        Files to open at most.
    kinds
        Classes of which one is chosen by the datum.
    """

    run: Callable[[Traced], None]
    names: str
    most: int | None = None
    home: tuple[str, ...] = ()
    within: tuple[str, ...] = ("",)
    kinds: frozenset[str] = frozenset()


WALKS = {
    "a clip": Walk(Traced.speak, CLIP, 35, kinds=KINDS),
    "`--audio` with words": Walk(speak_audio, r"audio|record(?:ing|ed)\w*|words|heard|source", kinds=KINDS),
    "`--photo`": Walk(speak_photo, PHOTO, 40, ("tts2face/photo/",), kinds=KINDS),
    "`--style`": Walk(lambda traced: traced.speak("--style", "delighted"), r"\w*style\w*"),
    "`POST /v1/clips`": Walk(post_clip, "", 10, (SERVICE,), (SERVICE,)),
    "a subtitle job to its webhook": Walk(subtitle_job, "", 15, JOB, JOB),
    "a webcam take to a talker": Walk(take_to_talker, "", 8, TAKE, TAKE),
}


@cache
def functions(path: Path) -> dict[int, tuple[Function, str]]:
    """Functions of a file and the names of their classes, by the line of their first decorator or of themselves."""
    found: dict[int, tuple[Function, str]] = {}

    def add(outer: ast.AST, owner: str) -> None:
        for node in ast.iter_child_nodes(outer):
            if isinstance(node, Function):
                found[min(part.lineno for part in (node, *node.decorator_list))] = node, owner
            add(node, node.name if isinstance(node, ast.ClassDef) else owner)

    add(ast.parse(path.read_text(encoding="utf-8")), "")
    return found


def decisions(function: Function) -> Iterator[ast.expr]:
    """Conditions, comparisons and the keys of look-ups in tables of the module."""
    for node in ast.walk(function):
        if isinstance(node, ast.If | ast.IfExp | ast.While):
            yield node.test
        elif isinstance(node, ast.comprehension):
            yield from node.ifs
        elif isinstance(node, ast.Match):
            yield node.subject
        elif isinstance(node, ast.BoolOp | ast.Compare):
            yield node
        elif isinstance(node, ast.Subscript) and isinstance(node.value, ast.Name) and node.value.id.isupper():
            yield node.slice


def decides(walk: Walk, root: Path, called: Called) -> bool:
    """Whether a function decides about the datum."""
    if called.line not in functions(root / called.file):  # a lambda or comprehension, which its function holds
        return False
    function, owner = functions(root / called.file)[called.line]
    tests = list(decisions(function))
    is_at_home = bool(tests) and called.file.startswith(walk.home)
    names_it = any(re.fullmatch(walk.names, word) for test in tests for word in words(test))
    return owner in walk.kinds or is_at_home or names_it


def words(expression: ast.expr) -> Iterator[str]:
    """Names and attributes of an expression, without names of numpy."""
    for node in ast.walk(expression):
        if isinstance(node, ast.Name):
            yield node.id
        elif isinstance(node, ast.Attribute) and ast.unparse(node.value) != "np":
            yield node.attr


class Counted(NamedTuple):
    """Files of a walk in the order in which they are entered, those to open, and the moves between rooms."""

    files: list[str]
    to_open: dict[str, list[str]]
    moves: int


def counted(walk: Walk, root: Path, called: list[Called]) -> Counted:
    """The files of a walk, of the functions that it called."""
    counted_here = [function for function in called if function.file.startswith(walk.within)]
    files = list(dict.fromkeys(function.file for function in counted_here))
    to_open: dict[str, list[str]] = {}
    for function in counted_here:
        if decides(walk, root, function):
            to_open.setdefault(function.file, []).append(function.name)
    rooms = [room_of(root / file, root) for file in files]
    return Counted(files, to_open, sum(one != other for one, other in pairwise(rooms)))


def main(arguments: list[str]) -> None:
    """Run the walks of the arguments and print their counts."""
    root = Path(arguments[0]).resolve() if arguments else ROOT
    for name in arguments[1:] or WALKS:
        with tempfile.TemporaryDirectory() as folder:
            traced = Traced(root, Path(folder))
            WALKS[name].run(traced)
            found = counted(WALKS[name], root, traced.called())
        n_rooms = len({room_of(root / file, root) for file in found.files})
        counts = f"{len(found.files)} files run in {n_rooms} rooms, {len(found.to_open)} to open, {found.moves} moves"
        print(f"{name}: {counts}")
        for file, names in found.to_open.items():
            print(f"  {file}: {', '.join(names[:4])}")


if __name__ == "__main__":
    main(sys.argv[1:])
