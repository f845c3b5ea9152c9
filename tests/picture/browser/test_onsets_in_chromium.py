"""Where Chromium hears a sound in encoded files, sent and complete."""

import base64
from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path

import pytest

from tests.picture.bursts import BURSTS_S, MOVIES, STREAMED, TOLERANCE_S, encoded, encoded_movie
from tests.serving.studio.chromium import Browser, missing_program
from tts2face.picture.sound_stream import SOUND_KINDS

pytestmark = pytest.mark.formats

DECODE = """
    const bytes = Uint8Array.from(atob(arguments[0]), (letter) => letter.charCodeAt(0));
    const middle = (samples, rate, from, until) => {  // of the 20 ms that have most energy
        const width = Math.round(0.02 * rate);
        let [energy, most, found] = [0, -1, 0];
        for (let at = from * rate; at < Math.min(until * rate, samples.length); at++) {
            energy += samples[at] ** 2 - (at - width >= from * rate ? samples[at - width] ** 2 : 0);
            if (energy > most) [most, found] = [energy, at - width / 2];
        }
        return found / rate;
    };
    window.found = null;
    new OfflineAudioContext(1, 96000, 24000).decodeAudioData(bytes.buffer).then(
        (sound) => {
            const samples = sound.getChannelData(0), rate = sound.sampleRate;
            window.found = [middle(samples, rate, 0, 1), middle(samples, rate, 1, 3)];
        }, (refused) => { window.found = String(refused); });
    return true"""
SOUNDS = [f"{state}{kind}" for kind in SOUND_KINDS if kind != "pcm" for state in ("", STREAMED)]


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    if program := missing_program():
        pytest.skip(f"{program} is not installed")
    opened = Browser()
    opened.open("data:text/html,<html></html>")
    yield opened
    opened.close()


@pytest.mark.parametrize("name", [*SOUNDS, *MOVIES])
def test_chromium_hears_a_sound_where_it_stood(name: str, browser: Browser, tmp_path: Path) -> None:
    kind = name.removeprefix(STREAMED)
    path = None if name.startswith(STREAMED) else tmp_path / f"clip.{kind}"
    content = encoded(kind, 24_000, path) if name in SOUNDS else encoded_movie(MOVIES[name], Fraction(30), path)
    browser.run(DECODE, base64.b64encode(content).decode())
    assert browser.wait("return window.found") == pytest.approx(BURSTS_S, abs=TOLERANCE_S)
