"""A page of another origin uses the service in Chromium: clips, events, HeadTTS and WebSockets, with a key."""

import json
from pathlib import Path

from tests.interchange.exports.programs import browser
from tests.running import HostService
from tests.serving.service.browser.shown import REPORT, Page
from tts2face.serving.service.keys import add_key

SCRIPT = """<!doctype html><script>REPORT
const url = SERVICE, own = {"authorization": "bearer " + KEY, "content-type": "application/json"};
const post = (path, body, headers = {}) =>
  fetch(url + path, {method: "POST", headers: {...own, ...headers}, body: JSON.stringify(body)});
const lines = async answer => (await answer.text()).split("\\n").filter(line => line.startsWith("data: "));
const talk = (path, first, last) => new Promise((done, failed) => {
  const socket = new WebSocket(url.replace("http", "ws") + path), came = [];
  socket.onopen = () => first.forEach(message => socket.send(JSON.stringify(message)));
  socket.onmessage = event => {
    if (typeof event.data !== "string") return;
    came.push(JSON.parse(event.data).type);
    if (came.at(-1) === last) { socket.close(); done(came); }
  };
  socket.onerror = () => failed("the socket " + path + " failed");
});
(async () => {
  const wav = {text: "Hello.", format: "wav"};
  const clip = await post("/v1/clips", wav, {"x-request-id": "own-7", "x-stainless-os": "x"});
  found.clip = [clip.status, clip.headers.get("x-request-id"), (await clip.arrayBuffer()).byteLength > 20000];
  found.wrong = (await post("/v1/clips", {text: 7})).status;
  const without = await fetch(url + "/v1/voices");
  found.without = [without.status, (await without.json()).error.code];
  const speech = {input: "Hello.", voice: "alloy", response_format: "pcm", stream_format: "sse"};
  found.speech = JSON.parse((await lines(await post("/v1/audio/speech", speech))).at(-1).slice(6)).type;
  const job = await post("/v1/jobs", {kind: "clip", request: wav}, {"idempotency-key": "a"});
  const place = job.headers.get("location");
  found.job = [job.status, (await lines(await fetch(url + place + "/events", {headers: own}))).length > 0];
  found.deleted = (await fetch(url + place, {method: "DELETE", headers: own})).status;
  found.hello = (await (await post("/v1/hello", {})).text()).slice(0, 7);
  found.synthesize = (await (await post("/v1/synthesize", {input: "Hello."})).json()).words;
  const key = "?key=" + KEY;
  found.live = await talk("/v1/stream" + key, [
    {type: "start", with_idle: false}, {type: "text", text: "Hello."}, {type: "end"}], "done");
  found.headtts = await talk("/v1/headtts" + key, [{type: "synthesize", id: 1, data: {input: "Hello."}}], "audio");
  report();
})();
</script>"""
EXPECTED = {
    "errors": [],
    "clip": [200, "own-7", True],
    "wrong": 422,
    "without": [401, "unauthorized"],
    "speech": "speech.audio.done",
    "job": [202, True],
    "deleted": 204,
    "hello": "HeadTTS",
    "synthesize": ["Hello"],
    "live": ["mark", "speech", "curves", "done"],
    "headtts": ["audio"],
}


def shown(host: HostService, tmp_path: Path, origin: str = "") -> dict[str, object]:
    """Report of the page; the service allows its origin, or another one."""
    browser()
    key = add_key(tmp_path / "keys.toml", "page", ["speak"])
    with Page().served() as page:
        settings = {"keys": tmp_path / "keys.toml", "origins": f"https://a.example,{origin or page.address}"}
        with host(**settings) as service:
            page.content = SCRIPT.replace("REPORT", REPORT)
            page.content = page.content.replace("SERVICE", json.dumps(service.url)).replace("KEY", json.dumps(key))
            return page.report(tmp_path / "profile")


def test_a_page_of_an_allowed_origin_uses_everything(host: HostService, tmp_path: Path) -> None:
    assert shown(host, tmp_path) == EXPECTED


def test_a_page_of_another_origin_reaches_nothing(host: HostService, tmp_path: Path) -> None:
    assert shown(host, tmp_path, "https://b.example") == {"errors": ["TypeError: Failed to fetch"]}
