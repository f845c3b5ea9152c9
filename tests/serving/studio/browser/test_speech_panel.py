"""The left panel of the studio in Chromium: the style of the whole clip, and a table of marks."""

from typing import Any

import httpx

from tests.running import eventually
from tests.serving.studio.browser.test_character_dialog import drop
from tests.serving.studio.chromium import Browser
from tts2face.serving.studio.pages.mark_table_dialog import TITLE

TABLE = "mark\tkind\tstyle\tgesture\n🦊\temoji\thappy\twink left\nhooray\ttag\tdelighted\tnod\n"
WRONG = "mark\tkind\n[\tnosuch\n"


def test_a_style_by_the_words_and_a_table_of_marks_are_chosen(
    browser: Browser, studio_service: Any, studio: httpx.Client
) -> None:
    number = studio.post("/api/projects", json={"text": "What a lovely day! Hooray 🦊"}).json()["id"]

    def request() -> dict[str, Any]:
        content = studio.get(f"/api/projects/{number}/project.json").json()
        return {**content.get("request", {})}

    browser.open(f"{studio_service.url}/studio/animate/{number}")
    browser.wait("return window.__studio?.frames > 0")
    browser.run("document.querySelector('[aria-label=Style]').click()")
    browser.wait("return !!document.querySelector('[role=option]')")
    browser.click("auto - by the words of each sentence")
    eventually(lambda: request().get("style") == "auto", 30, "the style is auto")
    browser.click(TITLE)
    browser.wait("return !!document.querySelector('.q-uploader')")
    drop(browser, WRONG.encode(), "wrong.tsv")
    browser.wait("return document.body.innerText.includes('line 2')")
    assert "text_marks" not in request()
    drop(browser, TABLE.encode(), "marks.tsv")
    browser.wait("return document.querySelector('.q-dialog').innerText.includes('2 marks of your own')")
    eventually(lambda: "text_marks" in request(), 30, "the project has the table")
    browser.click("Without a table")
    eventually(lambda: "text_marks" not in request(), 30, "the table is removed")
    assert browser.errors() == []
