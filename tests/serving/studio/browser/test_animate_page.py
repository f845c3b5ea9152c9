"""The studio in Chromium: from a text to a file, and what all pages must have."""

import time
from itertools import pairwise
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import httpx
import numpy as np
import pytest

from tests.interchange.exports.programs import node_package
from tests.running import eventually
from tests.serving.studio.chromium import Browser
from tests.serving.studio.served import Page, create_project
from tts2face.serving.studio.renders import formats
from tts2face.video.media import read_frames, read_sound

TEXT = "Bob may move. Five maps were there."
DRAGGED_S = 0.05
LOUD = 3000  # of 32767
PREVIEW = "const { preview } = await import('tts2face-studio/preview.js'); return "
CLOCK = "const { clock } = await import('tts2face-studio/clock.js'); return "
AXE = """const found = await axe.run(document, {resultTypes: ['violations']});
    return found.violations.map((one) => `${one.id}: ${one.nodes.map((node) => node.html.slice(0, 150)).join(' ')}`)"""


class Project:
    """A project as the server has it."""

    def __init__(self, studio: httpx.Client, number: str) -> None:
        self._studio, self._address = studio, f"/api/projects/{number}"

    def content(self) -> dict[str, Any]:
        found: dict[str, Any] = self._studio.get(f"{self._address}/project.json").json()
        return found

    def wait_for(self, part: str) -> Any:
        """A part of the project, once it is there."""
        return eventually(lambda: self.content().get(part), 30, f"the project has {part}")

    def files(self, n: int) -> dict[str, bytes]:
        """Files of the project by suffix, once there are n and all are complete."""

        def done() -> list[dict[str, Any]]:
            found: list[dict[str, Any]] = self._studio.get(f"{self._address}/renders").json()
            assert not [one for one in found if one["state"] == "failed"], found
            return found if len(found) == n and all(one["state"] == "done" for one in found) else []

        made = eventually(done, 240, f"{n} files are made")
        address = f"{self._address}/renders"
        return {
            Path(one["name"]).suffix: self._studio.get(f"{address}/{one['id']}/file").content for one in made
        }  # fmt: skip


def check_sound(page: Page) -> None:
    """Ctrl+Enter plays: the clock of the sound runs, and the samples are loud."""
    page.browser.run("document.querySelector('textarea').focus()")
    page.browser.press("Control+Enter")
    first = page.browser.wait(CLOCK + "clock.playing && clock.time > 0.1 && clock.time")
    page.browser.wait(CLOCK + "clock.time > arguments[0] + 0.3", first)
    assert page.browser.run(PREVIEW + "preview.pcm.reduce((peak, one) => Math.max(peak, Math.abs(one)), 0)") > LOUD
    page.browser.run(CLOCK + "clock.pause()")


def check_mouth(page: Page) -> None:
    """The mouth's pixels rest in silence and change with speech."""
    phones = page.browser.run(PREVIEW + "preview.phones")
    assert phones[0][0] == "sil"
    rest, again = page.mouth(0.01), page.mouth(0.04)
    vowels = [(one[1] + one[2]) / 2 for one in phones if one[0] in {"ɑ", "eɪ", "æ", "u", "aɪ"}]
    noise, speech = np.abs(rest - again).mean(), [np.abs(page.mouth(time) - rest).mean() for time in vowels[:3]]
    assert noise < 4  # of 255; the head moves a little
    assert np.median(speech) > max(8, 3 * noise)


def paint(page: Page, project: Project) -> None:
    page.browser.click("delighted")
    page.browser.wait("return document.querySelector('#studio-brush').getAttribute('aria-pressed') === 'true'")
    page.browser.drag([page.at("lane:brows", 0.4), page.at("lane:brows", 0.6), page.at("lane:brows", 0.9)], held="Alt")
    (span,) = project.wait_for("timeline")["spans"]
    assert (span["feature"], span["style"]) == ("brows", "delighted")
    assert (span["start"], span["end"]) == (pytest.approx(0.4, abs=0.02), pytest.approx(0.9, abs=0.02))
    page.browser.run("document.querySelector('#studio-select').click()")
    page.browser.wait("return document.querySelector('#studio-select').getAttribute('aria-pressed') === 'true'")


