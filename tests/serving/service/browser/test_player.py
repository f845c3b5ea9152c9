"""Clips and sound play in Chromium while they are made: Media Source Extensions with the parts of /v1/clips."""

import json
from pathlib import Path
from typing import Any

import pytest

from tests.interchange.exports.programs import browser
from tests.running import RunningService
from tests.serving.service.browser.shown import REPORT, Page

TEXT = "Hello there, this is the first sentence. " + "This is another one, which comes a little later. " * 5
PAGE = """<!doctype html><video muted></video><script>REPORT
found.type = MediaSource.isTypeSupported(TYPE);
console.error = (...words) => found.errors.push(words.join(" "));
const video = document.querySelector("video"), source = new MediaSource();
video.src = URL.createObjectURL(source);
video.onerror = () => { found.errors.push(video.error.message); report(); };
video.playbackRate = 4;
video.onended = () => {
  found.frames = video.getVideoPlaybackQuality().totalVideoFrames;
  found.played = video.currentTime;
  found.duration = video.duration;
  report();
};
source.onsourceopen = async () => {
  const answer = await fetch("/v1/clips", {
    method: "POST", headers: {"content-type": "application/json"}, body: JSON.stringify(BODY)});
  if (!found.type) {
    video.src = URL.createObjectURL(await answer.blob());
    video.playbackRate = 4;
    video.play();
    return;
  }
  const buffer = source.addSourceBuffer(TYPE), reader = answer.body.getReader();
  let has_ended = false;
  video.ontimeupdate = () => {
    if (video.currentTime > 0 && !("ended_before_it_played" in found)) {
      found.ended_before_it_played = has_ended;
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
  found.gaps = buffer.buffered.length - 1;
  found.start = buffer.buffered.start(0);
};
</script>"""
MOVIE = {"size": "128x128", "supersampling": 1}
PLAYED: dict[str, tuple[dict[str, Any], str]] = {
    "mp4": (MOVIE, 'video/mp4; codecs="avc1.64001E, mp4a.40.2"'),
    "webm": (MOVIE, 'video/webm; codecs="vp9, opus"'),
    "transparent webm": (MOVIE | {"background": "transparent"}, 'video/webm; codecs="vp9, opus"'),
    "mp3": ({}, "audio/mpeg"),
    "weba": ({}, 'audio/webm; codecs="opus"'),
    "opus": ({}, 'audio/ogg; codecs="opus"'),  # which MediaSource takes in no browser
}


@pytest.mark.parametrize("name", PLAYED)
def test_a_clip_plays_before_it_is_complete(name: str, service: RunningService, tmp_path: Path) -> None:
    browser()
    options, kind = PLAYED[name]
    body = {"text": TEXT, "format": name.removeprefix("transparent "), **options}
    content = PAGE.replace("REPORT", REPORT).replace("TYPE", json.dumps(kind)).replace("BODY", json.dumps(body))
    with Page(content, service.url).served() as page:
        report = page.report(tmp_path / "profile")
    assert report["errors"] == []
    assert report["type"] == (name != "opus")
    assert (report.get("gaps", 0), report.get("start", 0.0)) == (0, 0.0)
    if options:  # of sound, all may have come when it begins to play
        assert report["ended_before_it_played"] is False
        assert report["frames"] > 200
    assert report["played"] == pytest.approx(report["duration"], abs=0.1)
    assert report["duration"] > 10.0
