"""In Chromium a photo is dropped, its lips and lids are corrected with the mouse, and the face shows on the stage."""

import base64
import io
import os
from collections.abc import Iterator
from pathlib import Path

import httpx
import pytest
from PIL import Image

from tests.interchange.exports.programs import node_package
from tests.photo.pictures import still
from tests.running import ServeProcess, eventually, serve_process
from tests.serving.studio.browser.test_animate_page import AXE
from tests.serving.studio.chromium import Browser
from tests.serving.studio.consents import give_consent
from tests.serving.studio.served import Page
from tts2face.models.face_file import read_face
from tts2face.serving.studio.app import RECONNECT_S

SIDE = 480
CONSENT = "agreed: Tom Smith, 2026-01-02"
DROP = """const bytes = Uint8Array.from(atob(arguments[0]), (one) => one.charCodeAt(0)), data = new DataTransfer();
    data.items.add(new File([bytes], arguments[1], {type: 'image/png'}));
    const options = {dataTransfer: data, bubbles: true, cancelable: true};
    const fire = (one, kind) => one.dispatchEvent(new DragEvent(kind, options));
    fire(document.querySelector('.q-uploader'), 'dragover');
    return new Promise((done) => setTimeout(() => {
        fire(document.querySelector('.q-uploader__dnd'), 'drop');
        done(true);
    }, 200))"""
# A menu has no size for a while after it is mounted, as on a busy page.
BUSY = """const {get} = Object.getOwnPropertyDescriptor(HTMLElement.prototype, 'offsetHeight');
    const until = performance.now() + 500;
    const height = function () { return this.matches('.q-menu') && performance.now() < until ? 0 : get.call(this); };
    Object.defineProperty(HTMLElement.prototype, 'offsetHeight', {get: height})"""
HANDLE = "const one = document.querySelector(`[data-place='${arguments[0]}']`)?.getBoundingClientRect();"


