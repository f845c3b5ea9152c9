"""The recording page in Chromium, with a fake camera and microphone fed with a recording."""

import json
import os
import subprocess
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from corpus_tools.prompts.coverage import count_units, sentence_units
from corpus_tools.recording_process import prompts_answer
from tests.corpus_tools.test_browser_recordings import RATE, uneven_times, write_browser_file
from tests.studio.browser import Browser, chromium, free_port, wait_for_port
from tests.studio.fake_camera import write_fake_media
from tts2face.models.talker import load_talker
from tts2face.studio.recording_store import GOOD, RecordingStore
from tts2face.video.media import read_frames, read_sound

pytest.importorskip("nicegui", reason="needs `pip install 'tts2face[studio]'`")

WRONG = "place green with q nine please"
SCREENSHOTS = Path(os.environ.get("TTS2FACE_SCREENSHOTS", tempfile.gettempdir()))
QUIET_LEVEL = 45  # of 100, of the page's meter
MODE = "return !!document.querySelector('.recorder-on')"


@pytest.fixture
def studio_folder(tmp_path: Path, request: pytest.FixtureRequest) -> Path:
    """Folder of a studio with one recording; all of its prompts but the second are the test's parameter."""
    folder, prompts = tmp_path / "studio", [request.param, WRONG, *[request.param] * 3]
    units = [sentence_units(prompt, "en-us") for prompt in prompts]
    RecordingStore(folder).create("local", "Test person", prompts_answer(prompts, units, count_units(units)))
    return folder


@pytest.fixture
def server(studio_folder, tmp_path):
    port = free_port()
    command = [sys.executable, "-m", "tests.studio.record_server", str(studio_folder), str(port)]
    environment = {name: value for name, value in os.environ.items() if not name.startswith("PYTEST")}  # as for a user
    with (tmp_path / "server.log").open("w") as log:
        child = subprocess.Popen(command, stdout=log, stderr=subprocess.STDOUT, env=environment)
        try:
            wait_for_port(port)
            yield f"http://127.0.0.1:{port}"
        finally:
            child.terminate()
            child.wait()
    assert "Traceback" not in (tmp_path / "server.log").read_text()


def open_camera(browser: Browser, url: str) -> None:
    browser.open(url)
    browser.click("Use camera")
    browser.wait("return document.querySelector('.recorder video').videoWidth === 320")


def level(browser: Browser) -> int:
    return int(browser.run("return document.querySelector('.recorder-level').ariaValueNow"))


def wait_for_level(browser: Browser, *, is_loud: bool, seconds: float) -> None:
    """Wait until the microphone is loud, or quiet, for so many seconds."""
    since, end = time.monotonic(), time.monotonic() + 60
    while time.monotonic() - since < seconds:
        assert time.monotonic() < end
        if (level(browser) > QUIET_LEVEL) != is_loud:
            since = time.monotonic()
        time.sleep(0.02)


def record(browser: Browser) -> None:
    """Record one utterance of the looping microphone, with the space bar."""
    wait_for_level(browser, is_loud=True, seconds=0.1)
    wait_for_level(browser, is_loud=False, seconds=0.9)
    browser.press(" ")
    browser.wait(MODE)
    wait_for_level(browser, is_loud=True, seconds=0.1)
    wait_for_level(browser, is_loud=False, seconds=0.9)
    browser.press(" ")
    browser.wait("return !document.querySelector('.recorder-on')")


def wait_for_states(browser: Browser, *states: str) -> None:
    """Wait until the prompts have these states: ``accepted``, ``refused``, or empty for one that is not recorded."""
    script = """const found = [...document.querySelectorAll('.recorder-list button')].map((one) => one.className);
        const names = {accepted: ['good', 'weak']};
        return arguments[0].every((state, at) => (names[state] || [state]).includes(found[at]))"""
    browser.wait(script, states)


