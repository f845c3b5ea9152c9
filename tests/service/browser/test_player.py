"""A clip plays in Chromium while it is made: Media Source Extensions with the fragments of /v1/clips."""

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

from tests.exports.programs import browser
from tests.running import RunningService

TEXT = "Hello there, this is the first sentence. " + "This is another one, which comes a little later. " * 5
PAGE = """<!doctype html><video muted></video><script>
const found = {type: MediaSource.isTypeSupported(TYPE), errors: []};
const report = () => fetch("/report", {method: "POST", body: JSON.stringify(found)});
addEventListener("error", event => found.errors.push(String(event.message)));
addEventListener("unhandledrejection", event => found.errors.push(String(event.reason)));
console.error = (...words) => found.errors.push(words.join(" "));
const video = document.querySelector("video"), source = new MediaSource();
video.src = URL.createObjectURL(source);
video.onerror = () => { found.errors.push(video.error.message); report(); };
source.onsourceopen = async () => {
  const buffer = source.addSourceBuffer(TYPE);
  const answer = await fetch(ADDRESS, {method: "POST", headers: {"content-type": "application/json"}, body: BODY});
  const reader = answer.body.getReader();
  let has_ended = false;
  video.ontimeupdate = () => {
    if (video.currentTime > 0 && !("ended_before_it_played" in found)) {
      found.ended_before_it_played = has_ended;
      found.frames = video.getVideoPlaybackQuality().totalVideoFrames;
    }
  };
  while (true) {
    const {done, value} = await reader.read();
    if (done) break;
    buffer.appendBuffer(value);
    await new Promise(resolve => buffer.addEventListener("updateend", resolve, {once: true}));
    if (video.paused) video.play().catch(refused => found.errors.push(String(refused)));
  }
  has_ended = true;
  source.endOfStream();
  found.duration = source.duration;
  const wait = setInterval(() => { if (video.currentTime > 0) { clearInterval(wait); report(); } }, 50);
};
</script>"""
PLAYED_S = 240.0  # until the clip has arrived; it takes some seconds on an idle machine


class Answers:
    """The page, the service that makes its clip, and what it reports."""

    def __init__(self, page: str, service: str) -> None:
        self.service = service
        self.page, self.has_come, self.report = page, Event(), dict[str, Any]()


@contextmanager
def page_server(answers: Answers) -> Iterator[str]:
    """Address of a page, whose script posts to ``/report``; other posts go to the service, as by a reverse proxy."""

    class Handler(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            content = answers.page.encode() if self.path == "/" else b""
            self.send_response(200)
            self.send_header("content-type", "text/html" if self.path == "/" else "image/x-icon")
            self.send_header("content-length", str(len(content)))
            self.end_headers()
            self.wfile.write(content)

        def do_POST(self) -> None:
            body = self.rfile.read(int(self.headers["content-length"]))
            if self.path == "/report":
                answers.report = json.loads(body)
                self.send_response(204)
                self.end_headers()
                answers.has_come.set()
                return
            with httpx.stream("POST", f"{answers.service}{self.path}", content=body, timeout=PLAYED_S) as answer:
                self.send_response(answer.status_code)
                self.end_headers()
                for chunk in answer.iter_raw():
                    self.wfile.write(chunk)

        def log_message(self, *_: object) -> None:
            pass

    server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    thread = Thread(target=server.serve_forever)
    thread.start()
    try:
        yield f"http://localhost:{server.server_port}"
    finally:
        server.shutdown()
        thread.join()
        server.server_close()


def test_a_clip_plays_before_it_is_complete(service: RunningService, tmp_path: Path) -> None:
    program = browser()
    body = json.dumps({"text": TEXT, "size": "128x128", "supersampling": 1})
    values = {
        "TYPE": json.dumps('video/mp4; codecs="avc1.64001E, mp4a.40.2"'),
        "ADDRESS": json.dumps("/v1/clips"),
        "BODY": json.dumps(body),
    }
    page = PAGE
    for name, value in values.items():
        page = page.replace(name, value)
    answers = Answers(page, service.url)
    with page_server(answers) as address:
        command = [
            program, "--headless=new", "--no-sandbox", "--disable-gpu",
            "--autoplay-policy=no-user-gesture-required", f"--user-data-dir={tmp_path / 'profile'}", address,
        ]  # fmt: skip
        began = time.monotonic()
        shown = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        try:
            assert answers.has_come.wait(PLAYED_S), f"nothing was played within {time.monotonic() - began:.0f} s"
        finally:
            shown.terminate()
            shown.wait(30)
    report = answers.report
    assert report["errors"] == []
    assert report["type"]
    assert report["ended_before_it_played"] is False
    assert report["frames"] > 0
    assert report["duration"] > 10.0
