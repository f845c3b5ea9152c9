"""In Chromium a person is before a fake camera: the head follows, a take is recorded, and becomes a style."""

from pathlib import Path

import numpy as np
import pytest

from tests.running import RunningService, eventually
from tests.serving.studio.chromium import Browser
from tts2face.models.palette_file import read_palette

TAKE_S = 4.0
POSE = """import("tts2face-studio/preview.js").then(({preview}) => {
    const at = preview.channel("jawOpen");
    if (preview.nFrames === 1 && at >= 0) (window.jaws ??= []).push(preview.motion[at]);
    }); return window.jaws?.length > 30 && Math.max(...window.jaws) - Math.min(...window.jaws) > 0.05"""


@pytest.fixture
def page(browser: Browser, studio_service: RunningService, shared_recordings: Path, face_model: Path) -> Browser:
    """The page, before a camera that plays a recording."""
    browser.open(f"{studio_service.url}/studio/puppet")
    return browser


def press(browser: Browser, label: str) -> None:
    """Press the button with this accessible name."""
    script = "const one = document.querySelector(`button[aria-label^='${arguments[0]}']`); one?.click(); return !!one"
    browser.wait(script, label)


def head(page: Browser) -> np.ndarray:
    """The stage's picture."""
    return page.picture(".studio-stage canvas").astype(np.float64)


def test_a_camera_drives_the_head_and_its_take_becomes_a_style(page: Browser, data: Path) -> None:
    page.wait("return window.__studio?.face_ms > 0", seconds=120)
    rest = head(page)
    assert rest.std() > 20  # a head before a wall
    page.click("Use camera and microphone")
    page.wait("return window.__studio.camera_state === 'live'", seconds=120)
    page.wait(POSE, seconds=60)
    eventually(lambda: np.abs(head(page) - rest).mean() > 1, 60, "the head to follow the person")
    page.click("Record a take")
    page.wait(
        "return parseFloat(document.querySelector('.puppet-on')?.innerText.match(/[0-9.]+/)) > arguments[0]", TAKE_S
    )
    page.click("Stop")
    page.click("Stop the camera")
    page.wait("return document.body.innerText.includes(' s, with sound')", seconds=120)
    press(page, "Play Take")
    page.wait("import('tts2face-studio/preview.js').then(({preview}) => { window.long = preview.duration });"
              "return window.long > 3")  # fmt: skip
    (folder,) = (data / "studio" / "takes").iterdir()
    assert sorted(file.name for file in folder.iterdir()) == [
        "owner", "preview.bin", "sound.wav", "take.csv", "take.json"
    ]  # fmt: skip
    press(page, "More for Take")
    page.wait("const one = [...document.querySelectorAll('.q-item')].find((e) => e.innerText === 'Make it a style');"
              "one?.click(); return !!one")  # fmt: skip
    page.wait("return location.pathname === '/studio/palette'")
    page.wait("return document.body.innerText.includes('gestures of 20 s and more repeat less')", seconds=60)
    page.type("Name of the style", "from the camera")
    page.click("Make the style")
    page.wait("return document.querySelector('[aria-label=\"Moving picture of from the camera\"]')"
              "?.style.backgroundImage.includes('swatch.webp')", seconds=120)  # fmt: skip
    own = data / "studio" / "palettes" / "local.styles"
    assert "from the camera" in read_palette(own / "my-styles.palette").styles
    assert not (own / "take").exists()
    press(page, "Delete from the camera")
    page.wait("const one = [...document.querySelectorAll('.q-dialog button')].find((e) => /delete/i.test(e.innerText));"
              "one?.click(); return !!one")  # fmt: skip
    page.wait("return document.body.innerText.includes('You have no own style yet')")
    assert not (own / "my-styles.palette").exists()