def build_and_speak(browser: Browser, folder: Path) -> None:
    browser.click("Build the talker")
    browser.wait("return document.body.innerText.includes('state the consent')")
    browser.type("Statement of consent", "I, Test person, agree to this test.")
    browser.click("Build the talker")
    script = (
        "const text = document.body.innerText; return text.includes('is made of 4 takes') || text.includes(' refused')"
    )
    browser.wait(script, seconds=240)
    assert "The talker Test person is made of 4 takes" in browser.text()
    assert load_talker(str(folder / "talker.talker")).metadata["consent"]["statement"].startswith("I, Test person")
    browser.type("First sentence", "Now I speak.")
    browser.click("Speak")
    browser.wait("return document.querySelector('video[aria-label^=First]')?.readyState >= 2", seconds=240)
    browser.run("""const clip = document.querySelector('video[aria-label^=First]');
        clip.currentTime = 0.5; clip.scrollIntoView()""")
    browser.wait("return !document.querySelector('video[aria-label^=First]').seeking")
    size = browser.run("const clip = document.querySelector('video[aria-label^=First]'); return clip.duration")
    assert 0.5 < size < 5


def delete_everything(browser: Browser) -> None:
    browser.click("Delete everything")
    browser.wait("return [...document.querySelectorAll('button')].some((one) => one.innerText === 'Delete')")
    browser.run("[...document.querySelectorAll('button')].find((one) => one.innerText === 'Delete').click()")
    browser.wait("return location.pathname === '/studio/record'")


@pytest.mark.parametrize("studio_folder", ["bin blue at f two now"], indirect=True)
def test_prompts_are_recorded_refused_taken_again_after_a_reload_and_deleted(
    server, studio_folder, shared_recordings, face_model, tmp_path
):
    arguments = write_fake_media(shared_recordings / "grid_s1" / "clips" / "bbaf2n.mkv", tmp_path)
    (folder,) = (studio_folder / "recordings").iterdir()
    page = f"{server}/studio/record/{folder.name}"
    with chromium(arguments, tmp_path / "driver.log") as open_browser:
        browser = open_browser()
        open_camera(browser, page)
        for _ in range(3):
            record(browser)
        wait_for_states(browser, "accepted", "refused", "accepted", "")
        advice = json.loads((folder / "manifest.json").read_text())["takes"]["1"]["advice"]
        assert "read exactly what is shown" in advice
        browser.picture(SCREENSHOTS / "record_takes.png")

        open_camera(browser, page)  # an interrupted recording goes on where it was
        wait_for_states(browser, "accepted", "refused", "accepted", "")
        assert browser.run("return document.querySelector('.recorder-number').innerText").startswith("Prompt 4 of 5")
        for _ in range(2):
            record(browser)
        wait_for_states(browser, "accepted", "refused", *["accepted"] * 3)
        assert "100.0 %" not in browser.text()  # the words of the refused prompt are missing
        (earlier,) = (folder / "recordings").glob("take-0001-*.webm")
        browser.run("document.querySelectorAll('.recorder-list button')[0].click()")
        record(browser)
        wait_for_states(browser, "checking")
        wait_for_states(browser, "accepted")
        assert not earlier.exists()
        assert len(list((folder / "recordings").glob("*.webm"))) == 4

        delete_everything(browser)
        assert list((studio_folder / "recordings").iterdir()) == []
        assert browser.log() == []


@pytest.mark.parametrize("studio_folder", ["bin red by k seven now"], indirect=True)
def test_takes_become_a_talker_that_speaks(server, studio_folder, shared_recordings, face_model, tmp_path):
    (folder,) = (studio_folder / "recordings").iterdir()
    store, source = RecordingStore(studio_folder), shared_recordings / "grid_talkers" / "brbk7n.mpg"
    frames = list(read_frames(source))
    for at in range(5):
        times = uneven_times(frames[-1].time, seed=at)
        nearest = [frames[int(np.argmin([abs(frame.time - time) for frame in frames]))].pixels for time in times]
        write_browser_file("vp8.webm", tmp_path / "upload", nearest, times, read_sound(source, RATE).samples)
        take = store.add_take(folder.name, at, tmp_path / "upload", "video/webm")
        if at != 1:
            store.judge(folder.name, at, replace(take, state=GOOD))
    with chromium([], tmp_path / "driver.log") as open_browser:
        browser = open_browser()
        browser.open(f"{server}/studio/record/{folder.name}")
        build_and_speak(browser, folder)
        browser.picture(SCREENSHOTS / "record_talker.png")
        assert browser.log() == []
