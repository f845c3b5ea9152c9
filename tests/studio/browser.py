"""Chromium without a window, driven by chromedriver (W3C WebDriver)."""

import base64
import json
import shutil
import socket
import subprocess
import time
import urllib.error
import urllib.request
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

WAIT_S = 60.0


def free_port() -> int:
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        return int(listener.getsockname()[1])


class Browser:
    """One window of a WebDriver session."""

    def __init__(self, driver: str, arguments: list[str]) -> None:
        self._driver = driver
        options = {"args": arguments, "binary": shutil.which("chromium")}
        wanted = {"goog:chromeOptions": options, "goog:loggingPrefs": {"browser": "ALL"}}
        found = self._send("POST", "/session", {"capabilities": {"alwaysMatch": wanted}})
        self._session = f"/session/{found['sessionId']}"

    def _send(self, method: str, path: str, content: Any = None) -> Any:
        body = None if content is None else json.dumps(content).encode()
        request = urllib.request.Request(self._driver + path, body, {"Content-Type": "application/json"}, method=method)
        try:
            with urllib.request.urlopen(request, timeout=300) as answer:
                return json.load(answer)["value"]
        except urllib.error.HTTPError as error:
            with error:
                raise AssertionError(json.load(error)["value"]["message"]) from error

    def open(self, url: str) -> None:
        self._send("POST", f"{self._session}/url", {"url": url})

    def run(self, script: str, *arguments: Any) -> Any:
        """Value of a script that returns one."""
        return self._send("POST", f"{self._session}/execute/sync", {"script": script, "args": list(arguments)})

    def wait(self, script: str, *arguments: Any, seconds: float = WAIT_S) -> Any:
        """First true value of a script."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            if found := self.run(script, *arguments):
                return found
            time.sleep(0.1)
        raise AssertionError(f"not within {seconds:g} s: {script} {arguments}; page: {self.text()[-1500:]}")

    def text(self) -> str:
        return str(self.run("return document.body.innerText"))

    def press(self, key: str) -> None:
        actions = [{"type": "keyDown", "value": key}, {"type": "keyUp", "value": key}]
        self._send("POST", f"{self._session}/actions", {"actions": [{"type": "key", "id": "keys", "actions": actions}]})

    def click(self, text: str) -> None:
        """Click the button or link whose visible text begins with `text`."""
        script = """const all = [...document.querySelectorAll('button, a')].filter(
            (one) => one.offsetParent && !one.disabled && one.innerText.trim().startsWith(arguments[0]));
            if (all.length) all[0].click(); return all.length"""
        self.wait(script, text)

    def type(self, label: str, value: str) -> None:
        """Write into the input with a label."""
        script = """const one = document.querySelector(`input[aria-label="${arguments[0]}"]`);
            if (!one) return false; one.value = arguments[1];
            one.dispatchEvent(new Event('input', {bubbles: true})); one.dispatchEvent(new Event('change'));
            return true"""
        self.wait(script, label, value)

    def picture(self, out: Path) -> None:
        out.write_bytes(base64.b64decode(self._send("GET", f"{self._session}/screenshot")))

    def log(self) -> list[str]:
        """Errors of the console since the last call."""
        found = self._send("POST", f"{self._session}/se/log", {"type": "browser"})
        return [entry["message"] for entry in found if entry["level"] == "SEVERE"]

    def close(self) -> None:
        self._send("DELETE", self._session)


@contextmanager
def chromium(arguments: list[str], log: Path) -> Iterator[Callable[[], Browser]]:
    """Open browsers with these arguments; the test is skipped without Chromium."""
    if not shutil.which("chromium") or not shutil.which("chromedriver"):
        pytest.skip("needs chromium and chromedriver")
    port = free_port()
    with log.open("w") as file:
        driver = subprocess.Popen(["chromedriver", f"--port={port}"], stdout=file, stderr=subprocess.STDOUT)
    opened: list[Browser] = []

    def open_browser() -> Browser:
        base = ["--headless=new", "--no-sandbox", "--disable-gpu", "--window-size=1280,800", "--mute-audio"]
        opened.append(Browser(f"http://127.0.0.1:{port}", [*base, *arguments]))
        return opened[-1]

    try:
        wait_for_port(port)
        yield open_browser
    finally:
        for browser in opened:
            browser.close()
        driver.terminate()
        driver.wait()


def wait_for_port(port: int) -> None:
    end = time.monotonic() + WAIT_S
    while time.monotonic() < end:
        with socket.socket() as probe:
            if probe.connect_ex(("127.0.0.1", port)) == 0:
                return
        time.sleep(0.1)
    raise AssertionError(f"nothing listens on port {port}")
