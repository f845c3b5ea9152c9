"""Opening the studio's example, from Enter to speech, and from a moved edge to its curves.

Run: ``PYTHONPATH=. python tests/bench/bench_studio_pages.py``.
A service that has been started before (its face is made and kept, its processes have spoken) and headless Chromium
without a GPU. The page is loaded cold: each round has a browser of its own. Times hold for the load of the machine,
of which the script's slowness is a measure.
"""

import statistics
import time
from pathlib import Path

import httpx

from tests.running import RunningService, ServeProcess, eventually
from tests.serving.studio.chromium import Browser
from tests.serving.studio.served import slowness
from tests.serving.studio.server.test_projects_http import create, edit, preview

ROUNDS = 3
SHOWN = "const s = window.__studio; return Boolean(s && s.frames > 0 && s.face_ms && s.view && s.view.duration > 0)"
TIME = "return window.__studio.time"
SENT = """
    const entries = [...performance.getEntriesByType('navigation'), ...performance.getEntriesByType('resource')];
    return entries.reduce((sum, one) => sum + one.transferSize, 0)
"""
CLICK = """
    const named = (one) => one.innerText.trim().toLowerCase() === arguments[0];
    const all = [...document.querySelectorAll('button, a')].filter(named);
    if (all.length) all[0].click();
    return all.length
"""
# Writes a text as a person does, presses Ctrl+Enter, and notes when the sound starts and when the head has moved.
SPEAK = """
    const field = document.querySelector('textarea'), text = arguments[0];
    field.focus();
    field.value = text;
    field.dispatchEvent(new Event('input', {bubbles: true}));
    window.spoken = {};
    const begin = performance.now();
    import('tts2face-studio/clock.js').then(({clock}) => {
      const stop = clock.on('play', () => {
        stop();
        window.spoken.sound = performance.now() - begin;
        const frames = window.__studio.frames;
        const look = () => {
          if (window.__studio.frames > frames && clock.time > 0) window.spoken.motion = performance.now() - begin;
          else requestAnimationFrame(look);
        };
        look();
      });
      field.dispatchEvent(new KeyboardEvent('keydown', {key: 'Enter', code: 'Enter', ctrlKey: true, bubbles: true}));
    });
"""
TEXTS = ("A quiet word about the weather.", "Seven ships sailed south at dawn.", "Please put the kettle on for Ruth.")


DRAGS = 20


def main() -> None:
    """Print all figures."""
    running = ServeProcess(environment={"TTS2FACE_SERVE_WARM_STUDIO": "true"}, processes=2)
    try:
        running.wait_until_ready()
        _wait_for_face(running)
        _measure_edges(running.url)
        for number in range(ROUNDS):
            browser = Browser((1280, 859))
            try:
                _measure(browser, running.url, number)
            finally:
                browser.close()
    finally:
        running.close()


def _wait_for_face(running: RunningService) -> None:
    begin, folder = time.monotonic(), Path(running.data.name) / "studio" / "faces"
    eventually(lambda: list(folder.glob("*.glb.gz")), 300, "the face is made")
    print(f"face made {time.monotonic() - begin:.1f} s after the first process was ready")


def _measure_edges(url: str) -> None:
    """Times from the release of a phone edge to the new curves of its sentence, which has been made before."""
    with httpx.Client(base_url=f"{url}/studio", timeout=60.0) as studio:
        number = create(studio)
        header, *_ = preview(studio, number)
        text, occurrence, begin, _ = header["sentences"][1]
        index, time_of = next((one[4], one[1] - begin) for one in header["phones"] if one[3] == 1 and one[4] > 1)
        change, seconds = {"kind": "edge", "text": text, "occurrence": occurrence, "index": index}, []
        for at in range(DRAGS):
            began = time.perf_counter()
            edit(studio, number, change | {"time": time_of + 0.004 * (at % 2 + 1)})
            header, *_ = preview(studio, number, header["revision"])
            seconds.append(time.perf_counter() - began)
    middle, most = 1e3 * statistics.median(seconds), 1e3 * max(seconds)
    print(f"from a moved edge to its curves {middle:.0f} ms, at most {most:.0f} ms")


def _measure(browser: Browser, url: str, number: int) -> None:
    browser.open(f"{url}/studio/")
    eventually(lambda: browser.run("return document.querySelectorAll('textarea').length"), 60, "the list is shown")
    begin = time.monotonic()
    eventually(lambda: browser.run(CLICK, "open the example"), 30, "the button is there")
    eventually(lambda: browser.run(SHOWN), 120, "the example is shown")
    shown = time.monotonic() - begin
    browser.run("document.querySelector('.studio-play').click()")
    eventually(lambda: browser.run(TIME) > 0, 30, "the example plays")
    played = time.monotonic() - begin
    sent = browser.run(SENT) / 1e6
    browser.run("document.querySelector('.studio-play').click()")
    spoken = {}
    for text in TEXTS:
        browser.run(SPEAK, f"{text} {number}")
        spoken = eventually(lambda: browser.run("return window.spoken.motion ? window.spoken : null"), 60, "it speaks")
        print(f"  from Enter to sound {spoken['sound']:.0f} ms, to motion {spoken['motion']:.0f} ms")
        eventually(
            lambda: browser.run("return import('tts2face-studio/clock.js').then((m) => !m.clock.playing)"), 60, ""
        )
    print(
        f"example shown after {shown:.2f} s, plays after {played:.2f} s, {sent:.2f} MB transferred; "
        f"{slowness(browser):.1f} times slower than an idle core"
    )


if __name__ == "__main__":
    main()
