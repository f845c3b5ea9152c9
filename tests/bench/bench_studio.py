"""Live preview in headless Chromium without a GPU: PYTHONPATH=. python tests/bench/bench_studio.py [folder].

Plays a new project on its page, whose window makes a stage of 640 x 480, then ten minutes of material on the harness,
then an empty WebGL scene of the same size, each once the processes of service and browser rest. Frames per second hold
for the load of the machine, which the slowness of a script tells, taken just before.
"""

import gzip
import os
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from tests.serving.studio.chromium import Browser
from tests.serving.studio.harness import TEXT
from tests.serving.studio.served import HARNESS, Page, create_project, service_with_harness
from tts2face.serving.studio.components.stage import COMPONENTS

WARM_S, PLAYED_S = 2.0, 6.0  # played before and while a page is measured
REPEATS = 3  # of the harness's sentence of 4 s in the project
SIZE = (1280, 900)  # of the harness's window, whose pixels are composed for each frame
STAGE = (640, 480)
REST_SHARE = 0.15  # of a core that all processes together use at most when they rest; workers look for jobs
REST_S, LONGEST_START_S = 2.0, 120.0
TICKS_PER_S = os.sysconf("SC_CLK_TCK")
EMPTY = """
    const [width, height] = arguments;
    const canvas = Object.assign(document.createElement('canvas'), {width, height});
    document.body.replaceChildren(canvas);
    const gl = canvas.getContext('webgl2');
    let n = 0;
    const frame = () => {
      n++;
      gl.clearColor(n % 2, 0, 0, 1);
      gl.clear(gl.COLOR_BUFFER_BIT);
      requestAnimationFrame(frame);
    };
    requestAnimationFrame(frame);
    window.empty = () => n;
"""


def processor_s(root: int) -> dict[str, float]:
    """Processor seconds of the processes below one, by their type."""
    stats = {}
    for folder in Path("/proc").iterdir():
        if folder.name.isdigit():
            try:
                fields = (folder / "stat").read_text().rpartition(")")[2].split()
                command = (folder / "cmdline").read_bytes().decode().replace(chr(0), " ")
            except OSError:
                continue  # it ended meanwhile
            kind = command.partition("--type=")[2].partition(" ")[0] or "browser"
            stats[int(folder.name)] = (int(fields[1]), kind, (int(fields[11]) + int(fields[12])) / TICKS_PER_S)
    inside, spent = {root}, dict[str, float]()
    while found := {pid for pid, (parent, _, _) in stats.items() if parent in inside} - inside:
        inside |= found
    for pid in inside & set(stats):
        spent[stats[pid][1]] = spent.get(stats[pid][1], 0.0) + stats[pid][2]
    return spent


def wait_for_rest() -> None:
    """Wait until service and browser, processes below this one, have done what follows their start."""
    end = time.monotonic() + LONGEST_START_S
    while time.monotonic() < end:
        before = sum(processor_s(os.getpid()).values())
        time.sleep(REST_S)
        if sum(processor_s(os.getpid()).values()) - before < REST_SHARE * REST_S:
            return
    raise SystemExit(f"the service does not rest within {LONGEST_START_S:g} s: other work on the machine?")


def processor_ms(browser: Browser, frames: Callable[[], float]) -> str:
    """Processor time of a frame by kind of process, while a page draws for `PLAYED_S`."""
    before, first = processor_s(browser.driver), frames()
    time.sleep(PLAYED_S)
    after, n = processor_s(browser.driver), frames() - first
    spent = {kind: 1000 * (after[kind] - before.get(kind, 0.0)) / max(n, 1) for kind in after}
    each = {kind: ms for kind, ms in spent.items() if ms > 0.05}  # of a kind whose process has ended it is less than 0
    parts = ", ".join(f"{kind} {ms:.1f}" for kind, ms in each.items())
    return f"{n / PLAYED_S:.1f} frames/s; processor time of a frame {sum(each.values()):.1f} ms ({parts})"


def play(page: Page, name: str) -> None:
    """Print the figures of a page that plays."""
    wait_for_rest()
    alone = page.slowness()
    page.play()
    time.sleep(WARM_S)
    cost = processor_ms(page.browser, lambda: page.measure("frames"))
    script, lines, share = (page.measure(one) for one in ("js_ms", "timeline_ms", "playing_share"))
    page.pause()
    print(
        f"{name}: {cost}; {100 * share:.0f} % of the pixels along a side, script of the stage {script:.2f} ms a frame, "
        f"of the timeline {lines:.2f} ms; a script is {alone:.1f} times slower than on an idle core of 2.5 GHz"
    )


def open_project(browser: Browser, url: str) -> Page:
    """The page of a new project, in a window whose stage has the size `STAGE`."""
    create_project(browser, url, " ".join([TEXT] * REPEATS))
    page, (width, height) = Page(browser), SIZE
    for _ in range(8):  # part of each change of the height is the timeline's
        browser.devtools(
            "Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=False
        )
        time.sleep(0.5)
        stage = browser.box(".studio-stage canvas")
        wider, higher = (round(wanted - stage[side]) for wanted, side in zip(STAGE, ("width", "height"), strict=True))
        if not wider and not higher:
            break
        width, height = width + wider, height + higher
    print(f"window of {width} x {height}, stage of {stage['width']:.0f} x {stage['height']:.0f}")
    return page


def main() -> None:
    """Print all figures."""
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else tempfile.mkdtemp(prefix="bench-studio-"))
    with service_with_harness(folder) as running:
        running.wait_until_ready()
        browser = Browser(SIZE)
        try:
            page = open_project(browser, running.url)
            print(f"face from request to first frame: {page.measure('face_ms'):.0f} ms")
            play(page, "new project")
            browser.devtools("Emulation.clearDeviceMetricsOverride")
            page = Page(browser, f"{running.url}{HARNESS}?preview=long.bin")
            page.focus()
            browser.press("Right", *"++++++")
            play(page, "ten minutes")
            browser.open("about:blank")
            browser.run(EMPTY, *STAGE)
            print(f"empty scene: {processor_ms(browser, lambda: browser.run('return window.empty()'))}")
        finally:
            browser.close()
    face = (folder / "face.glb").read_bytes()
    files = [file.read_bytes() for pattern in ("*.js", "*.css") for file in COMPONENTS.glob(pattern)]
    sizes = [sum(map(len, group)) / 1e6 for group in ([face], [gzip.compress(face)], files, map(gzip.compress, files))]
    print("face {:.2f} MB ({:.2f} compressed), components {:.3f} MB ({:.3f} compressed)".format(*sizes))


if __name__ == "__main__":
    main()
