"""Bytes that a browser receives for the page "animate" with an empty cache."""

import httpx
import pytest

from tests.running import RunningService, eventually
from tests.serving.studio.chromium import Browser

MOST_BYTES = 2_500_000
SHOWN = "const s = window.__studio; return Boolean(s && s.frames > 0 && s.face_ms && s.view && s.view.duration > 0)"
RECEIVED = """
    const entries = [...performance.getEntriesByType('navigation'), ...performance.getEntriesByType('resource')];
    return entries.map((one) => [one.name, one.transferSize])
"""


def received(browser: Browser, address: str) -> dict[str, int]:
    """Bytes of each file of a page that came over the network."""
    browser.open(address)
    eventually(lambda: browser.run(SHOWN), 120, "face and sound are shown")
    sizes = dict[str, int]()
    for one, size in browser.run(RECEIVED):
        name = one.partition("?")[0].rpartition("/")[2]
        sizes[name] = sizes.get(name, 0) + size
    return sizes


def test_the_page_with_face_and_sound_stays_below_its_limit(
    browser: Browser, studio: httpx.Client, studio_service: RunningService
) -> None:
    text = "The young chef usually pushes five big maps before noon."
    number = studio.post("/api/projects", json={"text": text}).json()["id"]
    address = f"{studio_service.url}/studio/animate/{number}"
    browser.devtools("Network.clearBrowserCache")
    sizes = received(browser, address)
    assert sizes["face.glb"] > 500_000  # it came from the service, not from a cache
    assert sizes["preview"] > 50_000
    assert sum(sizes.values()) < MOST_BYTES, sorted(sizes.items(), key=lambda one: -one[1])[:10]
    assert received(browser, address)["face.glb"] == 0  # a browser keeps a face that its address names


def test_a_face_that_is_not_the_one_of_the_address_is_not_kept_by_a_browser(studio: httpx.Client) -> None:
    number = studio.post("/api/projects", json={"text": "Hello."}).json()["id"]
    assert studio.get(f"/api/projects/{number}/face.glb?look=another").headers["cache-control"] == "no-store"


@pytest.mark.parametrize("address", ["projects/{}/face.glb", "takes/face.glb"])
def test_the_face_is_the_same_with_and_without_compression(studio: httpx.Client, address: str) -> None:
    number = studio.post("/api/projects", json={"text": "Hello."}).json()["id"]
    answers = [
        studio.get(f"/api/{address.format(number)}", headers={"Accept-Encoding": coding})
        for coding in ("gzip", "identity")
    ]
    assert answers[1].content[:4] == b"glTF"
    assert [one.headers.get("content-encoding") for one in answers] == ["gzip", None]
    assert int(answers[0].headers["content-length"]) < 0.7 * len(answers[0].content)
    assert int(answers[1].headers["content-length"]) == len(answers[1].content)
    assert answers[0].content == answers[1].content