def drag_edge(page: Page, project: Project) -> None:
    """Drag the edge between the two longest neighbours; the lips of the page follow."""
    phones = page.browser.run(PREVIEW + "preview.phones")
    lengths = [min(after[2] - after[1], before[2] - before[1]) * (after[3] == before[3]) for before, after in
               pairwise(phones)]  # fmt: skip
    at = int(np.argmax(lengths)) + 1
    time_of = phones[at][1]
    page.browser.drag([page.at("phones", time_of + shift) for shift in (0.0, 0.02, 0.04, DRAGGED_S)])
    (edge,) = project.wait_for("edges")
    begin = page.browser.run(PREVIEW + "preview.sentences[arguments[0]][2]", phones[at][3])
    assert edge["edges"][phones[at][4]] == pytest.approx(time_of + DRAGGED_S - begin, abs=0.02)
    page.browser.wait(
        PREVIEW + "Math.abs(preview.phones[arguments[0]][1] - arguments[1]) < 0.02", at, time_of + DRAGGED_S
    )


def correct_word(page: Page, project: Project) -> None:
    word = next(one for one in page.browser.run(PREVIEW + "preview.words") if one[0].lower() == "maps")
    place = page.at("words", (word[1] + word[2]) / 2)
    page.browser.drag([place, place])
    page.browser.wait("return document.querySelector('input[aria-label=Word]').value === 'maps'")
    page.browser.type("Phones", "/mɑps/")
    page.browser.click("Set")
    assert project.wait_for("pronunciations") == {"maps": "/mɑps/"}
    page.browser.wait(PREVIEW + "preview.phones.filter((one) => one[0] === 'ɑ').length > 1")


def undo(page: Page, project: Project) -> None:
    page.focus()
    page.browser.press("Control+z")
    eventually(lambda: "pronunciations" not in project.content(), 10, "the correction is taken back")
    page.browser.wait("return !document.querySelector('#studio-redo').disabled")
    page.browser.press("Control+Shift+z")
    assert project.wait_for("pronunciations") == {"maps": "/mɑps/"}


def check_reload(page: Page, project: Project) -> None:
    """All is there after a reload, also what can be undone."""
    before = project.content()
    reloaded = Page(page.browser, page.browser.run("return location.href"))
    assert project.content() == before
    assert page.browser.run(PREVIEW + "preview.phones.filter((one) => one[0] === 'ɑ').length") > 1
    page.browser.wait("""return [...document.querySelectorAll('.studio-grid [role=gridcell]')].some(
        (one) => one.innerText === 'Brows lane, 1 elements')""")
    page.browser.wait("return !document.querySelector('#studio-undo').disabled")
    reloaded.focus()


def export(browser: Browser, form: str) -> None:
    """Make a file in the dialog."""
    browser.press("x")
    browser.wait("return !!document.querySelector('.q-dialog [aria-label=Format]')")
    names = list(formats())
    steps = names.index(form) - names.index("mp4")  # which is chosen first
    if steps:
        browser.run("document.querySelector('.q-dialog [aria-label=Format]').focus()")
        browser.press("Down")
        browser.wait("return !!document.querySelector('[role=option]')")
        browser.press(*["Down" if steps > 0 else "Up"] * abs(steps), "Enter")
    browser.wait("return document.querySelector('.q-dialog .q-select').innerText.includes(arguments[0])", f"{form} - ")
    browser.click("Make")
    browser.wait(
        "return [...document.querySelectorAll('.q-dialog .project')].some((one) => one.innerText.includes('.'))"
    )
    browser.press("Escape")
    browser.wait("return !document.querySelector('.q-dialog')")


