"""Pages that Chromium shows, and what their scripts report."""

import json
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Event, Thread
from typing import Any

import httpx

from tests.interchange.exports.programs import browser

REPORT = """
const found = {errors: []};
const report = () => fetch("/report", {method: "POST", body: JSON.stringify(found)});
addEventListener("error", event => found.errors.push(String(event.message)));
addEventListener("unhandledrejection", event => { found.errors.push(String(event.reason)); report(); });
"""  # at the begin of a script, which calls `report()` when it is done
REPORTED_S = 240.0  # until a page reports; it takes some seconds on an idle machine


class Page:
    """A page with its own origin; posts go to a service, as by a reverse proxy, and its report comes back.

    Parameters
    ----------
    content
        HTML of the page; may be set until it is shown.
    service
        Address of the service.
    """

    def __init__(self, content: str = "", service: str = "") -> None:
        self.content, self.service, self.address = content, service, ""
        self._has_come, self._report = Event(), dict[str, Any]()

    @contextmanager
    def served(self) -> Iterator["Page"]:
        """Serve it on this machine."""
        page = self

        class Handler(BaseHTTPRequestHandler):
            def do_GET(self) -> None:
                content = page.content.encode() if self.path == "/" else b""
                self.send_response(200)
                self.send_header("content-type", "text/html" if self.path == "/" else "image/x-icon")
                self.send_header("content-length", str(len(content)))
                self.end_headers()
                self.wfile.write(content)

            def do_POST(self) -> None:
                body = self.rfile.read(int(self.headers["content-length"]))
                if self.path == "/report":
                    page._report = json.loads(body)
                    self.send_response(204)
                    self.end_headers()
                    page._has_come.set()
                    return
                with httpx.stream("POST", f"{page.service}{self.path}", content=body, timeout=REPORTED_S) as answer:
                    self.send_response(answer.status_code)
                    self.end_headers()
                    for chunk in answer.iter_raw():
                        self.wfile.write(chunk)

            def log_message(self, *_: object) -> None:
                pass

        server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        thread = Thread(target=server.serve_forever)
        thread.start()
        self.address = f"http://localhost:{server.server_port}"
        try:
            yield self
        finally:
            server.shutdown()
            thread.join()
            server.server_close()

    def report(self, profile: Path) -> dict[str, Any]:
        """What its script reports when Chromium shows it."""
        command = [
            browser(), "--headless=new", "--no-sandbox", "--disable-gpu",
            "--autoplay-policy=no-user-gesture-required", f"--user-data-dir={profile}", self.address,
        ]  # fmt: skip
        began = time.monotonic()
        shown = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        try:
            assert self._has_come.wait(REPORTED_S), f"no report within {time.monotonic() - began:.0f} s"
        finally:
            shown.terminate()
            shown.wait(30)
        return self._report
