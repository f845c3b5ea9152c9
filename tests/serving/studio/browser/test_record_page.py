"""The recording page in Chromium, with a fake camera and microphone fed with a recording."""

import json
import re
from pathlib import Path

import pytest

from corpus_tools.prompts.coverage import count_units, sentence_units
from corpus_tools.tools.recordings import prompts_answer
from tests.serving.studio.chromium import Browser
from tests.serving.studio.consents import give_consent
from tts2face.models.talker_file import load_talker
from tts2face.serving.service.keys import LOCAL_KEY
from tts2face.serving.studio.recordings import RecordingStore

SPOKEN, WRONG = "bin blue at f two now", "place green with q nine please"
STATE = """return ['good', 'weak', 'refused'].find(
    (one) => document.querySelectorAll('.recorder-list button')[arguments[0]].className === one)"""
PAUSE_MS = (900, 2300)  # after an utterance; the microphone is quiet for 5 s and a countdown takes 1.8 s
N_TRIES = 4
QUIET_LEVEL = 45  # of 100, of the page's meter


@pytest.fixture
def recording(data: Path) -> Path:
    """Folder of a recording whose second prompt is not what the microphone says."""
    store, prompts = RecordingStore(data / "studio"), [SPOKEN, WRONG, *[SPOKEN] * 3]
    units = [sentence_units(prompt, "en-us") for prompt in prompts]
    number = store.create(LOCAL_KEY.name, "Test person", prompts_answer(prompts, units, count_units(units)))
    return store.folder(number, LOCAL_KEY.name)


def open_camera(browser: Browser, url: str) -> None:
    browser.open(url)
    browser.click("Use camera")
    browser.wait("return document.querySelector('.recorder video').videoWidth === 320")
    browser.run("""window.lastLoud = 0; setInterval(() => {
        if (document.querySelector('.recorder-level').ariaValueNow > arguments[0]) window.lastLoud = performance.now();
        }, 20)""", QUIET_LEVEL)  # fmt: skip


def wait_for_pause(browser: Browser) -> None:
    """Wait until an utterance of the looping microphone is just over, with time for a countdown before the next."""
    browser.wait("""const quiet_ms = performance.now() - window.lastLoud;
        return window.lastLoud > 0 && quiet_ms > arguments[0] && quiet_ms < arguments[1]""", *PAUSE_MS)  # fmt: skip


def record(browser: Browser, at: int) -> None:
    """Record one utterance of the microphone as the take of a prompt, with the space bar."""
    browser.run(
        "document.querySelectorAll('.recorder-list button')[arguments[0]].click(); document.activeElement.blur()", at
    )
    wait_for_pause(browser)
    browser.press(" ")
    browser.wait("return !!document.querySelector('.recorder-on')")
    browser.run("window.lastLoud = 0")
    wait_for_pause(browser)
    browser.press(" ")
    browser.wait("return ['sending', 'checking'].includes("
                 "document.querySelectorAll('.recorder-list button')[arguments[0]].className)", at)  # fmt: skip


def record_accepted(browser: Browser, *prompts: int) -> None:
    """Record takes until they are accepted: on a busy machine, Chromium's fake devices lose parts of their files."""
    left = list(prompts)
    for _ in range(N_TRIES):
        for at in left:
            record(browser, at)
        left = [at for at in left if browser.wait(STATE, at, seconds=180) == "refused"]
        if not left:
            return
    raise AssertionError(f"{N_TRIES} takes of prompts {left} were refused; page: {browser.text()[:600]}")


def wait_for_states(browser: Browser, *states: str) -> None:
    """Wait until the prompts have these states: ``accepted``, ``refused``, or empty for one that is not recorded."""
    script = """const found = [...document.querySelectorAll('.recorder-list button')].map((one) => one.className);
        const names = {accepted: ['good', 'weak']};
        return arguments[0].every((state, at) => (names[state] || [state]).includes(found[at]))"""
    browser.wait(script, states)


def build_and_speak(browser: Browser, folder: Path) -> None:
    browser.click("Build the talker")
    browser.wait("return document.body.innerText.includes('state the consent')")
    give_consent(browser, "Test person", "2026-01-02", "for this test")
    browser.click("Build the talker")
    done = "const text = document.body.innerText; return text.match(/(The talker .* is made of|.* refused).*/)?.[0]"
    check_takes(browser.wait(done, seconds=240))
    assert (
        load_talker(str(folder / "talker.talker")).metadata["consent"]["statement"]
        == "agreed: Test person, 2026-01-02, for this test"
    )
    browser.type("First sentence", "Now I speak.")
    browser.click("Speak")
    browser.wait("return document.querySelector('video[aria-label^=First]')?.readyState >= 2", seconds=240)
    browser.run("""const clip = document.querySelector('video[aria-label^=First]');
        clip.currentTime = 0.5; clip.scrollIntoView()""")
    browser.wait("return !document.querySelector('video[aria-label^=First]').seeking")
    size = browser.run("const clip = document.querySelector('video[aria-label^=First]'); return clip.duration")
    assert 0.5 < size < 5


def check_takes(sentence: str) -> None:
    """All four takes are in the talker, but those that Chromium's fake devices have moved against their sound.

    A take is too short to tell; the build compares it with the others.
    """
    made = re.match(r"The talker Test person is made of (\d) takes?, [0-9.]+ minutes\.", sentence)
    assert made, sentence
    n_refused = sentence.count("lip motion does not match the sound")
    assert (int(made[1]) + n_refused, n_refused <= 2) == (4, True), sentence


def delete_everything(browser: Browser) -> None:
    browser.click("Delete everything")
    browser.wait("return [...document.querySelectorAll('button')].some((one) => one.innerText === 'Delete')")
    browser.run("[...document.querySelectorAll('button')].find((one) => one.innerText === 'Delete').click()")
    browser.wait("return location.pathname === '/studio/record'")


def test_five_prompts_become_a_talker_that_speaks_with_its_own_face(
    browser, studio_service, recording, shared_recordings, face_model
):
    page = f"{studio_service.url}/studio/record/{recording.name}"
    open_camera(browser, page)
    record(browser, 1)
    record_accepted(browser, 0, 2)
    wait_for_states(browser, "accepted", "refused", "accepted", "")
    advice = json.loads((recording / "manifest.json").read_text())["takes"]["1"]["advice"]
    assert "read exactly what is shown" in advice

    open_camera(browser, page)  # an interrupted recording goes on where it was
    wait_for_states(browser, "accepted", "refused", "accepted", "")
    assert browser.run("return document.querySelector('.recorder-number').innerText").startswith("Prompt 4 of 5")
    record_accepted(browser, 3, 4)
    wait_for_states(browser, "accepted", "refused", *["accepted"] * 3)
    assert "100.0 %" not in browser.text()  # the words of the refused prompt are missing
    assert len(list((recording / "recordings").glob("*.webm"))) == 4

    build_and_speak(browser, recording)
    delete_everything(browser)
    assert not recording.exists()
