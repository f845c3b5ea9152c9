"""The README's film (a GIF) and the pictures of the studio's docs: ``PYTHONPATH=. python docs/make_studio_film.py``.

Starts a service, works with it in headless Chromium (chromium and chromedriver on the PATH), and takes each frame of
the film when the page shows it: the clock of the sound is set from frame to frame, so that the film is smooth on any
machine.
"""

import base64
import io
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any

import av
import httpx
import numpy as np
from numpy.typing import NDArray
from PIL import Image
from scipy.spatial import cKDTree

from corpus_tools.prompts.coverage import count_units, sentence_units
from corpus_tools.tools.recordings import prompts_answer
from tests.running import ServeProcess, serve_process
from tests.serving.studio.chromium import Browser, open_browser
from tests.serving.studio.fake_camera import write_fake_media
from tests.serving.studio.served import Page
from tts2face.serving.service.keys import LOCAL_KEY
from tts2face.serving.studio.recordings import GOOD, REFUSED, WEAK, RecordingStore

HERE = Path(__file__).parent / "pictures"
SIZE = (1280, 720)
FILM_SIZE = (800, 450)
FPS = 12
TICKS = 100  # a second, of a GIF's clock
N_PALETTE_FRAMES = 8
N_EXACT, N_SHADES, N_RARE = 16, 220, 20  # colours of a palette, 256 in all
TEXT = "We were away a year ago, but Bob may move five big maps."
CORRECTED = "/mɑps/"
CLOCK = "const { clock } = await import('tts2face-studio/clock.js'); return "
PREVIEW = "const { preview } = await import('tts2face-studio/preview.js'); return "
POINTER = """
    const pointer = document.createElement('div');
    pointer.id = 'film-pointer';
    pointer.innerHTML = '<svg width="26" height="26" viewBox="0 0 16 16">'
        + '<path d="M3 1l10 9-5 .6 2.7 4.3-1.9 1-2.6-4.5L3 15z" fill="#fff" stroke="#000"/></svg>';
    Object.assign(pointer.style, {position: 'fixed', left: '-50px', top: '0', zIndex: 99999, pointerEvents: 'none'});
    document.body.append(pointer);
    window.movePointer = (x, y) => Object.assign(pointer.style, {left: `${x - 4}px`, top: `${y - 1}px`})"""
MIDDLE = """const one = [...document.querySelectorAll(arguments[0])].find((each) => each.offsetParent
        && (each.innerText || each.getAttribute('aria-label') || '').includes(arguments[1]));
    if (!one) return null;
    const box = one.getBoundingClientRect();
    return [box.x + box.width / 2, box.y + box.height / 2]"""
PROMPTS = (
    "The birch canoe slid on the smooth planks.", "Glue the sheet to the dark blue background.",
    "It is easy to tell the depth of a well.", "These days a chicken leg is a rare dish.",
    "Rice is often served in round bowls.", "The juice of lemons makes fine punch.",
    "The box was thrown beside the parked truck.", "Four hours of steady work faced us.",
    "A large size in stockings is hard to sell.", "The boy was there when the sun rose.",
)  # fmt: skip
STATES = (GOOD, GOOD, WEAK, GOOD, REFUSED, GOOD)  # of the takes that the picture of the recording page shows
ADVICE = {
    WEAK: "it is a little dark; turn your face to a window or a lamp",
    REFUSED: "the words differ from the prompt; read exactly what is shown",
}


