"""The recording page in Chromium, with a fake camera and microphone fed with a recording."""

import json
import os
import subprocess
import sys
import tempfile
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
N_TRIES = 4
QUIET_LEVEL = 45  # of 100, of the page's meter


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
    browser.run("""window.lastLoud = 0; setInterval(() => {
        if (document.querySelector('.recorder-level').ariaValueNow > arguments[0]) window.lastLoud = performance.now();
        }, 20)""", QUIET_LEVEL)  # fmt: skip


def wait_for_sound(browser: Browser) -> None:
    """Wait until an utterance of the looping microphone is over by 0.9 s."""
    browser.run("window.lastLoud = 0")
    browser.wait("return window.lastLoud > 0")
    browser.wait("return performance.now() - window.lastLoud > 900")


def record(browser: Browser, at: int) -> None:
    """Record one utterance of the microphone as the take of a prompt, with the space bar."""
    browser.run(
        "document.querySelectorAll('.recorder-list button')[arguments[0]].click(); document.activeElement.blur()", at
    )
    wait_for_sound(browser)
    browser.press(" ")
    browser.wait("return !!document.querySelector('.recorder-on')")
    wait_for_sound(browser)
    browser.press(" ")
    browser.wait("return ['sending', 'checking'].includes("
                 "document.querySelectorAll('.recorder-list button')[arguments[0]].className)", at)  # fmt: skip


def record_accepted(browser: Browser, at: int) -> None:
    """Record a take until it is accepted: on a busy machine, Chromium's fake devices lose parts of their files."""
    for _ in range(N_TRIES):
        record(browser, at)
        done = "return ['good', 'weak', 'refused'].find((one) => document.querySelectorAll('.recorder-list button')"
        if browser.wait(f"{done}[arguments[0]].className === one)", at) != "refused":
            return
    raise AssertionError(f"{N_TRIES} takes of prompt {at + 1} were refused; page: {browser.text()[:600]}")


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
        record_accepted(browser, 0)
        record(browser, 1)
        record_accepted(browser, 2)
        wait_for_states(browser, "accepted", "refused", "accepted", "")
        advice = json.loads((folder / "manifest.json").read_text())["takes"]["1"]["advice"]
        assert "read exactly what is shown" in advice
        browser.picture(SCREENSHOTS / "record_takes.png")

        open_camera(browser, page)  # an interrupted recording goes on where it was
        wait_for_states(browser, "accepted", "refused", "accepted", "")
        assert browser.run("return document.querySelector('.recorder-number').innerText").startswith("Prompt 4 of 5")
        record_accepted(browser, 3)
        record_accepted(browser, 4)
        wait_for_states(browser, "accepted", "refused", *["accepted"] * 3)
        assert "100.0 %" not in browser.text()  # the words of the refused prompt are missing
        (earlier,) = (folder / "recordings").glob("take-0001-*.webm")
        record_accepted(browser, 0)
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
