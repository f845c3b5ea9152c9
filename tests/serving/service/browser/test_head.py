"""The element <tts2face-head> in Chromium: a character of its own names speaks, is interrupted, and listens."""

import base64
import io
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest
from PIL import Image

from tests.docs.blocks import DOCS
from tests.interchange.characters.made import Variant, head_without_mouth, write_character_file
from tests.interchange.characters.made import write_landmarks as write_true_landmarks
from tests.interchange.exports.programs import node_package, served
from tests.running import HostService, RunningService
from tests.serving.studio.chromium import Browser, open_browser
from tts2face.interchange.characters.importing import import_face
from tts2face.interchange.characters.saving import save_face
from tts2face.serving.service.keys import add_key

TEXT = "Papa saw fifty boats."
LONG = "In the village they spoke of nothing else for days, and then all of them went down to the river."
POSED = """head.stage.puppet.pose(["Mund_A"], [arguments[0]], {});
head.stage.render();
return head.shadowRoot.querySelector("canvas").toDataURL();"""
WORDS = """window.words = [];
const head = document.querySelector("tts2face-head");
head.addEventListener("word", ({ detail }) => words.push(detail.word));"""
PUSHED = """
const body = JSON.stringify({text: arguments[0], format: "pcm"});
const headers = {"content-type": "application/json", authorization: `Bearer ${await head.key()}`};
const answer = await fetch(head.getAttribute("server") + "/v1/clips", {method: "POST", headers, body});
const pcm = await answer.arrayBuffer();
found.drawn.length = 0;
for (let at = 0; at < pcm.byteLength; at += 960) {
  head.push(pcm.slice(at, at + 960), 24000).then(how => { found.how = how; });
}
head.endSound();
return pcm.byteLength / 48000;"""
OWN = {"Mund_A": "jawOpen", "Mund_I": "mouthSmileLeft", "Mund_U": "mouthPucker", "Mund_E": "mouthStretchLeft"}
PAGE = """<!doctype html><html lang="en"><meta charset="utf-8"><title>A head</title><link rel="icon" href="data:,">
<style>tts2face-head { width: 320px; height: 320px; background: #fff; }</style>
<script type="importmap">{"imports": {"three": "/node_modules/three/build/three.module.js",
"three/addons/": "/node_modules/three/examples/jsm/"}}</script>
<tts2face-head captions></tts2face-head>
<script type="module">
import SCRIPT;
const head = document.querySelector("tts2face-head");
window.found = {events: [], drawn: []};
for (const type of ["ready", "word", "phone", "caption", "state", "end", "error", "blocked"]) {
  head.addEventListener(type, ({ detail }) => {
    found.events.push({ type, ...detail, caption: head.shadowRoot.querySelector("[part=captions]").innerText,
      jaw: head.weights.Mund_A ?? null });
  });
}
setInterval(() => found.drawn.push([head.state, head.weights.Mund_A ?? 0]), 20);
Object.entries(ATTRIBUTES).forEach(([name, value]) => head.setAttribute(name, value));
head.key = () => Promise.resolve(KEY);
window.head = head;
</script></html>"""