class Film:
    """Frames of a browser's window, and a visible pointer.

    Parameters
    ----------
    browser
        The window; its pages get the pointer by `begin`.
    """

    def __init__(self, browser: Browser) -> None:
        self.browser = browser
        self.frames: list[Image.Image] = []
        self._place = (640.0, 400.0)

    def begin(self) -> None:
        """Show the pointer on a page that has been opened."""
        self.browser.run(POINTER)
        self._point(*self._place)

    def take(self, count: int = 1) -> None:
        """Add a frame as the window is now, several times."""
        self.frames += [screenshot(self.browser)] * count

    def move(self, place: tuple[float, float], seconds: float = 0.4) -> None:
        """Move the pointer to a place."""
        begin, n = self._place, max(round(seconds * FPS), 1)
        for step in range(1, n + 1):
            share = (1 - np.cos(np.pi * step / n)) / 2
            self._point(*(float(a + share * (b - a)) for a, b in zip(begin, place, strict=True)))
            self.take()

    def click(self, selector: str, text: str = "", seconds: float = 0.4) -> None:
        """Move to an element whose text or label contains `text`, and press it."""
        place = self.browser.wait(MIDDLE, selector, text)
        self.move((place[0], place[1]), seconds)
        self.browser.mouse({"type": "pointerDown", "button": 0}, {"type": "pointerUp", "button": 0})

    def drag(self, places: list[tuple[float, float]], seconds: float) -> None:
        """Press at the first place, move over the others, release."""
        self.move(places[0])
        self.browser.mouse({"type": "pointerDown", "button": 0})
        for place in places[1:]:
            self.move(place, seconds / (len(places) - 1))
        self.browser.mouse({"type": "pointerUp", "button": 0})

    def play(self, begin: float, end: float) -> None:
        """Show the clip from one time to another at its own speed."""
        for time_of in np.arange(begin, end, 1 / FPS):
            seek(self.browser, float(time_of))
            self.take()

    def write(self, path: Path) -> None:
        """Write the film as a GIF with one palette."""
        frames = [frame.resize(FILM_SIZE, Image.Resampling.LANCZOS) for frame in self.frames]
        colours = palette(frames[:: len(frames) // N_PALETTE_FRAMES])
        table = np.full((256, 4), 255, np.uint8)  # alpha, red, green, blue
        table[: len(colours), 1:] = colours
        with av.open(str(path), "w", format="gif", options={"loop": "0"}) as container:
            stream = container.add_stream("gif", rate=FPS)
            stream.width, stream.height, stream.pix_fmt = *FILM_SIZE, "pal8"
            stream.codec_context.time_base = Fraction(1, TICKS)
            for number, frame in enumerate(frames):
                indexed: Any = (indices(frame, colours), table)
                picture = av.VideoFrame.from_ndarray(indexed, format="pal8")
                picture.pts, picture.time_base = round(number * TICKS / FPS), Fraction(1, TICKS)
                container.mux(stream.encode(picture))
            container.mux(stream.encode(None))

    def _point(self, x: float, y: float) -> None:
        self._place = (x, y)
        self.browser.mouse({"type": "pointerMove", "x": round(x), "y": round(y), "duration": 0})
        self.browser.run("window.movePointer(...arguments)", x, y)


def screenshot(browser: Browser) -> Image.Image:
    """Pixels of the window."""
    data = browser.devtools("Page.captureScreenshot", format="png")["data"]
    return Image.open(io.BytesIO(base64.b64decode(data))).convert("RGB")


def palette(pictures: list[Image.Image]) -> NDArray[np.uint8]:
    """Colours (256, 3) of pictures: the most frequent ones exactly, those of shades, and rare ones of small marks."""
    sheet = Image.fromarray(np.concatenate([np.asarray(picture) for picture in pictures]))
    numbers, counts = np.unique(packed(np.asarray(sheet)), return_counts=True)
    parts = [unpacked(numbers[np.argsort(-counts)[:N_EXACT]])]
    for count, method, steps in ((N_SHADES, Image.Quantize.MEDIANCUT, 3), (N_RARE, Image.Quantize.MAXCOVERAGE, 0)):
        found = sheet.quantize(count, method, kmeans=steps, dither=Image.Dither.NONE).getpalette() or []
        parts.append(np.reshape(found, (-1, 3))[:count])
    return np.concatenate(parts).astype(np.uint8)


def indices(picture: Image.Image, colours: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """For each pixel (H, W) the nearest of some colours; without dither, whose patterns would not compress."""
    own, places = np.unique(packed(np.asarray(picture)), return_inverse=True)
    nearest = np.asarray(cKDTree(colours).query(unpacked(own))[1], np.uint8)
    return nearest[places].reshape(picture.height, picture.width)


def packed(pixels: NDArray[np.uint8]) -> NDArray[np.int64]:
    """Colours (..., 3) as one number each."""
    return pixels.astype(np.int64) @ np.array([65536, 256, 1])


def unpacked(numbers: NDArray[np.int64]) -> NDArray[np.uint8]:
    """Colours (..., 3) of numbers."""
    return np.stack([numbers >> 16, numbers >> 8 & 255, numbers & 255], axis=-1).astype(np.uint8)


def seek(browser: Browser, time_of: float) -> None:
    """Show a time of the clip, and wait for the sharp picture."""
    browser.run(CLOCK + "clock.seek(arguments[0])", time_of)
    browser.wait("return Math.abs(window.__studio.time - arguments[0]) < 0.001 && window.__studio.is_sharp", time_of)


def made(browser: Browser, revision: int) -> None:
    """Wait for a newer preview that is complete."""
    browser.wait(PREVIEW + "preview.revision > arguments[0] && preview.isComplete", revision)


def revision_of(browser: Browser) -> int:
    """Revision of the preview that the page shows."""
    return int(browser.run(PREVIEW + "preview.revision"))


def write_text(film: Film, service: ServeProcess) -> Page:
    """Type a text on the first page and open its project."""
    browser = film.browser
    browser.open(f"{service.url}/studio/")
    browser.wait("return !!document.querySelector('textarea[aria-label=\"Text to speak\"]')")
    film.begin()
    film.take(4)
    film.click("textarea", "", 0.3)
    for end in range(2, len(TEXT) + 2, 2):
        browser.type("Text to speak", TEXT[:end])
        film.take()
    film.click("button", "Create from text")
    browser.wait("return location.pathname.includes('/animate/')")
    page = Page(browser)
    film.begin()
    return page


def paint(film: Film, page: Page) -> None:
    """Paint a style on two lanes, and show what it changes."""
    browser = film.browser
    film.click(".styles button", "delighted")
    for lane in ("lane:expression", "lane:brows"):
        revision = revision_of(browser)
        film.drag([page.at(lane, 0.35), page.at(lane, 1.5), page.at(lane, 2.6)], 0.8)
        made(browser, revision)
    film.play(1.0, 2.5)


def drag_edge(film: Film, page: Page) -> None:
    """Drag the edge before the vowel of "five"."""
    browser = film.browser
    film.click("#studio-select")
    phones = browser.run(PREVIEW + "preview.phones")
    time_of = next(one[2] for one in phones if one[0] == "aɪ")
    seek(browser, time_of - 0.02)
    revision = revision_of(browser)
    film.drag([page.at("phones", time_of), page.at("phones", time_of + 0.03), page.at("phones", time_of + 0.06)], 0.7)
    made(browser, revision)
    film.play(time_of - 0.3, time_of + 0.4)


def correct(film: Film, page: Page) -> None:
    """Correct the pronunciation of a word."""
    browser = film.browser
    word = next(one for one in browser.run(PREVIEW + "preview.words") if one[0].startswith("maps"))
    film.move(page.at("words", (word[1] + word[2]) / 2))
    browser.mouse({"type": "pointerDown", "button": 0}, {"type": "pointerUp", "button": 0})
    browser.wait("return document.querySelector('input[aria-label=Word]').value === 'maps'")
    film.click("input[aria-label=Phones]")
    for end in range(1, len(CORRECTED) + 1):
        browser.type("Phones", CORRECTED[:end])
        film.take()
    revision = revision_of(browser)
    film.click("button", "Set")
    made(browser, revision)
    film.play(word[1] - 0.1, word[2] + 0.1)


def export(film: Film, pictures: Path) -> None:
    """Make a film and a subtitle file in the dialog; its picture is kept."""
    browser = film.browser
    film.click("#studio-files")
    browser.wait("return !!document.querySelector('.q-dialog [aria-label=Format]')")
    time.sleep(0.5)  # the dialog has opened
    film.take(3)
    film.click(".q-dialog button", "Make")
    state = "return document.querySelector('.q-dialog .project')?.innerText ?? ''"
    shown = ""
    for _ in range(2000):
        now = browser.run(state)
        if now != shown:
            film.take()
            shown = now
        if "done" in now:
            break
        time.sleep(0.1)
    film.take(FPS)
    keep(browser, pictures / "studio_export.png")


def keep(browser: Browser, path: Path) -> None:
    """Write a picture of the window."""
    browser.run("document.getElementById('film-pointer')?.remove()")
    screenshot(browser).save(path, optimize=True)


def animate_pictures(browser: Browser, page: Page, pictures: Path) -> None:
    """The page "animate", light with painted lanes and dark with curves."""
    browser.run(
        "document.querySelector('#studio-select').click(); document.querySelector('.studio-body').scrollTop = 0"
    )
    seek(browser, 1.9)
    keep(browser, pictures / "studio_light.png")
    set_dark(browser, True)
    page.browser.run("document.querySelector('.studio-views button:nth-of-type(2)').click()")
    body = "document.querySelector('.studio-body')"
    page.browser.run(f"{body}.scrollTop = {body}.scrollHeight")
    seek(browser, 2.05)
    keep(browser, pictures / "studio_dark.png")
    set_dark(browser, False)


def add_curves(studio: httpx.Client, number: str, tab: str = "") -> None:
    """Edits that the dark picture shows: an expression through keys, a nod, a corrected channel."""
    edits: tuple[dict[str, Any], ...] = (
        {"kind": "paint", "feature": "expression", "style": "delighted", "start": 0.3, "end": 2.0},
        {"kind": "paint", "feature": "brows", "style": "exaggerated", "start": 0.8, "end": 2.9},
        {"kind": "paint", "feature": "head", "style": "delighted", "start": 1.9, "end": 3.6},
        {"kind": "curve", "expression": "happy", "keys": [[0.2, 0], [1.2, 0.6], [2.4, 0.2], [3.4, 0.7], [3.9, 0]]},
        {"kind": "gesture", "name": "nod", "time": 1.45, "size": 1.0},
        {"kind": "gaze", "start": 2.2, "end": 2.9, "down_deg": 4, "left_deg": 12},
        {"kind": "channel", "channel": "jawOpen", "keys": [[0.9, 0], [1.1, 0.12], [1.3, 0]]},
    )
    for edit in edits:
        answer = studio.post(f"/api/projects/{number}/edits", json={"edit": edit, "tab": tab})
        assert answer.status_code == 200, answer.text


def record_picture(browser: Browser, service: ServeProcess, pictures: Path) -> None:
    """The recording page, on which the camera shows a rendered head and the states of takes are examples."""
    store = RecordingStore(Path(service.data.name) / "studio")
    units = [sentence_units(prompt, "en-us") for prompt in PROMPTS]
    number = store.create(LOCAL_KEY.name, "Ada", prompts_answer(list(PROMPTS), units, count_units(units)))
    for at, state in enumerate(STATES):
        upload = store.folder(number, LOCAL_KEY.name) / "upload"
        upload.write_bytes(b"example")
        take = store.add_take(number, at, upload, "video/webm")
        store.judge(number, at, replace(take, state=state, advice=ADVICE.get(state, "")))
    browser.open(f"{service.url}/studio/record/{number}")
    browser.click("Use camera")
    browser.wait("return document.querySelector('.recorder video').videoWidth > 0")
    browser.run("document.querySelectorAll('.recorder-list button')[4].click()")
    time.sleep(1.0)  # the camera's pictures and the meter's level have come
    keep(browser, pictures / "studio_record.png")


def set_dark(browser: Browser, is_dark: bool) -> None:
    """Choose the colours of the system."""
    value = "dark" if is_dark else "light"
    browser.devtools("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": value}])
    time.sleep(0.6)  # transitions of colours end


def camera_files(folder: Path) -> list[str]:
    """Arguments of Chromium whose camera shows a rendered head."""
    clip = folder / "camera.mp4"
    command = [
        sys.executable,
        "-m",
        "tts2face",
        PROMPTS[0],
        "--size",
        "320x240",
        "--identity",
        "amara",
        "--out",
        str(clip),
    ]
    subprocess.run(command, check=True)
    return write_fake_media(clip, folder)


def windows(folder: Path) -> Iterator[tuple[ServeProcess, Browser]]:
    """A service, and a window of the film's size."""
    with serve_process() as service, open_browser(SIZE, camera_files(folder)) as browser:
        width, height = SIZE
        browser.devtools(
            "Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=False
        )
        set_dark(browser, False)
        yield service, browser


def main() -> None:
    """Write the film, and the four pictures."""
    folder = Path(tempfile.mkdtemp(prefix="studio-film-"))
    for service, browser in windows(folder):
        film = Film(browser)
        page = write_text(film, service)
        film.play(0.0, float(browser.run(PREVIEW + "preview.duration")))
        paint(film, page)
        drag_edge(film, page)
        correct(film, page)
        export(film, HERE)
        film.write(HERE / "studio.gif")
        with httpx.Client(base_url=f"{service.url}/studio", timeout=120.0) as studio:
            number = studio.post("/api/projects", json={"text": TEXT, "name": "Five big maps"}).json()["id"]
            add_curves(studio, number)
        animate_pictures(browser, Page(browser, f"{service.url}/studio/animate/{number}"), HERE)
        record_picture(browser, service, HERE)
        sys.stdout.write(f"{len(film.frames) / FPS:.1f} s, {(HERE / 'studio.gif').stat().st_size / 1e6:.2f} MB\n")


if __name__ == "__main__":
    main()
