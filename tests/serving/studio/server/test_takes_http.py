"""Takes of puppetry over HTTP, and a live camera; takes of one key are invisible to others."""

import io
import json
import struct
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest
from PIL import Image
from websockets.sync.client import connect

from tests.corpus_tools.test_takes_tool import write_table
from tests.running import RunningService, eventually
from tests.serving.studio.server.test_styles_http import owned, wait_for_take  # noqa: F401 - a fixture
from tts2face.serving.studio.preview_bundle import read_bundle
from tts2face.serving.studio.take_store import READY
from tts2face.serving.work.jobs import FAILED
from tts2face.session.performance import Performance, perform
from tts2face.session.session import Session
from tts2face.video.media import read_frames

TABLE = {"Content-Type": "text/csv"}
SECONDS = 3.0


def put(studio: httpx.Client, content: bytes, **headers: str) -> str:
    answer = studio.put("/api/takes/new", params={"name": "My  take"}, content=content, headers=TABLE | headers)
    assert answer.status_code == 201, answer.text
    return str(answer.json()["id"])


def wait_until_read(studio: httpx.Client, number: str) -> dict[str, Any]:
    def read() -> dict[str, Any] | None:
        (take,) = [one for one in studio.get("/api/takes").json() if one["id"] == number]
        return take if take["state"] in {READY, FAILED} else None

    return dict(eventually(read, 120.0))


@pytest.fixture
def table(tmp_path: Path) -> Path:
    return write_table(tmp_path / "take.csv", SECONDS)


def test_a_table_plays_with_its_sound_becomes_a_style_and_is_deleted(
    owned: httpx.Client,  # noqa: F811
    data: Path,
    table: Path,
    wave_file: bytes,
) -> None:
    number = put(owned, table.read_bytes())
    assert wait_until_read(owned, number) == {
        "id": number, "name": "My take", "state": READY, "seconds": SECONDS, "has_sound": False, "message": ""
    }  # fmt: skip
    header, motion, head, samples = read_bundle(owned.get(f"/api/takes/{number}/preview").content)
    shown = perform(Performance(take=table), Session().animated_face(has_gestures=False))
    assert tuple(header["channels"]) == shown.motion.face.channels
    np.testing.assert_array_equal(motion, shown.motion.face.values)
    np.testing.assert_array_equal(head, shown.motion.head.values)
    assert (header["rate"], len(samples), np.ptp(samples)) == (8000, round(8000 * header["duration"]), 0)
    assert owned.put(f"/api/takes/{number}/sound", content=wave_file).status_code == 204
    header, again, _, samples = read_bundle(owned.get(f"/api/takes/{number}/preview").content)
    assert header["rate"] == 48_000
    assert np.ptp(samples) > 10_000
    np.testing.assert_array_equal(again, motion)
    assert owned.get(f"/api/takes/{number}/files/take.csv").content == table.read_bytes()
    assert "render the film first" in owned.get(f"/api/takes/{number}/files/film.mp4").json()["error"]["message"]
    assert owned.patch(f"/api/takes/{number}", json={"name": "Better"}).status_code == 204
    assert owned.delete(f"/api/takes/{number}").status_code == 204
    assert not (data / "studio" / "takes" / number).exists()
    assert owned.get(f"/api/takes/{number}/preview").status_code == 400


def test_what_is_no_take_is_refused_in_one_sentence(studio: httpx.Client, table: Path) -> None:
    broken = put(studio, b"\n".join(table.read_bytes().splitlines()[:2]))
    take = wait_until_read(studio, broken)
    assert take["state"] == FAILED
    assert "holds fewer than two frames with a time and a face (1)" in take["message"]
    assert "is not ready" in studio.get(f"/api/takes/{broken}/preview").json()["error"]["message"]
    studio.delete(f"/api/takes/{broken}")
    answer = studio.put("/api/takes/new", content=b"%PDF", headers={"Content-Type": "application/pdf"})
    assert "a take must be" in answer.json()["error"]["message"]
    assert studio.get("/api/takes/../takes/files").status_code in {404, 405}


def test_a_live_camera_is_followed_and_only_one_at_a_time(
    studio_service: RunningService, shared_recordings: Path, face_model: Path
) -> None:
    clips = sorted((shared_recordings / "grid_s1" / "clips").iterdir())[:3]
    pictures = [frame.pixels for clip in clips for frame in read_frames(clip)][5:]
    address = studio_service.url.replace("http", "ws") + "/studio/api/takes/live"
    with connect(address) as camera:
        channels = json.loads(camera.recv(60))["channels"]
        with connect(address) as other:
            assert "live in another tab" in json.loads(other.recv(10))["message"]
        found = []
        for number, picture in enumerate(pictures[:150:2]):  # 12.5 pictures a second
            content = io.BytesIO()
            Image.fromarray(picture).save(content, "JPEG", quality=80)
            camera.send(struct.pack("<d", number / 12.5) + content.getvalue())
            found.append(json.loads(camera.recv(60)))
    states = [one["state"] for one in found]
    assert states[0] == "calibrating"
    assert states[-1] == "live"
    live = [one for one in found if one["state"] == "live"]
    weights = np.array([one["weights"] for one in live])
    assert weights.shape == (len(live), len(channels))
    assert np.ptp(weights[:, channels.index("jawOpen")]) > 0.1
    with connect(address) as again:  # the first has ended with its connection
        assert "channels" in json.loads(again.recv(60))
        again.send(struct.pack("<d", 0.0) + b"no picture")
        assert "no JPEG that can be decoded" in json.loads(again.recv(60))["message"]


def test_a_take_becomes_the_one_of_a_style(owned: httpx.Client, table: Path) -> None:  # noqa: F811
    number = put(owned, table.read_bytes())
    wait_until_read(owned, number)
    assert owned.post(f"/api/takes/{number}/style").status_code == 204
    assert wait_for_take(owned)["state"] == "weak"
    owned.delete("/api/styles/take/0")
    owned.delete(f"/api/takes/{number}")


@pytest.fixture
def wave_file() -> bytes:
    """Two seconds of a tone."""
    import wave

    content = io.BytesIO()
    tone = 12_000 * np.sin(np.arange(32_000) * 0.1)
    with wave.open(content, "wb") as file:
        file.setparams((1, 2, 16_000, 0, "NONE", ""))
        file.writeframes(tone.astype("<i2").tobytes())
    return content.getvalue()