@pytest.fixture(scope="module")
def uploads(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of the private folders of uploads."""
    return tmp_path_factory.mktemp("uploads")


@pytest.fixture(scope="module")
def service(uploads: Path, face_model: Path) -> Iterator[ServeProcess]:
    """A service whose operator allows photos."""
    variables = {"TTS2FACE_SERVE_PHOTOS": "true", "TMPDIR": str(uploads), "TTS2FACE_FACE_MODEL": str(face_model)}
    with serve_process(environment=os.environ | variables) as running:
        yield running


@pytest.fixture
def dialog(browser: Browser, service: ServeProcess) -> Browser:
    """The dialog of a project, in which the picture of a shipped person was dropped."""
    number = httpx.post(f"{service.url}/studio/api/projects", json={"text": "Bob may move."}).json()["id"]
    Page(browser, f"{service.url}/studio/animate/{number}")
    browser.click("A face from a photo")
    browser.wait("return document.querySelector('.q-uploader')")
    drop_picture(browser)
    return browser


def drop_picture(browser: Browser) -> None:
    content = io.BytesIO()
    Image.fromarray(still("tomas", SIDE)).save(content, "PNG")
    browser.run(DROP, base64.b64encode(content.getvalue()).decode(), "Tom Smith.png")
    browser.wait("return document.querySelector('.studio-photo image')?.closest('svg').clientWidth", seconds=120)


def place(browser: Browser, handle: str) -> tuple[float, float]:
    """Place of a handle in the window."""
    x, y = browser.wait(HANDLE + "return one && [one.x + one.width / 2, one.y + one.height / 2]", handle)
    return float(x), float(y)


def pictures(uploads: Path) -> list[Path]:
    return list(uploads.glob("tts2face-upload-*"))


def test_places_are_dragged_and_the_face_is_made_with_them(
    dialog: Browser, service: ServeProcess, uploads: Path
) -> None:
    assert len(pictures(uploads)) == 1
    before, lids = place(dialog, "teeth"), place(dialog, "left_eye-upper-4")
    dialog.drag([before, (before[0] + 3, before[1] + 6), (before[0] + 5, before[1] + 12)])
    assert place(dialog, "teeth") == pytest.approx((before[0] + 5, before[1] + 12), abs=1.5)
    corrected = dialog.run("const one = document.querySelector(`[data-place='teeth']`);"
                           "return ['cx', 'cy'].map((name) => Number(one.getAttribute(name)))")  # fmt: skip
    dialog.drag([lids, (lids[0], lids[1] - 4), (lids[0], lids[1] - 8)])
    assert place(dialog, "left_eye-upper-4") == pytest.approx((lids[0], lids[1] - 8), abs=1.5)
    corner = place(dialog, "left_eye-upper-0")
    dialog.run("document.querySelector(`[data-place='pivot']`).focus()")
    pivot = place(dialog, "pivot")
    dialog.press("Right")
    assert place(dialog, "pivot")[0] > pivot[0]
    assert place(dialog, "left_eye-upper-0") == corner
    dialog.click("Make the face")
    dialog.wait("return document.body.innerText.includes('state the consent')", seconds=60)
    give_consent(dialog, "Tom Smith", "2026-01-02")
    dialog.click("Make the face")
    dialog.wait("return !document.querySelector('.q-dialog .photo-dialog')", seconds=120)
    faces = {one["name"]: one for one in httpx.get(f"{service.url}/v1/faces").json()["data"]}
    assert "tom-smith" in faces
    eventually(lambda: not pictures(uploads), 10, "the picture is deleted")
    dialog.wait("return [...document.querySelectorAll('.studio-views button')].map((one) => one.innerText.trim())"
                ".filter(Boolean).join() === 'Front,Close-up'", seconds=120)  # fmt: skip
    eventually(lambda: dialog.picture(".studio-stage canvas").std() > 20, 30, "the stage shows the picture")
    content = next(Path(service.data.name).rglob(faces["tom-smith"]["sha256"]))
    face = read_face(content)
    assert face.metadata["fit"]["teeth"] == pytest.approx(corrected, abs=1.0)  # pixels
    assert face.metadata["consent"]["statement"] == CONSENT


def test_no_picture_is_kept_when_the_dialog_or_the_page_is_left(
    dialog: Browser, service: ServeProcess, uploads: Path
) -> None:
    axe = (node_package("axe-core") / "axe-core" / "axe.min.js").read_text()
    dialog.run(axe + "; window.axe = axe")
    assert dialog.run(AXE) == []
    assert len(pictures(uploads)) == 1
    dialog.press("Escape")
    eventually(lambda: not pictures(uploads), 10, "the picture is deleted")
    dialog.click("A face from a photo")
    dialog.wait("return document.querySelector('.q-uploader')")
    assert not dialog.run("return document.querySelector('.studio-photo')?.closest('.photo-found').clientWidth")
    drop_picture(dialog)
    assert len(pictures(uploads)) == 1
    dialog.open(f"{service.url}/studio/")
    eventually(lambda: not pictures(uploads), 3 * RECONNECT_S, "the picture is deleted")


def test_a_head_is_made_in_place_of_a_picture_that_speaks(dialog: Browser, service: ServeProcess) -> None:
    dialog.run("[...document.querySelectorAll('.q-radio')].find((one) => one.innerText.includes('3D head')).click()")
    dialog.wait("return !document.querySelector('.studio-photo')?.offsetParent")
    assert dialog.run("return document.querySelector('.photo-found').innerText.includes('Keep wrinkles')")
    dialog.run(BUSY)
    dialog.run("document.querySelector('.photo-found .q-select').click()")
    blue = "[...document.querySelectorAll('[role=option]')].find((one) => one.innerText.includes('blue'))"
    dialog.wait(f"return !!{blue}")
    dialog.run(f"{blue}.click()")
    dialog.wait("return document.querySelector('.photo-found .q-select').innerText.includes('blue')")
    dialog.type("Name of the face", "tom-head")
    give_consent(dialog, "Tom Smith", "2026-01-02")
    dialog.click("Make the face")
    dialog.wait("return !document.querySelector('.q-dialog .photo-dialog')", seconds=240)
    made = httpx.get(f"{service.url}/v1/faces/tom-head").json()
    assert made["about"]["takes_haircuts"]
    dialog.wait("return document.querySelector('.studio-views').innerText.includes('Profile')", seconds=120)
