"""The page "animate" with a comparison and an explained phone, in a real browser."""

import httpx

from tests.running import RunningService, eventually
from tests.serving.studio.chromium import Browser
from tests.serving.studio.server.test_projects_http import create, preview

LOADED = "const s = window.__studio; return Boolean(s && s.face_ms && s.frames > 0 && s.view?.duration > 1)"
SIDE = "return document.querySelector('.studio-side')?.innerText ?? ''"


def test_a_is_compared_shown_by_key_and_a_phone_explained(
    browser: Browser, studio: httpx.Client, studio_service: RunningService
) -> None:
    number = create(studio, "Bob may move.")
    header, *_ = preview(studio, number)
    browser.open(f"{studio_service.url}/studio/animate/{number}")
    eventually(lambda: browser.run(LOADED), 120, "the head is shown")
    reference = {"kind": "settings", "label": "<noise>", "request": {"gestures": "noise"}}
    studio.put(f"/api/projects/{number}/comparison", json={"reference": reference})
    eventually(lambda: browser.run(SIDE) == "B: the project", 60, "the comparison is loaded")
    assert browser.run("return document.querySelector('.studio-head small').innerText") == "dashed: A"
    eventually(lambda: browser.run("return document.querySelectorAll('.measures tbody tr').length > 3"), 60, "measures")
    assert "A: <noise>." in browser.run("return document.body.innerText")
    begin, end = next(one[1:3] for one in header["phones"] if one[0] == "m")
    clock = "import('tts2face-studio/clock.js').then((m) => m.clock.seek(arguments[0]))"
    browser.run(clock.replace("arguments[0]", str((begin + end) / 2)))
    before = browser.run("return window.__studio.frames")
    browser.press("a")
    eventually(lambda: browser.run(SIDE) == "A", 20, "A is shown")
    eventually(lambda: browser.run("return window.__studio.frames") > before, 20, "A is drawn")
    browser.press("a")
    eventually(lambda: browser.run(SIDE) == "B: the project", 20, "the project is shown")
    script = "[...document.querySelectorAll('button')].find((one) => /at the playhead/i.test(one.innerText)).click()"
    browser.run(script)
    strips = "return [...document.querySelectorAll('.lip-strip')].map((one) => one.getAttribute('aria-label'))"
    labels = eventually(lambda: browser.run(strips), 60, "strips of lips")
    assert labels[0].startswith("Lips made for m, from its beginning to its end: open by ")
    assert len(labels) == 7  # the made lips, and six examples
    studio.delete(f"/api/projects/{number}/comparison")
    eventually(lambda: browser.run(SIDE) == "", 20, "the comparison ends")
