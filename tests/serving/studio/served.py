"""The harness in a service, and its page in a browser."""

import json
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

import numpy as np

from tests.running import ServeProcess, eventually, serve_process
from tests.serving.studio.chromium import Browser

HARNESS = "/studio/harness"  # path of the page
MOUTH = (slice(0.60, 0.74), slice(-0.107, 0.107))  # down and from the middle across, of the height in the front view
SWITCH = """const button = document.querySelector('.studio-play');
    if (button.getAttribute('aria-label') === arguments[0]) button.click()"""
# A fixed piece of work in the page, and its milliseconds on an idle core of 2.5 GHz.
CALIBRATION = (
    "const t = performance.now(); let a = 0; for (let i = 0; i < 1e8; i++) a += i; return performance.now() - t"
)
CALIBRATION_MS = 75


def service_with_harness(folder: Path) -> AbstractContextManager[ServeProcess]:
    """A service with the harness, which keeps its files in a folder."""
    return serve_process(program=("-m", "tests.serving.studio.harness", str(folder)), is_ready=False)


def create_project(browser: Browser, url: str, text: str) -> str:
    """Id of a project that is made of a text on the first page; its own page is open then."""
    browser.open(f"{url}/studio/")
    browser.wait("return window.did_handshake")  # a page that waits long for its socket is loaded again, and empty then
    browser.type("Text to speak", text)
    browser.click("Create from text")
    browser.wait("return location.pathname.includes('/animate/')")
    return str(browser.run("return location.pathname.split('/').pop()"))


class Page:
    """A page with stage and timeline, of the harness or of a project, with what its components report."""

    def __init__(self, browser: Browser, url: str = "") -> None:
        self.browser = browser
        if url:
            browser.open(url)
        ready = "const s = window.__studio; return Boolean(s && s.face_ms && s.frames > 0 && s.view?.duration > 1)"
        eventually(lambda: browser.run(ready), 120, "face and sound are loaded")
        self.grid = browser.box(".studio-grid")
        self.rows = {row["id"]: row for row in browser.run("return window.__studio.rows")}

    def measure(self, name: str) -> Any:
        """A value of ``window.__studio``."""
        return self.browser.run("return window.__studio[arguments[0]] ?? null", name)

    def at(self, row: str, time: float, share: float = 0.5) -> tuple[float, float]:
        """Place of a time on a row in the window."""
        view, place = self.measure("view"), self.rows[row]
        down = place["y"] + share * place["height"]
        return self.grid["x"] + (time - view["start"]) * view["scale"], self.grid["y"] + down

    def edits(self, n: int) -> list[dict[str, Any]]:
        """The edits that the server received, once there are n."""
        script = "return document.querySelector('.edits').innerText"

        def received() -> list[dict[str, Any]]:
            found: list[dict[str, Any]] = json.loads(self.browser.run(script))
            return found if len(found) >= n else []

        return list(eventually(received, 20, f"{n} edits"))

    def focus(self) -> None:
        """Give the keyboard to the timeline."""
        self.browser.run("document.querySelector('.studio-grid').focus()")

    def play(self) -> None:
        """Play, unless it plays."""
        self.browser.run(SWITCH, "Play")

    def pause(self) -> None:
        """Pause, unless it has come to its end."""
        self.browser.run(SWITCH, "Pause")

    def show(self, time: float) -> None:
        """Move the playhead by the ruler, and wait for the sharp picture of a stage at rest."""
        place = self.at("ruler", time)
        self.browser.drag([place, place])
        eventually(lambda: abs(self.measure("time") - time) < 0.02 and self.measure("is_sharp"), 30, "drawn")

    def mouth(self, time: float) -> np.ndarray:
        """Pixels of the mouth at a time."""
        self.show(time)
        picture = self.browser.picture(".studio-stage canvas").astype(np.float64)
        height, width, _ = picture.shape
        down, across = MOUTH
        rows = slice(int(down.start * height), int(down.stop * height))
        return picture[rows, int(width / 2 + across.start * height) : int(width / 2 + across.stop * height)]

    def slowness(self) -> float:
        """How many times slower than an idle core the page's script runs now, at least 1."""
        return slowness(self.browser)


def slowness(browser: Browser) -> float:
    """How many times slower than an idle core the script of a page runs now, at least 1."""
    return float(max(browser.run(CALIBRATION) / CALIBRATION_MS, 1.0))
