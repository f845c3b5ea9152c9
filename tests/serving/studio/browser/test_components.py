"""Stage and timeline in a real browser, with the motion and sound of a real session."""

import time

import numpy as np
import pytest

from tests.running import eventually
from tests.serving.studio.served import HARNESS, Page

SILENCE_S, SPEECH_S = (0.01, 0.03), (0.55, 0.95, 2.0, 2.4, 2.6)  # of the harness's sentence
COUNT_FRAMES = """window.called = 0;
    const next = window.requestAnimationFrame;
    window.requestAnimationFrame = (call) => next((now) => (window.called++, call(now)));"""
CHANGE_FACE = """
    const id = document.querySelector('.studio-stage').id.slice(1), first = window.fetch;
    const later = (seconds) => new Promise((done) => setTimeout(done, 1000 * seconds));
    window.late = 0;
    window.fetch = async (url, options) => {
      if (!String(url).includes('slow')) return first(url, options);
      await later(1.0); // by then the other face is shown
      window.late++;
      return first(url.replace('slow', arguments[0]), options);
    };
    const { props } = mounted_app.elements[id];
    window.stage = getElement(id);
    props.face = '/studio/files/face.glb?slow';
    await later(0.1);
    props.face = '/studio/files/face.glb?second'"""
MERGE = """
    const { Preview } = await import('tts2face-studio/preview.js');
    const bundle = (header, motion, pcm) => {
      const text = new TextEncoder().encode(JSON.stringify({fps: 30, channels: ['a'], rate: 8, words: [], phones: [],
        sentences: [], duration: 1, ...header}));
      const parts = [new Uint32Array([text.length]), text, new Float32Array(motion),
        new Float32Array(6 * motion.length), new Int16Array(pcm)];
      return new Blob(parts).arrayBuffer();
    };
    const preview = new Preview(), changes = [];
    preview.on('change', (change) => changes.push([change.sound, change.motion]));
    const first = {revision: 1, n_frames: 4, first_frame: 0, n: 4, n_samples: 4, sound_first: 0};
    preview.merge(await bundle(first, [1, 2, 3, 4], [10, 20, 30, 40]));
    const longer = {revision: 2, n_frames: 5, first_frame: 1, n: 2, n_samples: 5, sound_first: 1};
    preview.merge(await bundle(longer, [9, 8], [50, 60]));
    preview.merge(await bundle({...longer, revision: 3, first_frame: 4, n: 1, sound_first: 0}, [7], []));
    return [[...preview.motion], [...preview.pcm], preview.revision, changes];
"""


@pytest.fixture
def address(studio_service):
    """Address of the harness."""
    return studio_service.url + HARNESS


@pytest.fixture
def page(browser, address):
    """A fresh page."""
    return Page(browser, address)


def phones(browser):
    """Rows of the preview's phones."""
    return browser.run("""
        const bytes = await (await fetch('/studio/files/clip.bin')).arrayBuffer();
        const n = new DataView(bytes).getUint32(0, true);
        return JSON.parse(new TextDecoder().decode(new Uint8Array(bytes, 4, n))).phones""")


def test_mouth_moves_with_speech_and_rests_in_silence(page):
    rest, again = [page.mouth(time) for time in SILENCE_S]
    noise = np.abs(rest - again).mean()
    speech = [np.abs(page.mouth(time) - rest).mean() for time in SPEECH_S]
    assert noise < 4  # of 255; the head moves a little
    assert np.median(speech) > max(10, 4 * noise)


def test_views_differ_and_the_picture_covers_the_head(page):
    front = page.browser.picture(".studio-stage canvas").astype(np.float64)
    page.browser.run("document.querySelector('.studio-views button:nth-of-type(3)').click()")
    eventually(lambda: np.abs(page.browser.picture(".studio-stage canvas") - front).mean() > 5, 20, "profile")
    assert page.browser.run("return document.querySelector('.studio-views [aria-pressed=true]').innerText") == "Profile"


def plays_until(page, is_done, what):
    """Play until something has happened; again, if the clip ends before a busy browser has drawn enough of it."""

    def is_done_now():
        page.play()
        return is_done()

    eventually(is_done_now, 60, what)