@pytest.fixture(scope="module")
def character(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder with a character whose four shapes have names of its own, as a file and as a face."""
    folder, head = tmp_path_factory.mktemp("character"), head_without_mouth()
    names = {shape: own for own, shape in OWN.items()}
    variant = Variant(
        rename=lambda shape: names[shape], dropped=frozenset(set(head.shape_names) - set(names)), is_skinned=True
    )
    file = write_character_file(folder / "own.glb", variant, head)
    mapping = folder / "mapping.tsv"
    mapping.write_text("".join(f"{shape}\t{own}\n" for own, shape in OWN.items()))
    landmarks = write_true_landmarks(folder / "own.tsv")
    save_face(folder / "own.face", import_face(file, landmarks=landmarks, mapping=mapping).face)
    return folder


@pytest.fixture(scope="module")
def window(
    character: Path, host: HostService, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[tuple[Browser, RunningService, str]]:
    """A window, a service with keys that allows the page's origin, and a key; the character is its face `own`."""
    modules, keys = node_package("three"), tmp_path_factory.mktemp("keys") / "keys.toml"
    (character / "node_modules").mkdir()
    (character / "node_modules/three").symlink_to(modules / "three")
    key = add_key(keys, "page", ["speak", "build"])
    with served(character) as address, host(keys=keys, origins=address) as service, open_browser((400, 460)) as opened:
        files, headers = {"file": (character / "own.face").read_bytes()}, {"authorization": f"Bearer {key}"}
        answer = httpx.post(f"{service.url}/v1/faces", data={"name": "own"}, files=files, headers=headers, timeout=300)
        assert answer.status_code == 201, answer.text
        opened.address = f"{address}/index.html"
        yield opened, service, key


@pytest.fixture
def page(window: tuple[Browser, RunningService, str], character: Path) -> Iterator[Browser]:
    """The window with the element, which shows the character."""
    opened, service, key = window
    content = PAGE.replace("SCRIPT", json.dumps(f"{service.url}/browser/tts2face-head.js"))
    content = content.replace(
        "ATTRIBUTES", json.dumps({"server": service.url, "face": "own", "src": "own.glb"})
    ).replace("KEY", json.dumps(key))
    (character / "index.html").write_text(content)
    opened.errors()
    opened.requests()
    opened.open(opened.address)
    opened.wait("return found.events.some(one => one.type === 'ready') && head.state === 'idle'")
    yield opened
    assert opened.errors() == []
    assert [address for address in opened.requests() if key in address] == []
    opened.open("about:blank")


def test_the_page_of_the_guide_speaks(window: tuple[Browser, RunningService, str], character: Path) -> None:
    """docs/examples/talking_head.html as it is copied, with a shipped face; a script of the page sets its key."""
    opened, service, key = window
    page = (DOCS / "examples/talking_head.html").read_text(encoding="utf-8")
    assert page.count("http://localhost:8880") == 2
    page = page.replace("http://localhost:8880", service.url).replace('face="ada"', f'face="ada" key="{key}"')
    (character / "index.html").write_text(page.replace("24rem", "8rem"), encoding="utf-8")
    opened.errors()
    opened.open(opened.address)
    opened.run(WORDS)
    opened.click("Speak")
    opened.wait("return words.at(-1) === 'you'")
    opened.wait("return document.querySelector('tts2face-head').stage.puppet?.names.includes('jawOpen')")
    assert opened.run("return words") == ["Hello", "there", "how", "are", "you"]
    assert opened.errors() == []


def events(page: Browser, *types: str) -> list[dict[str, Any]]:
    return [one for one in page.run("return found.events") if one["type"] in types]


def drawn(page: Browser, weight: float) -> np.ndarray:
    """Pixels (H, W, 4), red, green, blue and alpha, of the canvas with one weight of the character."""
    content = page.run(POSED, weight)
    return np.asarray(Image.open(io.BytesIO(base64.b64decode(content.partition(",")[2]))).convert("RGBA"), int)


def test_a_character_of_its_own_names_speaks(page: Browser) -> None:
    page.run("found.drawn.length = 0; head.speak(arguments[0]).then(how => { found.how = how; })", TEXT)
    assert page.wait("return found.how")["interrupted"] is False
    page.wait("return head.state === 'idle'")
    heard = events(page, "state", "caption", "word", "end")
    told = [one.get("state") or one.get("word") or one["type"] for one in heard]
    told = told[told.index("speaking") :]
    assert told == ["speaking", "caption", "Papa", "saw", "fifty", "boats", "end", "idle"]
    assert {one["caption"] for one in heard if one["type"] == "word"} == {TEXT}
    phones = [one["phone"] for one in events(page, "phone") if one["phone"] != "sil"]
    assert phones[:3] == ["p", "ɑ", "p"]
    jaws = {state: [jaw for at, jaw in page.run("return found.drawn") if at == state] for state in ("speaking", "idle")}
    assert max(jaws["speaking"]) > 0.15
    assert np.median(jaws["idle"]) < 0.02
    assert events(page, "error", "blocked") == []


def test_weights_move_the_pixels_of_the_mouth(page: Browser) -> None:
    rest, opened = drawn(page, 0.0), drawn(page, 1.0)
    rows = np.flatnonzero(rest[..., 3].any(axis=1))
    assert 0.4 < np.ptp(rows) / len(rest) < 1.0  # the head fills the picture
    changed = np.argwhere((np.abs(opened - rest) > 20).any(axis=2))
    assert len(changed) > 30
    assert (changed[:, 0].mean() - rows[0]) / np.ptp(rows) > 0.5  # the mouth is below the middle
    assert np.array_equal(drawn(page, 0.0), rest)


def test_an_interruption_ends_words_and_closes_the_mouth(page: Browser) -> None:
    page.run("head.speak(arguments[0]).then(how => { found.how = how; })", LONG)
    page.wait("return found.events.some(one => one.word === 'village')")
    assert page.run("return head.interrupt()") > 0
    assert page.wait("return found.how")["interrupted"] is True
    page.wait("return head.state === 'idle' && head.weights.Mund_A < 0.01")
    after = [one["type"] for one in page.run("return found.events")]
    assert set(after[after.index("end") :]) <= {"end", "state"}
    page.run("head.speak('Boats.')")  # it speaks on
    page.wait("return found.events.some(one => one.word === 'Boats')")
    assert "river" not in [one["word"] for one in events(page, "word")]


def test_pushed_sound_has_lips_and_an_end(page: Browser) -> None:
    seconds = page.run(PUSHED, TEXT)
    how = page.wait("return found.how")
    assert how["interrupted"] is False
    assert how["seconds"] == pytest.approx(seconds, abs=0.01)
    assert max(jaw for state, jaw in page.run("return found.drawn") if state == "speaking") > 0.15
    assert [one["state"] for one in events(page, "state")][-2:] == ["speaking", "idle"]


def test_it_listens_until_it_speaks(page: Browser) -> None:
    page.run("head.listen()")
    page.wait("return head.state === 'listening'")
    page.run("head.speak('Yes.').then(how => { found.how = how; })")
    page.wait("return found.how")
    page.wait("return head.state === 'idle'")


def test_a_file_with_other_names_is_reported(page: Browser) -> None:
    """A face that was sent without its character's file comes back with ARKit's names."""
    page.run("found.events.length = 0; head.removeAttribute('src')")
    page.wait("return found.events.some(one => one.type === 'error')")
    (error,) = events(page, "error")
    assert "no shape named as the service's weights (Mund_" in error["message"]


def test_a_wrong_key_is_reported(page: Browser) -> None:
    page.run("head.removeAttribute('src'); head.key = 'x'")
    page.wait("return found.events.some(one => one.message?.includes('the API key is unknown'))")
    page.errors()  # of the refused requests
