"""In Chromium a character is dropped, refused with what helps, and becomes a face with a report."""

import base64
import os
from collections.abc import Iterator
from pathlib import Path

import httpx
import pytest

from tests.interchange.characters.made import Variant, head_without_mouth, write_character_file
from tests.interchange.exports.programs import node_package
from tests.running import ServeProcess, serve_process
from tests.serving.studio.browser.test_animate_page import AXE
from tests.serving.studio.browser.test_photo_dialog import DROP
from tests.serving.studio.chromium import Browser
from tests.serving.studio.served import Page
from tts2face.serving.studio.pages.character_dialog import SHAPES, TITLE, mapping_rows


@pytest.fixture(scope="module")
def service(face_model: Path) -> Iterator[ServeProcess]:
    with serve_process(environment=os.environ | {"TTS2FACE_FACE_MODEL": str(face_model)}) as running:
        yield running


def drop(browser: Browser, content: bytes, name: str) -> None:
    """Drop a file on the dialog, in parts: a script's text is limited."""
    browser.run("window.dropped = ''")
    text = base64.b64encode(content).decode()
    for at in range(0, len(text), 1_000_000):
        browser.run("window.dropped += arguments[0]", text[at : at + 1_000_000])
    browser.run(DROP.replace("arguments[0]", "window.dropped"), "", name)


def test_a_head_without_shapes_is_refused_with_what_helps_and_then_made(
    browser: Browser, service: ServeProcess, tmp_path: Path
) -> None:
    head = head_without_mouth()
    bare = write_character_file(tmp_path / "bare.glb", Variant(dropped=frozenset(head.shape_names)), head).read_bytes()
    number = httpx.post(f"{service.url}/studio/api/projects", json={"text": "Bob may move."}).json()["id"]
    Page(browser, f"{service.url}/studio/animate/{number}")
    browser.click(TITLE)
    browser.wait("return document.querySelector('.q-uploader')")
    axe = (node_package("axe-core") / "axe-core" / "axe.min.js").read_text()
    browser.run(axe + "; window.axe = axe")
    assert browser.run(AXE) == []
    browser.run(
        "window.asked = 0; document.querySelector('.q-uploader input').addEventListener('click', (one) => {"
        " asked += 1; one.preventDefault(); }); document.querySelector('.q-uploader button').click()"
    )
    assert browser.run("return asked") == 1
    drop(browser, bare, "Bare Head.glb")
    browser.wait("return document.querySelector('[aria-label=\"Name of the face\"]').value === 'bare-head'", seconds=60)
    browser.click("Make the face")
    status = "return document.querySelector('.photo-dialog [role=status]').innerText"
    shown = browser.wait(status + ".includes('carry over') && " + status.removeprefix("return "), seconds=120)
    assert f"with “{SHAPES}”" in shown
    assert "the part" not in shown
    browser.run(
        "[...document.querySelectorAll('.q-checkbox')].find((one) => one.innerText.startsWith('Shapes')).click()"
    )
    browser.click("Make the face")
    browser.wait(status + ".startsWith('bare-head speaks')", seconds=240)
    notes = browser.run("return document.querySelector('.photo-dialog').innerText")
    assert "of the shipped face head" in notes
    faces = httpx.get(f"{service.url}/v1/faces/bare-head").json()
    assert faces["about"]["summary"].startswith("mesh with 5")
    browser.click("Close")
    project = httpx.get(f"{service.url}/studio/api/projects/{number}/project.json").json()
    assert project["models"]["face"] == "bare-head"


def test_rows_of_names_are_typed_with_spaces() -> None:
    assert mapping_rows("jawOpen Mouth Wide\nmouthSmile\tSmile\t0.5\n") == "jawOpen\tMouth Wide\nmouthSmile\tSmile\t0.5"
    assert mapping_rows('[shapes]\njawOpen = "A"') == '[shapes]\njawOpen = "A"'
    assert mapping_rows(" \n") is None