def check_film(content: bytes, folder: Path, seconds: float) -> None:
    (folder / "film.mp4").write_bytes(content)
    frames = [frame.pixels for frame in read_frames(folder / "film.mp4")]
    sound = read_sound(folder / "film.mp4", 16_000).samples
    assert len(frames) == pytest.approx(30 * seconds, abs=1)
    assert len(sound) == pytest.approx(16_000 * seconds, rel=0.05)
    assert np.abs(sound).max() > LOUD / 32767
    assert max(np.abs(one.astype(float) - frames[0]).mean() for one in frames) > 0.5


def check_requests(browser: Browser, url: str) -> None:
    """No request of a page has left the host."""
    found = {urlsplit(one) for one in browser.requests()}
    assert {one.scheme for one in found} <= {"http", "ws", "data", "blob"}
    assert {one.netloc for one in found if one.scheme in {"http", "ws"}} == {urlsplit(url).netloc}


def test_a_text_is_heard_painted_corrected_kept_and_rendered(
    browser: Browser, studio_service: Any, studio: httpx.Client, tmp_path: Path
) -> None:
    url = studio_service.url
    browser.requests()
    number = create_project(browser, url, TEXT)
    project = Project(studio, number)
    change = {"edit": {"kind": "picture", "options": {"size": "128x128", "quality": "draft"}}}
    assert studio.post(f"/api/projects/{number}/edits", json=change).status_code == 400  # the page edits it
    page = Page(browser, f"{url}/studio/animate/{number}")
    check_sound(page)
    check_mouth(page)
    paint(page, project)
    drag_edge(page, project)
    correct_word(page, project)
    undo(page, project)
    check_reload(page, project)
    browser.press("p")
    browser.wait("return document.querySelector('.studio-picture')?.naturalWidth > 100")
    seconds = browser.run(PREVIEW + "preview.duration")
    export(browser, "srt")
    export(browser, "mp4")
    files = project.files(2)
    assert b"Five maps were there." in files[".srt"]
    check_film(files[".mp4"], tmp_path, seconds)
    check_requests(browser, url)


def test_styles_of_another_tab_are_offered_when_the_page_is_seen_again(
    browser: Browser, studio_service: Any, studio: httpx.Client
) -> None:
    number = studio.post("/api/projects", json={"text": TEXT}).json()["id"]
    browser.open(f"{studio_service.url}/studio/animate/{number}")
    browser.wait("return window.__studio?.frames > 0")
    texts = "return [...document.querySelectorAll('[role=option], button')].map((one) => one.innerText.trim())"

    def is_offered(name: str) -> bool:
        browser.run("document.dispatchEvent(new Event('visibilitychange'))")
        return name in browser.run(texts)

    try:
        studio.post("/api/styles", json={"name": "half glad", "mix": {"source": "grid_s1"}}).raise_for_status()
        browser.run("document.querySelector('[aria-label=Palette]').click()")
        eventually(lambda: is_offered("my styles"), 30, "the own palette is offered")
        browser.click("my styles")
        eventually(lambda: "half glad" in browser.run(texts), 30, "the own palette is chosen")
        studio.post("/api/styles", json={"name": "very glad", "mix": {"source": "grid_s1"}}).raise_for_status()
        eventually(lambda: is_offered("very glad"), 30, "the new style is offered")
    finally:
        for name in ("half glad", "very glad"):
            studio.delete(f"/api/styles/{name}")
    assert browser.errors() == []


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_axe_finds_nothing(browser: Browser, studio_service: Any, studio: httpx.Client, scheme: str) -> None:
    axe = (node_package("axe-core") / "axe-core" / "axe.min.js").read_text()
    number = studio.post("/api/projects", json={"text": TEXT}).json()["id"]
    browser.devtools("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": scheme}])
    found = []
    try:
        for path in ("", "record", "palette", "puppet", "reports", f"animate/{number}"):
            browser.open(f"{studio_service.url}/studio/{path}")
            browser.wait("return !!document.querySelector('h1') && document.readyState === 'complete'")
            time.sleep(0.5)  # transitions of colours end
            browser.run(axe + "; window.axe = axe")
            found += [f"/{path}: {violation}" for violation in browser.run(AXE)]
    finally:
        browser.devtools("Emulation.setEmulatedMedia", features=[])
    assert found == []