def test_time_follows_the_sound_and_measures_are_reported(page):
    page.browser.press("Tab")
    plays_until(page, lambda: page.measure("time") > 1.5, "plays")
    plays_until(page, lambda: page.measure("fps") and page.measure("timeline_ms") is not None, "measures")
    assert page.measure("js_ms") > 0
    page.pause()
    stopped = page.measure("time")
    assert page.browser.run("return document.querySelector('.studio-play').getAttribute('aria-label')") == "Play"
    assert stopped < 4.1


def test_a_page_at_rest_does_nothing_until_it_plays_or_changes(page):
    def rests() -> bool:
        before = page.browser.run("return window.called")
        time.sleep(0.5)
        return bool(page.browser.run("return window.called") == before)

    page.browser.run(COUNT_FRAMES)
    plays_until(page, lambda: page.browser.run("return window.called > 5"), "frames")
    page.pause()
    page.browser.wait("return window.__studio.is_sharp")
    eventually(rests, 20, "the page rests")
    drawn = page.measure("frames")
    page.focus()
    page.browser.press("Right")
    eventually(lambda: page.measure("frames") > drawn, 10, "the head is drawn at another time")
    eventually(rests, 20, "the page rests")


@pytest.mark.parametrize("answer", ["late", "/../nothing.glb?"])
def test_an_earlier_face_that_comes_late_is_neither_shown_nor_a_failure(page, answer):
    before = page.browser.run("return window.__studio.face_ms")
    page.browser.run(CHANGE_FACE, answer)
    page.browser.wait("return window.__studio.face_ms !== arguments[0]", before)
    page.browser.run("window.shown = window.stage.scene.face")
    page.browser.wait("return window.late")
    time.sleep(0.5)
    assert page.browser.run("return window.shown === window.stage.scene.face")
    assert page.browser.run("return window.stage.message") == ""


def test_brush_paints_the_span_that_is_dragged(page):
    begin, end = page.at("lane:brows", 0.6), page.at("lane:brows", 1.45)
    page.browser.drag([begin, page.at("lane:brows", 1.0), end], held="Alt")
    (edit,) = page.edits(1)
    assert (edit["kind"], edit["feature"], edit["style"]) == ("paint", "brows", "delighted")
    assert edit["start"] == pytest.approx(0.6, abs=0.01)
    assert edit["end"] == pytest.approx(1.45, abs=0.01)


def test_painting_snaps_to_words(page):
    edges = sorted({edge for phone in phones(page.browser) for edge in phone[1:3]})
    target = min(edges, key=lambda edge: abs(edge - 1.0))
    begin, end = page.at("lane:head", target + 0.012), page.at("lane:head", 3.7)
    page.browser.drag([begin, page.at("lane:head", 2.0), end])
    (edit,) = page.edits(1)
    assert edit["start"] == pytest.approx(target, abs=0.001)


def test_dragged_edge_is_sent_in_seconds_of_its_sentence(page):
    place = next(i for i, phone in enumerate(phones(page.browser)) if phone[0] == "aɪ")
    label, begin, end, _, index = phones(page.browser)[place]
    page.browser.drag([page.at("phones", begin), page.at("phones", begin + 0.02), page.at("phones", begin + 0.03)])
    (edit,) = page.edits(1)
    assert (edit["kind"], edit["occurrence"], edit["index"]) == ("edge", 0, index)
    assert edit["text"].startswith("We were away")
    assert edit["time"] == pytest.approx(begin + 0.03, abs=0.006)
    assert label == "aɪ"
    assert edit["time"] < end


def test_edge_stays_ten_milliseconds_from_the_next(page):
    place = next(i for i, phone in enumerate(phones(page.browser)) if phone[0] == "aɪ")
    _, begin, end, _, _ = phones(page.browser)[place]
    page.browser.drag([page.at("phones", begin), page.at("phones", begin + 0.1), page.at("phones", end + 0.3)])
    (edit,) = page.edits(1)
    assert edit["time"] == pytest.approx(end - 0.01, abs=0.001)


def test_keys_reach_rows_and_elements(page):
    page.focus()
    page.browser.press("Down", "Down", "Down", "Right", "Right")
    active = "return document.getElementById(document.activeElement.getAttribute('aria-activedescendant')).innerText"
    eventually(lambda: "phone" in page.browser.run(active), 10, "a phone has the focus")
    page.browser.press("Alt+Right")
    (edit,) = page.edits(1)
    assert edit["kind"] == "edge"


