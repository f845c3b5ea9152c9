"""A headless Chromium driven by chromedriver over the W3C WebDriver protocol: a real mouse, real keys, real pixels."""

import base64
import io
import json
import os
import shutil
import subprocess
import tempfile
import urllib.error
import urllib.request
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from tests.running import eventually, free_port

CLICK = """
    // the name of an icon is a line of its own
    const lines = (one) => [...one.innerText.split('\\n'), one.getAttribute('aria-label') || ''];
    const named = (one) => lines(one).some((line) => line.trim().startsWith(arguments[0]));
    const all = [...document.querySelectorAll('button, a, [role=option]')].filter(
        (one) => one.offsetParent && !one.disabled && named(one));
    if (all.length) all[0].click();
    return all.length"""
TYPE = """
    const one = [...document.querySelectorAll('input, textarea')].find(
        (each) => each.getAttribute('aria-label') === arguments[0]);
    if (!one) return false;
    one.value = arguments[1];
    one.dispatchEvent(new Event('input', {bubbles: true}));
    one.dispatchEvent(new Event('change', {bubbles: true}));
    return true"""
ELEMENT = "element-6066-11e4-a52e-4f735466cecf"  # key of an element's id, by the protocol
KEYS = {
    "Left": "\ue012", "Up": "\ue013", "Right": "\ue014", "Down": "\ue015", "Enter": "\ue007", "Delete": "\ue017",
    "Escape": "\ue00c", "Home": "\ue011", "Tab": "\ue004", "Alt": "\ue00a", "Control": "\ue009", "Shift": "\ue008",
}  # fmt: skip
ARGUMENTS = (
    "--headless=new", "--no-sandbox", "--disable-gpu-sandbox", "--use-gl=angle", "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader", "--autoplay-policy=no-user-gesture-required", "--force-device-scale-factor=0.5",
    "--mute-audio", "--disable-background-networking",
)  # fmt: skip
WAIT_S = 60.0
SCRIPT_S = 150  # of one script or load, on a busy machine


def missing_program() -> str:
    """Name of a program that is needed and not installed; empty if none is."""
    chromium = next((name for name in ("chromium", "chromium-browser", "google-chrome") if shutil.which(name)), "")
    if not chromium:
        return "chromium"
    return "" if shutil.which("chromedriver") else "chromedriver"