def test_keys_paint_and_erase_the_selection(page):
    page.show(0.5)
    page.focus()
    page.browser.press("[")
    page.show(1.5)
    page.focus()
    page.browser.press("]", "Down", "Down", "Down", "Down", "Enter", "Delete")
    paint, erase = page.edits(2)
    assert (paint["kind"], paint["feature"], erase["kind"]) == ("paint", "expression", "erase")
    assert (paint["start"], paint["end"]) == (pytest.approx(0.5, abs=0.02), pytest.approx(1.5, abs=0.02))
    assert (erase["start"], erase["end"]) == (paint["start"], paint["end"])


def test_double_click_adds_key_points_gestures_gaze_targets_and_listening(page):
    page.browser.double_click(*page.at("curve", 1.2, 0.3))
    page.browser.double_click(*page.at("gestures", 2.0))
    page.browser.double_click(*page.at("targets", 2.5))
    page.browser.double_click(*page.at("listens", 1.0))
    page.browser.double_click(*page.at("channel", 2.0, 0.2))
    curve, nod, gaze, listen, channel = page.edits(5)
    assert (curve["kind"], curve["expression"], len(curve["keys"])) == ("curve", "happy", 3)
    assert (nod["kind"], nod["name"], nod["size"]) == ("gesture", "nod", 1)
    assert (gaze["kind"], gaze["down_deg"], gaze["left_deg"]) == ("gaze", 0, 0)
    assert (listen["kind"], listen["end"] - listen["start"]) == ("listen", pytest.approx(1.0))
    assert (channel["kind"], channel["channel"]) == ("channel", "jawOpen")
    assert [key[1] for key in channel["keys"]][::2] == [0, 0]


FILL = """
    const [name, value] = arguments;
    const labels = [...document.querySelectorAll('.studio-editor label')];
    const input = labels.find((one) => one.innerText.startsWith(name)).querySelector('input, select');
    input.value = value;
    input.dispatchEvent(new Event('input', { bubbles: true }));
    input.dispatchEvent(new Event('change', { bubbles: true }));"""


def test_a_gesture_gets_another_name_size_and_direction(page):
    page.show(1.0)
    page.focus()
    page.browser.press(*["Down"] * 11, "Enter")
    (nod,) = page.edits(1)
    page.browser.press("Right", "Enter")
    eventually(lambda: page.browser.run("return !!document.querySelector('.studio-editor')"), 10, "the form opens")
    for field, value in (("Gesture", "wink"), ("Size", "1.5"), ("Duration", "2"), ("Direction", "right")):
        page.browser.run(FILL, field, value)
    page.browser.run("document.querySelector('form.studio-editor').requestSubmit()")
    _, removed, made = page.edits(3)
    assert removed == {"kind": "remove_gesture", "time": nod["time"], "name": "nod"}
    assert made == {
        "kind": "gesture", "time": nod["time"], "name": "wink", "size": 1.5, "seconds": 2, "down_deg": None,
        "left_deg": -15,
    }  # fmt: skip


def test_lanes_are_muted_and_get_new_seeds(page):
    page.browser.run("document.querySelector('[aria-label=\"Mute Brows\"]').click()")
    page.browser.run("document.querySelector('[aria-label^=\"New seed for Head\"]').click()")
    assert page.edits(2) == [
        {"kind": "mute", "feature": "brows", "on": True},
        {"kind": "seed", "feature": "head", "seed": 1},
    ]
    pressed = "return document.querySelector('[aria-label=\"Mute Brows\"]').getAttribute('aria-pressed')"
    eventually(lambda: page.browser.run(pressed) == "true", 10, "the lane is muted")


def test_ten_minutes_zoom(browser, address):
    page = Page(browser, f"{address}?preview=long.bin")
    fitted = page.measure("view")["scale"]
    page.focus()
    browser.press("Right", "+", "+", "+", "+", "+", "+", "+", "+", "+", "+", "+", "+")
    assert page.measure("view")["scale"] > 20 * fitted


def test_previews_keep_what_lies_before_and_after_a_change(page):
    motion, pcm, revision, changes = page.browser.run(MERGE)
    assert motion == [1, 9, 8, 3, 7]
    assert pcm == [10, 50, 60, 30, 40]
    assert revision == 3
    assert changes == [[True, True], [True, True], [False, True]]