class Browser:
    """One window of a browser.

    Parameters
    ----------
    size
        Width and height of the window in pixels.
    arguments
        Further arguments of Chromium.
    """

    def __init__(self, size: tuple[int, int] = (1280, 1180), arguments: Sequence[str] = ()) -> None:
        port = free_port()
        own_files = {"XDG_CONFIG_HOME": tempfile.gettempdir()}  # its reports of crashes end with the run
        self._driver = subprocess.Popen(
            ["chromedriver", f"--port={port}"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
            env=os.environ | own_files,
        )  # fmt: skip
        self._root = f"http://127.0.0.1:{port}"
        eventually(self._is_ready, 30, "chromedriver starts")
        options = {"args": [*ARGUMENTS, f"--window-size={size[0]},{size[1]}", *arguments]}
        logs = {"browser": "ALL", "performance": "ALL"}
        timeouts = {"script": 1000 * SCRIPT_S, "pageLoad": 1000 * SCRIPT_S}
        wanted = {"goog:chromeOptions": options, "goog:loggingPrefs": logs, "timeouts": timeouts}
        answer = self._post("/session", {"capabilities": {"alwaysMatch": wanted}})
        self._session = f"/session/{answer['sessionId']}"

    @property
    def driver(self) -> int:
        """Number of the process whose descendants the browser's processes are."""
        return self._driver.pid

    def close(self) -> None:
        """End window and driver."""
        try:
            self._call("DELETE", self._session, None)
        finally:
            self._driver.terminate()
            self._driver.wait(20)

    def open(self, url: str) -> None:
        """Load a page."""
        self._post(f"{self._session}/url", {"url": url})

    def run(self, script: str, *arguments: Any) -> Any:
        """Value that a function body returns in the page."""
        return self._post(f"{self._session}/execute/sync", {"script": script, "args": list(arguments)})

    def wait(self, script: str, *arguments: Any, seconds: float = WAIT_S) -> Any:
        """First true value of a function body in the page."""

        def what() -> str:
            return f"{script} {arguments}; page: {self.text()[:1500]}"

        return eventually(lambda: self.run(script, *arguments), seconds, what)

    def text(self) -> str:
        """Visible text of the page."""
        return str(self.run("return document.body.innerText"))

    def devtools(self, command: str, **options: Any) -> Any:
        """Answer of a command of the Chrome DevTools Protocol."""
        return self._post(f"{self._session}/goog/cdp/execute", {"cmd": command, "params": options})

    def click(self, text: str) -> None:
        """Click the button or link whose visible text or label begins with `text`."""
        self.wait(CLICK, text)

    def type(self, label: str, value: str) -> None:
        """Write into the input or text area with a label."""
        self.wait(TYPE, label, value)

    def box(self, selector: str) -> dict[str, float]:
        """Place and size of an element in the window: x, y, width, height."""
        script = "const b = document.querySelector(arguments[0]).getBoundingClientRect(); return b.toJSON()"
        return dict(self.run(script, selector))

    def drag(self, places: list[tuple[float, float]], held: str = "") -> None:
        """Press the mouse at the first place, move over the others, and release it; `held` names a key."""
        moves = [
            {"type": "pointerMove", "x": round(x), "y": round(y), "duration": 60 if number else 0}
            for number, (x, y) in enumerate(places)
        ]
        actions = [moves[0], {"type": "pointerDown", "button": 0}, *moves[1:], {"type": "pointerUp", "button": 0}]
        keys = [{"type": "pause"}] * len(actions)
        if held:
            keys = [{"type": "keyDown", "value": KEYS[held]}, *keys[2:], {"type": "keyUp", "value": KEYS[held]}]
            actions = [{"type": "pause", "duration": 0}, *actions]
            keys = [keys[0], *keys[1:-1], {"type": "pause"}, keys[-1]]
        self._perform(
            [
                {"type": "pointer", "id": "mouse", "parameters": {"pointerType": "mouse"}, "actions": actions},
                {"type": "key", "id": "keys", "actions": keys},
            ]
        )

    def mouse(self, *actions: dict[str, Any]) -> None:
        """Perform actions of the mouse, which stays where it is, and pressed, until the next ones."""
        self._perform([{"type": "pointer", "id": "mouse", "parameters": {"pointerType": "mouse"}, "actions": actions}])

    def double_click(self, x: float, y: float) -> None:
        """Press the mouse twice at a place: a double click also where a busy browser takes long over the first."""
        place = {"x": round(x), "y": round(y)}
        self.devtools("Input.dispatchMouseEvent", type="mouseMoved", **place)
        for count in (1, 2):
            for kind in ("mousePressed", "mouseReleased"):
                self.devtools("Input.dispatchMouseEvent", type=kind, button="left", clickCount=count, **place)

    def press(self, *names: str) -> None:
        """Press keys one after the other: names of `KEYS`, or characters; ``Alt+Left`` holds the first."""
        for name in names:
            parts = [KEYS.get(part, part) for part in name.split("+")] if len(name) > 1 else [name]
            down = [{"type": "keyDown", "value": part} for part in parts]
            up = [{"type": "keyUp", "value": part} for part in reversed(parts)]
            self._perform([{"type": "key", "id": "keys", "actions": [*down, *up]}])

    def picture(self, selector: str) -> np.ndarray:
        """Pixels (H, W, 3) of an element as the window shows it."""
        found = self._post(f"{self._session}/element", {"using": "css selector", "value": selector})
        shot = self._call("GET", f"{self._session}/element/{found[ELEMENT]}/screenshot", None)
        return np.asarray(Image.open(io.BytesIO(base64.b64decode(shot))).convert("RGB"))

    def errors(self) -> list[str]:
        """Errors of the page's console since the last call."""
        entries = self._post(f"{self._session}/se/log", {"type": "browser"})
        return [entry["message"] for entry in entries if entry["level"] == "SEVERE"]

    def requests(self) -> list[str]:
        """Addresses that the pages asked for since the last call, also those of WebSockets."""
        found = []
        for entry in self._post(f"{self._session}/se/log", {"type": "performance"}):
            message = json.loads(entry["message"])["message"]
            if message["method"] == "Network.requestWillBeSent":
                found.append(str(message["params"]["request"]["url"]))
            elif message["method"] == "Network.webSocketCreated":
                found.append(str(message["params"]["url"]))
        return found

    def save_screenshot(self, path: Path) -> None:
        """Write the window's pixels to a PNG file."""
        path.write_bytes(base64.b64decode(self._call("GET", f"{self._session}/screenshot", None)))

    def _perform(self, sources: list[dict[str, Any]]) -> None:
        self._post(f"{self._session}/actions", {"actions": sources})

    def _is_ready(self) -> bool:
        try:
            return bool(self._call("GET", "/status", None)["ready"])
        except OSError:
            return False

    def _post(self, path: str, content: dict[str, Any]) -> Any:
        return self._call("POST", path, content)

    def _call(self, method: str, path: str, content: dict[str, Any] | None) -> Any:
        data = None if content is None else json.dumps(content).encode()
        headers = {"Content-Type": "application/json"}
        request = urllib.request.Request(self._root + path, data, headers, method=method)
        try:
            with urllib.request.urlopen(request, timeout=180) as answer:
                return json.load(answer)["value"]
        except urllib.error.HTTPError as refused:
            raise AssertionError(json.load(refused)["value"]["message"]) from refused


@contextmanager
def open_browser(size: tuple[int, int] = (1280, 1180), arguments: Sequence[str] = ()) -> Iterator[Browser]:
    """A window that is closed at the end; the test is skipped where a program is missing."""
    if missing := missing_program():
        pytest.skip(f"needs {missing}")
    window = Browser(size, arguments)
    try:
        yield window
    finally:
        window.close()
